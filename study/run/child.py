"""The computing process: it receives tasks and returns outcomes in order. A crash ends only this process.

It does not use MPI, and is the only process that loads the solver.
"""

import ctypes
import faulthandler
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
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, Final

from nanoslip.study.origin import Origin, adopt
from nanoslip.study.run.dispatch import Done, attempt
from nanoslip.study.run.launch import ONE_THREAD, SIGNALS, Program
from nanoslip.study.run.queue import Work

READY: Final = "ready"
NO_TASK: Final = 70
"""Exit code where what comes is no task that this program knows."""
_DIE_WITH_PARENT: Final = 1
"""PR_SET_PDEATHSIG of prctl(2)."""
_VICTIM: Final = "500"
"""Where the kernel has no memory left, it ends this process before the one that hands out (0 is usual, 1000 the most)."""


def main(descriptor: int, last_words: int) -> None:
    """Compute tasks until the connection closes.

    descriptor: this end of the connection. last_words: a file's, which takes the traceback of a fault that ends the process.
    """
    for each in SIGNALS:  # a terminal sends them to all; what they mean is decided by the process that hands out
        signal.signal(each, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS)
    _end_with(os.getppid())
    with suppress(OSError):
        Path("/proc/self/oom_score_adj").write_text(_VICTIM)
    faulthandler.enable(last_words)
    parent: Connection[Any, Any] = Connection(descriptor)
    with suppress(EOFError, BrokenPipeError, ConnectionResetError), parent:
        _serve(parent)


def _serve(parent: "Connection[Any, Any]") -> None:
    program: Program
    program, number = parent.recv()
    execute = program.load()
    parent.send(READY)
    where, process = f"rank {number} on {socket.gethostname()}", os.getpid()
    while True:
        try:
            message = parent.recv()
        except (EOFError, OSError):
            return  # nobody is there any more
        except BaseException:
            traceback.print_exc()
            os._exit(NO_TASK)
        if isinstance(message, Origin):
            adopt(message)
            continue
        done = attempt(execute, message, where, survive=BaseException)
        if os.getpid() != process:
            os._exit(0)  # a copy of it, made by the task
        parent.send(done)
        if done.passing:
            return


def _end_with(parent: int) -> None:
    """Have the kernel kill this process when that one ends, however deep it is in a kernel; Linux only."""
    with suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(_DIE_WITH_PARENT, signal.SIGKILL)
        if os.getppid() != parent:  # it has ended before the kernel knew
            sys.exit()


# A child that computes, from this side: started, given tasks, received from, ended.

LONGEST_LOOK: Final = 1.0
"""Seconds between two looks at a child; more of them were not lived through."""
LAST_BREATH: Final = 2.0
"""Seconds that a child which has cut its connection has to end by itself."""
LONGEST_MESSAGE: Final = 1 << 20
"""Bytes of a message from it, at most: of a length that a task has made up the rest never comes."""
_MOST_WORDS: Final = 10_000
"""Bytes of its last words that are kept."""
_START: Final = (
    "import sys; sys.path[:] = sys.argv[3:]; "
    "from nanoslip.study.run.child import main; main(int(sys.argv[1]), int(sys.argv[2]))"
)


class ChildProcess:
    """A process that computes, and this end of its connection."""

    def __init__(self, program: Program, number: int) -> None:
        self.ready = False
        """Whether it can compute; `seconds` is how long it has been starting until then, and at its task from then on."""
        ours, theirs = socket.socketpair()
        self._last_words = tempfile.TemporaryFile()  # noqa: SIM115  closed with the child
        with theirs:
            files = (theirs.fileno(), self._last_words.fileno())
            words = [sys.executable, "-c", _START, *map(str, files), *sys.path]
            # By vfork where there is one: a fork would copy what libraries of MPI have registered with the network. In a session
            # of its own: what a task sends to its process group reaches nobody else.
            signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)  # it starts with them blocked, and then ignores them
            try:
                self._process = subprocess.Popen(
                    words,
                    stdin=subprocess.DEVNULL,
                    pass_fds=files,
                    start_new_session=True,
                    env=os.environ | ONE_THREAD,
                )
            finally:
                signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS)
        self.pipe: Connection[Any, Any] = Connection(ours.detach())
        self._poll = select.poll()  # that of the connection makes a new one each time
        self._poll.register(self.pipe, select.POLLIN)
        self._deaths = deaths_for_memory()
        self.seconds = 0.0
        self._seen = time.monotonic()
        self._send((program, number))

    def look(self) -> None:
        """Add the time since the last look to `seconds`, less that in which this process was stopped, and the child with it."""
        now = time.monotonic()
        self.seconds += min(now - self._seen, LONGEST_LOOK)
        self._seen = now

    def begin(self, task: Work) -> None:
        """Have it compute a task, now that it has none."""
        self.seconds, self._seen = 0.0, time.monotonic()
        self._send(task)

    def adopt(self, origin: Origin) -> None:
        """Have it state this software in results."""
        self._send(origin)

    def receive(self) -> Done | None:
        """Outcome of its task; None while it runs. Raises if the process ended or its output is no message."""
        while self._poll.poll(0):
            message = pickle.loads(self.pipe.recv_bytes(LONGEST_MESSAGE))
            self.seconds, self._seen = 0.0, time.monotonic()  # its task's, if it has been starting
            if message != READY:
                return message  # type: ignore[no-any-return]
            self.ready = True
        if self._process.poll() is not None and not self._poll.poll(0):
            raise EOFError  # where it has started others, they hold the other end of the connection
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
        """Exit code, or minus the signal that ended it; None where it had cut the connection and went on."""
        code = None
        with suppress(subprocess.TimeoutExpired):
            code = self._process.wait(LAST_BREATH)
            self.stop()
        return code

    def last_words(self) -> str:
        """The traceback of the fault that ended it; empty where it left none."""
        self._last_words.seek(0)
        return self._last_words.read(_MOST_WORDS).decode(errors="replace").partition("\nExtension modules:")[0]

    def out_of_memory(self) -> bool:
        """Whether the kernel has ended a process for want of memory since this one was started."""
        return deaths_for_memory() > self._deaths

    def _send(self, message: object) -> None:
        with suppress(OSError):  # it has died, as the other direction will say
            self.pipe.send(message)


def deaths_for_memory() -> int:
    """How many processes this machine has ended so far for want of memory; 0 where it does not say."""
    with suppress(OSError):
        for line in Path("/proc/vmstat").read_text("ascii").splitlines():
            if line.startswith("oom_kill "):
                return int(line.split()[1])
    return 0
