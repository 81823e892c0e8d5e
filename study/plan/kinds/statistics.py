"""How the sizes of a record's events are distributed: read off the record, where a campaign asks for it.

It takes longer than a small record itself, so no record has it by itself.
"""

from solver.case import Case
from solver.ensemble import ALONE, Ensemble
from solver.quantity import quantities
from solver.sliding.distributions.record import EventDistributions, event_distributions
from solver.sliding.plateau import plateau_of
from solver.sliding.record import FrictionRecord
from study.manifest.manifest import Manifest
from study.plan.cost.arrays import statistics_bytes
from study.plan.cost.seconds import statistics_seconds
from study.plan.keys import task_key
from study.plan.kinds.kind import Computed, Estimate, Kind, Member, Part, Wanted, case_of, disk_of, whole_again
from study.plan.kinds.record import record_task
from study.plan.task import Inputs, Task

NAME = "statistics"


def statistics_task(case: Case, ensemble: Ensemble = ALONE) -> Task:
    """The distributions of the sizes of a case's events."""
    record = record_task(case, ensemble)
    key, ensemble = task_key(NAME, record.key), record.ensemble
    return Task(key, NAME, case.slab, case, ensemble=ensemble, needs=(record.key,), scalars_only=True)


def _needed(manifest: Manifest) -> bool:
    return manifest.outputs.statistics


def _tasks(case: Case, manifest: Manifest) -> tuple[Wanted, ...]:
    return (Wanted(statistics_task(case, manifest.ensemble)),)


def _run(task: Task, inputs: Inputs) -> Computed:
    result = inputs[task.needs[0]]
    count = len(result.scalars["plateau_mean"])
    return Computed(tuple([_of(whole_again(FrictionRecord, result, number)) for number in range(count)]))


def _of(record: FrictionRecord) -> Member:
    if not record.outcome.usable:
        return Member((), record.outcome)
    return Member((event_distributions(record, plateau_of(record)),))


def _estimate(task: Task) -> Estimate:
    case = case_of(task)
    members = task.ensemble.likely
    scalars = members * len(quantities(EventDistributions))
    return Estimate(members * statistics_seconds(), statistics_bytes(case), disk_of(scalars))


STATISTICS = Kind(NAME, _needed, _tasks, _run, _estimate, (Part(EventDistributions),))
