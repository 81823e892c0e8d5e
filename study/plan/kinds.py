"""Kinds of task in the order of stages: condition, keys and results of each.

A kind is computed in nanoslip.study.run.compute; its cost is in nanoslip.study.plan.cost. A result holds the numbers of its
`parts`, dataclasses of the solver with declared fields (nanoslip.solver.parameter); dataset and tables follow from these.
"""

import math
from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, fields, replace
from functools import lru_cache, partial
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.arrays import Floats
from nanoslip.solver.case import Case
from nanoslip.solver.contact.state import NODE_X, NODE_Y, ContactState, ContactSummary
from nanoslip.solver.drive import OF_A_STROKE, Drive
from nanoslip.solver.dynamics.coefficients import FrictionCoefficients
from nanoslip.solver.dynamics.regime import CriticalVelocity, StickSlipCount
from nanoslip.solver.dynamics.result import DynamicsResult, StageLegs, StageLoops
from nanoslip.solver.dynamics.stick_slip import StickSlipFit
from nanoslip.solver.effects import LeftOut, SpacingChange
from nanoslip.solver.elasticity.fields import InteriorFields
from nanoslip.solver.ensemble import ALONE, Ensemble, Places
from nanoslip.solver.last import cache_last
from nanoslip.solver.load_path import Loops, PathLine, Turns
from nanoslip.solver.outcome import Ending
from nanoslip.solver.parameter import SHARED_ERROR, Quantity, as_field, quantities, quantity
from nanoslip.solver.slab import SCHEMES, Slab
from nanoslip.solver.sliding.interface import Portion, batches
from nanoslip.solver.sliding.plateau import Plateau
from nanoslip.solver.sliding.record import RECORD_Y, FrictionRecord
from nanoslip.solver.sliding.sizes import EventDistributions, SizeBins
from nanoslip.solver.sliding.statistics import Collective, EventStatistics
from nanoslip.solver.sliding.validity import Validity
from nanoslip.study.canonical import CanonicalText, canonical_text
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.plan.task import (
    Task,
    TaskResult,
    contact_parameters,
    path_parameters,
    record_parameters,
    task_case,
    task_key,
)


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


@dataclass(frozen=True, slots=True)
class Kind:
    """One kind of task. Its stage is its place in KINDS."""

    name: str
    needed: Callable[[Manifest], bool]
    """True if a campaign needs such tasks at all."""
    tasks: Callable[[Case, Manifest], tuple[Wanted, ...]]
    """Tasks of a case, inputs first; the last task of a drive computes the drive itself."""
    parts: tuple[Part, ...] = ()
    """Parts in the order of a dataset's variables."""
    ragged: tuple[Ragged, ...] = ()
    all_members: bool = False
    """True if results hold the columns of all members, which other tasks read; else the arrays of the first one."""


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
        scalars = ((name, each) for name, each in result_quantities(kind).items() if each.ensemble)
        own = {name: replace(each, along=MEMBER, ensemble=False, si=None) for name, each in scalars}
        return {MEMBER_OUTCOME.name: MEMBER_OUTCOME, **own}
    found = [each for part in kind.parts for each in quantities(part.type, part.prefix).items()]
    return {key: quantity for key, quantity in found if quantity.along == along}


def names_to_drop(kind: Kind, manifest: Manifest) -> frozenset[str]:
    """Names of the scalars and arrays of a kind's parts that a campaign does not request."""
    parts = (part for part in kind.parts if not part.wanted(manifest))
    return frozenset(name for part in parts for name in quantities(part.type, part.prefix))


def several(manifest: Manifest) -> bool:
    """True if cases have members whose values a dataset holds beside their means."""
    return manifest.ensemble.members > 1


def _has_target(manifest: Manifest) -> bool:
    """True if a campaign states an error instead of a number of members."""
    return manifest.ensemble.within is not None


def output(name: str) -> Callable[[Manifest], bool]:
    """Predicate: True if a campaign requests this of its outputs."""
    return lambda manifest: bool(getattr(manifest.outputs, name))


