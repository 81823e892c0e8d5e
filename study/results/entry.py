"""A result as bytes, in a log or in a separate file.

An entry is a head, the description of the result (JSON), a table of its numbers (JSON) and its arrays as they lie in
memory, each part filled up to a multiple of ALIGNED bytes. A checksum of all of them finds every change.
"""

import errno
import json
import os
import re
import secrets
import struct
import time
import weakref
import zlib
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, astuple
from functools import lru_cache
from pathlib import Path
from typing import Any, BinaryIO, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.outcome import Ending, Outcome, printable
from nanoslip.study.notices import print_notice
from nanoslip.study.origin import Origins, all_sources_hash, from_data
from nanoslip.study.results import files
from nanoslip.study.results.files import RANDOM, is_no_file, open_regular
from nanoslip.study.tasks.kind import as_declared
from nanoslip.study.tasks.task import TaskResult


class CorruptResultError(Exception):
    """The file is damaged: its bytes differ from the bytes written."""


class TornError(CorruptResultError):
    """Error of an entry with fewer bytes than were written, or are to come."""


class ResultFormatError(CorruptResultError):
    """A result as another nanoslip writes it: no damage."""


class UnusableResultError(CorruptResultError):
    """A result with right checksums that this version cannot use: it is computed again, and stays where it is."""


FORMAT: Final = 1
MARK: Final = b"nslip %d\n" % FORMAT
"""Beginning of every entry."""
_ANY_MARK: Final = re.compile(rb"nslip (\d+)\n")
ALIGNED: Final = 64
"""Bytes: numbers of any type lie in memory as kernels want them."""
_HEAD: Final = struct.Struct("<8s20sIIQI")
"""Mark, key, lengths of its description, of its table, and of table and arrays; checksum of table and arrays."""
_CHECKSUM: Final = struct.Struct("<I")
"""Checksum of the head and of the result's description."""
LEAST: Final = _HEAD.size + _CHECKSUM.size


class Meta(NamedTuple):
    """Head of a result, without its numbers."""

    kind: str
    outcome: Outcome
    origins: Origins


UNKNOWN: Final = Meta("", Outcome(Ending.INVALID), ())
"""Stands for a description with valid checksums that this version cannot read."""


class Head(NamedTuple):
    """The beginning of an entry."""

    key: str
    meta: Meta
    table: int
    """Bytes of the table."""
    numbers: int
    """Bytes of table and arrays."""
    checksum: int
    """Checksum of the numbers."""
    seal: int
    """Checksum of the head itself, and so of all that describes the result."""
    length: int
    """Bytes of the whole entry."""


def pack_result(result: TaskResult) -> bytes:
    """Pack a result as an entry; equal results give equal bytes. Raises ValueError if its key is invalid."""
    key = result.key.encode("ascii")
    if len(key) != _KEY:
        raise ValueError(f"{result.key!r}: no key of a result; needs {_KEY} letters")
    arrays = {name: np.asanyarray(array) for name, array in result.arrays.items()}
    if any(array.dtype.hasobject for array in arrays.values()):
        raise ValueError(f"{result.key}: an array of objects; needs numbers or texts")
    rows = [(name, array.dtype.str, array.shape, _is_fortran_order(array)) for name, array in arrays.items()]
    members = [astuple(member) for member in result.members]
    content = {"scalars": dict(result.scalars), "arrays": rows, "members": members}
    table = _pad(_json(content), b" ")
    columns = [_pad(array.tobytes("A"), b"\0") for array in arrays.values()]
    body = b"".join((table, *columns))
    meta = _meta_bytes(result.kind, result.outcome, result.origins)
    sizes = (len(meta), len(table), len(body))
    head = _HEAD.pack(MARK, key, *sizes, zlib.crc32(body))
    seal = zlib.crc32(meta, zlib.crc32(head))
    return b"".join((head, _CHECKSUM.pack(seal), meta, body))


# Kept, as most results have the same description.
@lru_cache(maxsize=256)
def _meta_bytes(kind: str, outcome: Outcome, origins: Origins) -> bytes:
    makers = [*map(asdict, origins)]
    content = {"kind": kind, **asdict(outcome), "origins": makers}
    return _pad(_json(content), b" ", LEAST)


