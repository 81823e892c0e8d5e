"""Spread tasks over the ranks of MPI, all of them computing.

Each rank hands tasks on to a child of its own, started before MPI, and only it calls MPI. Rank 0 also hands out.
"""

import atexit
import ctypes
import os
import socket
import sys
import threading
import time
import traceback
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from multiprocessing import connection
from types import TracebackType
from typing import Any, Final, NoReturn, Self

from nanoslip.study.exit_codes import INTERRUPTED
from nanoslip.study.origin import Origin, here
from nanoslip.study.run.agent import Agent
from nanoslip.study.run.dispatch import lookahead, say
from nanoslip.study.run.farm import Coordinator, Farm, FarmError, ProcessFarm, SerialFarm
from nanoslip.study.run.launch import (
    GRACE,
    LAST_WORDS,
    Interruption,
    Program,
    launcher_rank,
    processes_here,
    processes_started,
)
from nanoslip.study.run.mail import Mail, News, Outbox

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

    def take_back(self, rank: int) -> Sequence[str]:
        """Have a rank return the tasks that it has not begun, and their keys: of this one at once, others as news."""
        if rank:
            self._mail.send(rank, _GiveBack())
            return ()
        return self._agent.give_back()

    def news(self) -> list[tuple[int, News]]:
        """What has arrived from other ranks and from this one's child; waits a little where nothing has."""
        done = self._agent.arrived()
        found: list[tuple[int, News]] = [(0, News(done))] if done else []
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
        reported = False
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
            returned: Sequence[str] = ()
            interrupted = self.interruption.requested
            if interrupted and not reported:
                reported = True
                self._mail.send(0, _Interrupted())
            if interrupted or any(isinstance(message, _GiveBack) for message in messages):
                returned = self._agent.give_back()
            due = outbox.take(done, self._agent.waiting, time.monotonic())
            if due or returned:
                self._mail.send(0, News(due, returned))
            self._pause.after(bool(messages or done or returned))

    def leave(self, code: int) -> NoReturn:
        """End all together with one exit code, under any launcher."""
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


# Which farm a process is part of. The only importer of mpi4py.

LONGEST_START: Final = 300.0
"""Seconds after which a start of MPI is taken to hang: thousands of ranks need a minute."""
_NOT_STARTED: Final = (
    "Error: MPI has not started within {:g} s: a rank is missing, or the launcher speaks another language (srun --mpi=...); "
    "nothing was computed, run again to continue\n"
)
_NO_MPI4PY: Final = "mpi4py is not installed: pip install 'nanoslip[mpi]', or without a launcher nanoslip run -j 4"


def open_farm(program: Program, grace: float = GRACE, serial: bool = False, jobs: int | None = None) -> Farm:
    """The farm this process is part of: MPI's ranks where there are several, else `jobs` processes, else one.

    serial: this process itself computes. Raises FarmError where a launcher started several processes that do not see each other,
    or that would each start more.
    """
    started = processes_started()
    if jobs is not None and (serial or started > 1):
        other = "--serial" if serial else f"a launcher that has started {started} processes"
        raise FarmError(f"--jobs {jobs} with {other}: leave one of them out")
    if serial:
        return SerialFarm(program.load, grace)
    agents = [Agent(program, launcher_rank() + number) for number in range(jobs or 1)]
    if launcher_rank() == 0:
        for agent in agents:
            agent.adopt(here())  # starts git, and a process that uses MPI should start none
    with ExitStack() as stack:
        stack.callback(agents[0].close)
        interruption = Interruption(grace)
        if started > 1:  # a signal while MPI starts would end this rank alone, and the others would wait for it
            stack.enter_context(interruption)
        agents[0].start()  # before MPI, which may not like its process to start others
        mpi = None if jobs else _mpi(started)
        stack.pop_all()  # the farm goes on with them
    return MPIFarm(mpi, agents[0], interruption) if mpi else ProcessFarm(agents, grace)


def _mpi(started: int) -> Any:
    """The library where there are several ranks; None where nobody has started several processes. Raises FarmError."""
    try:
        import mpi4py  # noqa: PLC0415  a run without ranks must not need an MPI library

        mpi4py.rc.initialize = False
        from mpi4py import MPI as mpi  # noqa: N811, PLC0415

        _start(mpi)
    except (ImportError, RuntimeError) as error:
        if started > 1:
            cause = _NO_MPI4PY if getattr(error, "name", None) == "mpi4py" else error
            raise FarmError(f"{started} processes were started, but none can use MPI: {cause}") from error
        return None
    if mpi.COMM_WORLD.Get_size() > 1:
        return mpi
    if started > 1:
        raise FarmError(
            f"{started} processes were started, but each sees only itself (MPI library: {_library(mpi)}): the launcher "
            "belongs to another MPI. Use the mpiexec of this library, or srun with the --mpi type that it speaks"
        )
    return None


def _start(mpi: Any) -> None:
    """Start the library by its own function: mpi4py calls that with the interpreter locked, and no other thread could give up."""
    if mpi.Is_initialized():  # by `python -m mpi4py`
        return
    watch = threading.Timer(LONGEST_START, _give_up)
    watch.daemon = True
    watch.start()
    # The extension's handle finds the symbols of the library that it was linked with.
    code = ctypes.CDLL(mpi.__file__).MPI_Init_thread(None, None, mpi.THREAD_FUNNELED, ctypes.byref(ctypes.c_int()))
    watch.cancel()
    if code:
        raise RuntimeError(f"MPI_Init_thread returned {code}")
    for communicator in (mpi.COMM_WORLD, mpi.COMM_SELF):
        communicator.Set_errhandler(mpi.ERRORS_RETURN)  # as mpi4py does: errors become exceptions
    atexit.register(_end, mpi)


def _give_up() -> None:
    """End this process as an interrupted run does: a batch script starts it again."""
    if launcher_rank() == 0:
        say(_NOT_STARTED.format(LONGEST_START))
    time.sleep(LAST_WORDS)
    os._exit(INTERRUPTED)


def _end(mpi: Any) -> None:
    if not mpi.Is_finalized():
        mpi.Finalize()


def _library(mpi: Any) -> str:
    return str(mpi.Get_library_version()).split("\n", maxsplit=1)[0].strip("\0 ")
