"""A result in a file of its own, `<key>.result`, that appears whole: tasks which read it find it without looking."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO, Final

import numpy as np

from study.plan.task import TaskResult
from study.results.entry import CorruptResultError, Head, OtherFormatError, check, read_head, result_of
from study.results.whole_file import written_whole

ENDING: Final = ".result"
MAPPED: Final = 1 << 20
"""Bytes of numbers from which a file is mapped into memory instead of read: the ranks of a node hold one copy."""


def path_of(folder: Path, key: str) -> Path:
    """Where the file of a result is."""
    return folder / f"{key}{ENDING}"


def write(path: Path, entry: bytes) -> None:
    """Put an entry there, whole or not at all. Raises OSError."""
    with written_whole(path) as scratch:
        scratch.write_bytes(entry)


def read(path: Path) -> TaskResult:
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
    """What changes with a file. Raises FileNotFoundError."""
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