def read_head(file: BinaryIO) -> Head:
    """Read the head of the entry that begins here; leaves the file after it.

    Raises TornError, ResultFormatError, CorruptResultError.
    """
    begin = file.read(LEAST)
    other = None if begin.startswith(MARK) else _ANY_MARK.match(begin)
    if other and not _ours_but_for_its_mark(begin, file):
        number = other[1].decode()
        raise ResultFormatError(f"has format {number}, of another nanoslip; this one reads format {FORMAT}")
    if len(begin) < LEAST:
        raise TornError("it ends too early")
    mark, key, meta_length, table, numbers, checksum = _HEAD.unpack_from(begin)
    if mark != MARK or meta_length > _MOST:
        raise CorruptResultError("no result begins there")
    meta = file.read(meta_length)
    (seal,) = _CHECKSUM.unpack_from(begin, _HEAD.size)
    # A length that was damaged leads anywhere: it is not followed before its checksum is right.
    if seal != zlib.crc32(meta, zlib.crc32(begin[: _HEAD.size])):
        raise (TornError if len(meta) < meta_length else CorruptResultError)(CHANGED)
    try:
        said = _meta(meta)
    except NO_RESULT:
        said = UNKNOWN
    name = key.decode("ascii", "replace")
    length = LEAST + meta_length + numbers
    return Head(name, said, table, numbers, checksum, seal, length)


def _ours_but_for_its_mark(begin: bytes, file: BinaryIO) -> bool:
    """True if only the format number of a head is damaged: all other bytes agree with the checksum."""
    if len(begin) < LEAST:
        return False
    meta_length = _HEAD.unpack_from(begin)[2]
    meta = file.read(min(meta_length, _MOST))
    # Left where it was: the bytes are read once more as what they say they are.
    file.seek(-len(meta), os.SEEK_CUR)
    (seal,) = _CHECKSUM.unpack_from(begin, _HEAD.size)
    head = MARK + begin[len(MARK) : _HEAD.size]
    return bool(seal == zlib.crc32(meta, zlib.crc32(head)))


def require_whole(head: Head, numbers: Any) -> None:
    """Raises TornError, CorruptResultError unless these are the numbers of the entry with this head, in any buffer."""
    if len(numbers) < head.numbers:
        raise TornError("it ends too early")
    if zlib.crc32(numbers) != head.checksum:
        raise CorruptResultError(CHANGED)


def unpack_result(head: Head, numbers: Any) -> TaskResult:
    """Result with this head and these numbers (a buffer that is never written to). Its arrays are read-only.

    Raises UnusableResultError.
    """
    if head.meta is UNKNOWN:
        raise UnusableResultError(NOT_OURS)
    try:
        table = json.loads(str(numbers[: head.table], "ascii"))
        arrays = dict(_arrays(table["arrays"], numbers, head.table))
        members = tuple([Outcome(Ending(ending), *more) for ending, *more in table["members"]])
        kind, outcome, origins = head.meta
        result = TaskResult(head.key, kind, outcome, table["scalars"], arrays, members, origins)
        return as_declared(result)
    except NO_RESULT as error:
        raise UnusableResultError(f"{NOT_OURS}: {printable(str(error), LONGEST_REASON)}") from None


def _arrays(rows: list[Any], numbers: Any, at: int) -> Iterator[tuple[str, NDArray[Any]]]:
    for name, kind, shape, fortran in rows:
        dtype = np.dtype(kind)
        count = int(np.prod(shape))
        values = np.empty(0, dtype)
        # Of no numbers at all numpy makes no view.
        if count:
            values = np.frombuffer(numbers, dtype, count, at)
        values.flags.writeable = False
        yield name, values.reshape(shape, order="F" if fortran else "C")
        at += _round_time(count * dtype.itemsize)


