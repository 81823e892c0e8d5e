"""SIGTERM, SIGINT and SIGUSR1: the first sets a flag, a second one or the end of a grace period ends the process."""

import math
import os
import signal
import sys
import threading
import time
import types
from collections.abc import Callable
from typing import Self

from nanoslip.study.exit_codes import INTERRUPTED

SIGNALS = (signal.SIGTERM, signal.SIGINT, signal.SIGUSR1)
GRACE = 20.0
"""Seconds that a running task has to finish after a signal."""
ECHO = 2.0
"""Seconds in which a further signal is the same one again: a terminal signals the ranks, and so does their launcher."""
LAST_WORDS = 0.5
"""Seconds between a process's last message and its end: launchers drop what they have not passed on by then."""


class Interruption:
    """While entered, a first signal only sets a flag; a later one, or the grace (s) running out, ends the process.

    A thread watches rather than a handler: Python's handlers wait for the main thread, which may sit in a kernel that
    takes minutes. Results are written whole or not at all, so leaving in the middle of a task loses that task only. Once it
    is entered, entering it again changes nothing.
    """

    def __init__(self, grace: float) -> None:
        self._grace = grace
        self._end: Callable[[int], object] = os._exit
        self._at_request: Callable[[], object] = _do_nothing
        self._requested = threading.Event()
        self._patience: threading.Timer | None = None
        self._watcher: threading.Thread | None = None

    def end_by(self, end: Callable[[int], object]) -> None:
        """End the process so, with its exit code, where that cannot wait."""
        self._end = end

    def at_request(self, act: Callable[[], object]) -> None:
        """Do this as soon as the process is asked to stop, in whichever thread hears of it."""
        self._at_request = act

    @property
    def requested(self) -> bool:
        """True once the process was asked to stop."""
        return self._requested.is_set()

    def request(self) -> None:
        """Ask this process to stop, as a signal would (without the grace)."""
        self._requested.set()
        self._at_request()

    def __enter__(self) -> Self:
        if self._watcher is not None:
            return self
        self._read_end, self._write_end = os.pipe()
        os.set_blocking(self._write_end, False)
        self._handlers = {number: signal.signal(number, _note_nothing) for number in SIGNALS}
        self._old_wakeup = signal.set_wakeup_fd(self._write_end)
        self._watcher = threading.Thread(target=self._watch, name="interruption", daemon=True)
        self._watcher.start()
        return self

    def __exit__(self, *_: object) -> None:
        signal.set_wakeup_fd(self._old_wakeup)
        for number, handler in self._handlers.items():
            signal.signal(number, handler)
        os.close(self._write_end)  # ends the watcher
        if self._watcher is not None:
            self._watcher.join()
            self._watcher = None
        os.close(self._read_end)
        if self._patience is not None:
            self._patience.cancel()
            self._patience.join()

    def _watch(self) -> None:
        first = math.inf
        while received := os.read(self._read_end, 1):
            if received[0] not in SIGNALS:
                continue
            if time.monotonic() > first + ECHO:
                self._leave("asked again to stop")
            if self._patience is None:
                first = time.monotonic()
                self.request()
                self._patience = threading.Timer(self._grace, self._leave, [f"{self._grace:g} s to finish are over"])
                self._patience.daemon = True
                self._patience.start()

    def _leave(self, reason: str) -> None:
        sys.stderr.write(f"{reason}: left in the middle of a task; run again to continue\n")
        sys.stderr.flush()
        time.sleep(LAST_WORDS)
        self._end(INTERRUPTED)


def _do_nothing() -> None:
    """At a request, unless something is to be done."""


def _note_nothing(_number: int, _frame: types.FrameType | None) -> None:
    """A handler that does nothing: the watching thread reads the signal from the pipe."""
