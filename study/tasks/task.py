"""One unit of work, and its result. No files, no ranks."""

import itertools
import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass
from functools import lru_cache
from operator import attrgetter
from typing import Any, Final, NamedTuple

from numpy.typing import NDArray

from nanoslip.solver.case import PARTS, PIN_SIZES, STOP_CONDITIONS, Case
from nanoslip.solver.drive import Drive, Integrator
from nanoslip.solver.ensemble import ALONE, Ensemble
from nanoslip.solver.outcome import Outcome
from nanoslip.solver.parameter import declared
from nanoslip.solver.slab import Scheme, Slab
from nanoslip.study.canonical import Texts, content_hash
from nanoslip.study.manifest.observables import Observable
from nanoslip.study.manifest.parameters import Value, words_by_name
from nanoslip.study.origin import Origins

Label = tuple[tuple[str, ...], tuple[Value | None, ...]]
"""Label of a task, names and values: parameters, the ensemble's member, the drive. None is left out."""
PENDING: Final = "pending"
"""Word for the outcome of tasks that are not computed yet."""


@dataclass(frozen=True, slots=True)
class Task:
    """One computation, named by its content: equal keys mean equal results."""

    key: str
    """Hash of the kind and of all that decides the result, in the solver's units (20 hexadecimal digits)."""
    kind: str
    """One of nanoslip.study.tasks.kind.KINDS."""
    slab: Slab
    case: Case | None = None
    """The physics point; None for a compliance."""
    drive: Drive | None = None
    """Drive of the pin; drive tasks only."""
    events: tuple[int, ...] = ()
    """Events after which the contact is looked at; states tasks only."""
    contacts: tuple[int, int] = (0, 0)
    """First contact of an interface, and the first beyond; contacts tasks only."""
    subsurface: bool = False
    """True if the inside of the slab is computed, too; states tasks only."""
    scalars_only: bool = False
    """True if the result's arrays are left out."""
    fitted: bool = True
    """True if the closed form is fitted to the motion; drive tasks only."""
    critical: bool = False
    """True if the critical velocity is computed, too; drive tasks only."""
    observables: tuple[Observable, ...] = ()
    """One's own numbers; tasks of these only."""
    intermediate: bool = False
    """True if only other tasks need the result, not the campaign."""
    ensemble: Ensemble = ALONE
    """Number of starts of the case."""
    # Fields that are not compared change no result.
    shared: bool = field(default=False, compare=False)
    """True if other tasks read the result."""
    needs: tuple[str, ...] = ()
    """Keys of the tasks whose results this task reads."""
    free: bool = field(default=False, compare=False)
    """True if it only copies from another task's result."""
    cost: float = 0.0
    """Estimated seconds on one core."""
    memory: float = field(default=0.0, compare=False)
    """Estimated bytes of arrays while it runs, beside the compliance that it maps and the program's own."""
    disk: float = field(default=0.0, compare=False)
    """Estimated bytes of its result."""
    limit: float = field(default=math.inf, compare=False)
    """Seconds after which it is taken to hang."""
    names: tuple[str, ...] = field(default=(), compare=False)
    """Names of its label and of `values`."""
    values: tuple[Value | None, ...] = field(default=(), compare=False)

    def with_estimate(
        self, label: Label, cost: float = 0.0, memory: float = 0.0, disk: float = 0.0, limit: float = math.inf
    ) -> "Task":
        """The task with the fields that a plan adds: its label and, if estimated, its cost."""
        make: Any = Task
        planned: Task = make(*_CONTENT(self), cost, memory, disk, limit, *label)
        return planned

    @property
    def passing(self) -> bool:
        """True if its result is dropped once all that need it are computed. A compliance is kept, for cases to come."""
        return self.intermediate and self.kind != "compliance"

    @property
    def label(self) -> str:
        """Label for humans, in the words of a manifest."""
        words = words_by_name()
        words_of_values: dict[str, str] = {}
        for name, value in zip(self.names, self.values, strict=True):
            if value is not None:
                words_of_values[words.get(name, name)] = label_value(value)
        entries = [f"{word}={text}" for word, text in words_of_values.items()]
        return " ".join([self.kind, *entries])


_FIELDS: Final = tuple(item.name for item in fields(Task))
_CONTENT = attrgetter(*_FIELDS[: _FIELDS.index("cost")])
"""Fields of a task that are not the plan's; faster than `replace`, for millions of tasks."""