def uncertain_names(kind: Kind) -> frozenset[str]:
    """The variables of a kind's results whose means have an uncertainty."""
    return frozenset(each.name for each in result_quantities(kind).values() if each.ensemble)


@lru_cache(maxsize=64)  # asked for every case of a campaign
def own_ensemble(kind: str, ensemble: Ensemble) -> tuple[Ensemble, CanonicalText]:
    """The ensemble of the tasks of this kind in a campaign with this ensemble, and its canonical text."""
    found = ensemble.select_observables(uncertain_names(KINDS[kind]))
    return found, CanonicalText(canonical_text(found))


def column_length_name(sample: str) -> str:
    """Scalar with the length of each member's columns along a dimension, in results with columns of all members."""
    return f"{sample}_rows"


def member_column(result: TaskResult, name: str, sample: str, member: int = 0) -> NDArray[Any]:
    """A member's column along a dimension."""
    whole, rows = result.arrays[name], result.scalars.get(column_length_name(sample))
    if rows is None:
        return whole
    begin = int(sum(rows[:member]))
    return whole[begin : begin + int(rows[member])]


def _member_task(
    kind: str, physics: tuple[object, ...], case: Case, ensemble: Ensemble, scalars_only: bool, *inputs: str
) -> Task:
    """A task of all members of a case, that reads the compliance and these inputs; its key hashes these parameters."""
    ensemble, text = own_ensemble(kind, ensemble)
    key = task_key(kind, *physics, text, *_marks(scalars=scalars_only))
    needs = (*compliance_needs(case.slab), *inputs)
    return Task(key, kind, case.slab, case, ensemble=ensemble, needs=needs, scalars_only=scalars_only)


def _marks(**chosen: bool) -> tuple[str, ...]:
    """Marks of these choices in the key of a result."""
    return tuple(name for name, there in chosen.items() if there)


# The surface compliance of a slab: an intermediate result, shared by all cases on it that read its matrix.


@lru_cache(maxsize=4096)  # hashed once for all cases on it
def compliance_task(slab: Slab) -> Task:
    """The surface compliance of a slab."""
    return Task(task_key("compliance", slab), "compliance", slab, intermediate=True, shared=True)


@lru_cache(maxsize=4096)  # all cases on it share the text, and the tuple
def compliance_needs(slab: Slab) -> tuple[str, ...]:
    """Inputs of a task that uses the compliance of a slab; without ends it is computed faster than read."""
    return () if slab.scheme.endless else (compliance_task(slab).key,)


def _compliance_tasks(case: Case, manifest: Manifest) -> tuple[Wanted, ...]:
    return () if case.slab.scheme.endless else (Wanted(compliance_task(case.slab)),)


MATRIX: Final = "matrix"
"""The one array of a compliance."""
COMPLIANCE: Final = Kind("compliance", lambda _: True, _compliance_tasks)


# Initial contact. Sliding starts from its own, so a task of contact alone exists only where nothing follows it or where its
# tractions are wanted.


def event_field(along: str) -> Any:
    """A field that is a column: the event after which the values of a node hold."""
    comment = "of the record; 0: initial contact"
    return quantity("event after which the values hold", "event", along=along, dtype=np.int64, comment=comment)


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceNodes:
    """Event and position at which each surface node of a contact is seen."""

    event: NDArray[np.int64] = event_field(along="contact_node")
    x: Floats = as_field(NODE_X)


def _planar(manifest: Manifest) -> bool:
    """True if a case may have a plane of nodes."""
    return any(SCHEMES[str(scheme)].planar for scheme in manifest.case_values("scheme"))


@dataclass(frozen=True, slots=True, eq=False)
class RowsOfContact:
    """Position of each surface node across the drag, of a plane of nodes."""

    y: Floats = as_field(NODE_Y)


@dataclass(frozen=True, slots=True, eq=False)
class RowsOfRecord:
    """Position of each surface node of a record across the drag, of a plane of nodes."""

    y: Floats = as_field(RECORD_Y)


