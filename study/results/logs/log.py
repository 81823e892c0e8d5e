"""A log of results: one behind the other, added at the end by one process, read by any.

A killed writer loses nothing that it has added; when a machine loses power, that of the last seconds may be lost (the system
writes it to disk every second while tasks end, and within half a minute else). The end of a log may be torn, which costs the
last result.
"""

import errno
import os
import re
import secrets
import time
import weakref
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, Final, NamedTuple

from study.results.entry import ALIGNED, MARK, CorruptResultError, Head, OtherFormatError, TornError, check, read_head

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
        """Have what was added reach the disk, where other machines see it; a new log takes what comes later. Raises OSError."""
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
    """What has the name of a log, in the order in which they were begun."""
    return sorted(path for path in folder.glob(f"*{ENDING}") if is_name(path.name))


class Place(NamedTuple):
    """An entry, and where its bytes are."""

    head: Head
    path: Path
    begin: int
    """Of the entry, in bytes from the beginning of the file."""


class Fault(NamedTuple):
    """What is found where an entry should be."""

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