def label_value(value: Value) -> str:
    """A value of a parameter in a line of text."""
    return f"{value:g}" if isinstance(value, float) else str(value)


@dataclass(frozen=True, slots=True, eq=False)
class TaskResult:
    """The result of a task, refusals included; all numbers in the solver's units."""

    key: str
    kind: str
    outcome: Outcome
    scalars: Mapping[str, Sequence[float | int]] = field(default_factory=dict)
    """Scalars of each member, by the name that the parts of its kind give them (see nanoslip.study.tasks.kind)."""
    arrays: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    """Arrays by the same names: of the first member, or of all members one after the other (`Kind.all_members`)."""
    members: tuple[Outcome, ...] = ()
    """Outcome of each member; empty if all ended as the task did."""
    origins: Origins = ()
    """Software that computed it and its inputs; empty if unknown."""


Inputs = Mapping[str, TaskResult]
"""Results that a task needs, by key."""


# Keys of tasks: a hash of the whole case, less what is known not to matter.
#
# So a new field of a case changes the keys at once. A field is left out only by a line here that gives the reason.

SOLVER_VERSION = "48"
"""Part of every key: raise it whenever a change of the solver changes a result, or the set of its numbers."""


class Exclusion(NamedTuple):
    """Fields of a case that do not change a result, in the cases where they do not."""

    names: tuple[str, ...]
    """`radius`, `heterogeneity.seed`; `slip_rule` is all of its fields."""
    reason: str
    where: Callable[[Case], bool] = lambda _: True


def _drags_nothing(case: Case) -> bool:
    return not (case.effects.friction and case.effects.coupling)


OF_ALL = (
    *(
        Exclusion((size,), f"only a {shape} has a {size}", lambda case, shape=shape: case.pin != shape)  # type: ignore[misc]
        for shape, size in PIN_SIZES.items()
    ),
    Exclusion(
        ("slab.aspect_ratio", "slab.poisson"),
        "a chain has neither height nor Poisson's ratio",
        lambda case: not case.slab.scheme.continuum,
    ),
    Exclusion(("start_y",), "plane strain has no y", lambda case: "y" not in case.slab.layout.AXES),
    Exclusion(
        ("slab.aspect_ratio",),
        "a half-space has no height",
        lambda case: not case.slab.scheme.has_height,
    ),
    Exclusion(
        ("heterogeneity.distribution", "heterogeneity.seed"),
        "without a spread nothing is drawn",
        lambda case: case.heterogeneity.spread == 0.0,
    ),
    Exclusion(
        ("interface.loads", "interface.measured_loads"),
        "one contact carries all",
        lambda case: case.interface.contacts == 1,
    ),
    Exclusion(("path",), "without amplitude, way, loads or legs there is no path", lambda case: not case.path),
    Exclusion(("path.cycles",), "without an amplitude there are no cycles", lambda case: not case.path.cyclic),
)
"""Parameters that no result depends on."""
OF_CONTACT = (
    *OF_ALL,
    Exclusion((*STOP_CONDITIONS, "spacing_events"), "initial contact comes before any limit"),
    Exclusion(("path",), "initial contact comes before any path"),
    Exclusion(("interface.contacts",), "it is that of the first contact"),
    Exclusion(
        ("interface.loads", "interface.measured_loads"),
        "it is that of the first contact",
        lambda case: case.interface.contacts > 1,
    ),
    Exclusion(("effects.pin_translation",), "at initial contact the pin has not moved"),
    Exclusion(
        (
            "intrinsic_friction",
            "initial_contact",
            "slip_rule",
            "heterogeneity.distribution",
            "heterogeneity.spread",
            "heterogeneity.seed",
        ),
        "a pin that drags nothing slips nowhere",
        _drags_nothing,
    ),
)
"""Parameters that initial contact does not depend on."""
OF_RECORD = (
    *OF_ALL,
    Exclusion(("path",), "a record goes in one direction at one load"),
    Exclusion(("max_displacement", "max_spacings"), "both are in the key as the nearer of them, `farthest`"),
)
"""Parameters that a friction record does not depend on."""


OF_PATH = (
    *OF_ALL,
    Exclusion((*STOP_CONDITIONS, "spacing_events"), "a path ends by itself, not by the limits of a record"),
)
"""Parameters that a path does not depend on."""


