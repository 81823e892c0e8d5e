"""The farm's schedule in simulated time: what a campaign would take on more ranks than there are."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from heapq import heappop, heappush

from solver.outcome import COMPLETED
from study.execution.dispatch import Dispatcher, lookahead
from study.execution.farms.outbox import Outbox
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
    ledger: Ledger[Work] = Ledger(tasks, lambda *_: None)
    dispatcher = Dispatcher([partial(simulation.give, rank) for rank in range(ranks)])
    while ledger.unfinished:
        dispatcher.hand_out(ledger)
        for rank, ended in simulation.news():
            for task in ended:
                ledger.enter(dispatcher.take_back(rank, task.key), Done(task.key, COMPLETED, task.seconds))
    return Replay(simulation.last_end, simulation.coordinating)


class _Simulation:
    """Ranks that compute, and the clock of the coordinator."""

    def __init__(self, ranks: int, cost: Cost) -> None:
        self.now = self.coordinating = self.last_end = 0.0
        self._cost = cost
        self._free = [0.0] * ranks
        self._left = [0] * ranks
        self._outboxes: list[Outbox[Timed]] = [Outbox(lookahead(ranks) / 2.0) for _ in range(ranks)]
        self._ends: list[tuple[float, int, int, Timed]] = []
        self._count = 0

    def give(self, rank: int, tasks: list[Timed]) -> None:
        self._work(self._cost.message + len(tasks) * self._cost.task)
        self._left[rank] += len(tasks)
        for task in tasks:
            end = max(self.now, self._free[rank]) + task.seconds
            self._free[rank] = end
            self.last_end = max(self.last_end, end)
            heappush(self._ends, (end, self._count, rank, task))
            self._count += 1

    def news(self) -> list[tuple[int, list[Timed]]]:
        """All messages that have arrived; the next one where none has."""
        found: list[tuple[int, list[Timed]]] = []
        while self._ends and (not found or self._ends[0][0] <= self.now):
            end, _, rank, task = heappop(self._ends)
            self._left[rank] -= 1
            self._outboxes[rank].add([task], end)
            if due := self._outboxes[rank].due(max(self._left[rank] - 1, 0), end):
                self.now = max(self.now, end)
                self._work(self._cost.message)
                found.append((rank, due))
        return found

    def _work(self, seconds: float) -> None:
        self.now += seconds
        self.coordinating += seconds
