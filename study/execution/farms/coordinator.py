"""What all farms of several processes do: hand out tasks, hear how they end, take back what waits too long."""

import os
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeVar

from study.execution.dispatch import Dispatcher
from study.execution.interruption import Interruption
from study.execution.launch import end_of_time
from study.execution.ledger import Begin, Done, Fail, Ledger, Meanwhile, Report, Tally
from study.execution.queue import Work

W = TypeVar("W", bound=Work)


@dataclass(frozen=True, slots=True)
class Returned:
    """News of a rank: keys of the tasks that it has not begun and will not."""

    keys: tuple[str, ...]


News = Done | Returned


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
        meanwhile: Meanwhile | None = None,
    ) -> Tally:
        """Compute all tasks, each after its needs, idle ranks first; several at once where they are short.

        After a signal, or when `meanwhile` is over, only those that have been begun. None that would outlast the job.
        report: hears how each task ends. fail: hears of each attempt that fails. begin: hears what is handed out.
        """
        ledger = Ledger(tasks, report, fail, end_of_time(os.environ))
        dispatcher = Dispatcher([partial(self.give, rank) for rank in range(self.size)], begin)
        while ledger.unfinished and not (self.interruption.requested or ledger.halt):
            dispatcher.hand_out(ledger)
            for rank in dispatcher.stranded():
                _take_in(ledger, dispatcher, rank, [self.take_back(rank)])
            if meanwhile and not meanwhile():
                break
            self._hear(ledger, dispatcher, wait=not meanwhile)
        for rank in range(self.size):
            _take_in(ledger, dispatcher, rank, [self.take_back(rank)])
        while dispatcher.busy:
            self._hear(ledger, dispatcher, wait=True)
        return ledger.tally(self.interruption.requested)

    @abstractmethod
    def give(self, rank: int, tasks: list[Any]) -> None:
        """Have a rank compute tasks, behind those that it has."""

    @abstractmethod
    def take_back(self, rank: int) -> Returned:
        """Have a rank return the tasks that it has not begun: at once, or as news."""

    @abstractmethod
    def news(self, wait: bool) -> Sequence[tuple[int, Sequence[News]]]:
        """What ranks have said since, each time with the rank that said it. wait: a little, where none has."""

    def _hear(self, ledger: Ledger[Any], dispatcher: Dispatcher, wait: bool) -> None:
        for rank, news in self.news(wait):
            _take_in(ledger, dispatcher, rank, news)


def _take_in(ledger: Ledger[Any], dispatcher: Dispatcher, rank: int, news: Sequence[News]) -> None:
    """Enter what a rank says of its tasks."""
    for each in news:
        if isinstance(each, Done):
            ledger.enter(dispatcher.take_back(rank, each.key), each)
        else:
            for key in each.keys:
                ledger.give_back(dispatcher.take_back(rank, key))