def contact_task(case: Case, ensemble: Ensemble = ALONE, *, scalars_only: bool = False) -> Task:
    """Initial contact of a case's members."""
    return _member_task("contact", contact_parameters(case), case, ensemble, scalars_only)


def _contact_tasks(case: Case, manifest: Manifest) -> tuple[Wanted, ...]:
    return (Wanted(contact_task(case, manifest.ensemble, scalars_only=not manifest.outputs.tractions)),)


CONTACT: Final = Kind(
    "contact",
    lambda manifest: "slip" not in manifest.stages or manifest.outputs.tractions,
    _contact_tasks,
    (
        Part(Validity),
        Part(ContactState, whole=True),
        Part(ContactSummary),
        Part(SurfaceNodes),
        Part(RowsOfContact, wanted=_planar),
    ),
    (
        Ragged("contact", "contact_node", "contact_row_size", output("tractions")),
        Ragged(
            "ensemble", MEMBER, "member_row_size", lambda manifest: several(manifest) and "slip" not in manifest.stages
        ),
    ),
)


# Contacts of an interface, in batches: what their friction records add up to. The record of the slider is made of them.


def contacts_task(case: Case, places: Places, contacts: tuple[int, int]) -> Task:
    """A batch of the contacts of an interface, which is one member of an ensemble."""
    key = task_key("contacts", *record_parameters(case), places, contacts)
    return Task(
        key,
        "contacts",
        case.slab,
        case,
        contacts=contacts,
        intermediate=True,
        ensemble=Ensemble(places=places),
        shared=True,
        needs=compliance_needs(case.slab),
    )


def member_batches(member: Case, ensemble: Ensemble) -> Iterator[Task]:
    """The batches of a member of an ensemble."""
    return (contacts_task(member, ensemble.places, batch) for batch in batches(member.interface.contacts))


def all_batches(case: Case, ensemble: Ensemble) -> tuple[Task, ...]:
    """The batches of all members that are certain to be computed; empty for a case with a single contact."""
    if case.interface.contacts == 1:
        return ()
    return tuple(
        task for member in range(ensemble.likely) for task in member_batches(ensemble.case(case, member), ensemble)
    )


def _contacts_tasks(case: Case, manifest: Manifest) -> tuple[Wanted, ...]:
    ensemble, _ = own_ensemble("record", manifest.ensemble)
    return tuple(Wanted(task, part=True) for task in all_batches(case, ensemble))


def _interface(manifest: Manifest) -> bool:
    return "contacts" in manifest.fixed or "contacts" in manifest.axes


CONTACTS: Final = Kind(
    "contacts",
    lambda manifest: "slip" in manifest.stages and _interface(manifest),
    _contacts_tasks,
    (Part(Portion, whole=True),),
)


# The friction record of a case, with its plateau and statistics. Where drives or statistics need a record that the campaign
# does not keep, it is intermediate, and another task reads off its scalars.


def record_task(case: Case, ensemble: Ensemble = ALONE, *, scalars_only: bool = False) -> Task:
    """The friction records of a case's members."""
    return _record(case, ensemble, scalars_only)


@lru_cache(maxsize=4)  # asked again by each of its drives
def _record(case: Case, ensemble: Ensemble, scalars_only: bool) -> Task:
    contacts = (batch.key for batch in all_batches(case, own_ensemble("record", ensemble)[0]))
    return _member_task("record", record_parameters(case), case, ensemble, scalars_only, *contacts)


def record_scalars_task(record: Task) -> Task:
    """Task for the scalars of a friction record of another task; its result equals that of sliding for them alone."""
    task = record_task(task_case(record), record.ensemble, scalars_only=True)
    return replace(task, needs=(record.key,), free=True)


def _record_tasks(case: Case, manifest: Manifest) -> tuple[Wanted, ...]:
    shared = "dynamics" in manifest.stages or manifest.outputs.statistics
    kept = manifest.outputs.records
    if kept or not shared:
        record = record_task(case, manifest.ensemble, scalars_only=not kept)
        return (Wanted(replace(record, shared=True) if shared else record),)
    record = replace(record_task(case, manifest.ensemble), intermediate=True, shared=True)
    return Wanted(record), Wanted(record_scalars_task(record))


