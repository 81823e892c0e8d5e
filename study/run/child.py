"""The computing process: it receives tasks and returns outcomes in order. A crash ends only this process.

It does not use MPI, and is the only process that loads the solver. If it dies (segmentation fault, killed, out of memory,
`os._exit`), its task fails; if it exceeds its time it is killed. Another child continues with the next task half a second
later, also after an error of the machine.
"""

import ctypes
import faulthandler
import math
import os
import pickle
import select
import signal
import socket
import subprocess
import sys
import tempfile
import time
import traceback
from collections import deque
from collections.abc import Mapping, Sequence
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, Final

from nanoslip.solver.outcome import Ending, NanoslipError, Outcome
from nanoslip.study.memory import address_limit, describe_shortage, is_shortage
from nanoslip.study.origin import Origin, adopt, find_software
from nanoslip.study.run.dispatch import Done, Underway, Work, Worker, attempt, print_failure
from nanoslip.study.run.launch import SIGNALS, Program, computing_environment

READY: Final = "ready"
NO_TASK: Final = 70
"""Exit code if the received object is no task of this program."""
_DIE_WITH_PARENT: Final = 1
"""PR_SET_PDEATHSIG of prctl(2)."""
_RESERVE: Final = 2**23
"""Bytes that are free again where memory runs out while a program is loaded: to report that takes some, too."""
_VICTIM: Final = "500"
"""Value of oom_score_adj: out of memory, the kernel kills this process before its parent (0 is usual, 1000 the most)."""


def main(descriptor: int, last_words: int) -> None:
    """Compute tasks until the connection closes.

    descriptor: this end of the connection. last_words: a file's, which takes the traceback of a fault that ends the process.
    """
    # A terminal sends signals to all processes; what they mean is decided by the process that hands out tasks.
    for signal_number in SIGNALS:
        signal.signal(signal_number, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS)
    _die_with_parent(os.getppid())
    with suppress(OSError):
        Path("/proc/self/oom_score_adj").write_text(_VICTIM)
    faulthandler.enable(last_words)
    parent: Connection[Any, Any] = Connection(descriptor)
    with suppress(EOFError, BrokenPipeError, ConnectionResetError), parent:
        _serve(parent)


def _serve(parent: "Connection[Any, Any]") -> None:
    program: Program
    program, number = parent.recv()
    reserve = bytearray(_RESERVE)
    try:
        execute = program.load()
    except Exception as error:
        # Libraries that find no room raise whatever they come upon; the kind of error is named, in case it is a defect.
        if not is_shortage(error) and address_limit() == math.inf:
            raise
        del reserve
        kind = type(error).__name__
        parent.send(FarmError(f"a process that computes does not begin ({kind}): {describe_shortage()}"))
        return
    del reserve
    parent.send(READY)
    where, process = Worker(number, socket.gethostname()), os.getpid()

    def send(news: Underway | Done) -> None:
        # Any other process is a copy of this one, which the task has made.
        if os.getpid() == process:
            parent.send(news)

    while True:
        try:
            message = parent.recv()
        except (EOFError, OSError):
            # The process that would read the message has ended.
            return
        except BaseException:
            traceback.print_exc()
            os._exit(NO_TASK)
        if isinstance(message, Origin):
            if different := message.differences(find_software()):
                parent.send(_other_software(where, different))
                return
            adopt(message)
            continue
        done = attempt(execute, message, where, BaseException, send)
        if os.getpid() != process:
            # A copy of this process, which its task has made: there is nothing to report from it.
            os._exit(0)
        send(done)
        if done.passing:
            return


def _other_software(where: Worker, different: Mapping[str, tuple[str, str]]) -> "FarmError":
    """Error of a child with other software than the run. different: property of an origin -> the run's and the child's."""
    pairs = (f"{name.removesuffix('_version')} {its} instead of {mine}" for name, (mine, its) in different.items())
    return FarmError(f"{where} has other software than the run began with: {', '.join(pairs)}; it computes nothing")


def _die_with_parent(parent: int) -> None:
    """Have the kernel kill this process when that one ends, however deep it is in a kernel; Linux only."""
    with suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(_DIE_WITH_PARENT, signal.SIGKILL)
        # The parent ended before the kernel was asked to tell of its end.
        if os.getppid() != parent:
            sys.exit()


# A child that computes, from this side: started, given tasks, received from, ended.

LONGEST_LOOK: Final = 1.0
"""Seconds between two looks at a child; more of them were not lived through."""
LAST_BREATH: Final = 2.0
"""Seconds that a child which has closed its connection has to end."""
LONGEST_PICKLE: Final = 1 << 20
"""Bytes of a message from it, at most: of a length that a task has made up the rest never comes."""
_MOST_WORDS: Final = 10_000
"""Bytes of its last words that are kept."""
_START: Final = (
    "import sys; sys.path[:] = sys.argv[3:]; "
    "from nanoslip.study.run.child import main; main(int(sys.argv[1]), int(sys.argv[2]))"
)


