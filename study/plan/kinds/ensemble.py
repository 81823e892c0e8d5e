"""Whether an ensemble needs further members: not where those so far know the plateau well enough.

Nothing but the answer comes of it, as how it ends: all that waits for the answer `not_needed` ends likewise, at once.
"""

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from solver.case import Case
from solver.outcome import COMPLETED, Ending, Outcome
from solver.sliding.sampling import ensemble_uncertainty
from study.manifest.manifest import FIRST_MEMBERS, Manifest
from study.plan.keys import task_key
from study.plan.kinds.kind import Computed, Estimate, Kind, Wanted, disk_of
from study.plan.task import Inputs, Task

NAME = "ensemble"
SHORT: Final = 0.3
"""Node spacings of a record below which two sizes in a row have to know enough: four such members may agree by chance.

At 0.1 spacings twice ± held in 85 of 100 ensembles that one look ended, and in 91 with two (tests/verification/members.md)."""
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
    members = np.array([[each.get(name, np.nan) for name in _READ] for each in scalars], float)
    sizes = [len(members)] if _length(members) >= SHORT else [len(members), len(members) // 2]
    enough = all(size >= FIRST_MEMBERS and _relative_uncertainty(members[:size]) <= task.enough for size in sizes)
    return Computed((), Outcome(Ending.NOT_NEEDED) if enough else COMPLETED)


def _length(members: NDArray[np.float64]) -> float:
    """What their records span on average, in node spacings; NaN of none. members: what was read of each, (members, 3)."""
    known = members[np.isfinite(members[:, 2]), 2]
    return float(known.mean()) if len(known) else math.nan


def _relative_uncertainty(members: NDArray[np.float64]) -> float:
    """Of their mean plateau; NaN of none."""
    means = members[np.isfinite(members[:, 0]), 0]
    if not len(means):
        return math.nan
    return ensemble_uncertainty(members[:, 0], members[:, 1], _length(members)) / abs(float(means.mean()))


def _estimate(task: Task) -> Estimate:
    return Estimate(0.0, 0.0, disk_of(0))


ENSEMBLE = Kind(NAME, _needed, _tasks, _run, _estimate, takes_failed=True)
