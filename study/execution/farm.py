"""Spread tasks over processes: `SerialFarm` and `MPIFarm` behind one interface. The only importer of mpi4py.

Rank 0 hands out and computes: its main thread coordinates (only that thread calls MPI) while a second one works like
any other rank, which is possible because kernels and LAPACK release the interpreter's lock. Measured on 2 ranks and
2 cores: 50 compiled tasks of 84 ms take 2.13 s, 1.96 times faster than one process; MPICommExecutor of mpi4py.futures,
whose root only waits, takes 4.2 s, no faster than one process. 2000 tasks of 0.17 ms: 0.35 s against 1.0 s.
"""

import queue
import socket
import sys
import threading
import time
import traceback
import warnings
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from types import TracebackType
from typing import Any, NoReturn, Protocol, Self, TypeVar

from study.execution.dispatch import Dispatcher
from study.execution.interruption import GRACE, LAST_WORDS, Interruption
from study.execution.launch import processes_here, processes_started
from study.execution.ledger import Done, Execute, Ledger, Report, Tally, attempt_aloud, say
from study.execution.processes import LocalFarm, ProcessFarm
from study.execution.queue import Work

SHORTEST_PAUSE, LONGEST_PAUSE = 1e-4, 2e-3
"""Seconds between polls for messages: waiting inside MPI would spin and take a core from the ranks that compute."""

W = TypeVar("W", bound=Work)


class FarmError(Exception):
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

    def run(self, tasks: Sequence[W], execute: Execute[W], report: Report[W]) -> Tally:
        """Compute all tasks, each after its needs; `report` hears of each: task, outcome, seconds."""

    def serve(self, execute: Execute[Any]) -> int:
        """Compute what the root sends until it leaves; returns its exit code."""

    def leave(self, code: int) -> NoReturn:
        """End all processes with this exit code, by SystemExit in each."""

    def __enter__(self) -> Self: ...
    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...


class SerialFarm(LocalFarm):
    """One process that computes all tasks."""

    unit = "process"

    def __init__(self, grace: float = GRACE) -> None:
        super().__init__(1, grace)

    def run(self, tasks: Sequence[W], execute: Execute[W], report: Report[W]) -> Tally:
        """Compute one task after the other, in the order of the queue."""
        ledger = Ledger(tasks, report)
        while ledger.unfinished and not self.interruption.requested:
            task = ledger.take()
            ledger.enter(task, attempt_aloud(execute, task, rank=0))
        return ledger.tally(self.interruption.requested)


class MPIFarm:
    """The ranks of COMM_WORLD, all of them computing. No collective is called, so no rank can be left alone in one."""

    unit = "ranks"

    def __init__(self, mpi: Any, grace: float = GRACE) -> None:
        # MPI's own end gives every launcher the exit code; a rank that merely vanishes does not.
        self.interruption = Interruption(grace, end=mpi.COMM_WORLD.Abort)
        self._mpi = mpi
        self._world = mpi.COMM_WORLD
        self.rank = int(self._world.Get_rank())
        self.size = int(self._world.Get_size())
        self.root = self.rank == 0
        self.here = min(self.size, processes_here())
        self._sent: deque[Any] = deque()

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

    def run(self, tasks: Sequence[W], execute: Execute[W], report: Report[W]) -> Tally:
        """Hand out tasks, idle ranks first; several at once where they are short."""
        ledger = Ledger(tasks, report)
        pause = _Pause()
        with _LocalWorker(execute) as local_worker:
            dispatcher = Dispatcher([local_worker.give, *(partial(self._send, rank) for rank in range(1, self.size))])
            while ledger.unfinished and not self.interruption.requested:
                arrived = self._arrivals(dispatcher, local_worker, ledger)
                given = dispatcher.hand_out(ledger)
                pause.after(bool(arrived or given))
            if self.interruption.requested:
                self._call_off(dispatcher, local_worker, ledger)
        return ledger.tally(self.interruption.requested)

    def serve(self, execute: Execute[Any]) -> int:
        """Compute what rank 0 sends, first come first served, until it leaves."""
        waiting: list[Any] = []
        told = False
        pause = _Pause()
        while True:
            arrived = [message for _, message in self._messages()]
            for message in arrived:
                if isinstance(message, _Leave):
                    return message.code
                if isinstance(message, _Stop):
                    waiting.clear()
                    self._world.send(_Stopped(), dest=0)
                else:
                    waiting += message
            if self.interruption.requested:
                waiting.clear()
                if not told:
                    told = True
                    self._world.send(_Interrupted(), dest=0)
            if waiting:
                self._world.send(attempt_aloud(execute, waiting.pop(0), self.rank), dest=0)
            pause.after(bool(arrived or waiting))

    def leave(self, code: int) -> NoReturn:
        """Rank 0 tells the others; all end together with one exit code, under any launcher."""
        if self.root:
            for rank in range(1, self.size):
                self._send(rank, _Leave(code))
        # Finalized first, a nonzero code is no abort to `python -m mpi4py`; os._exit would skip MPICH's own farewell.
        self._mpi.Finalize()
        sys.exit(code)

    def _send(self, rank: int, message: object) -> None:
        while self._sent and self._sent[0].test()[0]:
            self._sent.popleft()
        self._sent.append(self._world.isend(message, dest=rank))

    def _messages(self) -> list[tuple[int, Any]]:
        """All messages that have arrived, each with the rank that sent it."""
        status = self._mpi.Status()
        found = []
        while self._world.iprobe(source=self._mpi.ANY_SOURCE, tag=self._mpi.ANY_TAG, status=status):
            rank = status.Get_source()
            found.append((rank, self._world.recv(source=rank)))
        return found

    def _arrivals(self, dispatcher: Dispatcher, local_worker: "_LocalWorker", ledger: Ledger[Any]) -> int:
        messages = [(0, done) for done in local_worker.finished()] + self._messages()
        for rank, message in messages:
            if isinstance(message, Done):
                ledger.enter(dispatcher.take_back(rank, message.key), message)
            elif isinstance(message, _Interrupted):
                self.interruption.request()
            elif isinstance(message, _Stopped):
                dispatcher.forget(rank)
        return len(messages)

    def _call_off(self, dispatcher: Dispatcher, local_worker: "_LocalWorker", ledger: Ledger[Any]) -> None:
        """Let every rank finish the task it computes, and start no other."""
        for task in local_worker.drop_waiting():
            dispatcher.take_back(0, task.key)
        for rank in range(1, self.size):
            self._send(rank, _Stop())
        pause = _Pause()
        while dispatcher.busy:
            pause.after(bool(self._arrivals(dispatcher, local_worker, ledger)))