# Kept, as most results have the same description.
@lru_cache(maxsize=1024)
def _meta(text: bytes) -> Meta:
    head_facts = json.loads(text)
    facts = (fact for origin in head_facts["origins"] for fact in origin.values())
    words = (head_facts["kind"], *facts)
    if not all(isinstance(word, str) for word in words):
        raise TypeError("no texts")
    longer = bool(head_facts.get("longer"))
    cause = head_facts.get("cause", "")
    outcome = Outcome(Ending(head_facts["ending"]), head_facts["message"], longer, cause)
    return Meta(head_facts["kind"], outcome, from_data(head_facts["origins"]))


def _is_fortran_order(array: NDArray[Any]) -> bool:
    """True if an array is contiguous by columns, not rows: BLAS may round its sums differently."""
    return array.flags.f_contiguous and not array.flags.c_contiguous


def _json(content: object) -> bytes:
    return _ENCODER.encode(content).encode()


def _pad(content: bytes, filling: bytes, before: int = 0) -> bytes:
    length = before + len(content)
    return content + filling * (_round_time(length) - length)


def _round_time(length: int) -> int:
    return -(-length // ALIGNED) * ALIGNED


_ENCODER: Final = json.JSONEncoder(sort_keys=True, default=lambda number: number.item())
_KEY: Final = 20
_MOST: Final = 1 << 20
"""Most bytes of a result's description: more are damage."""
CHANGED: Final = "its bytes are not those that were written"
NOT_OURS: Final = "its checksums are right, but this version cannot use its content"
LONGEST_REASON: Final = 120
"""Most characters of the reason why content cannot be used: it may come from anywhere."""
NO_RESULT: Final = (ValueError, LookupError, TypeError, AttributeError, ArithmeticError, RecursionError)
"""Raised by content that is no result's."""


# A result in a file of its own, `<key>.result`, that appears whole: tasks which read it find it without looking.

ENDING: Final = ".result"
AGAIN: Final = "; a run computes it again where it is needed"
"""Consequence of a damaged result, for messages."""
MAPPED: Final = 1 << 20
"""Bytes of numbers from which a file is mapped into memory instead of read: the ranks of a node hold one copy."""


def result_path(folder: Path, key: str) -> Path:
    """Path of a result's file."""
    return folder / f"{key}{ENDING}"


def read_entry(path: Path) -> TaskResult:
    """The result of a file; where it is mapped, its numbers are not checked. Raises CorruptResultError, FileNotFoundError."""
    with _open_result(path) as file, naming_file(path):
        head = _head(path, file)
        if head.numbers < MAPPED:
            return unpack_result(head, _numbers(head, file))
        begin = file.tell()
        numbers = np.memmap(file, np.uint8, "r", begin, head.numbers)
        return unpack_result(head, np.asarray(numbers))


def check_file(path: Path) -> Head:
    """The head of a file. Raises CorruptResultError unless every byte is as it was written, FileNotFoundError."""
    with _open_result(path) as file, naming_file(path):
        head = _head(path, file)
        _numbers(head, file)
    return head


def _open_result(path: Path) -> BinaryIO:
    """Raises FileNotFoundError, CorruptResultError if it is a folder, a pipe, a link to nothing."""
    if is_no_file(path):
        raise CorruptResultError(f"{path}: not a whole result ({files.NO_FILE})")
    return os.fdopen(open_regular(path), "rb")


@contextmanager
def naming_file(path: Path) -> Iterator[None]:
    """Name the file whose bytes are no result's."""
    try:
        yield
    except ResultFormatError as error:
        raise ResultFormatError(f"{path}: {error}") from error
    except CorruptResultError as error:
        kind = UnusableResultError if isinstance(error, UnusableResultError) else CorruptResultError
        raise kind(f"{path}: not a whole result ({error})") from error


def _head(path: Path, file: BinaryIO) -> Head:
    head = read_head(file)
    if head.length != os.fstat(file.fileno()).st_size:
        raise CorruptResultError("it has another length than was written")
    if head.key != path.stem:
        raise CorruptResultError(f"the result of another task, {head.key}")
    return head


def _numbers(head: Head, file: BinaryIO) -> Any:
    numbers = file.read(head.numbers)
    require_whole(head, numbers)
    return numbers


# Results that this version cannot use, though their checksums are right, stay where they are: another version may use them. A
# line for each keeps this version from counting them as finished.

UNUSABLE: Final = "unusable.txt"
"""File among the results with a line for each result that a version could not use."""


def unusable_lines(folder: Path) -> frozenset[str]:
    """The lines of all results here that a version could not use."""
    return frozenset(files.read_lines(folder / UNUSABLE))


def note_unusable(folder: Path, head: Head) -> None:
    """Keep this version from counting a result as finished, in this process and later ones."""
    # A reader without the right to write scans the log again next time.
    with suppress(OSError):
        files.append_lines(folder / UNUSABLE, f"{path_line(head)}\n".encode())


def path_line(head: Head) -> str:
    """The line of a result that this version cannot use: version, key and checksums."""
    return f"{all_sources_hash()} {head.key} {head.seal:08x} {head.checksum:08x}"


# Logs of results, and where each result is in them. One process appends to a log, any process reads it.
#
# A killed writer loses nothing added. A power failure may lose the last second while tasks end, else the last half minute; a
# torn end costs the last result.

LOGS: Final = ".log"
SYNC: Final = 1.0
"""Seconds after which additions are flushed to the disk."""
_PIECE: Final = 1 << 20
"""Bytes that are read at once."""
_NAME: Final = re.compile(rf"[0-9]{{6,12}}-[0-9a-f]{{{2 * RANDOM}}}{re.escape(LOGS)}")
"""Names made by `later`: other files with this ending belong to somebody else."""


class OpenFile:
    """Open file that closes with its last user."""

    def __init__(self, path: Path, flags: int = os.O_RDONLY) -> None:
        """Raises OSError."""
        self.number: Final = open_regular(path, flags)
        weakref.finalize(self, os.close, self.number)


class LogWriter:
    """The one writer of a log, which begins with the first thing that is added."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._file: OpenFile | None = None
        self._process = 0
        self._synced = 0.0

    def add(self, entry: bytes) -> None:
        """Add an entry, whole or not at all. Raises OSError."""
        file = self._open_log().number
        state = os.fstat(file)
        # To a file without a name bytes can be added as before; nobody would ever read them.
        if state.st_nlink == 0:
            raise FileNotFoundError(errno.ENOENT, "the log was removed")
        try:
            rest = memoryview(entry)
            while rest:
                # The system may write less than it is asked to.
                rest = rest[os.write(file, rest) :]
        except OSError:
            # A part of an entry would be damage as soon as the next one follows it.
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

    def _open_log(self) -> OpenFile:
        # A log has one writer: a forked process begins another one.
        if self._file is None or self._process != os.getpid():
            path = later(self._folder, f"{secrets.token_hex(RANDOM)}{LOGS}")
            flags = os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_EXCL
            self._file = OpenFile(path, flags)
            self._process, self._synced = os.getpid(), time.monotonic()
        return self._file


def later(folder: Path, name: str) -> Path:
    """Path of a log of this name that sorts after all existing ones: of two results the later one counts.

    The number that the name may begin with was its place in another folder.
    """
    numbers = (path.name.partition("-")[0] for path in list_logs(folder))
    number = 1 + max(map(int, numbers), default=0)
    return folder / f"{number:06d}-{name.rpartition('-')[2]}"


def is_name(name: str) -> bool:
    """True if this is the name of a log."""
    return _NAME.fullmatch(name) is not None


def list_logs(folder: Path) -> list[Path]:
    """Files named like logs, in order of creation."""
    return [path for path in files.matching(folder, f"*{LOGS}") if is_name(path.name)]


class LocatedEntry(NamedTuple):
    """An entry, and where its bytes are."""

    head: Head
    path: Path
    begin: int
    """Start of the entry, in bytes from the beginning of the file."""


class Fault(NamedTuple):
    """Damaged bytes in place of an entry."""

    begin: int
    end: int
    error: CorruptResultError


def scan(path: Path, begin: int = 0, whole: bool = True) -> Iterator[LocatedEntry | Fault]:
    """The entries of a log from here on, and the damaged parts between them. Raises OSError, ResultFormatError.

    A torn end comes last, as a Fault with a TornError: the writer may be at it. whole: numbers are checked, too, not
    only passed.
    """
    with os.fdopen(open_regular(path), "rb", _PIECE) as file, naming_file(path):
        file.seek(begin)
        length = os.fstat(file.fileno()).st_size
        while begin < length:
            try:
                head = read_head(file)
                if begin + head.length > length:
                    raise TornError("it ends too early")
                if whole:
                    require_whole(head, file.read(head.numbers))
                else:
                    file.seek(head.numbers, os.SEEK_CUR)
                yield LocatedEntry(head, path, begin)
                begin += head.length
            except CorruptResultError as error:
                # A log has one writer, hence one format: the first entry decides for all.
                if isinstance(error, ResultFormatError) and begin == 0:
                    raise
                end = _next(file, begin + ALIGNED)
                yield Fault(begin, end or length, _no_torn_end(error, end))
                if end is None:
                    return
                begin = end
                file.seek(begin)


def _no_torn_end(error: CorruptResultError, end: int | None) -> CorruptResultError:
    """Error for a torn end that has entries after it."""
    if end is not None and isinstance(error, TornError):
        return CorruptResultError(*error.args)
    return error


def _next(file: BinaryIO, begin: int) -> int | None:
    """Start of the next entry, at or after a position; None if there is none."""
    file.seek(begin)
    while piece := file.read(_PIECE):
        # Entries and pieces both begin at multiples of ALIGNED: no mark lies across two pieces.
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

    def __init__(self, folder: Path, whole: bool, notice: Callable[[str], None] = print_notice) -> None:
        """whole: numbers are checked when results are looked for, else only when they are read. notice: is called with damage."""
        self._folder, self._whole, self._notice = folder, whole, notice
        self._unread: dict[Path, list[Fault]] = {}
        self._seen: dict[Path, _Seen] = {}
        self._opened = lru_cache(_OPEN)(OpenFile)
        self._unusable = unusable_lines(folder)
        self.places: dict[str, LocatedEntry] = {}
        """Key -> where its result is, as far as was looked."""

    def look(self) -> None:
        """Read added results; damage is noted, except a torn end, which may still be written."""
        for path in self._paths():
            # A run that goes on meanwhile has mended the log.
            with suppress(FileNotFoundError):
                self._read_log_tail(path)

    def find(self, key: str) -> LocatedEntry | None:
        """Position of a task's result; None if no log holds it."""
        if key not in self.places:
            self.look()
        return self.places.get(key)

    def mend(self) -> None:
        """Read all logs and set damaged or unreadable parts aside; no other process may write. Raises OSError,
        ResultFormatError."""
        # All are read before any is changed: a log of another format is refused before that.
        for path, new in [(path, self._read_log_tail(path)) for path in self._paths()]:
            unread = {fault.begin: fault for fault in self._unread.pop(path, ())}
            if not (faults := [*unread.values(), *new]):
                continue
            aside = files.free_name(path)
            parts = [(fault.begin, fault.end) for fault in faults]
            _copy(path, aside, parts)
            if isinstance(faults[0].error, TornError):
                self._notice(f"{path}: its end was torn{AGAIN}")
                with os.fdopen(open_regular(path, os.O_WRONLY), "wb") as file:
                    file.truncate(faults[0].begin)
            else:
                faults.sort(key=lambda fault: fault.begin)
                ends = [0, *(fault.end for fault in faults)]
                length = path.stat().st_size
                begins = [*(fault.begin for fault in faults), length]
                _copy(path, path, zip(ends, begins, strict=True))
            self._notice(f"{aside}: what was cut out")

    def settle(self) -> None:
        """Sync added results to disk. Raises OSError."""
        for path in self._paths():
            files.sync(path)

    def read(self, place: LocatedEntry) -> TaskResult:
        """The result there. Raises CorruptResultError, FileNotFoundError."""
        head, path, begin = place
        end = begin + head.length
        numbers = os.pread(self._opened(path).number, head.numbers, end - head.numbers)
        try:
            require_whole(head, numbers)
            return unpack_result(head, numbers)
        except UnusableResultError as error:
            self.reject(head)
            fault = Fault(begin, end, error)
            raise UnusableResultError(_damage_text(path, fault)) from error
        except CorruptResultError as error:
            fault = Fault(begin, end, error)
            self._unread.setdefault(path, []).append(fault)
            self.places.pop(head.key, None)
            raise CorruptResultError(_damage_text(path, fault)) from error

    def reject(self, head: Head) -> None:
        """Have a result that this version cannot use count as not finished."""
        note_unusable(self._folder, head)
        self._unusable |= {path_line(head)}
        place = self.places.get(head.key)
        if place and place.head == head:
            del self.places[head.key]

    def is_rejected(self, head: Head) -> bool:
        """True if this version has found that it cannot use the result with this head."""
        return bool(self._unusable) and path_line(head) in self._unusable

    def set_aside_unusable(self, path: Path) -> None:
        """Give another name to a file with a result that this version cannot use, before it is written anew. Raises OSError."""
        if not os.path.lexists(path):
            return
        with suppress(CorruptResultError):
            head = check_file(path)
            try:
                read_entry(path)
                useful = not self.is_rejected(head)
            except UnusableResultError:
                useful = False
            if not useful:
                path.rename(files.free_name(path))

    def _paths(self) -> list[Path]:
        """Existing logs; other objects of such a name are reported once."""
        paths = list_logs(self._folder)
        strange = [path for path in paths if is_no_file(path)]
        for path in strange:
            self._notice(f"{path}: {files.NO_FILE}, so no log of results{AGAIN}")
        return [path for path in paths if path not in strange]

    def _read_log_tail(self, path: Path) -> list[Fault]:
        """Read the new part of a log, or all of a replaced one; returns damaged parts."""
        # Opened first: of an open file a network file system asks anew how long it is.
        with os.fdopen(open_regular(path), "rb") as file:
            state = os.fstat(file.fileno())
        unread = _Seen(0, state.st_ino, 0)
        seen = self._seen.get(path, unread)
        if (state.st_size, state.st_ino, state.st_mtime_ns) == seen:
            return []
        end, faults = seen.end, []
        # Exchanged, or changed without growing: it was mended, and nothing known of it holds any more.
        if state.st_ino != seen.inode or state.st_size <= seen.end:
            end = 0
            self.places = {key: place for key, place in self.places.items() if place.path != path}
            self._opened.cache_clear()
        for entry in scan(path, end, self._whole):
            if isinstance(entry, LocatedEntry):
                self._enter(entry)
                end = entry.begin + entry.head.length
                continue
            faults.append(entry)
            if not isinstance(entry.error, TornError):
                self._notice(f"{_damage_text(path, entry)}{AGAIN}")
                end = entry.end
        self._seen[path] = _Seen(end, state.st_ino, state.st_mtime_ns)
        return faults

    def _enter(self, place: LocatedEntry) -> None:
        """Enter a result. Of two results of the same task the later log counts, as the task was computed again."""
        if self.is_rejected(place.head):
            return
        if place.head.meta is UNKNOWN:
            end = place.begin + place.head.length
            fault = Fault(place.begin, end, UnusableResultError(NOT_OURS))
            self._notice(f"{_damage_text(place.path, fault)}{AGAIN}")
            self.reject(place.head)
            return
        earlier = self.places.get(place.head.key)
        if earlier is None or earlier.path <= place.path:
            self.places[place.head.key] = place


def _copy(path: Path, to: Path, parts: Iterable[tuple[int, int]]) -> None:
    """Write a whole file from parts of another one or of itself. parts: begin and end of each, in bytes."""
    with os.fdopen(open_regular(path), "rb") as file:
        files.write_whole(to, _pieces(file, parts))


def _pieces(file: BinaryIO, parts: Iterable[tuple[int, int]]) -> Iterator[bytes]:
    for begin, end in parts:
        file.seek(begin)
        yield file.read(end - begin)


def _damage_text(path: Path, fault: Fault) -> str:
    return f"{path}: bytes {fault.begin} to {fault.end} are no whole result ({fault.error})"
