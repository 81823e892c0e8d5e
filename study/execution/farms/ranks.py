"""Spread tasks over the ranks of MPI, all of them computing.

Each rank hands tasks on to a child of its own, started before MPI, and only it calls MPI. Rank 0 also hands out.
"""

import socket
import sys
import time
import traceback
from dataclasses import dataclass
from multiprocessing import connection
from types import TracebackType
from typing import Any, Final, NoReturn, Self

from nanoslip.study.execution.dispatch import lookahead
from nanoslip.study.execution.farms.agent import Agent
from nanoslip.study.execution.farms.coordinator import Coordinator
from nanoslip.study.execution.farms.mail import Mail
from nanoslip.study.execution.farms.outbox import News, Outbox, news_of
from nanoslip.study.execution.interruption import LAST_WORDS, Interruption
from nanoslip.study.execution.launch import processes_here
from nanoslip.study.execution.ledger import say
from nanoslip.study.origin import Origin, here

SHORTEST_PAUSE: Final = 1e-4
LONGEST_PAUSE: Final = 2e-3
"""Seconds between polls for messages: waiting inside MPI would spin and take a core from the children that compute."""


class MPIFarm(Coordinator):
    """The ranks of COMM_WORLD. No collective is called, so no rank can be left alone in one."""

    unit = "ranks"

    def __init__(self, mpi: Any, agent: Agent, interruption: Interruption) -> None:
        # MPI's own end gives every launcher the exit code; a rank that merely vanishes does not.
        interruption.end_by(mpi.COMM_WORLD.Abort)
        self.interruption = interruption
        self._mpi = mpi
        self._agent = agent
        self._world = mpi.COMM_WORLD
        self.rank = int(self._world.Get_rank())
        self.size = int(self._world.Get_size())
        self.root = self.rank == 0
        self.here = min(self.size, processes_here())
        self._mail = Mail(mpi)
        self._pause = _Pause(agent)
        for rank in range(1, self.size) if self.root else ():
            self._mail.send(rank, here())

    def __enter__(self) -> Self:
        self.interruption.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.interruption.__exit__()
        if error is not None and not isinstance(error, SystemExit):
            text = "".join(traceback.format_exception(kind, error, trace))
            say(f"rank {self.rank} on {socket.gethostname()} cannot go on:\n{text}")
            time.sleep(LAST_WORDS)
            self._world.Abort(1)  # the others wait for this rank's messages and would wait for ever

    def give(self, rank: int, tasks: list[Any]) -> None:
        """Have a rank compute tasks, behind those that it has."""
        if rank:
            self._mail.send(rank, tasks)
        else:
            self._agent.give(tasks)

    def take_back(self, rank: int) -> tuple[str, ...]:
        """Have a rank return the tasks that it has not begun, and say their keys: this one at once, others as news."""
        if rank:
            self._mail.send(rank, _GiveBack())
            return ()
        return self._agent.give_back()

    def news(self) -> list[tuple[int, News]]:
        """What has arrived from other ranks and from this one's child; waits a little where nothing has."""
        done = self._agent.arrived()
        found: list[tuple[int, News]] = [(0, news_of(done))] if done else []
        for rank, message in self._mail.received():
            if isinstance(message, _Interrupted):
                self.interruption.request()
            else:
                found.append((rank, message))
        self._pause.after(bool(found))
        return found

    def serve(self) -> int:
        """Compute what rank 0 sends, first come first served, until it leaves."""
        outbox = Outbox(lookahead(self.size) / 2.0)
        told = False
        while True:
            messages = [message for _, message in self._mail.received()]
            for message in messages:
                if isinstance(message, _Leave):
                    return message.code
                if isinstance(message, Origin):
                    self._agent.adopt(message)
                if isinstance(message, list):
                    self._agent.give(message)
            done = self._agent.arrived()
            returned: tuple[str, ...] = ()
            interrupted = self.interruption.requested
            if interrupted and not told:
                told = True
                self._mail.send(0, _Interrupted())
            if interrupted or any(isinstance(message, _GiveBack) for message in messages):
                returned = self._agent.give_back()
            outbox.add(done, returned, time.monotonic())
            if due := outbox.due(self._agent.waiting, time.monotonic()):
                self._mail.send(0, due)
            self._pause.after(bool(messages or done or returned))

    def leave(self, code: int) -> NoReturn:
        """Rank 0 tells the others; all end together with one exit code, under any launcher."""
        if self.root:
            for rank in range(1, self.size):
                self._mail.send(rank, _Leave(code))
        self._agent.close()
        self._mail.flush()
        # Finalized first, a nonzero code is no abort to `python -m mpi4py`; os._exit would skip MPICH's own farewell.
        self._mpi.Finalize()
        sys.exit(code)


@dataclass(frozen=True, slots=True)
class _GiveBack:
    """Message to a rank: return the tasks that wait."""


@dataclass(frozen=True, slots=True)
class _Interrupted:
    """Message from a rank: it received a signal to stop."""


@dataclass(frozen=True, slots=True)
class _Leave:
    """Message to a rank: the run is over, end with this exit code."""

    code: int


class _Pause:
    """Between polls for messages: short after one arrived, doubling while none does, over when the child has news."""

    def __init__(self, agent: Agent) -> None:
        self._agent = agent
        self._seconds = SHORTEST_PAUSE

    def after(self, news: bool) -> None:
        if news:
            self._seconds = SHORTEST_PAUSE
            return
        if self._agent.busy and self._agent.pipe:
            connection.wait([self._agent.pipe], self._seconds)
        else:
            time.sleep(self._seconds)
        self._seconds = min(2.0 * self._seconds, LONGEST_PAUSE)
