"""Farms, which hand out and compute tasks: this process alone, several on this machine, or the ranks of MPI.

Each rank hands tasks on to a child process, and only the rank calls MPI. Rank 0 also hands out. Of nanoslip's own
ranks the child starts before MPI, and MPI ends with the campaign; a program that calls `nanoslip.run` with a
communicator keeps its MPI.
"""

import atexit
import ctypes
import os
import socket
import sys
import threading
import time
import traceback
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from functools import cache
from multiprocessing import connection
from typing import Any, Final, NoReturn, Self

from nanoslip.study.exit_codes import INTERRUPTED
from nanoslip.study.notices import print_notice
from nanoslip.study.origin import Origin, here
from nanoslip.study.run import dispatch, launch
from nanoslip.study.run.child import Agent, FarmError

News = tuple[int, Sequence[dispatch.Done], Sequence[str]]
"""Rank, ends of its tasks, and keys of tasks that it will not begin."""


class Farm(ABC):
    """Processes that compute tasks, numbered by rank. Communication is private to the farm.

    The root calls `run`, all other ranks `serve`; all of them end with `leave`.
    """

    root = True
    unit = "processes"
    """Name of its processes."""

    def __init__(self, size: int, here: int, interruption: launch.Interruption) -> None:
        """here: how many of them are on this machine."""
        self.size, self.here, self.interruption = size, here, interruption
        # Ranks that have computed since they wrote out their results.
        self._unsettled: set[int] = set()
        self.advance: dispatch.Advance = dispatch.ignore_progress
        """Called with the progress of tasks."""

    def run(self, tasks: Sequence[dispatch.Work], watch: dispatch.Watch) -> dispatch.RunTally:
        """Compute all tasks, each after its needs, idle ranks first; several at once where they are short.

        After a signal only tasks already begun are finished. No task that would outlast the job is begun.
        """
        ledger = dispatch.Ledger(tasks, watch, launch.end_of_time(os.environ))
        dispatcher = dispatch.Dispatcher(self.size, ledger, self.give)
        self.advance = ledger.advance

        def enter_news(news: Sequence[News]) -> None:
            """Enter the tasks that ranks have ended or given back."""
            for rank, ended, returned in news:
                if ended:
                    self._unsettled.add(rank)
                ended_keys = [done.key for done in ended]
                # First the load of the rank: entering an end may make tasks ready, which go where there is room.
                dispatcher.take_back(rank, [*ended_keys, *returned])
                for done in ended:
                    ledger.enter(done)
                ledger.give_back(returned)

        while ledger.unfinished and not (self.interruption.requested or ledger.halt):
            dispatcher.hand_out()
            # Tasks that wait behind one that takes much longer than expected go to other ranks.
            stranded = [(rank, (), self.take_back(rank)) for rank in dispatcher.find_stranded()]
            enter_news(stranded)
            enter_news(self.news())
        # What has begun is awaited and kept; what only waits is left to the next run.
        waiting = [(rank, (), self.take_back(rank)) for rank in range(self.size)]
        enter_news(waiting)
        while dispatcher.busy:
            enter_news(self.news())
        return ledger.tally(self.interruption.requested)

    def settle(self) -> None:
        """Let all computing processes sync their results; a failing task reports it, or is ended at its time
        limit."""
        waiting, self._unsettled = self._unsettled, set()
        for rank in waiting:
            self.give(rank, [launch.Settle()])
        while waiting:
            waiting.difference_update(rank for rank, ended, _ in self.news() if ended)

    def serve(self) -> int:
        """Compute what the root sends until it leaves; returns its exit code. Raises FarmError if the root is alone."""
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
    def load(self, tasks: int) -> None:
        """Have the processes of this rank import the modules of tasks before the first task; no more processes than
        tasks."""

    @abstractmethod
    def give(self, rank: int, tasks: list[Any]) -> None:
        """Have a rank compute tasks, after the ones it has."""

    @abstractmethod
    def take_back(self, rank: int) -> Sequence[str]:
        """Have a rank return the tasks that it has not begun, and their keys: at once, or as news."""

    @abstractmethod
    def news(self) -> Sequence[News]:
        """Outcomes since the last call; waits briefly without any."""


