"""Results on disk: one file per finished task, whole or not there at all. The only writer of results.

`results/<key>.npz` holds a result's arrays and, as JSON, its outcome and scalars. A compliance is `<key>.npy`, which
readers map into memory so that the ranks of a node hold one copy, and a `<key>.json` with its checksum. Both say their key and
are sealed: no bit of a file can change, and no two files can change places, without being found.
"""

import io
import itertools
import json
import os
import re
import socket
import sys
import threading
import time
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solver.outcome import Ending, Outcome
from study.origin import Origins, as_data, from_data, here
from study.plan import attempts
from study.plan.attempts import Attempt
from study.plan.tasks import TaskResult

FOLDER = "results"
MAPPED = "matrix"
"""The one array of a result that is mapped into memory instead of read."""
ABANDONED = 86_400.0
"""Seconds after which another host's scratch file is taken for a killed run's."""
_META = "meta.json"
_KEY = "key"
_SEAL = "seal"
_SEAL_LENGTH = 8
"""Hexadecimal digits of the checksum at the end of an archive, which zip takes for a comment."""
_ORIGINS = "origins"
_SCRATCH = ".scratch"
_SCRATCH_NAME = re.compile(rf"\..+\.([^.]+)\.(\d{{1,9}})\.\d+{re.escape(_SCRATCH)}")
"""As `written_whole` makes it: host and process of its writer. Other files that end so are somebody else's."""


class StoreError(Exception):
    """The folder of results cannot be used; the message says which and why."""


class CorruptResultError(Exception):
    """A file of results is not what was written."""


class Store:
    """The results of a campaign in DIR/results. Two processes that write one result write the same bytes: no harm."""

    def __init__(self, out: Path) -> None:
        self.folder = out / FOLDER
        self._out = out
        self._checked: dict[Path, tuple[object, dict[str, Any]]] = {}

    def prepare(self) -> None:
        """Make the folder, try that it can be written and clear away what killed runs left. Raises StoreError."""
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            _clear_away(self.folder)
            _clear_away(self.folder.parent)  # the dataset is written there
            with written_whole(self.folder / ".probe") as scratch:
                scratch.touch()
            (self.folder / ".probe").unlink(missing_ok=True)
        except OSError as error:
            raise StoreError(f"{self.folder}: cannot write results there: {error.strerror or error}") from None

    def finished(self) -> set[str]:
        """Keys of all results that are there and sound; an unsound file is named on stderr and not counted."""
        return set(self.inventory())

    def inventory(self) -> dict[str, Origins]:
        """The finished results, as `finished` counts them, and the software that each stems from."""
        return {key: from_data(meta.get(_ORIGINS, ())) for key, meta in self._sound()}

    def outcomes(self) -> dict[str, Outcome]:
        """How each task ended: the finished results, as `finished` counts them, and what failed."""
        failed = {key: attempt.outcome for key, attempt in self.failures().items()}
        return failed | {key: Outcome(Ending(meta["ending"]), meta["message"]) for key, meta in self._sound()}

    def failures(self) -> dict[str, Attempt]:
        """The last attempt of this software at every task that has failed for good; it may have a result since."""
        return attempts.final(self._out, here().name)

    def write(self, result: TaskResult) -> None:
        """Keep a result. Raises StoreError where the disk refuses."""
        meta = {
            _KEY: result.key,
            "kind": result.kind,
            "ending": result.outcome.ending.value,
            "message": result.outcome.message,
            "scalars": dict(result.scalars),
            _ORIGINS: as_data(result.origins),
        }
        try:
            if MAPPED in result.arrays:
                self._write_mapped(result, meta)
            else:
                with written_whole(self.folder / f"{result.key}.npz") as scratch:
                    scratch.write_bytes(_archive(meta, result.arrays))
        except OSError as error:
            raise StoreError(f"{self.folder}: cannot write {result.key}: {error.strerror or error}") from error

    def read(self, key: str) -> TaskResult:
        """A result; its arrays are read-only. Raises CorruptResultError, FileNotFoundError."""
        mapped = self.folder / f"{key}.json"
        meta, arrays = _read_mapped(mapped) if mapped.is_file() else _read_archive(self.folder / f"{key}.npz")
        outcome = Outcome(Ending(meta["ending"]), meta["message"])
        origins = from_data(meta.get(_ORIGINS, ()))
        return TaskResult(key, meta["kind"], outcome, meta["scalars"], arrays, origins)

    def find(self, key: str) -> TaskResult | None:
        """A result as `read` gives it; None where there is none, or an unsound one, which is named on stderr."""
        try:
            return self.read(key)
        except (FileNotFoundError, NotADirectoryError):
            return None
        except CorruptResultError as error:
            _say_unsound(error)
            return None

    def drop(self, key: str) -> None:
        """Remove a result that nothing needs any more. Raises StoreError."""
        path = self.folder / f"{key}.npz"
        try:
            path.unlink(missing_ok=True)
        except OSError as error:
            raise StoreError(f"{path}: cannot be removed: {error.strerror or error}") from error

    def _sound(self) -> Iterator[tuple[str, dict[str, Any]]]:
        """Key and meta data of every sound result. A file that has not changed since the last time is not checked again."""
        for path in sorted(self.folder.glob("*.npz")) + sorted(self.folder.glob("*.json")):
            try:
                stamp = _stamp(path)
                if path not in self._checked or self._checked[path][0] != stamp:
                    self._checked[path] = stamp, _check(path)
                yield path.stem, self._checked[path][1]
            except CorruptResultError as error:
                _say_unsound(error)
            except FileNotFoundError:
                continue  # a run that goes on meanwhile has dropped it

    def _write_mapped(self, result: TaskResult, meta: dict[str, Any]) -> None:
        matrix = self.folder / f"{result.key}.npy"
        with written_whole(matrix) as scratch:
            with scratch.open("wb") as file:
                np.save(file, result.arrays[MAPPED], allow_pickle=False)
            meta["crc32"] = zlib.crc32(scratch.read_bytes())
        meta[_SEAL] = zlib.crc32(_json(meta))
        with written_whole(matrix.with_suffix(".json")) as scratch:
            scratch.write_bytes(_json(meta))


