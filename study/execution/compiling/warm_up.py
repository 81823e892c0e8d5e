"""Compile the kernels that a run needs before it begins, each in one process: the others load them from numba's cache.

Those of contact and sliding and those of the driven pin have nothing in common, so two processes compile side by side.
"""

import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from nanoslip.solver.compiled import told_of_compiling
from nanoslip.solver.outcome import COMPLETED, Outcome
from nanoslip.study.execution.compiling.miniatures import made_up_record, miniatures
from nanoslip.study.plan.tasks import Task, run_task
from nanoslip.study.results.store import Store


@dataclass(frozen=True, slots=True)
class WarmUp:
    """The compiling as a task of its own: what it does to its process costs nobody another one."""

    of: str
    """What is compiled, in words."""
    tasks: tuple[Task, ...]
    """Small ones, that run every kernel of that."""
    needs: tuple[str, ...] = ()
    kind: str = "warm_up"
    cost: float = 60.0
    limit: float = 600.0

    @property
    def key(self) -> str:
        """One name for each."""
        return f"{self.kind} {self.of}"

    @property
    def label(self) -> str:
        """What messages call it."""
        return f"compiling kernels of {self.of}"

    def run(self) -> Outcome:
        """Compile, and say so first where the cache has not all of it."""
        warm_up(self.tasks, lambda: sys.stderr.write(f"{self.label}, once: later runs load them\n"))
        return COMPLETED


def warm_ups(tasks: Sequence[Task]) -> list[WarmUp]:
    """What is to be compiled for these tasks, side by side."""
    small = miniatures(tasks)
    parts = {
        "contact and sliding": tuple(task for task in small if task.drive is None),
        "the driven pin": tuple(task for task in small if task.drive is not None),
    }
    return [WarmUp(of, found) for of, found in parts.items() if found]


def warm_up(tasks: Sequence[Task], say: Callable[[], object] = lambda: None) -> None:
    """Run `miniatures` of tasks, through a store: kernels are compiled for its read-only arrays.

    say: called once, before the first kernel is compiled; not where all are in the cache.
    """
    # What fails here fails again in a task of the run, where it is reported.
    with TemporaryDirectory() as folder, suppress(Exception), told_of_compiling(cache(say)):
        store = Store(Path(folder))
        store.prepare()
        store.write(made_up_record(), shared=True)
        for task in tasks:
            store.write(run_task(task, {key: store.read(key) for key in task.needs}), task.shared)