class ChildProcess:
    """A process that computes, and this end of its connection."""

    def __init__(self) -> None:
        self.loads = False
        """True if it has got its program: it has nothing to compute with before."""
        self.ready = False
        """True if it can compute. `seconds` counts its start until then, and its task from then on."""
        self.underway: Underway | None = None
        """Last report of its task's progress."""
        ours, theirs = socket.socketpair()
        self._last_words = tempfile.TemporaryFile()  # noqa: SIM115  closed with the child
        with theirs:
            files = (theirs.fileno(), self._last_words.fileno())
            descriptors = map(str, files)
            words = [sys.executable, "-c", _START, *descriptors, *sys.path]
            # By vfork where there is one: a fork would copy what libraries of MPI have registered with the network. In a session
            # of its own: what a task sends to its process group reaches nobody else.
            # The child starts with signals blocked, and then ignores them: none can end it in between.
            signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
            try:
                self._process = subprocess.Popen(
                    words, stdin=subprocess.DEVNULL, pass_fds=files, start_new_session=True, env=computing_environment()
                )
            finally:
                signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS)
        self.pipe: Connection[Any, Any] = Connection(ours.detach())
        # The connection's own poll makes a new object each time.
        self._poll = select.poll()
        self._poll.register(self.pipe, select.POLLIN)
        self._deaths = deaths_for_memory()
        self.seconds = 0.0
        self._seen = time.monotonic()

    def look(self) -> None:
        """Add the time since the last look to `seconds`, less that in which this process was stopped, and the child with it."""
        now = time.monotonic()
        self.seconds += min(now - self._seen, LONGEST_LOOK)
        self._seen = now

    def load(self, program: Program, number: int) -> None:
        """Have it import the modules of tasks."""
        self.loads = True
        self._send((program, number))

    def begin(self, task: Work) -> None:
        """Have it compute a task, now that it has none."""
        self.seconds, self._seen = 0.0, time.monotonic()
        self._send(task)

    def adopt(self, origin: Origin) -> None:
        """Have it state this software in results."""
        self._send(origin)

    def receive(self) -> "Done | FarmError | None":
        """Outcome of its task, None while it runs; or why it computes none. Raises if it ended or wrote no message."""
        while self._poll.poll(0):
            message = pickle.loads(self.pipe.recv_bytes(LONGEST_PICKLE))
            if isinstance(message, Underway):
                self.underway = message
                continue
            # Time of the task alone, where the child was still starting.
            self.seconds, self._seen = 0.0, time.monotonic()
            if message != READY:
                return message  # type: ignore[no-any-return]
            self.ready = True
        if self._process.poll() is not None and not self._poll.poll(0):
            # Processes that the child has started hold the other end of the connection, which thus never ends.
            raise EOFError
        self.look()
        return None

    def stop(self) -> None:
        """End its process and the processes it started; its traceback can still be read."""
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(self._process.pid, signal.SIGKILL)

    def kill(self) -> None:
        """End it at once."""
        if self._process.poll() is None:
            self.stop()
        self._process.wait()
        self.pipe.close()
        self._last_words.close()

    def last_code(self) -> int | None:
        """Exit code, or minus the signal that ended it; None if it had cut the connection and went on."""
        code = None
        with suppress(subprocess.TimeoutExpired):
            code = self._process.wait(LAST_BREATH)
            self.stop()
        return code

    def last_words(self) -> str:
        """The traceback of the fault that ended it; empty if it left none."""
        self._last_words.seek(0)
        text = self._last_words.read(_MOST_WORDS).decode(errors="replace")
        # faulthandler lists hundreds of modules after the traceback.
        return text.partition("\nExtension modules:")[0]

    def out_of_memory(self) -> bool:
        """True if the kernel has killed a process for lack of memory since this one was started."""
        return deaths_for_memory() > self._deaths

    def _send(self, message: object) -> None:
        # A child that has died is noticed where it is read from.
        with suppress(OSError):
            self.pipe.send(message)


def deaths_for_memory() -> int:
    """Number of processes that this machine has killed so far for lack of memory; 0 if it does not report them."""
    with suppress(OSError):
        for line in Path("/proc/vmstat").read_text("ascii").splitlines():
            if line.startswith("oom_kill "):
                return int(line.split()[1])
    return 0


# A child and the tasks that wait for it; the next child where one has died.

START: Final = 300.0
"""Seconds that a child has to start in; a crowded file system may need a while."""
FALSE_STARTS: Final = 5
"""Successive children of an agent that end before they can compute, until the agent gives up."""


class FarmError(NanoslipError):
    """Error of processes that a farm cannot use; the message has the remedy."""


class BrokenProgramError(Exception):
    """No computing process can be started; no task has an outcome."""


