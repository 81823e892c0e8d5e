"""What a kind of task is, and how the solver's values become the scalars and arrays of a result, and back.

A result holds the numbers of the kind's `parts`: dataclasses of the solver whose fields declare what they are
(nanoslip.solver.parameter). What a part declares is in results, dataset and tables without another word.
"""

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import lru_cache
from operator import attrgetter
from typing import Any, Final, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.case import Case
from nanoslip.solver.drive import Drive
from nanoslip.solver.elasticity.compliance import Compliance, SurfaceCompliance, normal_compliance
from nanoslip.solver.ensemble import Ensemble, change_by, needed
from nanoslip.solver.outcome import COMPLETED, Ending, Outcome, SolverError
from nanoslip.solver.parameter import Quantity, quantities
from nanoslip.solver.slab import Slab
from nanoslip.study.canonical import CanonicalText, canonical_text
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.plan.task import Inputs, Task, TaskResult

Value = TypeVar("Value")


class Part(NamedTuple):
    """A dataclass of which a kind's results hold the numbers."""

    type: type
    prefix: str = ""
    """What its fields' names get in front in results and, where they have no name of their own, in datasets."""
    whole: bool = False
    """Whether numbers that are no quantities are held too, as another task reads them."""
    wanted: Callable[[Manifest], bool] = lambda _: True
    """Whether a campaign asks for it; the value of a part that it does not ask for is None."""


@dataclass(frozen=True, slots=True)
class Ragged:
    """Columns of a kind's results in a dataset: one behind the other over `sample`, a run of it for each `instance`."""

    instance: str
    """The group that they are in, too. Several kinds may add to one group, where they have the same columns."""
    sample: str
    count: str
    """Variable over the instances: the length of each run."""
    wanted: Callable[[Manifest], bool]


class Wanted(NamedTuple):
    """A task of a case."""

    task: Task
    drive: str = ""
    """Label of its drive, where it has one."""
    free: bool = False
    """Whether it only reads off another task's result."""


@dataclass(frozen=True, slots=True)
class Member:
    """What was computed of one member: the values of its kind's parts, in their order, and its outcome."""

    values: tuple[object, ...] = ()
    outcome: Outcome = COMPLETED
    only: tuple[str, ...] | None = None
    """The variables that it knows, where it was computed without an effect on which others depend; None for all."""


@dataclass(frozen=True, slots=True)
class Computed:
    """The result of a task before it is stored."""

    members: tuple[Member, ...] = ()
    arrays: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    """Those that are in no part."""


class Estimate(NamedTuple):
    """What a task costs, to a factor of three."""

    seconds: float
    """On one core of an ordinary machine (nanoslip.study.plan.cost.rates)."""
    memory: float
    """Bytes of arrays while it runs, beside the compliance that it maps and the program's own."""
    disk: float
    """Bytes of its result."""


@lru_cache(maxsize=256)  # the tasks of a campaign share the number itself
def disk_of(scalars: float, arrays: float = 0.0) -> float:
    """Bytes of a result with so many scalars and so many numbers in arrays."""
    return _ARCHIVE + _SCALAR * scalars + 8.0 * arrays


_ARCHIVE = 1000.0  # of a result: its ending, its origin, and the archive's own
_SCALAR = 30.0  # as text, with its name


@dataclass(frozen=True, slots=True)
class Kind:
    """One kind of task. Its stage is its place in nanoslip.study.plan.tasks.KINDS."""

    name: str
    needed: Callable[[Manifest], bool]
    """Whether a campaign needs such tasks at all."""
    tasks: Callable[[Case, Manifest], tuple[Wanted, ...]]
    """Those of one case, needed ones first; the last one of a drive is the case's own."""
    run: Callable[[Task, Inputs], Computed]
    """Raises SolverError where the physics refuses."""
    estimate: Callable[[Task], Estimate]
    """What a task costs, from its case alone."""
    parts: tuple[Part, ...] = ()
    """In the order of a dataset's variables."""
    ragged: tuple[Ragged, ...] = ()
    all_members: bool = False
    """Whether results hold the columns of all members, as other tasks read them; else the arrays of the first one."""


MEMBER: Final = "member"
"""The dimension of what results hold of each member: their scalars."""


@lru_cache(maxsize=256)
def declared(kind: Kind, along: str = "") -> Mapping[str, Quantity]:
    """Name of each scalar of a kind's results that is a quantity -> its declaration; or of each array along a dimension.

    Along MEMBER: the scalars whose means have an uncertainty.
    """
    if along == MEMBER:
        scalars = ((name, each) for name, each in declared(kind).items() if each.ensemble)
        return {name: replace(each, along=MEMBER, ensemble=False, si=None) for name, each in scalars}
    found = [each for part in kind.parts for each in quantities(part.type, part.prefix).items()]
    return {key: quantity for key, quantity in found if quantity.along == along}


