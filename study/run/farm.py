"""What all farms have in common: of this process alone, of several on this machine."""

import os
import socket
import sys
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from functools import cached_property, partial
from multiprocessing import connection
from types import TracebackType
from typing import Any, Final, NoReturn, Protocol, Self, TypeVar

from nanoslip.solver.outcome import NanoslipError
from nanoslip.study.run.agent import Agent
from nanoslip.study.run.dispatch import Begin, Dispatcher, Execute, Fail, Ledger, Report, Tally, attempt, print_failure
from nanoslip.study.run.launch import GRACE, Interruption, Settle, end_of_time
from nanoslip.study.run.mail import News
from nanoslip.study.run.queue import Work

# What all farms of several processes do: hand out tasks, enter how they end, take back what waits too long.

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
                take_in(ledger, dispatcher, rank, News(returned=self.take_back(rank)))
            self._receive(ledger, dispatcher)
        for rank in range(self.size):
            take_in(ledger, dispatcher, rank, News(returned=self.take_back(rank)))
        while dispatcher.busy:
            self._receive(ledger, dispatcher)
        return ledger.tally(self.interruption.requested)

    def settle(self) -> None:
        """Have all who have computed write out their results; one that cannot says so, or is ended at its time limit."""
        waiting = self._unsettled.copy()
        self._unsettled.clear()
        for rank in waiting:
            self.give(rank, [Settle()])
        while waiting:
            waiting.difference_update(rank for rank, news in self.news() if news.done)

    @cached_property
    def _unsettled(self) -> set[int]:
        """Those that have computed since."""
        return set()

    @abstractmethod
    def give(self, rank: int, tasks: list[Any]) -> None:
        """Have a rank compute tasks, behind those that it has."""

    @abstractmethod
    def take_back(self, rank: int) -> Sequence[str]:
        """Have a rank return the tasks that it has not begun, and their keys: at once, or as news."""

    @abstractmethod
    def news(self) -> Sequence[tuple[int, News]]:
        """What has become of tasks since, each time with the rank that had them; waits a little where nothing has."""

    def _receive(self, ledger: Ledger[Any], dispatcher: Dispatcher) -> None:
        for rank, news in self.news():
            if news.done:
                self._unsettled.add(rank)
            take_in(ledger, dispatcher, rank, news)


def take_in(ledger: Ledger[Any], dispatcher: Dispatcher, rank: int, news: News) -> None:
    """Enter what has become of tasks of a rank."""
    dispatcher.take_back(rank, [*(done.key for done in news.done), *news.returned])
    for done in news.done:
        ledger.enter(done)
    ledger.give_back(news.returned)


class FarmError(NanoslipError):
    """The processes were not started as a farm can use them; the message says what to do."""


class Farm(Protocol):
    """Processes that compute tasks. The root calls `run`, the others `serve`; all of them end with `leave`."""

    root: bool
    size: int
    here: int
    """How many of them are on this machine."""
    unit: str
    """What they are called."""
    interruption: Interruption

    def run(
        self,
        tasks: Sequence[W],
        report: Report[W],
        fail: Fail[W] = ...,
        begin: Begin[W] = ...,
    ) -> Tally:
        """Compute all tasks, each after its needs.

        report, fail, begin: callbacks, called with each task's outcome, with each failed attempt, and with tasks to be computed.
        """

    def settle(self) -> None:
        """Have results of all processes on disk, where other machines see them."""

    def serve(self) -> int:
        """Compute what the root sends until it leaves; returns its exit code."""

    def leave(self, code: int) -> NoReturn:
        """Raises SystemExit with this exit code on every process."""

    def __enter__(self) -> Self: ...
    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...


class LocalFarm:
    """What farms without other ranks share: this process is the root, and a signal is its own affair."""

    root = True

    def __init__(self, size: int, grace: float) -> None:
        self.size = self.here = size
        self.interruption = Interruption(grace)

    def __enter__(self) -> Self:
        self.interruption.__enter__()
        return self

    def __exit__(self, *error: object) -> None:
        self.interruption.__exit__(*error)

    def serve(self) -> int:
        """Raises FarmError: the only rank is the root, which does not serve."""
        raise FarmError("a farm without ranks has nobody to serve")

    def leave(self, code: int) -> NoReturn:
        """End the process."""
        sys.exit(code)


class SerialFarm(LocalFarm):
    """This process alone. What a task does to its process it does to the whole run; KeyboardInterrupt stays Python's."""

    unit = "process"

    def __init__(self, load: Callable[[], Execute[Any]], grace: float = GRACE) -> None:
        """load: called once, for the function that computes a task."""
        super().__init__(1, grace)
        self._load = load

    def run(
        self,
        tasks: Sequence[W],
        report: Report[W],
        fail: Fail[W] = lambda *_: None,
        begin: Begin[W] = lambda *_: None,
    ) -> Tally:
        """Compute one task after the other, in the order of the queue."""
        ledger, execute = Ledger(tasks, report, fail), self._load()
        where = f"rank 0 on {socket.gethostname()}"
        while ledger.unfinished and not (self.interruption.requested or ledger.halt):
            task = ledger.take()
            begin([(task, ledger.expected(task))])
            done = attempt(execute, task, where, survive=(Exception, SystemExit, GeneratorExit))
            print_failure(task, done)
            ledger.enter(done)
        return ledger.tally(self.interruption.requested)

    def settle(self) -> None:
        """Nothing: this process sees what it has written."""


# Spread tasks over processes of one machine without MPI: this process hands out, its children compute.

PATIENCE: Final = 0.1
"""Seconds between looks whether a signal or a time limit has come, while no task ends."""


class ProcessFarm(Coordinator, LocalFarm):
    """Processes of this machine that compute tasks, one of each agent."""

    def __init__(self, agents: Sequence[Agent], grace: float = GRACE) -> None:
        super().__init__(len(agents), grace)
        self.unit = "process" if len(agents) == 1 else "processes"
        self._agents = agents

    def __exit__(self, *error: object) -> None:
        for agent in self._agents:
            agent.close()
        super().__exit__(*error)

    def give(self, rank: int, tasks: list[Any]) -> None:
        """Have a process compute tasks, behind those that it has."""
        self._agents[rank].give(tasks)

    def take_back(self, rank: int) -> Sequence[str]:
        """Have a process return the tasks that it has not begun; returns their keys."""
        return self._agents[rank].give_back()

    def news(self) -> list[tuple[int, News]]:
        """The tasks that have ended; waits a little for one, where none has."""
        connection.wait([agent.pipe for agent in self._agents if agent.busy and agent.pipe], PATIENCE)
        return [(number, News(agent.arrived())) for number, agent in enumerate(self._agents)]