class SerialFarm(Farm):
    """This process alone: a crash of a task ends the run. KeyboardInterrupt stays Python's."""

    unit = "process"

    def __init__(self, load: Callable[[], dispatch.Execute], grace: float = launch.GRACE) -> None:
        """load: called once, for the function that computes a task."""
        super().__init__(1, 1, launch.Interruption(grace))
        self._execute = cache(load)
        self._waiting: list[Any] = []

    def load(self, tasks: int) -> None:
        """Import the modules of tasks."""
        self._execute()

    def give(self, rank: int, tasks: list[Any]) -> None:
        """Compute tasks after others, when news are awaited."""
        self._waiting += tasks

    def take_back(self, rank: int) -> Sequence[str]:
        """Return the tasks that have not begun."""
        keys = [task.key for task in self._waiting]
        self._waiting.clear()
        return keys

    def news(self) -> Sequence[News]:
        """Compute the next one, if any: all that waited may have been taken back."""
        if not self._waiting:
            return []
        task = self._waiting.pop(0)
        where = dispatch.Worker(0, socket.gethostname())
        # All but KeyboardInterrupt: a task that calls sys.exit must not end the run.
        survive = (Exception, SystemExit, GeneratorExit)
        done = dispatch.attempt(self._execute(), task, where, survive, self.advance)
        dispatch.print_failure(task, done)
        return [(0, [done], ())]


NEWS_SECONDS: Final = 0.1
"""Seconds between looks whether a signal or a time limit has come, while no task ends."""


class ProcessFarm(Farm):
    """Processes of this machine, one of each agent: this process hands out, without MPI."""

    def __init__(self, agents: Sequence[Agent], grace: float = launch.GRACE) -> None:
        count = len(agents)
        super().__init__(count, count, launch.Interruption(grace))
        self.unit = "process" if len(agents) == 1 else "processes"
        self._agents = agents

    def __exit__(self, *error: object) -> None:
        for agent in self._agents:
            agent.close()
        super().__exit__(*error)

    def load(self, tasks: int) -> None:
        """Have as many processes as there are tasks import the modules of tasks."""
        for agent in self._agents[:tasks]:
            agent.load()

    def give(self, rank: int, tasks: list[Any]) -> None:
        """Have a process compute tasks, after the ones it has."""
        self._agents[rank].give(tasks)

    def take_back(self, rank: int) -> Sequence[str]:
        """Have a process return the tasks that it has not begun; returns their keys."""
        return self._agents[rank].give_back()

    def news(self) -> list[News]:
        """The tasks that have ended; waits a little for one, where none has."""
        busy = [agent for agent in self._agents if agent.busy]
        pipes = [agent.pipe for agent in busy if agent.pipe]
        connection.wait(pipes, NEWS_SECONDS)
        # All agents are asked, not only those whose pipe is ready: a child that hangs sends nothing.
        news: list[News] = []
        for rank, agent in enumerate(self._agents):
            news.append((rank, agent.arrived(), ()))
        for agent in self._agents:
            underway = agent.take_progress()
            if underway:
                self.advance(underway)
        return news


SHORTEST_PAUSE: Final = 1e-4
LONGEST_PAUSE: Final = 2e-3
"""Seconds between polls for messages: waiting inside MPI would spin and take a core from the children that compute."""


FLUSH: Final = 60.0
"""Seconds that the messages of a rank may take to leave it: a rank that does not listen any more takes none."""


GIVE_BACK: Final = "give back"
"""Message to a rank: return the tasks that wait. Others are lists of tasks, and in the end the exit code."""
TOLD_TO_STOP: Final = "told to stop"
"""Message from a rank: it received a signal. All other messages report tasks."""


