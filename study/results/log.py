"""Logs of results, and where each result is in them. One process appends to a log, any process reads it.

A killed writer loses nothing added. A power failure may lose the last second while tasks end, else the last half minute; a
torn end costs the last result.
"""

import errno
import os
import re
import secrets
import sys
import time
import weakref
from collections.abc import Iterable, Iterator
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import BinaryIO, Final, NamedTuple

from nanoslip.study.plan.task import TaskResult
from nanoslip.study.results.entry import (
    ALIGNED,
    MARK,
    NO_FILE,
    CorruptResultError,
    Head,
    OtherFormatError,
    TornError,
    check,
    free_name,
    is_no_file,
    read_head,
    result_of,
    written_whole,
)

ENDING: Final = ".log"
SYNC: Final = 1.0
"""Seconds after which what was added is made to last, too."""
_PIECE: Final = 1 << 20
"""Bytes that are read at once."""
_RANDOM: Final = 8
"""Bytes of a log's name that nobody else draws."""
_NAME: Final = re.compile(rf"[0-9]{{6,12}}-[0-9a-f]{{{2 * _RANDOM}}}{re.escape(ENDING)}")
"""As `later` makes it: other files that end so are somebody else's."""


class Opened:
    """An open file, closed when nobody has it any more."""

    def __init__(self, path: Path, flags: int = os.O_RDONLY) -> None:
        """Raises OSError."""
        self.number: Final = os.open(path, flags | os.O_CLOEXEC, 0o666)
        weakref.finalize(self, os.close, self.number)


