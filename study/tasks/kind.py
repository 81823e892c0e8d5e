"""Declaration of a kind of task, in the file of its name: condition, tasks and keys, results, cost, computation, miniature.

A result holds the numbers of a kind's `parts`, dataclasses of the solver with declared fields (nanoslip.solver.parameter);
dataset and tables follow from these. A kind's file imports what computes inside the functions that compute: plans and
datasets do without it.
"""

import math
from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from functools import lru_cache
from importlib import import_module
from typing import Any, Final, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.case import Case
from nanoslip.solver.ensemble import Ensemble
from nanoslip.solver.outcome import COMPLETED, Ending, Outcome
from nanoslip.solver.parameter import SHARED_ERROR, Quantity, quantities, quantity
from nanoslip.solver.slab import SCHEMES
from nanoslip.solver.sliding.plateau import Plateau
from nanoslip.study.canonical import CanonicalText, canonical_text
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.manifest.observables import Observable
from nanoslip.study.tasks.task import Inputs, Task, TaskResult, task_key

PartOfResult = TypeVar("PartOfResult")


class Part(NamedTuple):
    """A dataclass of which a kind's results hold the numbers."""

    type: type
    prefix: str = ""
    """Prefix of its fields in results and, for fields without a name of their own, in datasets."""
    whole: bool = False
    """True if results hold numbers that are no quantities, too, because another task reads them."""
    wanted: Callable[[Manifest], bool] = lambda _: True
    """True if a campaign requests it; an unrequested part is None."""


@dataclass(frozen=True, slots=True)
class Ragged:
    """Columns of a kind's results in a dataset: concatenated over `sample`, one run for each `instance`."""

    instance: str
    """Dimension and name of their group. Several kinds may add to one group if they have the same columns."""
    sample: str
    count: str
    """Variable over the instances: the length of each run."""
    wanted: Callable[[Manifest], bool]


class Wanted(NamedTuple):
    """A task of a case."""

    task: Task
    drive: str = ""
    """Label of its drive, where it has one."""
    part: bool = False
    """True if it is a part of another task of the case, whose result contains it."""


class Estimate(NamedTuple):
    """Estimated cost of a task."""

    seconds: float
    """Seconds on one core of an ordinary machine."""
    memory: float
    """Bytes of arrays while it runs, beside the compliance that it maps and the program's own."""
    numbers: float = 0.0
    """Count of numbers in the arrays of its result."""


@dataclass(frozen=True, slots=True)
class Member:
    """Result of a member: values of its kind's parts, in any order, and outcome."""

    values: tuple[object, ...] = ()
    outcome: Outcome = COMPLETED
    only: tuple[str, ...] | None = None
    """Known variables, if it was computed without an effect that changes others; None for all."""
    plateau: Plateau | None = None
    """Plateau of its record, which determines the error that members share."""
    halves: Mapping[str, float] = field(default_factory=dict)
    """Numbers that its record's length decides, as they are over the first half of it."""
    repetitions: Collection[str] = ()
    """Numbers that the repetition of its record decides, about as much as the surface."""
    node: float = 0.0
    """Change of its stiffness by one node more."""

    def part(self, kind: type[PartOfResult]) -> PartOfResult | None:
        """The value of a part; None if the member lacks it."""
        # The very type: a record of a path is also a friction record, but another part.
        values = (value for value in self.values if type(value) is kind)
        return next(values, None)


@dataclass(frozen=True, slots=True)
class Computed:
    """The result of a task before it is stored."""

    members: tuple[Member, ...] = ()
    arrays: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    """Arrays that are in no part."""
    scalars: Mapping[str, list[float]] = field(default_factory=dict)
    """Scalars of all members that are in no part."""


