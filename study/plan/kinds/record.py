"""The friction record of a case, with its plateau and statistics.

Where drives or statistics need a record that the campaign does not keep, it is intermediate, and another task reads off its
scalars.
"""

from dataclasses import replace
from functools import lru_cache

from nanoslip.solver.case import Case
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.elasticity.compliance import Compliance
from nanoslip.solver.ensemble import ALONE, Ensemble
from nanoslip.solver.last import of_the_last
from nanoslip.solver.sliding.plateau import Plateau, plateau_of
from nanoslip.solver.sliding.record import FrictionRecord
from nanoslip.solver.sliding.slide import slide_to_state
from nanoslip.solver.sliding.statistics import EventStatistics, event_statistics
from nanoslip.solver.sliding.validity import Validity, record_validity
from nanoslip.study.canonical import CanonicalText
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.plan.cost import events_of, record_bytes, record_seconds, sliding_bytes
from nanoslip.study.plan.kinds.compliance import compliance_needs
from nanoslip.study.plan.kinds.kind import (
    MEMBER,
    Computed,
    Estimate,
    Kind,
    Member,
    Part,
    Ragged,
    Wanted,
    case_of,
    compliance_of,
    computed_members,
    disk_of,
    own_ensemble,
    scalars_only_mark,
    several,
    whole_again,
)
from nanoslip.study.plan.task import Inputs, Task, TaskResult, of_record, task_key

NAME = "record"
Recorded = tuple[FrictionRecord, Plateau]
"""A member's record and its steady part."""


def record_task(case: Case, ensemble: Ensemble = ALONE, *, scalars_only: bool = False) -> Task:
    """The friction records of a case's members."""
    return (_scalars_task if scalars_only else _whole_task)(case, ensemble)


@lru_cache(maxsize=4)  # asked again by each of its drives
def _whole_task(case: Case, ensemble: Ensemble) -> Task:
    return _task(case, ensemble)


def _scalars_task(case: Case, ensemble: Ensemble) -> Task:
    return replace(_task(case, ensemble, *scalars_only_mark(scalars_only=True)), scalars_only=True)


def _task(case: Case, ensemble: Ensemble, *marks: str) -> Task:
    ensemble, text = _own(ensemble)
    key = task_key(NAME, *of_record(case), text, *marks)
    return Task(key, NAME, case.slab, case, ensemble=ensemble, needs=compliance_needs(case.slab))


@lru_cache(maxsize=64)  # of all cases
def _own(ensemble: Ensemble) -> tuple[Ensemble, CanonicalText]:
    return own_ensemble(RECORD, ensemble)


def record_scalars_task(record: Task) -> Task:
    """The scalars of a friction record that another task computes; the same result as sliding for them alone."""
    return replace(record_task(case_of(record), record.ensemble, scalars_only=True), needs=(record.key,))


def _needed(manifest: Manifest) -> bool:
    return "slip" in manifest.stages


def _kept(manifest: Manifest) -> bool:
    return manifest.outputs.records


def _tasks(case: Case, manifest: Manifest) -> tuple[Wanted, ...]:
    shared = "dynamics" in manifest.stages or manifest.outputs.statistics
    if _kept(manifest) or not shared:
        record = record_task(case, manifest.ensemble, scalars_only=not _kept(manifest))
        return (
            Wanted(replace(record, shared=True) if shared else record),
        )  # a copy takes its time, for millions of tasks
    record = replace(record_task(case, manifest.ensemble), intermediate=True, shared=True)
    return Wanted(record), Wanted(record_scalars_task(record), free=True)


def _run(task: Task, inputs: Inputs) -> Computed:
    compliance = compliance_of(task, inputs)
    return Computed(computed_members(RECORD, task, lambda case, number: computed_record(case, compliance)))


def computed_record(case: Case, compliance: Compliance) -> Member:
    """The record of one member, and all that is read off it."""
    start = initial_contact(case, compliance)
    record, end = slide_to_state(case, compliance, start)
    plateau = plateau_of(record)
    values = (record_validity(case, start, record, end), plateau, event_statistics(record), record)
    return Member(values, plateau.outcome if record.outcome.ok else record.outcome)


@of_the_last  # records are pulled over by one drive after the other
def records_in(result: TaskResult) -> list[Recorded]:
    """The records of all members."""
    count = len(result.scalars["plateau_mean"])
    return [
        (whole_again(FrictionRecord, result, number), whole_again(Plateau, result, number, Plateau.PREFIX))
        for number in range(count)
    ]


def _estimate(task: Task) -> Estimate:
    case = case_of(task)
    members = task.ensemble.likely
    if task.needs[:1] != compliance_needs(case.slab):  # another record's scalars
        return Estimate(0.0, 0.0, disk_of(members * _SCALARS))
    arrays = 0.0 if task.scalars_only else _ARRAYS + _PER_EVENT * events_of(case) + _PER_NODE * case.slab.n_x
    memory = sliding_bytes(case) + members * record_bytes(case)
    return Estimate(members * record_seconds(case), memory, disk_of(members * _SCALARS, members * arrays))


_SCALARS = 36.0
_ARRAYS = 350.0  # numbers' worth of the names of its arrays
_PER_EVENT = 8.7
_PER_NODE = 2.0


RECORD = Kind(
    NAME,
    _needed,
    _tasks,
    _run,
    _estimate,
    (
        Part(Validity),
        Part(Plateau, Plateau.PREFIX, whole=True),
        Part(EventStatistics),
        Part(FrictionRecord, whole=True),
    ),
    (
        Ragged("record", "event", "row_size", _kept),
        Ragged("record", "record_node", "record_node_row_size", _kept),
        Ragged("ensemble", MEMBER, "member_row_size", several),
    ),
    all_members=True,
)
