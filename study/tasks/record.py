"""The friction record of a case, with its plateau and statistics.

Where drives or statistics need a record that the campaign does not keep, it is intermediate, and another task reads off its
scalars.
"""

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Final

from nanoslip.solver.arrays import Floats
from nanoslip.solver.case import Case
from nanoslip.solver.ensemble import ALONE, Ensemble, SpacingChange
from nanoslip.solver.last import cache_last
from nanoslip.solver.parameter import as_field
from nanoslip.solver.sliding.interface import PIECES, Portion, batches
from nanoslip.solver.sliding.plateau import Plateau, plateau_of
from nanoslip.solver.sliding.record import RECORD_Y, FrictionRecord
from nanoslip.solver.sliding.statistics import Collective, EventStatistics, collective, event_statistics
from nanoslip.solver.sliding.validity import Validity, record_validity
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.tasks.compliance import compliance_needs, compliance_task, task_compliance
from nanoslip.study.tasks.compute import compute_members, whole_again
from nanoslip.study.tasks.contacts import PORTION, all_batches, has_interface, member_batches
from nanoslip.study.tasks.estimates import FLOAT, estimate_sizes, record_bytes, record_seconds, sliding_bytes
from nanoslip.study.tasks.kind import (
    MEMBER,
    Computed,
    Estimate,
    Kind,
    Member,
    Part,
    Ragged,
    Wanted,
    has_planes,
    has_several_members,
    has_target,
    member_task,
    output,
    own_ensemble,
)
from nanoslip.study.tasks.miniature import small_case
from nanoslip.study.tasks.task import Inputs, Task, TaskResult, record_parameters, task_case

if TYPE_CHECKING:
    from nanoslip.solver.elasticity.compliance import Compliance


@dataclass(frozen=True, slots=True, eq=False)
class RowsOfRecord:
    """Position of each surface node of a record across the drag, of a plane of nodes."""

    y: Floats = as_field(RECORD_Y)


def record_task(case: Case, ensemble: Ensemble = ALONE, *, scalars_only: bool = False) -> Task:
    """The friction records of a case's members."""
    return _record(case, ensemble, scalars_only)


# Each drive of a case asks for it again; a plan goes case by case, so that few are enough.
@lru_cache(maxsize=4)
def _record(case: Case, ensemble: Ensemble, scalars_only: bool) -> Task:
    of_records, _ = own_ensemble("record", ensemble)
    contacts = (batch.key for batch in all_batches(case, of_records))
    needs = (*compliance_needs(case.slab), *contacts)
    return member_task("record", record_parameters(case), case, ensemble, needs, scalars_only=scalars_only)


def record_scalars_task(record: Task) -> Task:
    """Task for the scalars of a friction record of another task; its result equals that of sliding for them alone."""
    task = record_task(task_case(record), record.ensemble, scalars_only=True)
    return replace(task, needs=(record.key,), free=True)


def _tasks(case: Case, manifest: Manifest) -> tuple[Wanted, ...]:
    shared = _is_read_by_others(manifest)
    kept = manifest.outputs.records
    if kept or not shared:
        record = record_task(case, manifest.ensemble, scalars_only=not kept)
        if shared:
            record = replace(record, shared=True)
        return (Wanted(record),)
    # The whole record is dropped once all have read it; its scalars are a result of their own, that stays.
    whole_record = record_task(case, manifest.ensemble)
    record = replace(whole_record, intermediate=True, shared=True)
    return Wanted(record), Wanted(record_scalars_task(record))


RECORD_SECONDS: Final = 4e-3
"""Time of a member's record beside its events: to set it up, and its numbers (1.5 to 9 ms of 9 nodes, by scheme)."""
# Numbers of a record for each event.
PER_EVENT = 9.0


def _estimate(task: Task) -> Estimate:
    case, members = task_case(task), task.ensemble.likely
    # The contacts of an interface are tasks of their own: here they are only added up.
    if case.interface.contacts > 1:
        numbers = members * PER_EVENT * PIECES
        inputs = members * len(batches(case.interface.contacts)) * PORTION
        return Estimate(0.0, FLOAT * (inputs + numbers), numbers)
    if task.free:
        return Estimate(0.0, 0.0)
    of_member = PER_EVENT * estimate_sizes(case).events + 2.0 * case.slab.nodes
    numbers = members * of_member
    seconds = RECORD_SECONDS + record_seconds(case)
    # Members slide one after the other, but all of their records are kept until the last has ended.
    memory = sliding_bytes(case) + members * record_bytes(case)
    return Estimate(members * seconds, memory, numbers)


def _compute(task: Task, inputs: Inputs) -> Computed:
    compliance = task_compliance(task, inputs)

    def compute(case: Case, number: int) -> Member:
        return compute_record(case, compliance, task.ensemble, inputs)

    def compute_coarse(case: Case, coarse: "Compliance") -> Member:
        return compute_record(case, coarse, task.ensemble, {})

    # Twice the node spacing has no batches of contacts: a coarse interface would slide one contact after the other here.
    is_single = task_case(task).interface.contacts == 1
    coarse = compute_coarse if is_single else None
    return Computed(compute_members(task, compute, coarse=coarse))


