"""How the sizes of the events of all members of a case are distributed: read off their records, where a campaign asks for it.

It takes longer than a small record itself, so no record has it by itself.
"""

from nanoslip.solver.case import Case
from nanoslip.solver.ensemble import ALONE, Ensemble
from nanoslip.solver.sliding.sizes import EventDistributions, SizeBins, event_distributions
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.plan.cost import statistics_bytes, statistics_seconds
from nanoslip.study.plan.kinds.kind import Computed, Estimate, Kind, Member, Part, Ragged, Wanted, case_of, disk_of
from nanoslip.study.plan.kinds.record import record_task, records_in
from nanoslip.study.plan.task import Inputs, Task, task_key

NAME = "statistics"


def statistics_task(case: Case, ensemble: Ensemble = ALONE) -> Task:
    """The distributions of the sizes of a case's events."""
    record = record_task(case, ensemble)
    key, ensemble = task_key(NAME, record.key), record.ensemble
    return Task(key, NAME, case.slab, case, ensemble=ensemble, needs=(record.key,))


def _needed(manifest: Manifest) -> bool:
    return manifest.outputs.statistics


def _tasks(case: Case, manifest: Manifest) -> tuple[Wanted, ...]:
    return (Wanted(statistics_task(case, manifest.ensemble)),)


def _run(task: Task, inputs: Inputs) -> Computed:
    return Computed((Member(event_distributions(records_in(inputs[task.needs[0]]))),))


def _estimate(task: Task) -> Estimate:
    case, members = case_of(task), task.ensemble.likely
    return Estimate(members * statistics_seconds(), members * statistics_bytes(case), disk_of(_SCALARS, _BINS))


_SCALARS = 51.0
_BINS = 800.0  # numbers of the bins of all sizes


STATISTICS = Kind(
    NAME,
    _needed,
    _tasks,
    _run,
    _estimate,
    (Part(EventDistributions, whole=True), Part(SizeBins)),
    (Ragged("event_sizes", "bin", "bins", _needed),),
)
