"""A result as bytes, in a log or in a file of its own; files that appear whole or not at all.

An entry is a head, the description of the result (JSON), a table of its numbers (JSON) and its arrays as they lie in memory,
each part filled up to a multiple of ALIGNED bytes. A checksum of all of them finds every change.
"""

import errno
import itertools
import json
import os
import re
import secrets
import socket
import struct
import time
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import Any, BinaryIO, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.outcome import Ending, Outcome
from nanoslip.study.origin import Origins, as_data, from_data
from nanoslip.study.plan.task import TaskResult

# Files of results: those of lines that several processes add to, and those that appear whole or not at all.

NO_FILE: Final = "no regular file"


def add(path: Path, lines: bytes) -> None:
    """Write whole lines behind the others, and on a line of their own where the last one was cut short. Raises OSError."""
    if is_no_file(path):
        raise OSError(errno.EINVAL, NO_FILE)
    with path.open("ab+") as file:
        torn = file.tell() > 0 and file.seek(-1, os.SEEK_END) and file.read(1) != b"\n"
        file.write(b"\n" * bool(torn) + lines)


def read(path: Path) -> list[str]:
    """All lines that are there; none where nothing is that can be read."""
    try:
        return path.read_text("utf-8", errors="replace").splitlines() if path.is_file() else []
    except OSError:
        return []


def is_no_file(path: Path) -> bool:
    """Whether something else stands in the place of a file: a folder, a link to nothing, a pipe or device that never ends."""
    return os.path.lexists(path) and not path.is_file()


# Files that appear whole or not at all, and what killed writers leave of them.

ABANDONED = 86_400.0
"""Seconds after which another host's scratch file is taken for a killed run's."""
_SCRATCH = ".scratch"
_SCRATCH_NAME = re.compile(rf"\..+\.([^.]+)\.(\d{{1,9}})\.[0-9a-f]+{re.escape(_SCRATCH)}")
"""As `scratch_beside` makes it: host and process of its writer. Other files that end so are somebody else's."""
_RANDOM = 8
"""Bytes of a name that nobody else draws."""


@contextmanager
def written_whole(path: Path) -> Iterator[Path]:
    """Yield a scratch file beside `path` to write to, then put it in its place: readers see the old or the new, whole.

    The mode is what the umask leaves of 0666, as for any file others shall read.
    """
    scratch = scratch_beside(path)
    try:
        yield scratch
        with scratch.open("rb") as file:
            os.fsync(file.fileno())
        if path.is_dir() and not path.is_symlink():
            path.rename(free_name(path))  # nothing of it is lost
        os.replace(scratch, path)
    finally:
        scratch.unlink(missing_ok=True)


def scratch_beside(path: Path) -> Path:
    """Make an empty file beside `path`, to be written; `clear_away` removes what a killed process leaves. Raises OSError.

    Nobody can have put a link there: its name is drawn at random, and a name that is there is refused.
    """
    scratch = path.with_name(f".{path.name}.{_host()}.{os.getpid()}.{secrets.token_hex(_RANDOM)}{_SCRATCH}")
    os.close(os.open(scratch, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC, 0o666))
    return scratch


def _host() -> str:
    return socket.gethostname().replace(".", "-")


def clear_away(folder: Path) -> None:
    """Remove the scratch files of processes that have ended."""
    for leftover in folder.glob(f".*{_SCRATCH}"):
        named = _SCRATCH_NAME.fullmatch(leftover.name)
        if named and not _writer_lives(leftover, *named.groups()):
            leftover.unlink(missing_ok=True)


def _writer_lives(scratch: Path, host: str, process: str) -> bool:
    """Whether the process that writes this scratch file may still be at it."""
    if host != _host():
        try:
            return time.time() - scratch.stat().st_mtime < ABANDONED
        except FileNotFoundError:
            return True  # it was, until just now
    return lives(int(process))


def lives(process: int) -> bool:
    """Whether a process of this machine has not ended."""
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        return True
    return not _is_zombie(process)


def _is_zombie(process: int) -> bool:
    """Whether a process is a zombie (exited, not yet reaped): containers often have no init that reaps."""
    try:
        fields = Path(f"/proc/{process}/stat").read_text()
    except OSError:
        return False  # no such file system here, or gone meanwhile: the next run clears away
    return fields.rpartition(")")[2].split()[0] == "Z"


def free_name(path: Path) -> Path:
    """A name beside it that nothing has."""
    names = (path.with_name(f"{path.name}.set-aside-{number}") for number in itertools.count(1))
    return next(name for name in names if not os.path.lexists(name))


class CorruptResultError(Exception):
    """Bytes are not those of a result as it was written."""


class TornError(CorruptResultError):
    """There are fewer bytes than were written, or are to come."""


class OtherFormatError(CorruptResultError):
    """A result as another nanoslip writes it: no damage."""


