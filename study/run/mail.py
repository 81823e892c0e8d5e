"""Messages between ranks, whatever they say. None waits inside MPI: that would spin and take a core from those who compute."""

import dataclasses
import io
import math
import os
import pickle
import time
from collections import defaultdict, deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from inspect import ismemberdescriptor
from operator import attrgetter
from pathlib import Path
from threading import Lock
from typing import Any, Final

from nanoslip.solver.outcome import UNDONE, Ending
from nanoslip.study.results import entry as lines
from nanoslip.study.run.dispatch import Done
from nanoslip.study.run.queue import Work

# Tasks that a run has begun, on disk until it ends: where it is killed as a whole, by one of them perhaps, they say
# which.

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


# Tasks and news as bytes, in a fifth of pickle's time: its own way with a dataclass looks up the fields of each value
# anew.
#
# Anything that pickle takes can be sent. The bytes are for processes of the same run, nothing else.

Reduced = tuple[Callable[..., Any], tuple[Any, ...]]


def dumps(message: object) -> bytes:
    """A message as bytes."""
    buffer = io.BytesIO()
    pickler = pickle.Pickler(buffer, pickle.HIGHEST_PROTOCOL)
    pickler.dispatch_table = _REDUCERS
    pickler.dump(message)
    return buffer.getvalue()


loads: Final = pickle.loads


class _Reducers(dict[type, Callable[[Any], Reduced]]):
    """How values of each type are taken apart; what is no dataclass with slots is left to pickle."""

    def __missing__(self, cls: type) -> Callable[[Any], Reduced]:
        if not _has_plain_slots(cls):
            raise KeyError(cls)
        self[cls] = made = _reducer(cls)
        return made


def _has_plain_slots(cls: type) -> bool:
    """Whether its fields are all that there is of a value."""
    if not dataclasses.is_dataclass(cls) or cls.__reduce__ is not object.__reduce__:
        return False
    return all(ismemberdescriptor(getattr(cls, field.name, None)) for field in dataclasses.fields(cls))


_REDUCERS: Final = _Reducers()


def _reducer(cls: type[Any]) -> Callable[[Any], Reduced]:
    names = [field.name for field in dataclasses.fields(cls)]
    home = f"{cls.__module__}:{cls.__qualname__}"  # a text: pickle imports anew what it is to find by its name
    if len(names) > 1:
        values = attrgetter(*names)
        return lambda value: (_build, (home, values(value)))
    return lambda value: (_build, (home, tuple(getattr(value, name) for name in names)))


def _build(home: str, values: tuple[Any, ...]) -> object:
    """A value of the type that is at home there, which was checked when it was made."""
    cls, setters = _setters(home)
    value = object.__new__(cls)
    for put, each in zip(setters, values, strict=True):
        put(value, each)
    return value


@cache
def _setters(home: str) -> tuple[type[Any], list[Callable[[Any, Any], None]]]:
    module, _, name = home.partition(":")
    cls = attrgetter(name)(import_module(module))
    return cls, [getattr(cls, field.name).__set__ for field in dataclasses.fields(cls)]


# What a rank tells of its tasks, and when: a message costs rank 0 more than what it says, so short tasks travel
# together.


@dataclass(frozen=True, slots=True)
class News:
    """What a rank tells of its tasks, in as few objects as can be: rank 0 reads what thousands of ranks tell."""

    ended: Mapping[Ending, Mapping[str, float]]
    """Seconds that tasks took, by their keys, and these by how the tasks ended. Their results say the rest."""
    failed: tuple[Done, ...] = ()
    """The tasks that failed."""
    returned: tuple[str, ...] = ()
    """Keys of the tasks that the rank has not begun and will not."""
    where: str = ""
    """Rank and host."""


def news_of(done: Iterable[Done], returned: tuple[str, ...] = ()) -> News:
    """What is to be told of tasks of one rank."""
    ended: defaultdict[Ending, dict[str, float]] = defaultdict(dict)
    failed = []
    where = ""
    for each in done:
        where = each.where
        if each.outcome.ending in UNDONE:
            failed.append(each)
        else:
            ended[each.outcome.ending][each.key] = each.seconds
    return News(dict(ended), tuple(failed), returned, where)


class Outbox:
    """News that have not been sent."""

    def __init__(self, patience: float) -> None:
        """patience: seconds that news may wait for further ones."""
        self._patience = patience
        self._done: list[Done] = []
        self._returned: tuple[str, ...] = ()
        self._oldest = math.inf

    def add(self, done: list[Done], returned: tuple[str, ...], now: float) -> None:
        """Put in what has ended or is returned. now: seconds of a clock; likewise in `due`."""
        if done or returned:
            self._oldest = min(self._oldest, now)
        self._done += done
        self._returned += returned

    def due(self, waiting: int, now: float) -> News | None:
        """Take out what is to be sent now: all if no more tasks wait than have ended, or the oldest was patient enough."""
        if self._oldest == math.inf or (waiting > len(self._done) and now < self._oldest + self._patience):
            return None
        news = news_of(self._done, self._returned)
        self._done, self._returned, self._oldest = [], (), math.inf
        return news


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
        self._sent.append(self._world.isend(dumps(message), dest=rank))

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
            found.append((rank, loads(self._world.recv(source=rank))))
        return found