RECORD: Final = Kind(
    "record",
    lambda manifest: (
        "slip" in manifest.stages
        and (not manifest.paths or "dynamics" in manifest.stages or manifest.outputs.statistics)
    ),
    _record_tasks,
    (
        Part(Validity),
        Part(Plateau, Plateau.PREFIX, whole=True),
        Part(EventStatistics),
        Part(FrictionRecord, whole=True),
        Part(Collective, wanted=_interface),
        Part(RowsOfRecord, "node_", wanted=_planar),
        Part(SpacingChange, wanted=_has_target),
    ),
    (
        Ragged("record", "event", "row_size", output("records")),
        Ragged("record", "record_node", "record_node_row_size", output("records")),
        Ragged("ensemble", MEMBER, "member_row_size", several),
    ),
    all_members=True,
)


# The contact along a path of pin and load, in place of a record: a line of friction force, and the numbers of its loops.


def path_task(case: Case, ensemble: Ensemble = ALONE, *, scalars_only: bool = False) -> Task:
    """The paths of a case's members."""
    return _member_task("path", path_parameters(case), case, ensemble, scalars_only)


def _path_tasks(case: Case, manifest: Manifest) -> tuple[Wanted, ...]:
    return (Wanted(path_task(case, manifest.ensemble, scalars_only=not manifest.outputs.records)),)


PATH: Final = Kind(
    "path",
    lambda manifest: manifest.paths,
    _path_tasks,
    (Part(Validity), Part(Loops), Part(Turns, "leg_"), Part(PathLine, "path_")),
    (
        Ragged("path", "turn", "turn_row_size", output("records")),
        Ragged("path", "path_point", "path_row_size", output("records")),
        Ragged("path_ensemble", MEMBER, "path_member_row_size", several),
    ),
)


# Distributions of the event sizes of all members of a case. They take longer than a small record, so they are an output.


def statistics_task(case: Case, ensemble: Ensemble = ALONE) -> Task:
    """The distributions of the sizes of a case's events."""
    record = record_task(case, ensemble)
    key, ensemble = task_key("statistics", record.key), record.ensemble
    return Task(key, "statistics", case.slab, case, ensemble=ensemble, needs=(record.key,))


def _statistics_tasks(case: Case, manifest: Manifest) -> tuple[Wanted, ...]:
    return (Wanted(statistics_task(case, manifest.ensemble)),)


STATISTICS: Final = Kind(
    "statistics",
    output("statistics"),
    _statistics_tasks,
    (Part(EventDistributions, whole=True), Part(SizeBins)),
    (Ragged("event_sizes", "bin", "bins", output("statistics")),),
)


# The contact of the first member after chosen events of a record (0: initial contact), and the inside of the slab there.


_AS_IN_A_CONTACT = quantities(ContactState)


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceStates(SurfaceNodes):
    """Surface nodes after each event, one event after the other; units as in ContactState."""

    pressure: Floats = as_field(_AS_IN_A_CONTACT["pressure"])
    shear: Floats = as_field(_AS_IN_A_CONTACT["shear"])
    slip: Floats = as_field(_AS_IN_A_CONTACT["slip"])
    gap: Floats = as_field(_AS_IN_A_CONTACT["gap"])


@dataclass(frozen=True, slots=True, eq=False)
class InteriorEvents:
    """Record and event of each node inside the slab."""

    event: NDArray[np.int64] = event_field(along="interior_node")


def states_task(case: Case, events: tuple[int, ...], subsurface: bool) -> Task:
    """The contact of a case after each of some events of its record, and the inside of the slab."""
    physics = record_parameters(case) if any(events) else contact_parameters(case)
    key = task_key("states", *physics, events, subsurface)
    needs = compliance_needs(case.slab)
    return Task(key, "states", case.slab, case, events=events, subsurface=subsurface, needs=needs)


