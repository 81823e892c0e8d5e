"""The account of a run: what waits, what came of what was done, and how long each kind of task really takes."""

import math
import time
import traceback
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

from solver.outcome import Ending, Outcome
from study.execution.queue import Backlog, Work

W = TypeVar("W", bound=Work)
Execute = Callable[[W], Outcome]
Report = Callable[[W, Outcome, float], None]

LEAST = 1e-3
"""Seconds that a task takes at least when counting ahead: its files and messages, however little it computes."""

UNDONE = {Ending.CRASHED: "crashed", Ending.OUT_OF_MEMORY: "ran out of memory"}
"""Endings that are not the task's own, in words: there is no result, and the next run tries again."""


@dataclass(frozen=True, slots=True)
class Done:
    """The news of one task; its result itself is in the store. `trace` is the traceback where it crashed."""

    key: str
    outcome: Outcome
    seconds: float
    trace: str = ""


@dataclass(frozen=True, slots=True)
class Tally:
    """What came of a run: tasks done, tasks that crashed, ran out of memory or waited for one that did, and whether it was
    cut short."""

    done: int = 0
    crashed: int = 0
    interrupted: bool = False


def attempt(execute: Execute[W], task: W, where: str) -> Done:
    """Compute one task; what it raises (a bug, never physics) becomes an outcome that says where and a traceback."""
    start = time.perf_counter()
    trace = ""
    try:
        outcome = execute(task)
    except Exception as error:
        trace = traceback.format_exc()
        outcome = Outcome(Ending.CRASHED, f"{type(error).__name__}: {error} ({where})")
    return Done(task.key, outcome, time.perf_counter() - start, trace)


class Ledger(Generic[W]):
    """Books what is taken from the backlog and what comes back, and reports it."""

    def __init__(self, tasks: Sequence[W], report: Report[W]) -> None:
        self.backlog = Backlog(tasks)
        self._report = report
        self._away = 0
        self._done = 0
        self._crashed = 0
        self._estimated: dict[str, float] = defaultdict(float)
        self._measured: dict[str, float] = defaultdict(float)

    @property
    def unfinished(self) -> bool:
        """True while a task waits or is being computed."""
        return len(self.backlog) + self._away > 0

    def take(self) -> W:
        """The next task, now being computed."""
        self._away += 1
        return self.backlog.take()

    def enter(self, task: W, done: Done) -> None:
        """Book the end of a task that was taken; what waits for a crashed one is given up."""
        self._away -= 1
        self._estimated[task.kind] += task.cost
        self._measured[task.kind] += done.seconds
        self._report(task, done.outcome, done.seconds)
        if done.outcome.ending not in UNDONE:
            self._done += 1
            self.backlog.finish(task.key)
            return
        self._crashed += 1
        for lost in self.backlog.abandon(task.key):
            self._crashed += 1
            self._report(lost, Outcome(Ending.NEEDS_FAILED, f"{task.label} {UNDONE[done.outcome.ending]}"), 0.0)

    def expected(self, task: W) -> float:
        """Seconds this task will take by its estimate and what its kind took so far; infinite before any is known."""
        estimated = self._estimated[task.kind]
        return max(task.cost * self._measured[task.kind] / estimated, LEAST) if estimated > 0.0 else math.inf

    def tally(self, interrupted: bool) -> Tally:
        """The account so far. A signal that found nothing left to do interrupted nothing."""
        return Tally(self._done, self._crashed, interrupted and self.unfinished)