class MPIFarm(Farm):
    """The ranks of a communicator. No collective is called, so no rank can be left alone in one.

    No rank waits inside MPI: that would spin and take a core from those who compute.
    """

    unit = "ranks"

    def __init__(self, mpi: Any, agent: Agent, interruption: launch.Interruption, world: Any = None) -> None:
        """world: the communicator, whose messages are all of this farm; None: COMM_WORLD."""
        # MPI's own end gives every launcher the exit code; a rank that merely vanishes does not.
        self._world = world or mpi.COMM_WORLD
        interruption.end = self._world.Abort
        size = int(self._world.Get_size())
        here_too = min(size, launch.processes_here())
        super().__init__(size, here_too, interruption)
        self._mpi, self._agent = mpi, agent
        self.rank = int(self._world.Get_rank())
        self.root = self.rank == 0
        # Messages that may not have left: their memory must not be freed.
        self._sent: deque[Any] = deque()
        self._pause = SHORTEST_PAUSE
        # Messages of one rank do not overtake each other: each has the origin before its first task.
        for rank in range(1, self.size) if self.root else ():
            self._send(rank, here())

    def __exit__(self, *error: Any) -> None:
        super().__exit__(*error)
        if error[0] is not None and not issubclass(error[0], SystemExit):
            text = "".join(traceback.format_exception(*error))
            print_notice(f"rank {self.rank} on {socket.gethostname()} cannot go on:\n{text}")
            time.sleep(launch.LAST_WORDS)
            # The other ranks wait for this rank's messages, and would wait for ever.
            self._world.Abort(1)

    def load(self, tasks: int) -> None:
        """Have this rank's child import the modules of tasks."""
        self._agent.load()

    def give(self, rank: int, tasks: list[Any]) -> None:
        """Have a rank compute tasks, after the ones it has."""
        if rank:
            self._send(rank, tasks)
        else:
            self._agent.give(tasks)

    def take_back(self, rank: int) -> Sequence[str]:
        """Ask a rank to return its waiting tasks, and return their keys: rank 0's at once, other ranks' as news."""
        if rank:
            self._send(rank, GIVE_BACK)
            return ()
        return self._agent.give_back()

    def news(self) -> list[News]:
        """Receive messages from other ranks and from this rank's child; wait a little if there are none."""
        done = self._agent.arrived()
        news: list[News] = []
        if done:
            news.append((0, done, ()))
        underway = self._agent.take_progress()
        if underway:
            self.advance(underway)
        for rank, message in self._receive_messages():
            if message == TOLD_TO_STOP:
                self.interruption.request()
            elif isinstance(message, dispatch.Underway):
                self.advance(message)
            elif isinstance(message, Exception):
                raise message
            else:
                news.append((rank, *message))
        self._wait(bool(news))
        return news

    def serve(self) -> int:
        """Compute what rank 0 sends, first come first served, until it leaves.

        Outcomes of short tasks are returned together, as a message costs rank 0 more than its content.
        """
        done: list[dispatch.Done] = []
        due, reported, progress_due = 0.0, False, 0.0
        while True:
            messages = [message for _, message in self._receive_messages()]
            for message in messages:
                if isinstance(message, int):
                    return message
                if isinstance(message, Origin):
                    self._agent.adopt(message)
                if isinstance(message, list):
                    self._agent.give(message)
            try:
                ended = self._agent.arrived()
            except FarmError as error:
                ended = []
                self._send(0, error)
            if ended:
                # Half of the work that waits here: rank 0 hears of it before this rank runs out.
                if not done:
                    due = time.monotonic() + dispatch.lookahead(self.size) / 2.0
                done += ended
            underway, now = self._agent.take_progress(), time.monotonic()
            if underway and now >= progress_due:
                self._send(0, underway)
                progress_due = now + dispatch.report_interval(self.size)
            returned: Sequence[str] = ()
            interrupted = self.interruption.requested
            if interrupted and not reported:
                reported = True
                self._send(0, TOLD_TO_STOP)
            if interrupted or GIVE_BACK in messages:
                returned = self._agent.give_back()
            if returned or (done and (not self._agent.waiting or time.monotonic() >= due)):
                self._send(0, (done, returned))
                done = []
            self._wait(bool(messages or ended or returned))

    def part(self, news: object) -> None:
        """End this rank's child: rank 0 sends its exit code to all others, of which each may send rank 0 an error."""
        for rank in range(1, self.size) if self.root else (0,) * isinstance(news, Exception):
            self._send(rank, news)
        self._agent.close()
        self._flush()

    def leave(self, code: int) -> NoReturn:
        """End all together with one exit code, under any launcher."""
        self.part(code)
        # Once MPI is finalized nothing can be aborted: a grace that ends meanwhile ends this process alone.
        self.interruption.end = lambda _: os._exit(code)
        # Finalized first, a nonzero code is no abort to `python -m mpi4py`; os._exit would skip MPICH's own farewell.
        self._mpi.Finalize()
        sys.exit(code)

    def _send(self, rank: int, message: object) -> None:
        """Send a message to a rank, which need not be listening."""
        self._drop_gone()
        self._sent.append(self._world.isend(message, dest=rank))

    def _flush(self) -> None:
        """Wait until all messages are sent: at the end of MPI unsent messages would be lost and their receivers wait
        forever."""
        end = time.monotonic() + FLUSH
        while self._drop_gone() and time.monotonic() < end:
            time.sleep(1e-3)

    def _drop_gone(self) -> int:
        """Forget messages that have left; returns how many have not."""
        while self._sent and self._sent[0].test()[0]:
            self._sent.popleft()
        return len(self._sent)

    def _receive_messages(self) -> list[tuple[int, Any]]:
        """All messages that have arrived, each with the rank that sent it."""
        status, messages = self._mpi.Status(), []
        while self._world.iprobe(source=self._mpi.ANY_SOURCE, tag=self._mpi.ANY_TAG, status=status):
            rank = status.Get_source()
            # Messages of one rank keep their order: the first is the one that was probed.
            messages.append((rank, self._world.recv(source=rank)))
        return messages

    def _wait(self, news: bool) -> None:
        """Between polls for messages: not after one arrived, then doubling while none does, over when the child has news."""
        if news:
            self._pause = SHORTEST_PAUSE
            return
        if self._agent.busy and self._agent.pipe:
            connection.wait([self._agent.pipe], self._pause)
        else:
            time.sleep(self._pause)
        self._pause = min(2.0 * self._pause, LONGEST_PAUSE)