def _states_tasks(case: Case, manifest: Manifest) -> tuple[Wanted, ...]:
    outputs = manifest.outputs
    first = manifest.ensemble.case(case, 0)
    return (Wanted(states_task(first, outputs.tractions_at or (0,), outputs.subsurface)),)


STATES: Final = Kind(
    "states",
    lambda manifest: bool(manifest.outputs.tractions_at) or manifest.outputs.subsurface,
    _states_tasks,
    (
        Part(SurfaceStates, "surface_"),
        Part(InteriorEvents, "interior_"),
        Part(InteriorFields, "interior_"),
        Part(RowsOfContact, "surface_", wanted=_planar),
    ),
    (
        Ragged("contact", "contact_node", "contact_row_size", output("tractions_at")),
        Ragged("interior", "interior_node", "interior_row_size", output("subsurface")),
    ),
)


# The motion of the driven pin over a case's friction records, and what is measured in it.


def drive_task(
    case: Case,
    drive: Drive,
    ensemble: Ensemble = ALONE,
    *,
    scalars_only: bool = False,
    fitted: bool = True,
    critical: bool = False,
) -> Task:
    """The motion of the pin over the friction records of a case's members.

    fitted: whether Eq. 16-19 are fitted to its spring force. critical: whether its critical velocity is computed.
    Members that its target needs beyond those records are slid too.
    """
    record = record_task(case, ensemble)
    own, text = own_ensemble("drive", ensemble)
    marks = _marks(scalars=scalars_only, unfitted=not fitted, critical=critical)
    key = task_key("drive", record.key, _key_text(drive), text, *marks)
    slides = own.within is not None or drive.memory
    needs = (record.key, *(compliance_needs(case.slab) if slides else ()))
    return Task(
        key,
        "drive",
        case.slab,
        case,
        drive,
        ensemble=own,
        needs=needs,
        scalars_only=scalars_only,
        fitted=fitted,
        critical=critical,
    )


@lru_cache(maxsize=4096)  # a campaign has few drives and many cases
def _key_text(drive: Drive) -> CanonicalText:
    settings = {item.name: getattr(drive, item.name) for item in fields(drive)}
    if drive.stage_stroke is None:  # a stage in one direction has no cycles
        settings = {name: value for name, value in settings.items() if name not in OF_A_STROKE}
    return CanonicalText(canonical_text({"type": type(drive).__name__, **settings}))


def _drive_tasks(case: Case, manifest: Manifest) -> tuple[Wanted, ...]:
    outputs = manifest.outputs
    bare = not (outputs.trajectory or outputs.phases)
    task = partial(drive_task, scalars_only=bare, fitted=outputs.fit, critical=outputs.critical)
    return tuple(Wanted(task(case, drive, manifest.ensemble), label) for label, drive in _dimensionless(manifest))


@cache_last
def _dimensionless(manifest: Manifest) -> tuple[tuple[str, Drive], ...]:
    """Label and numbers of the campaign's drives."""
    return tuple((each.label, each.drive.dimensionless(manifest.scales)) for each in manifest.drives if each.drive)


def reciprocates(manifest: Manifest) -> bool:
    """True if the stage of a drive goes to and fro."""
    return any(each.drive is not None and each.drive.in_si.stage_stroke is not None for each in manifest.drives)


def goes_one_way(manifest: Manifest) -> bool:
    """True if the stage of a drive keeps its direction; as it does where all drives are refused."""
    drives = [each.drive.in_si for each in manifest.drives if each.drive is not None]
    return not drives or any(drive.stage_stroke is None for drive in drives)


def _has_legs(manifest: Manifest) -> bool:
    """True if a dataset has the legs of stages."""
    return reciprocates(manifest) and manifest.outputs.trajectory