@dataclass(frozen=True, slots=True, eq=False)
class Kind:
    """One kind of task. Its stage is its place in KINDS."""

    name: str
    needed: Callable[[Manifest], bool]
    """True if a campaign needs such tasks at all."""
    tasks: Callable[[Case, Manifest], tuple[Wanted, ...]]
    """Tasks of a case, inputs first; the last task of a drive computes the drive itself."""
    estimate: Callable[[Task], Estimate]
    """Cost of a task, from its case alone."""
    compute: Callable[[Task, Inputs], Computed]
    """The numbers of a task's members. Raises SolverError where the physics refuses."""
    miniature: Callable[[Task], tuple[Task, ...]]
    """Small tasks that run every kernel of a task, inputs first. Raises InvalidInput if it cannot be made small."""
    parts: tuple[Part, ...] = ()
    """Parts in the order of a dataset's variables."""
    ragged: tuple[Ragged, ...] = ()
    all_members: bool = False
    """True if results hold the columns of all members, which other tasks read; else the arrays of the first one."""
    driven: bool = False
    """True if its results belong to cases and drives."""
    require_arrays: Callable[[TaskResult], None] = lambda _: None
    """Raises ValueError for a completed result whose arrays that are in no part are of no use."""


class Kinds(Mapping[str, Kind]):
    """Name -> kind of task, which is loaded when it is first asked for: a stage each, none of which needs a later one."""

    NAMES: Final = (
        "compliance",
        "contact",
        "contacts",
        "record",
        "path",
        "statistics",
        "states",
        "observables",
        "drive",
        "drive_observables",
    )

    def __init__(self) -> None:
        self.loaded: dict[str, Kind] = {}

    def __getitem__(self, name: str) -> Kind:
        if name not in self.loaded:
            if name not in self.NAMES:
                raise KeyError(name)
            self.loaded[name] = import_module(f"{__package__}.{name}").KIND
        return self.loaded[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.NAMES)

    def __len__(self) -> int:
        return len(self.NAMES)


KINDS: Final = Kinds()


MEMBER: Final = "member"
"""The dimension of members' scalars in results."""
MEMBER_OUTCOME: Final = Quantity(
    "member_outcome", "how the member ended", along=MEMBER, codes=tuple(Ending), dtype=np.int8
)


@lru_cache(maxsize=256)
def result_quantities(kind: Kind, along: str = "") -> Mapping[str, Quantity]:
    """Name of each scalar of a kind's results that is a quantity -> its declaration; or of each array along a dimension.

    Along MEMBER: how it ended, and the scalars whose means have an uncertainty.
    """
    if along == MEMBER:
        numbers = {MEMBER_OUTCOME.name: MEMBER_OUTCOME}
        for name, stated in result_quantities(kind).items():
            # A number of one member has no ± of its own, and its mean is what is given in SI, too.
            if stated.ensemble:
                numbers[name] = replace(stated, along=MEMBER, ensemble=False, si=None)
        return numbers
    declared: dict[str, Quantity] = {}
    for part in kind.parts:
        for name, stated in quantities(part.type, part.prefix).items():
            # Sorted out here: a scalar and a column of two parts may have the same name.
            if stated.along == along:
                declared[name] = stated
    return declared


def names_to_drop(kind: Kind, manifest: Manifest) -> frozenset[str]:
    """Names of the scalars and arrays of a kind's parts that a campaign does not request."""
    names: set[str] = set()
    for part in kind.parts:
        if not part.wanted(manifest):
            names |= quantities(part.type, part.prefix).keys()
    return frozenset(names)


OWN: Final = {"observables": False, "drive_observables": True}
"""Kinds of task that compute a user's own numbers -> True for numbers of drives."""


def own_quantities(kind: str, manifest: Manifest) -> dict[str, Quantity]:
    """Name of each of a campaign's own numbers among a kind's results -> its declaration."""
    return {number.name: own_quantity(number) for number in own_numbers(kind, manifest)}


def own_quantity(number: Observable) -> Quantity:
    """Declaration of a user's own number."""
    source = f"{number.reference}, SHA-256 {number.sha256}"
    return Quantity(number.name, number.meaning, number.unit, ensemble=True, comment=number.comment, source=source)


def own_numbers(kind: str, manifest: Manifest) -> tuple[Observable, ...]:
    """A campaign's own numbers among a kind's results."""
    # `is`: any other kind gives None, which is not False.
    return tuple(number for number in manifest.observables if number.driven is OWN.get(kind))


def has_own_numbers(kind: str) -> Callable[[Manifest], bool]:
    """Predicate: True if a campaign has own numbers among a kind's results."""
    return lambda manifest: bool(own_numbers(kind, manifest))


