"""The process that computes: tasks come, and how each has ended goes back, in their order. What one does to it, it does alone.

It knows nothing of MPI and loads what the solver computes with, which the process that hands tasks to it does not.
"""

import ctypes
import faulthandler
import os
import signal
import socket
import sys
import traceback
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, Final

from nanoslip.study.execution.farms.pickling import dumps, loads
from nanoslip.study.execution.interruption import SIGNALS
from nanoslip.study.execution.ledger import attempt
from nanoslip.study.execution.program import Program
from nanoslip.study.origin import Origin, adopt

READY: Final = "ready"
NO_TASK: Final = 70
"""Exit code where what comes is no task that this program knows."""
_DIE_WITH_PARENT: Final = 1
"""PR_SET_PDEATHSIG of prctl(2)."""
_VICTIM: Final = "500"
"""Where the kernel has no memory left, it ends this process before the one that hands out (0 is usual, 1000 the most)."""


def main(descriptor: int, last_words: int) -> None:
    """Compute what comes until nothing does any more.

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
    program, number = loads(parent.recv_bytes())
    execute = program.load()
    parent.send_bytes(dumps(READY))
    where, process = f"rank {number} on {socket.gethostname()}", os.getpid()
    while True:
        try:
            message = loads(parent.recv_bytes())
        except (EOFError, OSError):
            return  # nobody is there any more
        except BaseException:
            traceback.print_exc()
            os._exit(NO_TASK)
        if isinstance(message, Origin):
            adopt(message)
            continue
        for task in message:
            done = attempt(execute, task, where, survive=BaseException)
            if os.getpid() != process:
                os._exit(0)  # a copy of it, made by the task
            parent.send_bytes(dumps(done))
            if done.passing:
                return


def _end_with(parent: int) -> None:
    """Have the kernel kill this process when that one ends, however deep it is in a kernel; Linux only."""
    with suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(_DIE_WITH_PARENT, signal.SIGKILL)
        if os.getppid() != parent:  # it has ended before the kernel knew
            sys.exit()