def left_out(kind: Kind, manifest: Manifest) -> frozenset[str]:
    """Names of the scalars and arrays of those parts of a kind that a campaign does not ask for."""
    parts = (part for part in kind.parts if not part.wanted(manifest))
    return frozenset(name for part in parts for name in quantities(part.type, part.prefix))


def several(manifest: Manifest) -> bool:
    """Whether cases have members whose values a dataset holds beside their means."""
    return manifest.ensemble.members > 1


@lru_cache(maxsize=64)
def names_of(kind: Kind) -> frozenset[str]:
    """The variables of a kind's results whose means have an uncertainty."""
    return frozenset(each.name for each in declared(kind).values() if each.ensemble)


def own_ensemble(kind: Kind, ensemble: Ensemble) -> tuple[Ensemble, CanonicalText]:
    """The ensemble of a kind's tasks in a campaign with this one, and its canonical text."""
    found = ensemble.asked_of(names_of(kind))
    return found, CanonicalText(canonical_text(found))


def computed_members(
    kind: Kind,
    task: Task,
    compute: Callable[[Case, int], Member],
    there: int | None = None,
    spent: Callable[[], float] = lambda: 0.0,
) -> tuple[Member, ...]:
    """The members that a task asks for, or as many as its target takes. compute: one, from its case and number.

    A member that the physics refuses has that outcome and no values. there: how many have what this kind needs; all of them are
    computed, and further ones only for a target. spent: relative error by what members leave out, which the target includes.
    """
    ensemble, found = task.ensemble, list[Member]()

    def tried(number: int) -> Member:
        try:
            return compute(ensemble.case(case_of(task), number), number)
        except SolverError as error:
            return Member((), error.outcome)

    for size in ensemble.sizes() if there is None else (there, *(size for size in ensemble.sizes() if size > there)):
        found += map(tried, range(len(found), size))
        if ensemble.within is not None and known(kind, replace(ensemble, within=ensemble.within - spent()), found):
            break
    return tuple(found)


def known(kind: Kind, ensemble: Ensemble, members: Sequence[Member]) -> bool:
    """Whether these members know all observables of an ensemble's target that are numbers of this kind."""
    return all(map(ensemble.known, _asked(kind, ensemble, members)))


def largest_change(kind: Kind, ensemble: Ensemble, without: Sequence[Member], whole: Sequence[Member]) -> float:
    """`change_by` what members leave out, of the observable of an ensemble's target in which it is largest."""
    return max(map(change_by, _asked(kind, ensemble, without), _asked(kind, ensemble, whole)))


def _asked(kind: Kind, ensemble: Ensemble, members: Sequence[Member]) -> list[list[float | int]]:
    """Values of the members, of each number of this kind in an ensemble's target."""
    scalars = _scalars(kind, members)
    nothing = [math.nan] * len(members)
    return [scalars.get(key, nothing) for key, each in declared(kind).items() if each.name in ensemble.of]


def numbers(
    kind: Kind, members: Sequence[Member], *, scalars_only: bool = False
) -> tuple[dict[str, list[float | int]], dict[str, NDArray[Any]]]:
    """Scalars of all members, NaN where one has none, and arrays (see `Kind.all_members`) of the values of a kind's parts."""
    scalars, arrays = _scalars(kind, members), _arrays(kind, members[0]) if members else {}
    if kind.all_members and len(members) > 1:
        each = [arrays, *(_arrays(kind, member) for member in members[1:])]
        for sample in dict.fromkeys(item.sample for item in kind.ragged):
            columns = [name for name in declared(kind, sample) if any(name in one for one in each)]
            for name in columns[:1]:
                scalars[rows_of(sample)] = [len(one[name]) if name in one else 0 for one in each]
            for name in () if scalars_only else columns:
                arrays[name] = np.concatenate([one[name] for one in each if name in one])
    elif len(members) > 1 and not members[0].outcome.usable:  # an ensemble is usable without its first member
        arrays = {}
    return scalars, {} if scalars_only else arrays


def rows_of(sample: str) -> str:
    """The scalar that holds how long each member's columns along a dimension are, where results hold those of all members."""
    return f"{sample}_rows"


def column(result: TaskResult, name: str, sample: str, member: int = 0) -> NDArray[Any]:
    """A member's column along a dimension."""
    whole, rows = result.arrays[name], result.scalars.get(rows_of(sample))
    if rows is None:
        return whole
    begin = int(sum(rows[:member]))
    return whole[begin : begin + int(rows[member])]


