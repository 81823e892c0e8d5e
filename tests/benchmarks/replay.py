"""The farm's schedule in simulated time: what a campaign would take on more ranks than there are."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from heapq import heappop, heappush
from io import StringIO
from typing import Any, TypeVar

from nanoslip.solver.outcome import COMPLETED
from nanoslip.study.run.dispatch import Done, Watch, lookahead
from nanoslip.study.run.farm import Farm, News
from nanoslip.study.run.launch import Interruption
from nanoslip.study.run.progress import Progress
from tests.study.run.made_up import Work

T = TypeVar("T")


@dataclass(frozen=True)
class Replay:
    """What came of it, in simulated s."""

    makespan: float
    coordinating: float
    """Time that the coordinator was at work."""
    own: float
    """Processor seconds, not simulated, of the ledger, the dispatcher and the progress, from when they are set up."""


@dataclass(frozen=True)
class Timed(Work):
    """A task whose duration is known."""

    seconds: float = 0.0


@dataclass(frozen=True, slots=True)
class Cost:
    """What the coordinator is at work for, s."""

    task: float
    """Each task: chosen, written, its news read and entered."""
    message: float = 0.0
    """Each message, beyond what is in it."""


def replay(tasks: Sequence[Timed], ranks: int, cost: Cost) -> Replay:
    """Run a farm of simulated ranks; the coordinator does one thing after the other.

    A rank does what it was given in that order. Messages take no time beyond the coordinator's; files are in `seconds`.
    """
    simulation = _Simulation(ranks, cost)
    with Progress(tasks, StringIO(), ranks) as progress:
        start = time.thread_time()
        simulation.run(tasks, Watch(progress))
    return Replay(simulation.last_end, simulation.coordinating, time.thread_time() - start - simulation.took)


def _measured(work: Callable[..., T]) -> Callable[..., T]:
    """Count the processor time of a method as the simulation's."""

    def timed(self: "_Simulation", *given: Any) -> T:
        start = time.thread_time()
        found = work(self, *given)
        self.took += time.thread_time() - start
        return found

    return timed


class _Simulation(Farm):
    """Ranks that compute, and the clock of the coordinator."""

    def __init__(self, ranks: int, cost: Cost) -> None:
        super().__init__(ranks, ranks, Interruption(grace=1.0))
        self.now = self.coordinating = self.last_end = 0.0
        self.took = 0.0
        """Processor seconds of all that is not the coordinator's."""
        self._cost = cost
        self._free = [0.0] * ranks
        self._left = [0] * ranks
        self._patience = lookahead(ranks) / 2.0
        self._unsent: list[list[Done]] = [[] for _ in range(ranks)]
        self._due = [0.0] * ranks
        self._ends: list[tuple[float, int, int, Done]] = []
        self._count = 0

    @_measured
    def give(self, rank: int, tasks: list[Timed]) -> None:
        self._work(self._cost.message + len(tasks) * self._cost.task)
        self._left[rank] += len(tasks)
        for task in tasks:
            end = max(self.now, self._free[rank]) + task.seconds
            self._free[rank] = end
            self.last_end = max(self.last_end, end)
            heappush(self._ends, (end, self._count, rank, Done(task.key, COMPLETED, task.seconds)))
            self._count += 1

    @_measured
    def news(self) -> list[News]:
        """All messages that have arrived; the next one where none has."""
        found: list[News] = []
        while self._ends and (not found or self._ends[0][0] <= self.now):
            end, _, rank, done = heappop(self._ends)
            self._left[rank] -= 1
            if not self._unsent[rank]:
                self._due[rank] = end + self._patience
            self._unsent[rank].append(done)
            if self._left[rank] <= 1 or end >= self._due[rank]:
                self.now = max(self.now, end)
                self._work(self._cost.message)
                found.append((rank, self._unsent[rank], ()))
                self._unsent[rank] = []
        return found

    def take_back(self, rank: int) -> Sequence[str]:
        """Nothing is interrupted, and no task takes longer than expected."""
        return ()

    def _work(self, seconds: float) -> None:
        self.now += seconds
        self.coordinating += seconds