def has_target(manifest: Manifest) -> bool:
    """True if a campaign states an error instead of a number of members."""
    return manifest.ensemble.within is not None


def has_several_members(manifest: Manifest) -> bool:
    """True if cases have members whose values a dataset holds beside their means."""
    return manifest.ensemble.members > 1


def output(*names: str) -> Callable[[Manifest], bool]:
    """Predicate: True if a campaign requests any of these outputs."""
    return lambda manifest: any(getattr(manifest.outputs, name) for name in names)


def uncertain_names(kind: Kind) -> frozenset[str]:
    """The variables of a kind's results whose means have an uncertainty."""
    return frozenset(stated.name for stated in result_quantities(kind).values() if stated.ensemble)


# Kept, as it is asked for with every case of a campaign.
@lru_cache(maxsize=64)
def own_ensemble(kind: str, ensemble: Ensemble) -> tuple[Ensemble, CanonicalText]:
    """The ensemble of the tasks of this kind in a campaign with this ensemble, and its canonical text."""
    # A target of drives does not decide how many contacts are computed: the key of a contact must not change with it.
    of_kind = ensemble.select_observables(uncertain_names(KINDS[kind]))
    return of_kind, CanonicalText(canonical_text(of_kind))


def column_length_name(sample: str) -> str:
    """Scalar with the length of each member's columns along a dimension, in results with columns of all members."""
    return f"{sample}_rows"


def member_column(result: TaskResult, name: str, sample: str, member: int = 0) -> NDArray[Any]:
    """A member's column along a dimension."""
    column = result.arrays[name]
    rows = result.scalars.get(column_length_name(sample))
    # Without lengths the column is the first member's alone.
    if rows is None:
        return column
    begin = int(sum(rows[:member]))
    end = begin + int(rows[member])
    return column[begin:end]


def member_task(
    kind: str,
    physics: tuple[object, ...],
    case: Case,
    ensemble: Ensemble,
    needs: tuple[str, ...],
    *,
    scalars_only: bool,
) -> Task:
    """A task of all members of a case; its key hashes the kind, these parameters and the ensemble."""
    ensemble, text = own_ensemble(kind, ensemble)
    key = task_key(kind, *physics, text, *list_marks(scalars=scalars_only))
    return Task(key, kind, case.slab, case, ensemble=ensemble, needs=needs, scalars_only=scalars_only)


def list_marks(**chosen: bool) -> tuple[str, ...]:
    """Marks of these choices in the key of a result."""
    return tuple(name for name, is_chosen in chosen.items() if is_chosen)


def has_planes(manifest: Manifest) -> bool:
    """True if a case may have a plane of nodes."""
    return any("y" in SCHEMES[str(scheme)].LAYOUT.AXES for scheme in manifest.case_values("scheme"))


def event_field(along: str) -> Any:
    """A field that is a column: the event after which the values of a node hold."""
    comment = "of the record; 0: initial contact"
    return quantity("event after which the values hold", "event", along=along, dtype=np.int64, comment=comment)


ACROSS: Final = frozenset({"y", "node_y", "surface_y"})
"""Columns of positions across the drag: only results of a plane of nodes have them."""


# Another version of nanoslip with the same solver version writes results, too: numbers that they lack are NaN, numbers that this
# version does not declare stay. Only what cannot be put together again is of no use.


class PartContents(NamedTuple):
    """Names of the numbers and columns in results that belong to a part."""

    scalars: frozenset[str]
    """Declared scalars, and the errors that members share."""
    columns: Mapping[str, str]
    """Declared array -> its dimension."""
    undeclared: frozenset[str]
    """Numbers of a whole part that are no quantities."""

    def is_held(self, names: Collection[str]) -> bool:
        """True if any of these names is of this part."""
        names_of_part = (*self.scalars, *self.columns, *self.undeclared)
        return any(name in names for name in names_of_part)


@lru_cache(maxsize=64)
def result_names(kind: Kind) -> tuple[PartContents, ...]:
    """Names of the scalars and arrays in results of a kind, part by part."""
    return tuple(map(_contents_of_part, kind.parts))