class Agent:
    """One child, started when it is needed or by `start`, and the tasks that wait for it."""

    def __init__(self, program: Program, number: int) -> None:
        """number: how messages call the child, by its rank."""
        self._program, self._number = program, number
        self._child: ChildProcess | None = None
        self._origin: Origin | None = None
        self._waiting: deque[Work] = deque()
        self._begun: Work | None = None
        self._false_starts = 0

    @property
    def busy(self) -> bool:
        """True if it computes a task."""
        return self._begun is not None

    @property
    def waiting(self) -> int:
        """Number of its tasks that it has not begun."""
        return len(self._waiting)

    @property
    def pipe(self) -> "Connection[Any, Any] | None":
        """Descriptor that becomes readable with news; None without a child."""
        return self._child.pipe if self._child else None

    def start(self) -> ChildProcess:
        """Start the child, and return it."""
        self._child = self._child or ChildProcess()
        return self._child

    def load(self) -> ChildProcess:
        """Have the child import the modules of tasks before the first task."""
        child = self.start()
        if not child.loads:
            child.load(self._program, self._number)
            if self._origin:
                child.adopt(self._origin)
        return child

    def adopt(self, origin: Origin) -> None:
        """Have every child state this software in results."""
        self._origin = origin
        if self._child and self._child.loads:
            self._child.adopt(origin)

    def give(self, tasks: Sequence[Any]) -> None:
        """Append tasks to its queue."""
        self._waiting.extend(tasks)
        self._feed()

    def give_back(self) -> tuple[str, ...]:
        """Drop all tasks that the child has not got yet, and return their keys."""
        keys = tuple(task.key for task in self._waiting)
        self._waiting.clear()
        return keys

    def arrived(self) -> list[Done]:
        """The tasks that have ended since. Raises BrokenProgramError if no child can be started, FarmError."""
        done = self._ended(self._begun) if self._begun else None
        self._feed()
        return [done] if done else []

    def take_progress(self) -> Underway | None:
        """The progress of its task; None if there is no report since the last call."""
        if self._child is None:
            return None
        underway, self._child.underway = self._child.underway, None
        return underway

    def close(self) -> None:
        """End the child; its task is lost."""
        if self._child:
            self._child.kill()
            self._child = None

    def _feed(self) -> None:
        """Keep the child at work."""
        if self._waiting and self._begun is None:
            self._begun = self._waiting.popleft()
            self.load().begin(self._begun)

    def _begin_again(self) -> None:
        """Give the remaining tasks to the next child."""
        self.close()
        if self._begun:
            self._waiting.appendleft(self._begun)
            self._begun = None

    def _ended(self, task: Work) -> Done | None:
        """Outcome of a task; None until it has ended."""
        child = self._child
        assert child is not None
        try:
            done = child.receive()
        # The child has ended, or written what is no message.
        except Exception:
            return self._dead(task, child)
        if isinstance(done, FarmError):
            self._begun = None
            self._waiting.clear()
            self.close()
            raise done
        if done is None and not child.ready and child.seconds > START:
            child.stop()
            return self._dead(task, child)
        if done is None and child.ready and child.seconds > task.limit:
            message = _TIMED_OUT.format(task.limit)
            outcome = Outcome(Ending.TIMED_OUT, message, cause="seconds")
            return self._lost(task, child, outcome, again=False)
        if done is not None:
            self._begun = None
            print_failure(task, done)
            if done.passing:
                self.close()
        return done

    def _dead(self, task: Work, child: ChildProcess) -> Done | None:
        """Outcome of a task whose child has ended; None if it had not started and another child computes it."""
        code = child.last_code()
        outcome = _death(child, code)
        self._false_starts = 0 if child.ready else self._false_starts + 1
        if self._false_starts >= FALSE_STARTS or code == NO_TASK:
            raise BrokenProgramError(f"a process that computes does not begin: {outcome.message}") from None
        if child.ready:
            return self._lost(task, child, outcome, again=True)
        self._begin_again()
        return None

    def _lost(self, task: Work, child: ChildProcess, outcome: Outcome, again: bool) -> Done:
        where = Worker(self._number, socket.gethostname())
        trace = child.last_words()
        done = Done(task.key, outcome, child.seconds, where, trace, again, died=True)
        self._begun = None
        self.close()
        print_failure(task, done)
        return done


_TIMED_OUT: Final = "not finished after {:g} s, and ended: raise `seconds` of [limits] if it only needs longer"


def _death(child: ChildProcess, code: int | None) -> Outcome:
    """Cause of an unexpected end of a child."""
    # SIGKILL has many senders: the machine's own count of such deaths tells which it was.
    if code == -9 and child.out_of_memory():
        return Outcome(Ending.OUT_OF_MEMORY, "its process was ended as memory ran out: start fewer ranks on a machine")
    if code is None:
        cause, how = "connection", "closed its connection"
    elif code < 0:
        cause, how = "signal", f"died of signal {-code}"
    else:
        cause, how = "exit_code", f"ended with exit code {code}"
    # Libraries that get no memory abort, or go on without it.
    limited = "" if address_limit() == math.inf else f"{describe_shortage()}; else "
    return Outcome(Ending.CRASHED, f"its process {how}: {limited}a bug, or it was killed", cause=cause)
