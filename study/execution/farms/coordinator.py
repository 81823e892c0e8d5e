"""What all farms of several processes do: hand out tasks, hear how they end, take back what waits too long."""

import os
from abc import ABC, abstractmethod
from collections.abc import Sequence
from functools import cached_property, partial
from typing import Any, TypeVar

from nanoslip.solver.outcome import Outcome
from nanoslip.study.execution.dispatch import Dispatcher
from nanoslip.study.execution.farms.outbox import News
from nanoslip.study.execution.interruption import Interruption
from nanoslip.study.execution.launch import end_of_time
from nanoslip.study.execution.ledger import Begin, Fail, Ledger, Report, Tally
from nanoslip.study.execution.program import Settle
from nanoslip.study.execution.queue import Work

W = TypeVar("W", bound=Work)


class Coordinator(ABC):
    """Whoever hands out tasks to those who compute, each known by its number: how they are reached is a farm's affair."""

    size: int
    """How many compute."""
    interruption: Interruption

    def run(
        self,
        tasks: Sequence[W],
        report: Report[W],
        fail: Fail[W] = lambda *_: None,
        begin: Begin[W] = lambda *_: None,
    ) -> Tally:
        """Compute all tasks, each after its needs, idle ranks first; several at once where they are short.

        After a signal only those that have been begun. None that would outlast the job.
        report, fail, begin: callbacks, called with each task's outcome, with each failed attempt, and with the tasks handed out.
        """
        ledger = Ledger(tasks, report, fail, end_of_time(os.environ))
        dispatcher = Dispatcher([partial(self.give, rank) for rank in range(self.size)], begin)
        while ledger.unfinished and not (self.interruption.requested or ledger.halt):
            dispatcher.hand_out(ledger)
            for rank in dispatcher.stranded():
                _give_back(ledger, dispatcher, rank, self.take_back(rank))
            self._hear(ledger, dispatcher)
        for rank in range(self.size):
            _give_back(ledger, dispatcher, rank, self.take_back(rank))
        while dispatcher.busy:
            self._hear(ledger, dispatcher)
        return ledger.tally(self.interruption.requested)

    def settle(self) -> None:
        """Have all who have computed write out their results; one that cannot says so, or is ended at its time limit."""
        waiting = self._unsettled.copy()
        self._unsettled.clear()
        for rank in waiting:
            self.give(rank, [Settle()])
        while waiting:
            waiting.difference_update(rank for rank, news in self.news() if news.ended or news.failed)

    @cached_property
    def _unsettled(self) -> set[int]:
        """Those that have computed since."""
        return set()

    @abstractmethod
    def give(self, rank: int, tasks: list[Any]) -> None:
        """Have a rank compute tasks, behind those that it has."""

    @abstractmethod
    def take_back(self, rank: int) -> tuple[str, ...]:
        """Have a rank return the tasks that it has not begun, and say their keys: at once, or as news."""

    @abstractmethod
    def news(self) -> Sequence[tuple[int, News]]:
        """What ranks have told since, each time with the rank that told it; waits a little where none has."""

    def _hear(self, ledger: Ledger[Any], dispatcher: Dispatcher) -> None:
        for rank, news in self.news():
            if news.ended:
                self._unsettled.add(rank)
            take_in(ledger, dispatcher, rank, news)


def take_in(ledger: Ledger[Any], dispatcher: Dispatcher, rank: int, news: News) -> None:
    """Enter what a rank tells of its tasks."""
    for ending, seconds in news.ended.items():
        dispatcher.take_back(rank, seconds)
        ledger.finish(seconds, Outcome(ending), news.where)
    for done in news.failed:
        dispatcher.take_back(rank, (done.key,))
        ledger.enter(done)
    _give_back(ledger, dispatcher, rank, news.returned)


def _give_back(ledger: Ledger[Any], dispatcher: Dispatcher, rank: int, keys: tuple[str, ...]) -> None:
    dispatcher.take_back(rank, keys)
    ledger.give_back(keys)