def _contents_of_part(part: Part) -> PartContents:
    declared = quantities(part.type, part.prefix)
    columns = {name: stated.along for name, stated in declared.items() if stated.along}
    scalars = declared.keys() - columns
    shared = {f"{name}{SHARED_ERROR}" for name in scalars if declared[name].shared}
    undeclared: set[str] = set()
    if part.whole:
        every = {f"{part.prefix}{item.name}" for item in fields(part.type) if item.name != ENDING_FIELD}
        undeclared = every - declared.keys()
    return PartContents(frozenset(scalars | shared), columns, frozenset(undeclared))


ENDING_FIELD: Final = "outcome"
"""Field of a part that is no number: results hold outcomes apart."""


def as_declared(result: TaskResult) -> TaskResult:
    """The result with all scalars that its kind declares: NaN where the version that computed it had none.

    Raises ValueError if this version cannot use it.
    """
    if result.kind not in KINDS:
        raise ValueError(f"{result.kind!r}: no kind of task")
    kind, members = KINDS[result.kind], _member_count(result)
    names = result.scalars.keys() | result.arrays.keys()
    # A part of which nothing is there was not requested: only what is partly there lacks numbers.
    parts = [part for part in result_names(kind) if part.is_held(names)]
    if not parts and result_names(kind) and result.outcome.ok:
        raise ValueError("completed without numbers")
    if members:
        scalars = (part.scalars for part in parts)
        declared = set[str]().union(*scalars)
        # Sorted, as sets have another order in each process, and results the same bytes.
        missing = sorted(declared - result.scalars.keys())
        if missing:
            no_numbers = {name: [math.nan] * members for name in missing}
            result = replace(result, scalars={**result.scalars, **no_numbers})
    _require_arrays(kind, parts, members, result)
    return result


def _member_count(result: TaskResult) -> int:
    """Number of members, 0 without scalars. Raises ValueError unless each scalar is a number of each member."""
    columns = list(result.scalars.values())
    counts = {len(column) for column in columns}
    # No outcomes means that all members ended alike.
    if result.members:
        counts.add(len(result.members))
    # What comes from a file may be anything that JSON can hold.
    types = [{*map(type, column)} for column in columns]
    plain = all(found <= {int, float, bool} for found in types)
    if not plain or len(counts) > 1 or 0 in counts:
        raise ValueError("scalars that are not one number of each member")
    return max(counts) if result.scalars else 0


def _require_arrays(kind: Kind, parts: Iterable[PartContents], members: int, result: TaskResult) -> None:
    """Raise ValueError unless there are no arrays, or all of each part, as long as each other along a dimension."""
    arrays, scalars = result.arrays, result.scalars
    if any(array.dtype.kind not in "biuf" for array in arrays.values()):
        raise ValueError("an array of something else than numbers")
    if result.outcome.ok:
        kind.require_arrays(result)
    # A result of scalars alone has no arrays; of those that it has, a missing column would shift those of other members.
    if not arrays:
        return
    for part in parts:
        names_needed = part.columns.keys() | part.undeclared
        missing = names_needed - arrays.keys() - scalars.keys()
        if missing:
            raise ValueError(f"without {', '.join(sorted(missing))}")
        # Without lengths all columns along a dimension are as long as the first one.
        lengths: dict[str, tuple[int, ...]] = {}
        for name, sample in part.columns.items():
            rows = scalars.get(column_length_name(sample), ())
            if kind.all_members and members > 1 and not rows:
                raise ValueError(f"without {column_length_name(sample)}")
            shape = arrays[name].shape
            needed = (sum(rows),) if rows else lengths.setdefault(sample, shape)
            if shape != needed or len(shape) != 1:
                raise ValueError(f"{name} has another length along {sample}")


def task_kinds(manifest: Manifest) -> frozenset[str]:
    """The kinds of task that this manifest needs."""
    return frozenset(kind.name for kind in KINDS.values() if kind.needed(manifest))


def order_by_stage(tasks: Iterable[Task]) -> Iterator[Task]:
    """Order tasks by kind, so that no task needs a later task: intermediate tasks precede the tasks that use them."""
    stages: defaultdict[tuple[int, bool], list[Task]] = defaultdict(list)
    places = {kind: place for place, kind in enumerate(KINDS)}
    for task in tasks:
        stages[places[task.kind], not task.intermediate].append(task)
    for stage in sorted(stages):
        yield from stages[stage]