def _scalars(kind: Kind, members: Sequence[Member]) -> dict[str, list[float | int]]:
    found: dict[str, list[float | int]] = {}
    for place, part in enumerate(kind.parts):
        held, values = _held(part), [member.values[place] if member.values[place:] else None for member in members]
        rows = [held.values(value) for value in values if value is not None]
        for key, words, ones in zip(held.keys, held.words, zip(*rows, strict=True), strict=False):
            if not isinstance(ones[0], np.ndarray | Outcome):
                own = iter([_coded(one, words) for one in ones] if words else ones)
                found[key] = [math.nan if value is None else next(own) for value in values]
    for number, member in enumerate(members):
        if member.only is not None:
            known = {key for key, each in declared(kind).items() if each.name in member.only}
            for key in found.keys() - known:
                found[key][number] = math.nan
    return found


def _arrays(kind: Kind, member: Member) -> dict[str, NDArray[Any]]:
    found: dict[str, NDArray[Any]] = {}
    for part, value in zip(kind.parts, member.values, strict=False):
        if value is not None:
            held = _held(part)
            for key, one in zip(held.keys, held.values(value), strict=True):
                if isinstance(one, np.ndarray):
                    found[key] = one
    return found


def joint_outcome(members: Sequence[Outcome]) -> Outcome:
    """How an ensemble ended: as its members did, or completed where enough of them have, with what became of the others."""
    if len(members) < 2:
        return members[0] if members else COMPLETED
    counts = Counter(each.ending for each in members)
    first = {ending: next(each.message for each in members if each.ending is ending) for ending in counts}
    done = counts[Ending.COMPLETED]
    enough = done >= needed(len(members))
    ending = (
        Ending.COMPLETED
        if enough
        else max((each for each in counts if each is not Ending.COMPLETED), key=counts.__getitem__)
    )
    told = [
        message if count == len(members) else f"{count} of {len(members)} members {each}: {message}"
        for each, count in counts.most_common()
        if (message := first[each])
    ]
    return Outcome(ending, "; ".join(told))


class _Held(NamedTuple):
    """Of each number of a part that results hold: its name in them, and the words that it stands for."""

    keys: tuple[str, ...]
    words: tuple[tuple[str, ...], ...]
    values: Callable[[object], tuple[Any, ...]]
    """All of them, of a value of the part."""


@lru_cache(maxsize=64)
def _held(part: Part) -> _Held:
    known = quantities(part.type, part.prefix)
    named = {f"{part.prefix}{item.name}": item.name for item in fields(part.type)}
    held = {key: name for key, name in named.items() if part.whole or key in known}
    words = tuple(known[key].words if key in known else () for key in held)
    names = tuple(held.values())
    return _Held(tuple(held), words, attrgetter(*names) if len(names) > 1 else lambda value: (getattr(value, *names),))


def _coded(value: Any, words: tuple[str, ...]) -> float | int:
    """Of a text its position, NaN of none."""
    return float("nan") if value is None else words.index(value)


def whole_again(kind: type[Value], result: TaskResult, member: int = 0, prefix: str = "") -> Value:
    """A member's value that `numbers` took apart: of a whole part with this prefix."""
    make: Any = kind
    known = quantities(make, prefix)
    held: dict[str, Any] = {f"{prefix}outcome": (result.members or (result.outcome,) * (member + 1))[member]}
    for item in fields(make):
        name = f"{prefix}{item.name}"
        if name in result.arrays:
            held[name] = column(result, name, known[name].along if name in known else "", member)
        elif name in result.scalars:
            held[name] = result.scalars[name][member]
    return make(**{item.name: held[f"{prefix}{item.name}"] for item in fields(make)})  # type: ignore[no-any-return]


def case_of(task: Task) -> Case:
    """The physics point of a task that has one, as all but a compliance do."""
    assert task.case is not None
    return task.case


def drive_of(task: Task) -> Drive:
    """How the pin is pulled in a drive task."""
    assert task.drive is not None
    return task.drive


def compliance_of(task: Task, inputs: Inputs) -> Compliance:
    """The compliance that a task needs before anything else; where it needs none, what the slab's surface says by itself."""
    if not task.needs:
        return normal_compliance(task.slab)
    return compliance_in(inputs[task.needs[0]], task.slab)


@lru_cache(maxsize=4)  # tasks that follow each other get the same one: the solver keeps what it computes of it
def compliance_in(result: TaskResult, slab: Slab) -> SurfaceCompliance:
    """The compliance that a result holds."""
    return SurfaceCompliance(result.arrays["matrix"], slab)


def scalars_only_mark(scalars_only: bool) -> tuple[str, ...]:
    """What a key gets where the result's arrays are left out."""
    return ("scalars",) if scalars_only else ()