def open_farm(grace: float = GRACE, serial: bool = False, jobs: int | None = None) -> Farm:
    """The farm this process is part of: MPI's ranks where there are several, else a serial one, or `jobs` processes.

    Raises FarmError where a launcher started several processes that do not see each other, or that would each start more.
    """
    started = processes_started()
    if jobs is not None and (serial or started > 1):
        other = "--serial" if serial else f"a launcher that has started {started} processes"
        raise FarmError(f"--jobs {jobs} with {other}: leave one of them out")
    if serial or jobs == 1:
        return SerialFarm(grace)
    if jobs is not None:
        return ProcessFarm(jobs, grace)
    try:
        import mpi4py  # noqa: PLC0415  serial use must not need an MPI library

        mpi4py.rc.thread_level = "funneled"
        with warnings.catch_warnings():
            # Under a foreign launcher mpi4py warns in every process; the error below says it once.
            warnings.filterwarnings("ignore", message="suspicious MPI execution environment")
            from mpi4py import MPI as mpi  # noqa: N811, PLC0415
    except (ImportError, RuntimeError) as error:
        if started > 1:
            raise FarmError(f"{started} processes were started, but none can use MPI: {error}") from error
        return SerialFarm(grace)
    if mpi.COMM_WORLD.Get_size() > 1:
        return MPIFarm(mpi, grace)
    if started > 1:
        raise FarmError(
            f"{started} processes were started, but each sees only itself (MPI library: {_library(mpi)}): the launcher "
            "belongs to another MPI. Use the mpiexec of this library, or srun with the --mpi type that it speaks"
        )
    return SerialFarm(grace)


@dataclass(frozen=True, slots=True)
class _Stop:
    """Message to a rank: drop the tasks that wait."""


@dataclass(frozen=True, slots=True)
class _Stopped:
    """Message from a rank: no task waits or is computed there."""


@dataclass(frozen=True, slots=True)
class _Interrupted:
    """Message from a rank: it received a signal to stop."""


@dataclass(frozen=True, slots=True)
class _Leave:
    """Message to a rank: the run is over, end with this exit code."""

    code: int


class _LocalWorker:
    """Rank 0's share of the tasks, computed in a second thread."""

    def __init__(self, execute: Execute[Any]) -> None:
        self._execute = execute
        self._waiting: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._done: queue.SimpleQueue[Done] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._work, name="local worker", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self._waiting.put(None)
        if kind is None:
            self._thread.join()

    def give(self, tasks: list[Any]) -> None:
        for task in tasks:
            self._waiting.put(task)

    def finished(self) -> list[Done]:
        return _drained(self._done)

    def drop_waiting(self) -> list[Any]:
        return _drained(self._waiting)

    def _work(self) -> None:
        while (task := self._waiting.get()) is not None:
            self._done.put(attempt_aloud(self._execute, task, rank=0))


class _Pause:
    """Sleep between polls for messages: short after one arrived, doubling while none does."""

    def __init__(self) -> None:
        self._seconds = SHORTEST_PAUSE

    def after(self, news: bool) -> None:
        if news:
            self._seconds = SHORTEST_PAUSE
            return
        time.sleep(self._seconds)
        self._seconds = min(2.0 * self._seconds, LONGEST_PAUSE)


def _drained(source: "queue.SimpleQueue[Any]") -> list[Any]:
    found = []
    while not source.empty():
        found.append(source.get())
    return found


def _library(mpi: Any) -> str:
    return str(mpi.Get_library_version()).split("\n", maxsplit=1)[0].strip("\0 ")
