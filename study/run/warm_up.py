"""Compile the kernels that a run needs before it begins, in one process: the others load them from numba's cache."""

import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from nanoslip.solver.case import Case
from nanoslip.solver.compiled import reporting_compilation
from nanoslip.solver.drive import Drive
from nanoslip.solver.outcome import COMPLETED, InvalidInput, Outcome
from nanoslip.study.plan.kinds import compliance_task, contact_task, drive_task, record_task
from nanoslip.study.plan.task import Task
from nanoslip.study.results.store import Store
from nanoslip.study.run.compute import run_task

# Small tasks that run every kernel of a campaign's tasks.


_NUMBERS = {"n_x": 17, "radius": 50.0, "max_events": 300}
"""Numbers of a small case, whose record has a steady part."""
_SMALL = Case.of(_NUMBERS)
_COMPLIANCE, _OF_SLABS = compliance_task(_SMALL.slab), _SMALL.slab.flat
_ROUGH = ((-0.1, 0.0), (0.1, 0.0))
"""A rough pin has kernels of its own, whatever its profile."""


def miniatures(tasks: Sequence[Task]) -> tuple[Task, ...]:
    """Small tasks that run every kernel of these tasks, needs first."""
    found: dict[str, Task] = {}
    for (*_, choices), task in {(task.kind, _is_rough(task), _choices_of(task)): task for task in tasks}.items():
        with suppress(InvalidInput):  # what cannot be made small compiles its kernels itself
            found |= {each.key: each for each in _small(task, dict(choices))}
    return tuple(found.values())


def _choices_of(task: Task) -> tuple[tuple[str, object], ...]:
    """Words and switches of a task's drive, or of its case: they decide which kernels run, the numbers do not.

    The slab's are left out: nothing of a compliance is compiled.
    """
    part = task.drive or task.case
    flat = part.flat if part else {}
    return tuple([each for each in flat.items() if isinstance(each[1], str | bool) and each[0] not in _OF_SLABS])


def _is_rough(task: Task) -> bool:
    return task.case is not None and bool(task.case.heterogeneity.roughness)


def _small(task: Task, choices: Mapping[str, object]) -> list[Task]:
    if task.drive is not None:
        return [_COMPLIANCE, record_task(_SMALL), _short(task.drive)]
    if task.case is None:
        return []
    case = Case.of({**_NUMBERS, **choices, "roughness": _ROUGH if _is_rough(task) else ()})
    return [_COMPLIANCE, (contact_task if task.kind == "contact" else record_task)(case)]


def _short(drive: Drive) -> Task:
    """The drive over a hundredth of its duration, or all of it where that is less than a step of its integrator."""
    with suppress(InvalidInput):
        return drive_task(_SMALL, replace(drive, duration=(drive.duration or 100.0) / 100, samples=2))
    return drive_task(_SMALL, replace(drive, samples=2))


@dataclass(frozen=True, slots=True)
class WarmUp:
    """Compilation as a separate task, so that a crash costs no other task."""

    tasks: tuple[Task, ...]
    """Miniatures of those that a run computes."""
    key: str = "warm_up"
    needs: tuple[str, ...] = ()
    kind: str = "warm_up"
    cost: float = 60.0
    limit: float = 600.0
    label: str = "compiling kernels"

    def run(self) -> Outcome:
        """Run all of them, through a store: kernels are compiled for its read-only arrays.

        It is said before the first kernel is compiled, not where all are in the cache.
        """
        say = cache(lambda: sys.stderr.write(f"{self.label}, once: later runs load them\n"))
        with TemporaryDirectory() as folder, reporting_compilation(say):
            store = Store(Path(folder))
            store.prepare()
            for task in self.tasks:
                with suppress(Exception):  # it fails again in a task of the run, where it is reported
                    store.write(run_task(task, {key: store.read(key) for key in task.needs}), task.shared)
        return COMPLETED
