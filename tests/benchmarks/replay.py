"""The farm's schedule in simulated time: what a campaign would take on more ranks than there are."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from heapq import heappop, heappush
from io import StringIO
from typing import Any, TypeVar

from nanoslip.solver.outcome import COMPLETED
from nanoslip.study.run.dispatch import Dispatcher, Done, Ledger, lookahead
from nanoslip.study.run.farm import take_in
from nanoslip.study.run.mail import News, Outbox
from nanoslip.study.run.progress import PlainProgress
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
    """Run the farm's ledger, dispatcher and outboxes on simulated ranks; the coordinator does one thing after the other.

    A rank does what it was given in that order. Messages take no time beyond the coordinator's; files are in `seconds`.
    """
    simulation = _Simulation(ranks, cost)
    progress = PlainProgress(tasks, StringIO(), ranks)
    ledger: Ledger[Work] = Ledger(tasks, progress)
    dispatcher = Dispatcher([partial(simulation.give, rank) for rank in range(ranks)])
    start = time.thread_time()
    with progress:
        while ledger.unfinished:
            dispatcher.hand_out(ledger)
            for rank, news in simulation.news():
                take_in(ledger, dispatcher, rank, news)
    return Replay(simulation.last_end, simulation.coordinating, time.thread_time() - start - simulation.took)


def _measured(work: Callable[..., T]) -> Callable[..., T]:
    """Count the processor time of a method as the simulation's."""

    def timed(self: "_Simulation", *given: Any) -> T:
        start = time.thread_time()
        found = work(self, *given)
        self.took += time.thread_time() - start
        return found

    return timed


class _Simulation:
    """Ranks that compute, and the clock of the coordinator."""

    def __init__(self, ranks: int, cost: Cost) -> None:
        self.now = self.coordinating = self.last_end = 0.0
        self.took = 0.0
        """Processor seconds of all that is not the coordinator's."""
        self._cost = cost
        self._free = [0.0] * ranks
        self._left = [0] * ranks
        self._outboxes: list[Outbox] = [Outbox(lookahead(ranks) / 2.0) for _ in range(ranks)]
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
    def news(self) -> list[tuple[int, News]]:
        """All messages that have arrived; the next one where none has."""
        found: list[tuple[int, News]] = []
        while self._ends and (not found or self._ends[0][0] <= self.now):
            end, _, rank, done = heappop(self._ends)
            self._left[rank] -= 1
            if due := self._outboxes[rank].take([done], max(self._left[rank] - 1, 0), end):
                self.now = max(self.now, end)
                self._work(self._cost.message)
                found.append((rank, News(due)))
        return found

    def _work(self, seconds: float) -> None:
        self.now += seconds
        self.coordinating += seconds
