"""The state of a run: queued tasks, outcomes of finished ones, and measured seconds of each kind of task."""

import math
import socket
import sys
import time
import traceback
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Generic, TypeVar

from solver.outcome import Ending, Outcome
from study.execution.queue import TaskQueue, Work

W = TypeVar("W", bound=Work)
Execute = Callable[[W], Outcome]
Report = Callable[[W, Outcome, float], None]

LEAST = 1e-3
"""Lower bound of a task's estimated seconds: its files and messages, however little it computes."""

UNDONE = {Ending.CRASHED: "crashed", Ending.OUT_OF_MEMORY: "ran out of memory"}
"""Endings that leave no result, in words: the next run computes the task again."""


@dataclass(frozen=True, slots=True)
class Done:
    """Outcome and duration of one task; its result is in the store. `trace` is the traceback where it crashed."""

    key: str
    outcome: Outcome
    seconds: float
    trace: str = ""


@dataclass(frozen=True, slots=True)
class Tally:
    """Tasks done; tasks that crashed, ran out of memory or needed one that did; whether a signal left tasks undone.

    seconds: of all processes together in the tasks that ended; tallies that differ in nothing else are equal.
    """

    done: int = 0
    crashed: int = 0
    interrupted: bool = False
    seconds: float = field(default=0.0, compare=False)


def attempt(execute: Execute[W], task: W, where: str) -> Done:
    """Compute one task. An exception (a defect, never physics) becomes the outcome `crashed`, with its place and traceback."""
    start = time.perf_counter()
    trace = ""
    try:
        outcome = execute(task)
    except Exception as error:
        trace = traceback.format_exc()
        outcome = Outcome(Ending.CRASHED, f"{type(error).__name__}: {error} ({where})")
    return Done(task.key, outcome, time.perf_counter() - start, trace)


def attempt_aloud(execute: Execute[W], task: W, rank: int) -> Done:
    """Compute one task as `attempt` does; a crash, or a want of memory, is told on standard error at once."""
    where = f"rank {rank} on {socket.gethostname()}"
    done = attempt(execute, task, where)
    if done.trace:
        say(f"{where}: {task.label} crashed\n{done.trace}")
    elif done.outcome.ending in UNDONE:
        say(f"{where}: {task.label}: {done.outcome.message}\n")
    return done


def say(text: str) -> None:
    """Write to standard error at once, in one piece."""
    sys.stderr.write(text)
    sys.stderr.flush()


class Ledger(Generic[W]):
    """Counts tasks taken from the queue and tasks finished, and reports each end."""

    def __init__(self, tasks: Sequence[W], report: Report[W]) -> None:
        self.queue = TaskQueue(tasks)
        self._report = report
        self._away = 0
        self._done = 0
        self._crashed = 0
        self._estimated: dict[str, float] = defaultdict(float)
        self._measured: dict[str, float] = defaultdict(float)

    @property
    def unfinished(self) -> bool:
        """Whether a task is queued or being computed."""
        return len(self.queue) + self._away > 0

    def take(self) -> W:
        """Take the next task from the queue to be computed."""
        self._away += 1
        return self.queue.take()

    def give_back(self, task: W) -> None:
        """Put a taken task back into the queue: nobody has begun with it."""
        self._away -= 1
        self.queue.put_back(task)

    def enter(self, task: W, done: Done) -> None:
        """Record the end of a taken task; tasks that need a crashed one are abandoned."""
        self._away -= 1
        self._estimated[task.kind] += task.cost
        self._measured[task.kind] += done.seconds
        self._report(task, done.outcome, done.seconds)
        if done.outcome.ending not in UNDONE:
            self._done += 1
            self.queue.finish(task.key)
            return
        self._crashed += 1
        for lost in self.queue.abandon(task.key):
            self._crashed += 1
            self._report(lost, Outcome(Ending.NEEDS_FAILED, f"{task.label} {UNDONE[done.outcome.ending]}"), 0.0)

    def expected(self, task: W) -> float:
        """Estimated seconds of this task, scaled by what its kind took so far; infinite before any of its kind ended."""
        estimated = self._estimated[task.kind]
        return max(task.cost * self._measured[task.kind] / estimated, LEAST) if estimated > 0.0 else math.inf

    def tally(self, interrupted: bool) -> Tally:
        """The counts so far. A signal that came after the last task interrupted nothing."""
        return Tally(self._done, self._crashed, interrupted and self.unfinished, sum(self._measured.values()))
