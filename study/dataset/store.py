"""Results on disk: one file per finished task, whole or not there at all. The only writer of results.

`results/<key>.npz` holds a result's arrays and, as JSON, its outcome and scalars. A compliance is `<key>.npy`, which
readers map into memory so that the ranks of a node hold one copy, sealed by a `<key>.json` with its checksum.
"""

import io
import json
import os
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
_ORIGINS = "origins"
_SCRATCH = ".scratch"


class StoreError(Exception):
    """The folder of results cannot be used; the message says which and why."""


class CorruptResultError(Exception):
    """A file of results is not what was written."""


class Store:
    """The results of a campaign in DIR/results. Two processes that write one result write the same bytes: no harm."""

    def __init__(self, out: Path) -> None:
        self.folder = out / FOLDER
        self._out = out
        self._checked: dict[Path, tuple[tuple[int, int], dict[str, Any]]] = {}

    def prepare(self) -> None:
        """Make the folder, try that it can be written and clear away what killed runs left. Raises StoreError."""
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            for leftover in self.folder.glob(f".*{_SCRATCH}"):
                if not _writer_lives(leftover):
                    leftover.unlink(missing_ok=True)
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
                    _write_archive(scratch, meta, result.arrays)
        except OSError as error:
            raise StoreError(f"{self.folder}: cannot write {result.key}: {error.strerror or error}") from error

    def read(self, key: str) -> TaskResult:
        """A result; its arrays are read-only. Raises CorruptResultError, FileNotFoundError."""
        mapped = self.folder / f"{key}.json"
        meta, arrays = _read_mapped(mapped) if mapped.exists() else _read_archive(self.folder / f"{key}.npz")
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
                state = path.stat()
                stamp = (state.st_mtime_ns, state.st_size)
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
        os.replace(scratch, path)
    finally:
        scratch.unlink(missing_ok=True)


def _host() -> str:
    return socket.gethostname().replace(".", "-")


def _writer_lives(scratch: Path) -> bool:
    """Whether the process that writes this scratch file may still be at it."""
    host, process = scratch.name.removesuffix(_SCRATCH).split(".")[-3:-1]
    if host != _host():
        return time.time() - scratch.stat().st_mtime < ABANDONED
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


def _write_archive(path: Path, meta: dict[str, Any], arrays: Mapping[str, NDArray[Any]]) -> None:
    # Entries carry zipfile's fixed date, not the clock: the same result is the same bytes.
    with zipfile.ZipFile(path, "w", zipfile.ZIP_STORED) as archive:
        archive.writestr(zipfile.ZipInfo(_META), _json(meta))
        for name, array in arrays.items():
            with archive.open(zipfile.ZipInfo(f"{name}.npy"), "w", force_zip64=True) as entry:
                np.lib.format.write_array(entry, np.asanyarray(array), allow_pickle=False)


def _read_mapped(path: Path) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    try:
        return json.loads(path.read_bytes()), {
            MAPPED: np.asarray(np.load(path.with_suffix(".npy"), mmap_mode="r", allow_pickle=False))
        }
    except (ValueError, EOFError) as error:
        raise CorruptResultError(f"{path}: not a whole result ({error})") from error


def _read_archive(path: Path) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    arrays = {}
    try:
        with zipfile.ZipFile(path) as archive:
            meta = json.loads(archive.read(_META))
            for name in archive.namelist():
                if name != _META:
                    array = np.lib.format.read_array(io.BytesIO(archive.read(name)), allow_pickle=False)
                    array.flags.writeable = False
                    arrays[name.removesuffix(".npy")] = array
    except (zipfile.BadZipFile, KeyError, ValueError, EOFError) as error:
        raise CorruptResultError(f"{path}: not a whole result ({error})") from error
    return meta, arrays


def _check(path: Path) -> dict[str, Any]:
    """What a result says of itself. Raises CorruptResultError unless every byte is as it was written."""
    if path.suffix == ".npz":
        return _check_archive(path)
    matrix = path.with_suffix(".npy")
    try:
        meta: dict[str, Any] = json.loads(path.read_bytes())
        sound = zlib.crc32(matrix.read_bytes()) == meta["crc32"]
    except (FileNotFoundError, ValueError, KeyError) as error:
        raise CorruptResultError(f"{path}: not a whole result ({error})") from error
    if not sound:
        raise CorruptResultError(f"{matrix}: not a whole result (its bytes are not those that were written)")
    return meta


def _check_archive(path: Path) -> dict[str, Any]:
    # Checksums alone: making arrays of the bytes as well takes twice as long.
    try:
        with zipfile.ZipFile(path) as archive:
            meta: dict[str, Any] = json.loads(archive.read(_META))
            damaged = archive.testzip()
    except (zipfile.BadZipFile, KeyError, ValueError, EOFError) as error:
        raise CorruptResultError(f"{path}: not a whole result ({error})") from error
    if damaged is not None:
        raise CorruptResultError(f"{path}: not a whole result (the bytes of {damaged} are not those that were written)")
    return meta


def _say_unsound(error: CorruptResultError) -> None:
    sys.stderr.write(f"{error}; it will be computed again\n")


def _json(meta: Mapping[str, Any]) -> bytes:
    return json.dumps(meta, sort_keys=True, default=lambda number: number.item()).encode()
