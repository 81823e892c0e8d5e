"""The farm's schedule in simulated time: what a campaign would take on more ranks than there are."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from heapq import heappop, heappush
from typing import Any

from solver.outcome import COMPLETED
from study.execution.dispatch import Dispatcher
from study.execution.ledger import Done, Ledger
from tests.study.execution.made_up import Work


@dataclass(frozen=True)
class Replay:
    """What came of it, in simulated s."""

    makespan: float
    coordinating: float
    """Time that the coordinator was at work."""


@dataclass(frozen=True)
class Timed(Work):
    """A task whose duration is known."""

    seconds: float = 0.0


def replay(tasks: Sequence[Timed], ranks: int, per_task: float) -> Replay:
    """Run the farm's ledger and dispatcher on simulated ranks; the coordinator books one task after another, each `per_task` s.

    A rank does what it was given in that order. Messages take no time beyond the coordinator's; files are in `seconds`.
    """
    simulation = _Simulation(ranks, per_task)
    ledger: Ledger[Work] = Ledger(tasks, lambda *_: None)
    dispatcher = Dispatcher([partial(simulation.give, rank) for rank in range(ranks)])
    while ledger.unfinished:
        dispatcher.hand_out(ledger)
        rank, task = simulation.next_news()
        ledger.enter(dispatcher.take_back(rank, task.key), Done(task.key, COMPLETED, task.seconds))
    return Replay(simulation.last_end, simulation.coordinating)


class _Simulation:
    """Ranks that compute, and the clock of the coordinator."""

    def __init__(self, ranks: int, per_task: float) -> None:
        self.now = self.coordinating = self.last_end = 0.0
        self._per_task = per_task
        self._free = [0.0] * ranks
        self._news: list[tuple[float, int, int, Any]] = []
        self._count = 0

    def give(self, rank: int, tasks: list[Any]) -> None:
        for task in tasks:
            self._work()
            end = max(self.now, self._free[rank]) + task.seconds
            self._free[rank] = end
            self.last_end = max(self.last_end, end)
            heappush(self._news, (end, self._count, rank, task))
            self._count += 1

    def next_news(self) -> tuple[int, Any]:
        end, _, rank, task = heappop(self._news)
        self.now = max(self.now, end)
        return rank, task

    def _work(self) -> None:
        self.now += self._per_task
        self.coordinating += self._per_task