DRIVE: Final = Kind(
    "drive",
    lambda manifest: "dynamics" in manifest.stages,
    _drive_tasks,
    (
        Part(FrictionCoefficients, wanted=goes_one_way),
        Part(StickSlipFit, "fitted_", wanted=lambda manifest: manifest.outputs.fit and goes_one_way(manifest)),
        Part(StickSlipCount, wanted=goes_one_way),
        Part(CriticalVelocity, wanted=output("critical")),
        Part(DynamicsResult, whole=True),
        Part(StageLoops, wanted=reciprocates),
        Part(StageLegs, "stage_leg_", wanted=reciprocates),
        Part(LeftOut, wanted=_has_target),
        Part(SpacingChange, "drive_", wanted=_has_target),
    ),
    (
        Ragged("trajectory", "sample", "trajectory_row_size", output("trajectory")),
        Ragged("trajectory", "slip_phase", "phase_row_size", output("phases")),
        Ragged("trajectory", "stage_leg", "stage_leg_row_size", _has_legs),
        Ragged("drive_ensemble", MEMBER, "drive_member_row_size", several),
    ),
)


KINDS: Final = {kind.name: kind for kind in (COMPLIANCE, CONTACT, CONTACTS, RECORD, PATH, STATISTICS, STATES, DRIVE)}
"""Name -> kind of task: a stage each, none of which needs a later one."""


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
        return any(name in names for name in (*self.scalars, *self.columns, *self.undeclared))


@lru_cache(maxsize=64)
def result_names(kind: Kind) -> tuple[PartContents, ...]:
    """Names of the scalars and arrays in results of a kind, part by part."""
    return tuple(map(_contents_of_part, kind.parts))


def _contents_of_part(part: Part) -> PartContents:
    declared = quantities(part.type, part.prefix)
    columns = {name: each.along for name, each in declared.items() if each.along}
    scalars = declared.keys() - columns
    shared = {f"{name}{SHARED_ERROR}" for name in scalars if declared[name].shared}
    every = {f"{part.prefix}{item.name}" for item in fields(part.type) if item.name != ENDING_FIELD}
    return PartContents(frozenset(scalars | shared), columns, frozenset(every - declared.keys() if part.whole else ()))


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
    parts = [part for part in result_names(kind) if part.is_held(names)]
    if not parts and result_names(kind) and result.outcome.ok:
        raise ValueError("completed without numbers")
    if members:
        declared = {name for part in parts for name in part.scalars}
        missing = {name: [math.nan] * members for name in sorted(declared - result.scalars.keys())}
        result = replace(result, scalars={**result.scalars, **missing}) if missing else result
    _require_arrays(kind, parts, members, result)
    return result


def _member_count(result: TaskResult) -> int:
    """Number of members, 0 without scalars. Raises ValueError unless each scalar is a number of each member."""
    columns = list(result.scalars.values())
    counts = {len(column) for column in columns} | ({len(result.members)} - {0})
    plain = all({*map(type, column)} <= {int, float, bool} for column in columns)
    if not plain or len(counts) > 1 or 0 in counts:
        raise ValueError("scalars that are not one number of each member")
    return max(counts) if result.scalars else 0


def _require_arrays(kind: Kind, parts: Iterable[PartContents], members: int, result: TaskResult) -> None:
    """Raise ValueError unless there are no arrays, or all of each part, as long as each other along a dimension."""
    arrays, scalars = result.arrays, result.scalars
    if any(each.dtype.kind not in "biuf" for each in arrays.values()):
        raise ValueError("an array of something else than numbers")
    matrix = arrays.get(MATRIX)
    if kind is COMPLIANCE and result.outcome.ok and (matrix is None or matrix.shape != 2 * (len(matrix),)):
        raise ValueError("no square matrix")
    for part in parts if arrays else ():
        if lost := (part.columns.keys() | part.undeclared) - arrays.keys() - scalars.keys():
            raise ValueError(f"without {', '.join(sorted(lost))}")
        for name, sample in part.columns.items():
            rows = scalars.get(column_length_name(sample), ())
            if kind.all_members and members > 1 and not rows:
                raise ValueError(f"without {column_length_name(sample)}")
            first = next(arrays[each].shape for each, along in part.columns.items() if along == sample)
            if arrays[name].shape != ((sum(rows),) if rows else first) or arrays[name].ndim != 1:
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