class LogWriter:
    """The one writer of a log, which begins with the first thing that is added."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._file: Opened | None = None
        self._process = 0
        self._synced = 0.0

    def add(self, entry: bytes) -> None:
        """Add an entry, whole or not at all. Raises OSError."""
        file = self._opened().number
        state = os.fstat(file)
        if state.st_nlink == 0:
            raise FileNotFoundError(errno.ENOENT, "the log was removed")
        try:
            rest = memoryview(entry)
            while rest:
                rest = rest[os.write(file, rest) :]
        except OSError:
            os.ftruncate(file, state.st_size)
            raise
        if time.monotonic() - self._synced > SYNC:
            os.fsync(file)
            self._synced = time.monotonic()

    def close(self) -> None:
        """Sync added results to disk, where other machines see them; later results go to a new log. Raises OSError."""
        file, self._file = self._file, None
        if file and self._process == os.getpid():
            os.fsync(file.number)

    def _opened(self) -> Opened:
        if self._file is None or self._process != os.getpid():  # a log has one writer, whoever forks
            path = later(self._folder, f"{secrets.token_hex(_RANDOM)}{ENDING}")
            self._file = Opened(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_EXCL)
            self._process, self._synced = os.getpid(), time.monotonic()
        return self._file


def later(folder: Path, name: str) -> Path:
    """The path of a log of this name, so that it sorts behind all that are there: of two results the later one counts.

    The number that the name may begin with was its place in another folder.
    """
    number = 1 + max((int(path.name.partition("-")[0]) for path in logs_in(folder)), default=0)
    return folder / f"{number:06d}-{name.rpartition('-')[2]}"


def is_name(name: str) -> bool:
    """Whether a log is called so."""
    return _NAME.fullmatch(name) is not None


def logs_in(folder: Path) -> list[Path]:
    """Files named like logs, in order of creation."""
    return sorted(path for path in folder.glob(f"*{ENDING}") if is_name(path.name))


class Place(NamedTuple):
    """An entry, and where its bytes are."""

    head: Head
    path: Path
    begin: int
    """Of the entry, in bytes from the beginning of the file."""


class Fault(NamedTuple):
    """Damaged bytes in place of an entry."""

    begin: int
    end: int
    error: CorruptResultError


def scan(path: Path, begin: int = 0, whole: bool = True) -> Iterator[Place | Fault]:
    """The entries of a log from here on, and what lies between them that is none. Raises OSError, OtherFormatError.

    A torn end comes last, as a Fault with a TornError: the writer may be at it. whole: numbers are checked, too, not only passed.
    """
    with path.open("rb", buffering=_PIECE) as file:
        file.seek(begin)
        length = os.fstat(file.fileno()).st_size
        while begin < length:
            try:
                head = read_head(file)
                if begin + head.length > length:
                    raise TornError("it ends too early")
                if whole:
                    check(head, file.read(head.numbers))
                else:
                    file.seek(head.numbers, os.SEEK_CUR)
                yield Place(head, path, begin)
                begin += head.length
            except CorruptResultError as error:
                if isinstance(error, OtherFormatError) and begin == 0:  # a log has one writer
                    raise
                end = _next(file, begin + ALIGNED)
                yield Fault(begin, end or length, _told_apart(error, end))
                if end is None:
                    return
                begin = end
                file.seek(begin)


def _told_apart(error: CorruptResultError, end: int | None) -> CorruptResultError:
    """Something was added behind a torn end that is none."""
    return CorruptResultError(*error.args) if isinstance(error, TornError) and end is not None else error


def _next(file: BinaryIO, begin: int) -> int | None:
    """Where the next entry begins, at or behind a place; None where there is none."""
    file.seek(begin)
    while piece := file.read(_PIECE):
        at = piece.find(MARK)
        while at >= 0 and at % ALIGNED:
            at = piece.find(MARK, at + 1)
        if at >= 0:
            return begin + at
        begin += _PIECE
    return None


# All logs of a folder, as one: where each result is, found once and then only in what has been added since.

_OPEN: Final = 64
"""Logs that are held open to be read."""


class _Seen(NamedTuple):
    """Part of a log that was read, and its state then."""

    end: int
    inode: int
    changed: int


class Logs:
    """The results in logs of this folder."""

    def __init__(self, folder: Path, whole: bool) -> None:
        """whole: numbers are checked when results are looked for, else only when they are read."""
        self._folder, self._whole = folder, whole
        self._seen: dict[Path, _Seen] = {}
        self._opened = lru_cache(_OPEN)(Opened)
        self._no_files: set[Path] = set()
        """What stands in the place of a log and was named."""
        self.places: dict[str, Place] = {}
        """Key -> where its result is, as far as was looked."""

    def look(self) -> None:
        """Read added results; damage is reported on stderr, except a torn end, which may still be written."""
        for path in self._paths():
            with suppress(FileNotFoundError):  # a run that goes on meanwhile has mended it
                self._look_into(path)

    def find(self, key: str) -> Place | None:
        """Where the result of a task is; None where it is in no log."""
        if key not in self.places:
            self.look()
        return self.places.get(key)

    def mend(self) -> None:
        """Read, and set damaged parts aside; no other process may write. Raises OSError, OtherFormatError."""
        for path, faults in [(path, self._look_into(path)) for path in self._paths()]:  # refused before any is changed
            if not faults:
                continue
            aside = free_name(path)
            _copy(path, aside, [(fault.begin, fault.end) for fault in faults])
            if isinstance(faults[0].error, TornError):
                sys.stderr.write(f"{path}: its end was torn; what was there will be computed again\n")
                os.truncate(path, faults[0].begin)
            else:
                ends = [0, *(fault.end for fault in faults)]
                _copy(path, path, zip(ends, [*(fault.begin for fault in faults), path.stat().st_size], strict=True))
            sys.stderr.write(f"{aside}: what was cut out\n")

    def settle(self) -> None:
        """Sync added results to disk. Raises OSError."""
        for path in self._paths():
            with path.open("rb") as file:
                os.fsync(file.fileno())

    def read(self, place: Place) -> TaskResult:
        """The result there. Raises CorruptResultError, FileNotFoundError."""
        head, path, begin = place
        numbers = os.pread(self._opened(path).number, head.numbers, begin + head.length - head.numbers)
        try:
            check(head, numbers)
            return result_of(head, numbers)
        except CorruptResultError as error:
            raise CorruptResultError(_named(path, Fault(begin, begin + head.length, error))) from error

    def _paths(self) -> list[Path]:
        """Existing logs; other objects of such a name are reported once."""
        found = logs_in(self._folder)
        for path in found:
            if is_no_file(path) and path not in self._no_files:
                self._no_files.add(path)
                sys.stderr.write(f"{path}: {NO_FILE}, so no log of results; what was there will be computed again\n")
        return [path for path in found if path.is_file()]

    def _look_into(self, path: Path) -> list[Fault]:
        """Read the new part of a log, or all of a replaced one; returns damaged parts."""
        with path.open("rb") as file:  # of what is opened a network file system asks anew how long it is
            state = os.fstat(file.fileno())
        seen = self._seen.get(path, _Seen(0, state.st_ino, 0))
        if (state.st_size, state.st_ino, state.st_mtime_ns) == seen:
            return []
        end, faults = seen.end, []
        if state.st_ino != seen.inode or state.st_size <= seen.end:
            end = 0
            self.places = {key: place for key, place in self.places.items() if place.path != path}
            self._opened.cache_clear()
        for found in _scanned(path, end, self._whole):
            if isinstance(found, Place):
                self._enter(found)
                end = found.begin + found.head.length
                continue
            faults.append(found)
            if not isinstance(found.error, TornError):
                sys.stderr.write(f"{_named(path, found)}; what was there will be computed again\n")
                end = found.end
        self._seen[path] = _Seen(end, state.st_ino, state.st_mtime_ns)
        return faults

    def _enter(self, place: Place) -> None:
        """Of two results of one task the later log counts: it was computed again."""
        known = self.places.get(place.head.key)
        if known is None or known.path <= place.path:
            self.places[place.head.key] = place


def _scanned(path: Path, begin: int, whole: bool) -> Iterator[Place | Fault]:
    """As `scan`, with the name of a log that is refused."""
    try:
        yield from scan(path, begin, whole)
    except OtherFormatError as error:
        raise OtherFormatError(f"{path}: {error}") from None


def _copy(path: Path, to: Path, parts: Iterable[tuple[int, int]]) -> None:
    """Write a file, whole, of parts of another one or of itself. parts: where each begins and ends, in bytes."""
    with path.open("rb") as file, written_whole(to) as scratch, scratch.open("wb") as written:
        for begin, end in parts:
            file.seek(begin)
            written.write(file.read(end - begin))


def _named(path: Path, fault: Fault) -> str:
    return f"{path}: bytes {fault.begin} to {fault.end} are no whole result ({fault.error})"