Recorded = tuple[FrictionRecord, Plateau]
"""A member's record and its steady part."""


def compute_record(case: Case, compliance: "Compliance", places: Ensemble, inputs: Inputs) -> Member:
    """Record of a member, and all numbers that follow from it. inputs: computed batches of its contacts."""
    from nanoslip.solver.contact.initial import initial_contact  # noqa: PLC0415
    from nanoslip.solver.elasticity.compliance import stiffness_of_node  # noqa: PLC0415
    from nanoslip.solver.sliding.slide import slide_to_state  # noqa: PLC0415
    from nanoslip.solver.sliding.slider import portion, slider  # noqa: PLC0415

    if case.interface.contacts > 1:

        def batch_portion(batch: Task) -> Portion:
            # A batch that no task has computed is computed here: outside of a campaign nothing else does.
            if batch.key in inputs:
                return whole_again(Portion, inputs[batch.key])
            return portion(case, compliance, *batch.contacts, places)

        # Made one after the other, as `slider` adds each up and drops it.
        sum_of_contacts = slider(case, map(batch_portion, member_batches(case, places)))
        record = sum_of_contacts.record
        plateau = plateau_of(record)
        together = collective(record, plateau, sum_of_contacts.bound, sum_of_contacts.lost)
        values: tuple[object, ...] = (sum_of_contacts.validity, plateau, sum_of_contacts.statistics, record, together)
        halves = numbers_of_half(record, plateau)
        outcome = plateau.outcome.adding(record.outcome)
        return Member(values, outcome, plateau=plateau, halves=halves)
    start = initial_contact(case, compliance)
    record, end = slide_to_state(case, compliance, start)
    plateau = plateau_of(record)
    valid = record_validity(case, start, record, end)
    across = RowsOfRecord(record.node_y) if "y" in case.slab.layout.AXES else None
    together = collective(record, plateau)
    values = (valid, plateau, event_statistics(record), record, together, across)
    node = stiffness_of_node(compliance, start.contact) if start.outcome.ok else 0.0
    # A record that failed says why; that it has no plateau follows from it.
    outcome = plateau.outcome if record.outcome.ok else record.outcome
    halves = numbers_of_half(record, plateau)
    return Member(values, outcome, plateau=plateau, node=node, halves=halves)


def record_of_member(case: Case, compliance: "Compliance", ensemble: Ensemble, number: int) -> FrictionRecord:
    """The record of a case's member, by the member's number. Raises SolverError if there is none."""
    member = compute_record(ensemble.case(case, number), compliance, ensemble, {})
    return next(value for value in member.values if isinstance(value, FrictionRecord))


def numbers_of_half(record: FrictionRecord, plateau: Plateau) -> dict[str, float]:
    """Numbers that the length of a record decides, over its first half. plateau: of all of it, over which peaks are stated."""
    half = record.first_half
    peak = half.highest_force / half.normal_load if half.final_displacement > 0.0 else math.nan
    excess = collective(half, plateau).static_excess
    # A fluctuation is about the mean of the same displacements.
    fluctuation = collective(half, plateau_of(half)).fluctuation
    return {"peak_friction": peak, "static_excess": excess, "fluctuation": fluctuation}


# One drive after the other is pulled over the same records.
@cache_last
def member_records(result: TaskResult) -> list[Recorded]:
    """The records of all members."""
    members = []
    for number in range(len(result.scalars["plateau_mean"])):
        record = whole_again(FrictionRecord, result, number)
        plateau = whole_again(Plateau, result, number, Plateau.PREFIX)
        members.append((record, plateau))
    return members


def small_record(task: Task) -> tuple[Task, ...]:
    """A small case's record, which runs the kernels of a task's, and the compliance that it needs."""
    case = small_case(task)
    return compliance_task(case.slab), record_task(case)


def _has_records(manifest: Manifest) -> bool:
    # A path replaces the record of its case, unless drives or statistics need that as well.
    return "slip" in manifest.stages and (not manifest.paths or _is_read_by_others(manifest))


def _is_read_by_others(manifest: Manifest) -> bool:
    """True if numbers of a campaign follow from whole records."""
    return "dynamics" in manifest.stages or manifest.outputs.statistics or bool(manifest.observables)


KIND: Final = Kind(
    "record",
    needed=_has_records,
    tasks=_tasks,
    estimate=_estimate,
    compute=_compute,
    miniature=small_record,
    parts=(
        Part(Validity),
        Part(Plateau, Plateau.PREFIX, whole=True),
        Part(EventStatistics),
        Part(FrictionRecord, whole=True),
        Part(Collective, wanted=has_interface),
        Part(RowsOfRecord, "node_", wanted=has_planes),
        Part(SpacingChange, wanted=has_target),
    ),
    ragged=(
        Ragged("record", "event", "row_size", output("records")),
        Ragged("record", "record_node", "record_node_row_size", output("records")),
        Ragged("ensemble", MEMBER, "member_row_size", has_several_members),
    ),
    all_members=True,
)
