"""All logs of a folder, as one: where each result is, found once and then only in what has been added since."""

import os
import sys
from collections.abc import Iterable, Iterator
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import Final, NamedTuple

from study.plan.task import TaskResult
from study.results.entry import CorruptResultError, OtherFormatError, TornError, check, result_of
from study.results.lines import NO_FILE, is_no_file
from study.results.logs.log import Fault, Opened, Place, logs_in, scan
from study.results.logs.places import Places
from study.results.whole_file import free_name, written_whole

_OPEN: Final = 64
"""Logs that are held open to be read."""


class _Seen(NamedTuple):
    """How far a log was looked through, and what it was then."""

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
        self.places = Places()
        """As far as was looked."""

    def look(self) -> None:
        """Look for what has been added; what is no result is named on stderr, a torn end is not: its writer may be at it."""
        for path in self._paths():
            with suppress(FileNotFoundError):  # a run that goes on meanwhile has mended it
                self._look_into(path)

    def find(self, key: str) -> Place | None:
        """Where the result of a task is; None where it is in no log."""
        if key not in self.places:
            self.look()
        return self.places.get(key)

    def mend(self) -> None:
        """Look, and set aside what is no result; nobody may be writing. Raises OSError, OtherFormatError."""
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
        """Have what was added outlast a loss of power. Raises OSError."""
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
        """The logs that are there; what has their name and is no file is named once."""
        found = logs_in(self._folder)
        for path in found:
            if is_no_file(path) and path not in self._no_files:
                self._no_files.add(path)
                sys.stderr.write(f"{path}: {NO_FILE}, so no log of results; what was there will be computed again\n")
        return [path for path in found if path.is_file()]

    def _look_into(self, path: Path) -> list[Fault]:
        """Find what a log has that was not seen yet (all, where it is another one than it was); returns what is no result."""
        with path.open("rb") as file:  # of what is opened a network file system asks anew how long it is
            state = os.fstat(file.fileno())
        seen = self._seen.get(path, _Seen(0, state.st_ino, 0))
        if (state.st_size, state.st_ino, state.st_mtime_ns) == seen:
            return []
        end, faults = seen.end, []
        if state.st_ino != seen.inode or state.st_size <= seen.end:
            end = 0
            self.places.forget_all(path)
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
        """Of two results of one task that of the later log counts: somebody had it computed again."""
        key = place.head.key
        if key not in self.places or self.places.path(key) <= place.path:
            self.places.add(place)


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