FORMAT: Final = 1
MARK: Final = b"nslip %d\n" % FORMAT
"""How every entry begins."""
_ANY_MARK: Final = re.compile(rb"nslip (\d+)\n")
ALIGNED: Final = 64
"""Bytes: numbers of any type lie in memory as kernels want them."""
_HEAD: Final = struct.Struct("<8s20sIIQI")
"""Mark, key, length of what it says of itself, of its table, of table and arrays; checksum of table and arrays."""
_CHECKSUM: Final = struct.Struct("<I")
"""Of the head and what the result says of itself."""
LEAST: Final = _HEAD.size + _CHECKSUM.size


class Meta(NamedTuple):
    """Head of a result, without its numbers."""

    kind: str
    outcome: Outcome
    origins: Origins


class Head(NamedTuple):
    """The beginning of an entry."""

    key: str
    meta: Meta
    table: int
    """Bytes of the table."""
    numbers: int
    """Bytes of table and arrays."""
    checksum: int
    """Of the numbers."""
    seal: int
    """Of the head itself, and so of all that the result says."""
    length: int
    """Bytes of the whole entry."""


def packed(result: TaskResult) -> bytes:
    """A result as an entry; the same result is the same bytes. Raises ValueError where its key is none."""
    key = result.key.encode("ascii")
    if len(key) != _KEY:
        raise ValueError(f"{result.key!r}: no key of a result; needs {_KEY} letters")
    arrays = {name: np.asanyarray(array) for name, array in result.arrays.items()}
    if any(array.dtype.hasobject for array in arrays.values()):
        raise ValueError(f"{result.key}: an array of objects; needs numbers or texts")
    rows = [(name, array.dtype.str, array.shape, _fortran(array)) for name, array in arrays.items()]
    members = [(each.ending.value, each.message) for each in result.members]
    table = _filled(_json({"scalars": dict(result.scalars), "arrays": rows, "members": members}), b" ")
    body = b"".join((table, *(_filled(array.tobytes("A"), b"\0") for array in arrays.values())))
    meta = _said(result.kind, result.outcome, result.origins)
    head = _HEAD.pack(MARK, key, len(meta), len(table), len(body), zlib.crc32(body))
    return b"".join((head, _CHECKSUM.pack(zlib.crc32(meta, zlib.crc32(head))), meta, body))


@lru_cache(maxsize=256)  # most results say the same of themselves
def _said(kind: str, outcome: Outcome, origins: Origins) -> bytes:
    ending = {"ending": outcome.ending.value, "message": outcome.message}
    return _filled(_json({"kind": kind, **ending, "origins": as_data(origins)}), b" ", LEAST)


def read_head(file: BinaryIO) -> Head:
    """The head of the entry that begins here; the file stands behind it then.

    Raises TornError, OtherFormatError, CorruptResultError.
    """
    begin = file.read(LEAST)
    if (other := _ANY_MARK.match(begin)) and not begin.startswith(MARK) and not _ours_but_for_its_mark(begin, file):
        number = other[1].decode()
        raise OtherFormatError(f"has format {number}, of another nanoslip; this one reads format {FORMAT}")
    if len(begin) < LEAST:
        raise TornError("it ends too early")
    mark, key, meta_length, table, numbers, checksum = _HEAD.unpack_from(begin)
    if mark != MARK or meta_length > _MOST:
        raise CorruptResultError("no result begins there")
    meta = file.read(meta_length)
    (seal,) = _CHECKSUM.unpack_from(begin, _HEAD.size)
    if seal != zlib.crc32(meta, zlib.crc32(begin[: _HEAD.size])):  # a length that was damaged leads anywhere
        raise (TornError if len(meta) < meta_length else CorruptResultError)(CHANGED)
    try:
        return Head(key.decode("ascii"), _meta(meta), table, numbers, checksum, seal, LEAST + meta_length + numbers)
    except _NO_RESULT:
        raise CorruptResultError(NOT_OURS) from None


def _ours_but_for_its_mark(begin: bytes, file: BinaryIO) -> bool:
    """Whether only the format number of a head is damaged: all other bytes agree with the checksum."""
    if len(begin) < LEAST:
        return False
    meta_length = _HEAD.unpack_from(begin)[2]
    meta = file.read(min(meta_length, _MOST))
    file.seek(-len(meta), os.SEEK_CUR)
    (seal,) = _CHECKSUM.unpack_from(begin, _HEAD.size)
    return bool(seal == zlib.crc32(meta, zlib.crc32(MARK + begin[len(MARK) : _HEAD.size])))


def check(head: Head, numbers: Any) -> None:
    """Raises TornError, CorruptResultError unless these are the numbers of the entry with this head, in any buffer."""
    if len(numbers) < head.numbers:
        raise TornError("it ends too early")
    if zlib.crc32(numbers) != head.checksum:
        raise CorruptResultError(CHANGED)


