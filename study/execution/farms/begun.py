"""Tasks that a run has begun, on disk until it ends: where it is killed as a whole, by one of them perhaps, they say which."""

import os
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from threading import Lock
from typing import Final

from nanoslip.study.execution.queue import Work
from nanoslip.study.results import entry as lines

FILE: Final = "begun.txt"
LONG: Final = 1.0
"""Seconds from which on a task is noted, and one of which nothing is known: of shorter ones too many are begun."""


class Begun:
    """Keys of tasks in the order in which they were begun. What the disk refuses to take is left out."""

    def __init__(self, out: Path) -> None:
        self._path = out / FILE
        self._lock = Lock()  # a signal closes it from another thread
        self._file: int | None = None
        self._closed = False

    def begin(self, tasks: Sequence[tuple[Work, float]]) -> None:
        """Note tasks that are expected to take so many seconds each."""
        long = [task.key for task, seconds in tasks if seconds >= LONG]
        if not long:
            return
        with self._lock, suppress(OSError):
            if self._closed:
                return
            if self._file is None:
                # Without waiting: a pipe in its place would have no reader.
                how = os.O_WRONLY | os.O_CREAT | os.O_APPEND | os.O_NONBLOCK | os.O_NOFOLLOW
                self._file = os.open(self._path, how, 0o666)
            os.write(self._file, "".join(f"{key}\n" for key in long).encode())

    def close(self) -> None:
        """Forget all of them: the run ends by itself, or was told to stop."""
        with self._lock, suppress(OSError):
            self._closed = True
            if self._file is not None:
                os.close(self._file)
                self._file = None
            self._path.unlink(missing_ok=True)

    def read(self) -> frozenset[str]:
        """What a run that was killed has left."""
        return frozenset(word for line in lines.read(self._path) for word in line.split())
