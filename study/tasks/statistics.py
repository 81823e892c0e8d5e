"""Distributions of the event sizes of all members of a case. They take longer than a small record, so they are an output."""

import math
from typing import Final

from nanoslip.solver.case import Case
from nanoslip.solver.ensemble import ALONE, Ensemble
from nanoslip.solver.sliding.sizes import EventDistributions, SizeBins, event_distributions
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.tasks.estimates import FLOAT, estimate_sizes
from nanoslip.study.tasks.kind import Computed, Estimate, Kind, Member, Part, Ragged, Wanted, output
from nanoslip.study.tasks.record import member_records, record_task, small_record
from nanoslip.study.tasks.task import Inputs, Task, task_case, task_key


def statistics_task(case: Case, ensemble: Ensemble = ALONE) -> Task:
    """The distributions of the sizes of a case's events."""
    record = record_task(case, ensemble)
    key, ensemble = task_key("statistics", record.key), record.ensemble
    return Task(key, "statistics", case.slab, case, ensemble=ensemble, needs=(record.key,))


def _tasks(case: Case, manifest: Manifest) -> tuple[Wanted, ...]:
    return (Wanted(statistics_task(case, manifest.ensemble)),)


STATISTICS_SECONDS: Final = 0.04
"""Time to fit the distributions of event sizes to drawn samples, over the cube root of their number, all members together: 0.3 s
for 400 events, 1.0 for 20,000 and 2.5 for 160,000."""
# Numbers for each event while its sizes are fitted.
_OF_A_SIZE = 25.0


def _estimate(task: Task) -> Estimate:
    events = task.ensemble.likely * estimate_sizes(task_case(task)).events
    return Estimate(STATISTICS_SECONDS * math.cbrt(events), FLOAT * _OF_A_SIZE * events, 800.0)


def _compute(task: Task, inputs: Inputs) -> Computed:
    records = member_records(inputs[task.needs[0]])
    return Computed((Member(event_distributions(records)),))


KIND: Final = Kind(
    "statistics",
    needed=output("statistics"),
    tasks=_tasks,
    estimate=_estimate,
    compute=_compute,
    # It runs no kernel beside its record's.
    miniature=small_record,
    parts=(Part(EventDistributions, whole=True), Part(SizeBins)),
    ragged=(Ragged("event_sizes", "bin", "bins", output("statistics")),),
)