def result_of(head: Head, numbers: Any) -> TaskResult:
    """The result whose entry has this head and these numbers (a buffer that nobody writes to). Its arrays are read-only.

    Raises CorruptResultError.
    """
    try:
        table = json.loads(str(numbers[: head.table], "ascii"))
        arrays = dict(_arrays(table["arrays"], numbers, head.table))
        members = tuple([Outcome(Ending(ending), message) for ending, message in table["members"]])
    except _NO_RESULT:
        raise CorruptResultError(NOT_OURS) from None
    return TaskResult(head.key, head.meta.kind, head.meta.outcome, table["scalars"], arrays, members, head.meta.origins)


def _arrays(rows: list[Any], numbers: Any, at: int) -> Iterator[tuple[str, NDArray[Any]]]:
    for name, kind, shape, fortran in rows:
        dtype = np.dtype(kind)
        count = int(np.prod(shape))
        found = np.frombuffer(numbers, dtype, count, at) if count else np.empty(0, dtype)
        found.flags.writeable = False
        yield name, found.reshape(shape, order="F" if fortran else "C")
        at += _rounded(count * dtype.itemsize)


@lru_cache(maxsize=1024)  # most results say the same of themselves
def _meta(text: bytes) -> Meta:
    found = json.loads(text)
    return Meta(found["kind"], Outcome(Ending(found["ending"]), found["message"]), from_data(found["origins"]))


def _fortran(array: NDArray[Any]) -> bool:
    """Whether its columns lie in one piece, not its rows: sums that BLAS makes of it depend on that."""
    return array.flags.f_contiguous and not array.flags.c_contiguous


def _json(content: object) -> bytes:
    return _ENCODER.encode(content).encode()


def _filled(content: bytes, filling: bytes, before: int = 0) -> bytes:
    return content + filling * (_rounded(before + len(content)) - before - len(content))


def _rounded(length: int) -> int:
    return -(-length // ALIGNED) * ALIGNED


_ENCODER: Final = json.JSONEncoder(sort_keys=True, default=lambda number: number.item())
_KEY: Final = 20
_MOST: Final = 1 << 20
"""Bytes that a result says of itself: more are damage."""
CHANGED: Final = "its bytes are not those that were written"
NOT_OURS: Final = "its checksums are right, its content is no result's"
_NO_RESULT: Final = (ValueError, LookupError, TypeError, AttributeError, ArithmeticError, RecursionError)
"""Raised by content that is no result's."""


# A result in a file of its own, `<key>.result`, that appears whole: tasks which read it find it without looking.

ENDING: Final = ".result"
MAPPED: Final = 1 << 20
"""Bytes of numbers from which a file is mapped into memory instead of read: the ranks of a node hold one copy."""


def path_of(folder: Path, key: str) -> Path:
    """Where the file of a result is."""
    return folder / f"{key}{ENDING}"


def write(path: Path, content: bytes) -> None:
    """Put content there, whole or not at all. Raises OSError."""
    with written_whole(path) as scratch:
        scratch.write_bytes(content)


def read_entry(path: Path) -> TaskResult:
    """The result of a file; where it is mapped, its numbers are not checked. Raises CorruptResultError, FileNotFoundError."""
    with _opened(path) as file, _named(path):
        head = _head(path, file)
        if head.numbers < MAPPED:
            return result_of(head, _numbers(head, file))
        begin = file.tell()
        return result_of(head, np.asarray(np.memmap(path, np.uint8, "r", begin, head.numbers)))


def checked(path: Path) -> Head:
    """The head of a file. Raises CorruptResultError unless every byte is as it was written, FileNotFoundError."""
    with _opened(path) as file, _named(path):
        head = _head(path, file)
        _numbers(head, file)
    return head


def stamp(path: Path) -> object:
    """Size, times and number of a file, which change with it. Raises FileNotFoundError."""
    state = path.lstat()
    return state.st_mtime_ns, state.st_size, state.st_ino


def _opened(path: Path) -> BinaryIO:
    """Raises FileNotFoundError, CorruptResultError where it is a folder, a pipe, a link to nothing."""
    if not path.is_file() and os.path.lexists(path):
        raise CorruptResultError(f"{path}: not a whole result (no regular file)")
    return path.open("rb")


@contextmanager
def _named(path: Path) -> Iterator[None]:
    """Name the file whose bytes are no result's."""
    try:
        yield
    except OtherFormatError as error:
        raise OtherFormatError(f"{path}: {error}") from error
    except CorruptResultError as error:
        raise CorruptResultError(f"{path}: not a whole result ({error})") from error


def _head(path: Path, file: BinaryIO) -> Head:
    head = read_head(file)
    if head.length != os.fstat(file.fileno()).st_size:
        raise CorruptResultError("it has another length than was written")
    if head.key != path.stem:
        raise CorruptResultError(f"the result of another task, {head.key}")
    return head


def _numbers(head: Head, file: BinaryIO) -> Any:
    numbers = file.read(head.numbers)
    check(head, numbers)
    return numbers
