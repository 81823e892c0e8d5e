"""Messages between ranks, whatever is in them. None waits inside MPI: that would spin and take a core from those who compute."""

import os
import time
from collections import deque
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Lock
from typing import Any, Final

from nanoslip.study.results import entry as lines
from nanoslip.study.run.dispatch import Done
from nanoslip.study.run.queue import Work

# Tasks that a run has begun, on disk until it ends: where it is killed as a whole, by one of them perhaps, they say which.

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
        """Forget all of them: the run ends by itself, or was signalled to stop."""
        with self._lock, suppress(OSError):
            self._closed = True
            if self._file is not None:
                os.close(self._file)
                self._file = None
            self._path.unlink(missing_ok=True)

    def read(self) -> frozenset[str]:
        """What a run that was killed has left."""
        return frozenset(word for line in lines.read(self._path) for word in line.split())


# What a rank sends of its tasks, and when.


@dataclass(frozen=True, slots=True)
class News:
    """What has become of tasks of a rank."""

    done: Sequence[Done] = ()
    """Those that have ended."""
    returned: Sequence[str] = ()
    """Keys of those that the rank has not begun and will not."""


class Outbox:
    """Ends of tasks that have not been sent: short ones travel together, as a message costs rank 0 more than what is in it."""

    def __init__(self, patience: float) -> None:
        """patience: seconds that an end may wait for further ones."""
        self._patience = patience
        self._done: list[Done] = []
        self._due = 0.0

    def take(self, done: Sequence[Done], waiting: int, now: float) -> list[Done]:
        """Put in what has ended; take out all if no task waits or the oldest end has waited long enough, else nothing.

        waiting: number of tasks that the rank has not begun. now: seconds of a clock.
        """
        if done and not self._done:
            self._due = now + self._patience
        self._done += done
        if waiting and now < self._due:
            return []
        taken, self._done = self._done, []
        return taken


FLUSH: Final = 60.0
"""Seconds that the messages of a rank may take to leave it: a rank that does not listen any more takes none."""


class Mail:
    """What this rank sends to others and receives from them."""

    def __init__(self, mpi: Any) -> None:
        self._mpi = mpi
        self._world = mpi.COMM_WORLD
        self._sent: deque[Any] = deque()

    def send(self, rank: int, message: object) -> None:
        """Send a message to a rank, which need not be listening."""
        self._drop_gone()
        self._sent.append(self._world.isend(message, dest=rank))

    def flush(self) -> None:
        """Wait until all that was sent has left: what has not when MPI ends never does, and whom it was for waits for ever."""
        end = time.monotonic() + FLUSH
        self._drop_gone()
        while self._sent and time.monotonic() < end:
            time.sleep(1e-3)
            self._drop_gone()

    def _drop_gone(self) -> None:
        while self._sent and self._sent[0].test()[0]:
            self._sent.popleft()

    def received(self) -> list[tuple[int, Any]]:
        """All messages that have arrived, each with the rank that sent it."""
        status = self._mpi.Status()
        found = []
        while self._world.iprobe(source=self._mpi.ANY_SOURCE, tag=self._mpi.ANY_TAG, status=status):
            rank = status.Get_source()
            found.append((rank, self._world.recv(source=rank)))
        return found