@contextmanager
def sharing(comm: Any, program: launch.Program) -> Iterator[MPIFarm]:
    """The ranks of a communicator of a program's own: none of their messages is taken, and MPI goes on whatever a task does."""
    from mpi4py import MPI as mpi  # noqa: N811, PLC0415

    agent = Agent(program, comm.Get_rank())
    interruption = launch.Interruption(launch.GRACE)
    # A communicator of its own: messages of the program's and of the farm's never meet.
    farm = MPIFarm(mpi, agent, interruption, comm.Dup())
    if farm.root:
        agent.adopt(here())
    try:
        yield farm
    except Exception as error:
        farm.part(INTERRUPTED if farm.root else FarmError(f"rank {farm.rank}: {error}"))
        raise
    farm.part(0)


# The farm that a process is part of. The only importer of mpi4py.

LONGEST_START: Final = 300.0
"""Seconds after which a start of MPI is taken to hang: thousands of ranks need a minute."""
_NOT_STARTED: Final = (
    "Error: MPI has not started within {:g} s: a rank is missing, or the launcher speaks another language (srun --mpi=...); "
    "nothing was computed, run again to continue"
)
_NO_MPI4PY: Final = "mpi4py is not installed: pip install 'nanoslip[mpi]', or without a launcher nanoslip run -j 4"


def open_farm(
    program: launch.Program, grace: float = launch.GRACE, serial: bool = False, jobs: int | None = None
) -> Farm:
    """The farm this process is part of: MPI's ranks where there are several, else `jobs` processes, else one.

    serial: this process itself computes. Raises FarmError if a launcher started several processes that do not see each other,
    or that would each start more.
    """
    started = launch.processes_started()
    if jobs is not None and (serial or started > 1):
        other = "--serial" if serial else f"a launcher that has started {started} processes"
        raise FarmError(f"--jobs {jobs} with {other}: leave one of them out")
    if serial:
        return SerialFarm(program.load, grace)
    first = launch.launcher_rank()
    agents = [Agent(program, first + number) for number in range(jobs or 1)]
    if launch.launcher_rank() == 0:
        for agent in agents:
            # It starts git, and a process that uses MPI should start no other.
            agent.adopt(here())
    with ExitStack() as stack:
        stack.callback(agents[0].close)
        interruption = launch.Interruption(grace)
        # A signal while MPI starts would end this rank alone, and the others would wait for it.
        if started > 1:
            stack.enter_context(interruption)
        # Before MPI, some of which fail in a process that forks.
        agents[0].start()
        # Rank 0 finds out whether there is a task at all.
        if launch.launcher_rank():
            agents[0].load()
        mpi = None if jobs else _mpi(started)
        # The farm closes the agents from here on.
        stack.pop_all()
    return MPIFarm(mpi, agents[0], interruption) if mpi else ProcessFarm(agents, grace)


def _mpi(started: int) -> Any:
    """Load the MPI library if there are several ranks; None if a single process was started. Raises FarmError."""
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
    """Start the library by calling MPI's function directly: mpi4py holds the interpreter's lock during the call, so
    that the watching thread could not give up."""
    # By `python -m mpi4py`, for example.
    if mpi.Is_initialized():
        return
    watch = threading.Timer(LONGEST_START, _give_up)
    watch.daemon = True
    watch.start()
    # The extension's handle finds the symbols of the library that it was linked with.
    provided = ctypes.byref(ctypes.c_int())
    initialize = ctypes.CDLL(mpi.__file__).MPI_Init_thread
    code = initialize(None, None, mpi.THREAD_FUNNELED, provided)
    watch.cancel()
    if code:
        raise RuntimeError(f"MPI_Init_thread returned {code}")
    for communicator in (mpi.COMM_WORLD, mpi.COMM_SELF):
        # As mpi4py does: errors become exceptions.
        communicator.Set_errhandler(mpi.ERRORS_RETURN)
    atexit.register(lambda: mpi.Is_finalized() or mpi.Finalize())


def _give_up() -> None:
    """End this process as an interrupted run does: a batch script starts it again."""
    if launch.launcher_rank() == 0:
        print_notice(_NOT_STARTED.format(LONGEST_START))
    time.sleep(launch.LAST_WORDS)
    os._exit(INTERRUPTED)


def _library(mpi: Any) -> str:
    first, *_ = str(mpi.Get_library_version()).split("\n", maxsplit=1)
    # The text may end in zeros, as it stands in its buffer.
    return first.strip("\0 ")