def ineffective_parameters(case: Case, exclusions: tuple[Exclusion, ...] = OF_ALL) -> frozenset[str]:
    """Names of the parameters of a case that change no result."""
    names: list[str] = []
    for exclusion in exclusions:
        if exclusion.where(case):
            names += exclusion.names
    return _all_parameters(tuple(names))


def idle(cases: Sequence[Case], stated: Collection[str], contact_alone: bool) -> Iterator[str]:
    """The given parameters, by field name, that change nothing in any of the cases, as in campaigns, each with the reason.

    contact_alone: whether nothing slides.
    """
    # Without a case every exclusion would hold, of none of them.
    if not cases:
        return
    words = words_by_name()
    for exclusion in OF_CONTACT if contact_alone else OF_ALL:
        parameters = itertools.chain.from_iterable(map(_parameters, exclusion.names))
        names = [name for name in parameters if name in stated]
        if names and all(map(exclusion.where, cases)):
            yield from (f"{words[name]} changes nothing here: {exclusion.reason}" for name in names)


# Kept, as it is asked for with every case of a campaign.
@lru_cache(maxsize=256)
def _all_parameters(names: tuple[str, ...]) -> frozenset[str]:
    return frozenset(itertools.chain.from_iterable(_parameters(name) for name in names))


def _parameters(name: str) -> tuple[str, ...]:
    """Parameters in a field of a case: all of a part, or a single one."""
    if name in PARTS:
        return tuple(declared(PARTS[name]))
    return (name.rpartition(".")[2],)


def task_key(kind: str, *content: object) -> str:
    """The key of a task of this kind that this content decides."""
    return content_hash(kind, SOLVER_VERSION, *content)


def contact_parameters(case: Case) -> tuple[object, ...]:
    """Parameters that decide initial contact."""
    return (_CONTACTS(case),)


def record_parameters(case: Case) -> tuple[object, ...]:
    """Parameters that decide a friction record."""
    return (_RECORDS(case), case.farthest)


def path_parameters(case: Case) -> tuple[object, ...]:
    """Parameters that decide a path of pin and load."""
    return (_PATHS(case),)


def deciding_texts(exclusions: tuple[Exclusion, ...]) -> Texts:
    """Canonical texts of the fields that determine a result, case by case; equal to the texts of `deciding_fields`.

    No exclusion may depend on a number of the case itself (tests/study/test_canonical.py).
    """
    return Texts(lambda case: deciding_fields(case, exclusions))


_CONTACTS, _RECORDS, _PATHS = map(deciding_texts, (OF_CONTACT, OF_RECORD, OF_PATH))


def deciding_fields(case: Case, exclusions: tuple[Exclusion, ...]) -> dict[str, object]:
    """Fields of a case and its parts by dotted name, without the excluded fields. Raises KeyError for unknown
    exclusions."""
    every = dict(list_dotted_fields(case))
    left_out: set[str] = set()
    for exclusion in exclusions:
        if not exclusion.where(case):
            continue
        for name in exclusion.names:
            excluded = _fields_under(name, every)
            # A field that was renamed would count again, unnoticed, and give equal cases different keys.
            if not excluded:
                raise KeyError(f"{name}: no field of a case")
            left_out.update(excluded)
    return {name: value for name, value in every.items() if name not in left_out}


def _fields_under(name: str, fields: Iterable[str]) -> list[str]:
    """The field of this dotted name, and the fields of its parts."""
    return [field for field in fields if field == name or field.startswith(f"{name}.")]


def list_dotted_fields(value: Any, prefix: str = "") -> Iterator[tuple[str, object]]:
    """Dotted name and value of every field of a dataclass and of nested dataclasses; for a scheme or integrator its
    name, too."""
    for item in fields(value):
        part = getattr(value, item.name)
        # Two schemes may have the same settings: by these alone they would have the same key.
        if isinstance(part, Scheme | Integrator):
            yield f"{prefix}{item.name}", part.name
        if is_dataclass(part):
            yield from list_dotted_fields(part, f"{prefix}{item.name}.")
        else:
            yield f"{prefix}{item.name}", part


def task_case(task: Task) -> Case:
    """The physics point of a task that has one, as all but a compliance do."""
    assert task.case is not None
    return task.case


def task_drive(task: Task) -> Drive:
    """Drive of the pin in a drive task."""
    assert task.drive is not None
    return task.drive