@contextmanager
def written_whole(path: Path) -> Iterator[Path]:
    """Yield a scratch name beside `path` to write to, then put it in its place: readers see the old or the new, whole.

    The mode is what the umask leaves of 0666, as for any file others shall read.
    """
    scratch = path.with_name(f".{path.name}.{_host()}.{os.getpid()}.{threading.get_ident()}{_SCRATCH}")
    try:
        yield scratch
        with scratch.open("rb") as file:
            os.fsync(file.fileno())
        if path.is_dir() and not path.is_symlink():
            path.rename(_free_name(path))  # nothing of it is lost
        os.replace(scratch, path)
    finally:
        scratch.unlink(missing_ok=True)


def _host() -> str:
    return socket.gethostname().replace(".", "-")


def _clear_away(folder: Path) -> None:
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
    try:
        os.kill(int(process), 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return not _is_zombie(int(process))


def _is_zombie(process: int) -> bool:
    """Whether a process is a zombie (exited, not yet reaped): containers often have no init that reaps."""
    try:
        fields = Path(f"/proc/{process}/stat").read_text()
    except OSError:
        return False  # no such file system here, or gone meanwhile: the next run clears away
    return fields.rpartition(")")[2].split()[0] == "Z"


def _free_name(path: Path) -> Path:
    """A name beside it that nothing has."""
    names = (path.with_name(f"{path.name}.set-aside-{number}") for number in itertools.count(1))
    return next(name for name in names if not name.exists())


def _archive(meta: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> bytes:
    # Entries carry zipfile's fixed date, not the clock: the same result is the same bytes.
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_STORED) as archive:
        archive.comment = bytes(_SEAL_LENGTH)
        archive.writestr(zipfile.ZipInfo(_META), _json(meta))
        for name, array in arrays.items():
            with archive.open(zipfile.ZipInfo(f"{name}.npy"), "w", force_zip64=True) as entry:
                np.lib.format.write_array(entry, np.asanyarray(array), allow_pickle=False)
    content = buffer.getvalue()[:-_SEAL_LENGTH]
    return content + _seal(content)


def _seal(content: bytes) -> bytes:
    return b"%08x" % zlib.crc32(content)


def _content(path: Path) -> bytes:
    """The bytes of a file. Raises FileNotFoundError, CorruptResultError where it is a folder, a pipe, a link to nothing."""
    if not path.is_file() and (path.exists() or path.is_symlink()):
        raise CorruptResultError(f"{path}: not a whole result (no regular file)")
    return path.read_bytes()


def _read_mapped(path: Path) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    meta, matrix = _meta_of_mapped(path), path.with_suffix(".npy")
    try:
        if not matrix.is_file():
            raise ValueError("no matrix beside it")
        return meta, {MAPPED: np.asarray(np.load(matrix, mmap_mode="r", allow_pickle=False))}
    except (ValueError, EOFError) as error:
        raise CorruptResultError(f"{path}: not a whole result ({error})") from error


def _meta_of_mapped(path: Path) -> dict[str, Any]:
    content = _content(path)
    try:
        meta: dict[str, Any] = json.loads(content)
        seal = meta.pop(_SEAL)
        if seal != zlib.crc32(_json(meta)) or content != _json({**meta, _SEAL: seal}):
            raise ValueError(_CHANGED)
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise CorruptResultError(f"{path}: not a whole result ({error})") from error
    return _of_its_name(path, meta)


def _of_its_name(path: Path, meta: dict[str, Any]) -> dict[str, Any]:
    if meta[_KEY] != path.stem:
        raise CorruptResultError(f"{path}: the result of another task, {meta[_KEY]}")
    return meta


_CHANGED = "its bytes are not those that were written"


def _read_archive(path: Path) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    arrays = {}
    try:
        with _opened(path) as archive:
            meta = json.loads(archive.read(_META))
            for name in archive.namelist():
                if name != _META:
                    array = np.lib.format.read_array(io.BytesIO(archive.read(name)), allow_pickle=False)
                    array.flags.writeable = False
                    arrays[name.removesuffix(".npy")] = array
    except (zipfile.BadZipFile, KeyError, ValueError, EOFError) as error:
        raise CorruptResultError(f"{path}: not a whole result ({error})") from error
    return _of_its_name(path, meta), arrays


def _opened(path: Path) -> zipfile.ZipFile:
    """An archive whose every byte is as it was written. Raises ValueError, zipfile.BadZipFile where it is not."""
    content = _content(path)
    if _seal(content[:-_SEAL_LENGTH]) != content[-_SEAL_LENGTH:]:
        raise ValueError(_CHANGED)
    return zipfile.ZipFile(io.BytesIO(content))


def _stamp(path: Path) -> object:
    """What changes with a result's files. Raises FileNotFoundError."""
    files = [path] if path.suffix == ".npz" else [path, path.with_suffix(".npy")]
    states = [each.lstat() for each in files if each is path or os.path.lexists(each)]
    return [(state.st_mtime_ns, state.st_size, state.st_ino) for state in states]


def _check(path: Path) -> dict[str, Any]:
    """What a result says of itself. Raises CorruptResultError unless every byte is as it was written."""
    if path.suffix == ".npz":
        return _check_archive(path)
    meta, matrix = _meta_of_mapped(path), path.with_suffix(".npy")
    try:
        sound = zlib.crc32(_content(matrix)) == meta["crc32"]
    except FileNotFoundError as error:
        raise CorruptResultError(f"{path}: not a whole result ({error})") from error
    if not sound:
        raise CorruptResultError(f"{matrix}: not a whole result ({_CHANGED})")
    return meta


def _check_archive(path: Path) -> dict[str, Any]:
    try:
        with _opened(path) as archive:
            meta: dict[str, Any] = json.loads(archive.read(_META))
    except (zipfile.BadZipFile, KeyError, ValueError, EOFError) as error:
        raise CorruptResultError(f"{path}: not a whole result ({error})") from error
    return _of_its_name(path, meta)


def _say_unsound(error: CorruptResultError) -> None:
    sys.stderr.write(f"{error}; it will be computed again\n")


def _json(meta: Mapping[str, Any]) -> bytes:
    return json.dumps(meta, sort_keys=True, default=lambda number: number.item()).encode()
