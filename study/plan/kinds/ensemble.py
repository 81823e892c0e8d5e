"""Whether an ensemble needs further members: not where those so far know the plateau well enough.

Nothing but the answer comes of it, as how it ends: all that waits for the answer `not_needed` ends likewise, at once.
"""

from collections.abc import Sequence

import numpy as np

from solver.case import Case
from solver.outcome import COMPLETED, Ending, Outcome
from solver.sliding.sampling import ensemble_uncertainty
from study.manifest.manifest import Manifest
from study.plan.keys import task_key
from study.plan.kinds.kind import Computed, Estimate, Kind, Wanted, disk_of
from study.plan.task import Inputs, Task

NAME = "ensemble"
_READ = ("plateau_mean", "plateau_uncertainty", "spacings")
"""Scalars of a record: what dataset and question know of a mean are the same numbers."""


def ensemble_task(records: Sequence[Task], enough: float) -> Task:
    """The question whether the members with these records know their mean plateau to a relative uncertainty."""
    keys, first = tuple(record.key for record in records), records[0]
    batch = max(record.batch for record in records)
    return Task(
        task_key(NAME, enough, *keys),
        NAME,
        first.slab,
        first.case,
        intermediate=True,
        enough=enough,
        batch=batch,
        shared=True,
        needs=keys,
    )


def _needed(manifest: Manifest) -> bool:
    return manifest.ensemble.uncertainty is not None


def _tasks(case: Case, manifest: Manifest) -> tuple[Wanted, ...]:
    """None: it is of several cases (study.plan.ensemble.batches)."""
    return ()


def _run(task: Task, inputs: Inputs) -> Computed:
    scalars = [inputs[key].scalars for key in task.needs]
    means, stated, spacings = (np.array([each.get(name, np.nan) for each in scalars], float) for name in _READ)
    known = np.isfinite(means)
    if not known.any():
        return Computed()
    uncertainty = ensemble_uncertainty(means, stated, float(np.nanmean(spacings)))
    enough = uncertainty <= task.enough * abs(float(means[known].mean()))
    return Computed((), Outcome(Ending.NOT_NEEDED) if enough else COMPLETED)


def _estimate(task: Task) -> Estimate:
    return Estimate(0.0, 0.0, disk_of(0))


ENSEMBLE = Kind(NAME, _needed, _tasks, _run, _estimate, takes_failed=True)
