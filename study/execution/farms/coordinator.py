"""What all farms of several processes do: hand out tasks, hear how they end, take back what waits too long, until all is done."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol, TypeVar

from study.execution.dispatch import Dispatcher
from study.execution.interruption import Interruption
from study.execution.launch import end_of_time
from study.execution.ledger import Begin, Done, Fail, Ledger, Report, Tally
from study.execution.queue import Work

W = TypeVar("W", bound=Work)


@dataclass(frozen=True, slots=True)
class Returned:
    """News of a rank: keys of the tasks that it has not begun and will not."""

    keys: tuple[str, ...]


News = Done | Returned


class Ranks(Protocol):
    """Those who compute, each known by its number, as far as they can be reached: how is their farm's affair."""

    size: int

    def give(self, rank: int, tasks: list[Any]) -> None:
        """Have a rank compute tasks, behind those that it has."""

    def take_back(self, rank: int) -> Returned:
        """Have a rank return the tasks that it has not begun: at once, or as news."""

    def news(self) -> Sequence[tuple[int, Sequence[News]]]:
        """What ranks have said since, each time with the rank that said it; waits a little where none has."""


def coordinate(
    ranks: Ranks,
    interruption: Interruption,
    tasks: Sequence[W],
    report: Report[W],
    fail: Fail[W],
    begin: Begin[W] = lambda *_: None,
) -> Tally:
    """Compute all tasks, each after its needs; after a signal only those that have been begun. None that would outlast the job.

    report: hears how each task ends. fail: hears of each attempt that fails. begin: hears what is handed out.
    """
    ledger = Ledger(tasks, report, fail, end_of_time(os.environ))
    dispatcher = Dispatcher([partial(ranks.give, rank) for rank in range(ranks.size)], begin)
    while ledger.unfinished and not (interruption.requested or ledger.halt):
        dispatcher.hand_out(ledger)
        for rank in dispatcher.stranded():
            _take_in(ledger, dispatcher, rank, [ranks.take_back(rank)])
        _hear(ranks, ledger, dispatcher)
    for rank in range(ranks.size):
        _take_in(ledger, dispatcher, rank, [ranks.take_back(rank)])
    while dispatcher.busy:
        _hear(ranks, ledger, dispatcher)
    return ledger.tally(interruption.requested)


def _hear(ranks: Ranks, ledger: Ledger[Any], dispatcher: Dispatcher) -> None:
    for rank, news in ranks.news():
        _take_in(ledger, dispatcher, rank, news)


def _take_in(ledger: Ledger[Any], dispatcher: Dispatcher, rank: int, news: Sequence[News]) -> None:
    """Enter what a rank says of its tasks."""
    for each in news:
        if isinstance(each, Done):
            ledger.enter(dispatcher.take_back(rank, each.key), each)
        else:
            for key in each.keys:
                ledger.give_back(dispatcher.take_back(rank, key))
