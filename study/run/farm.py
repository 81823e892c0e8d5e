"""Farms: whoever hands out tasks, and whoever computes them: this process alone, or several on this machine."""

import os
import socket
import sys
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from multiprocessing import connection
from typing import Any, Final, NoReturn, Self

from nanoslip.solver.outcome import NanoslipError
from nanoslip.study.run.child import Agent
from nanoslip.study.run.dispatch import Dispatcher, Done, Execute, Ledger, Tally, Watch, attempt, print_failure
from nanoslip.study.run.launch import GRACE, Interruption, Settle, end_of_time
from nanoslip.study.run.queue import Work


class FarmError(NanoslipError):
    """The processes were not started as a farm can use them; the message says what to do."""


News = tuple[int, Sequence[Done], Sequence[str]]
"""A rank, how those of its tasks ended that have, and keys of those that it has not begun and will not."""


class Farm(ABC):
    """Processes that compute tasks, numbered by rank. Communication is private to the farm.

    The root calls `run`, the others `serve`; all of them end with `leave`.
    """

    root = True
    unit = "processes"
    """What they are called."""

    def __init__(self, size: int, here: int, interruption: Interruption) -> None:
        """here: how many of them are on this machine."""
        self.size, self.here, self.interruption = size, here, interruption
        self._unsettled: set[int] = set()  # those that have computed since they wrote out their results

    def run(self, tasks: Sequence[Work], watch: Watch) -> Tally:
        """Compute all tasks, each after its needs, idle ranks first; several at once where they are short.

        After a signal only those that have been begun. None that would outlast the job.
        """
        ledger = Ledger(tasks, watch, end_of_time(os.environ))
        dispatcher = Dispatcher(self.size, ledger, self.give)

        def take_in(found: Sequence[News]) -> None:
            for rank, ended, returned in found:
                if ended:
                    self._unsettled.add(rank)
                dispatcher.take_back(rank, [*(done.key for done in ended), *returned])
                for done in ended:
                    ledger.enter(done)
                ledger.give_back(returned)

        while ledger.unfinished and not (self.interruption.requested or ledger.halt):
            dispatcher.hand_out()
            take_in([(rank, (), self.take_back(rank)) for rank in dispatcher.stranded()])
            take_in(self.news())
        take_in([(rank, (), self.take_back(rank)) for rank in range(self.size)])
        while dispatcher.busy:
            take_in(self.news())
        return ledger.tally(self.interruption.requested)

    def settle(self) -> None:
        """Let all computing processes sync their results; one that fails reports it, or is ended at its time limit."""
        waiting, self._unsettled = self._unsettled, set()
        for rank in waiting:
            self.give(rank, [Settle()])
        while waiting:
            waiting.difference_update(rank for rank, ended, _ in self.news() if ended)

    def serve(self) -> int:
        """Compute what the root sends until it leaves; returns its exit code. Raises FarmError where the root is alone."""
        raise FarmError("a farm without ranks has nobody to serve")

    def leave(self, code: int) -> NoReturn:
        """Raises SystemExit with this exit code on every process."""
        sys.exit(code)

    def __enter__(self) -> Self:
        self.interruption.__enter__()
        return self

    def __exit__(self, *error: object) -> None:
        self.interruption.__exit__(*error)

    @abstractmethod
    def give(self, rank: int, tasks: list[Any]) -> None:
        """Have a rank compute tasks, behind those that it has."""

    @abstractmethod
    def take_back(self, rank: int) -> Sequence[str]:
        """Have a rank return the tasks that it has not begun, and their keys: at once, or as news."""

    @abstractmethod
    def news(self) -> Sequence[News]:
        """Outcomes since the last call; waits briefly without any."""


class SerialFarm(Farm):
    """This process alone: a crash of a task ends the run. KeyboardInterrupt stays Python's."""

    unit = "process"

    def __init__(self, load: Callable[[], Execute], grace: float = GRACE) -> None:
        """load: called once, for the function that computes a task."""
        super().__init__(1, 1, Interruption(grace))
        self._load = load
        self._execute: Execute | None = None
        self._waiting: list[Any] = []

    def give(self, rank: int, tasks: list[Any]) -> None:
        """Compute tasks behind others, as soon as news are asked for."""
        self._waiting += tasks

    def take_back(self, rank: int) -> Sequence[str]:
        """Return those that were not begun."""
        keys = [task.key for task in self._waiting]
        self._waiting.clear()
        return keys

    def news(self) -> Sequence[News]:
        """Compute the next one, if any: all that waited may have been taken back."""
        if not self._waiting:
            return []
        self._execute = self._execute or self._load()
        task, where = self._waiting.pop(0), f"rank 0 on {socket.gethostname()}"
        done = attempt(self._execute, task, where, survive=(Exception, SystemExit, GeneratorExit))
        print_failure(task, done)
        return [(0, [done], ())]


PATIENCE: Final = 0.1
"""Seconds between looks whether a signal or a time limit has come, while no task ends."""


class ProcessFarm(Farm):
    """Processes of this machine, one of each agent: this process hands out, without MPI."""

    def __init__(self, agents: Sequence[Agent], grace: float = GRACE) -> None:
        super().__init__(len(agents), len(agents), Interruption(grace))
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

    def news(self) -> list[News]:
        """The tasks that have ended; waits a little for one, where none has."""
        connection.wait([agent.pipe for agent in self._agents if agent.busy and agent.pipe], PATIENCE)
        return [(rank, agent.arrived(), ()) for rank, agent in enumerate(self._agents)]
