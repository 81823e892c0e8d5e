"""The decision whether an ensemble needs further members: not if those so far reach the target uncertainty.

Its only result is its outcome. After the outcome `not_needed`, all tasks that wait for it end with the same outcome at once.
"""

import math
from collections.abc import Iterable, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from solver.case import Case
from solver.outcome import COMPLETED, Ending, Outcome
from solver.sliding.sampling import Members, uncertainty_of_members
from study.manifest.manifest import FIRST_MEMBERS, KNOWABLE, Ensemble, Manifest
from study.plan.keys import task_key
from study.plan.kinds.drive import DRIVE
from study.plan.kinds.kind import Computed, Estimate, Kind, Wanted, declared, disk_of
from study.plan.kinds.record import RECORD
from study.plan.task import Inputs, Task, TaskResult

NAME = "ensemble"
SHORT: Final = 0.3
"""Node spacings of a record below which two sizes in a row have to know enough: four such members may agree by chance.

At 0.1 spacings twice ± held in 94 of 100 ensembles that one look ended, of 194 cases, and in 97 with two."""
DRAWN: Final = "plateau_drawn"
"""Scalar of a record: what of its mean force's uncertainty is the draw of the nodes' μ_i."""
_LENGTH: Final = "spacings"
"""Scalar of a record: what it spans, in node spacings."""


def kind_of(observable: str) -> Kind:
    """The kind of task whose results contain the observable of an ensemble."""
    return DRIVE if KNOWABLE[observable] == "dynamics" else RECORD


def one_event(observable: str) -> bool:
    """Whether it is one event of each member, so that the scatter of few says little of it."""
    return declared(kind_of(observable))[observable].ensemble == "event"


def ensemble_task(members: Sequence[Sequence[Task]], ensemble: Ensemble) -> Task:
    """The task that decides whether members reach the target. members: of each its record, then its drives where asked for."""
    read = [task for tasks in members for task in tasks]
    keys, first = tuple(task.key for task in read), read[0]
    enough = ensemble.uncertainty or 0.0
    return Task(
        task_key(NAME, enough, ensemble.observable, *keys),
        NAME,
        first.slab,
        first.case,
        intermediate=True,
        enough=enough,
        observable=ensemble.observable,
        batch=max(task.batch for task in read),
        shared=True,
        needs=keys,
    )


def _needed(manifest: Manifest) -> bool:
    return manifest.ensemble.uncertainty is not None


def _tasks(case: Case, manifest: Manifest) -> tuple[Wanted, ...]:
    """None: it is of several cases (study.plan.ensemble.batches)."""
    return ()


def _run(task: Task, inputs: Inputs) -> Computed:
    results = [inputs[key] for key in task.needs]
    records = [each for each in results if each.kind == RECORD.name]
    spacings, drawn = _numbers(records, _LENGTH), _numbers(records, DRAWN)
    asked = [each for each in results if each.kind == kind_of(task.observable).name]
    each_member = len(asked) // len(spacings)
    quantity = declared(kind_of(task.observable))[task.observable]
    enough = bool(asked)
    for number in range(each_member):
        drive = asked[number::each_member]
        values, stated = (_numbers(drive, name) for name in (task.observable, quantity.uncertainty))
        common = _numbers(drive, quantity.in_common) if quantity.in_common else np.zeros(len(drive))
        enough = enough and _enough(task.enough, quantity.ensemble, Members(values, stated, common, spacings, drawn))
    return Computed((), Outcome(Ending.NOT_NEEDED) if enough else COMPLETED)


def _numbers(results: Iterable[TaskResult], name: str) -> NDArray[np.float64]:
    return np.array([each.scalars.get(name, np.nan) for each in results], float)


def _enough(target: float, kind: str, members: Members) -> bool:
    """Whether members know their mean to the target, a share of it, and half of them did where few may agree by chance."""
    count, alone = len(members.values), kind != "event" and _mean(members.spacings) >= SHORT
    for size in (count,) if alone else (count, count // 2):
        first = members.of(slice(size))
        if size < FIRST_MEMBERS or not uncertainty_of_members(kind, first) <= target * abs(_mean(first.values)):
            return False
    return True


def _mean(values: NDArray[np.float64]) -> float:
    known = values[np.isfinite(values)]
    return float(known.mean()) if len(known) else math.nan


def _estimate(task: Task) -> Estimate:
    return Estimate(0.0, 0.0, disk_of(0))


ENSEMBLE = Kind(NAME, _needed, _tasks, _run, _estimate, takes_failed=True)
