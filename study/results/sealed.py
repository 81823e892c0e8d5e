"""How a result is written and read: every byte counts towards its seal, so that none can change without being found.

An archive is a zip file that ends with its checksum. A matrix that is mapped into memory lies bare beside a JSON text that has
its checksum and one of its own. Both say the key of their task.
"""

import io
import json
import os
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray


class CorruptResultError(Exception):
    """A file of results is not what was written."""


MAPPED: Final = "matrix"
"""The one array of a result that is mapped into memory instead of read."""
KEY: Final = "key"
_META = "meta.json"
_SEAL = "seal"
_CHECKSUM = "crc32"
_SEAL_LENGTH = 8
"""Hexadecimal digits of the checksum at the end of an archive, which zip takes for a comment."""


Content = tuple[dict[str, Any], dict[str, NDArray[Any]]]
"""What a result says of itself, and its arrays."""


def archived(meta: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> bytes:
    """A result as an archive, sealed."""
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


def described(meta: Mapping[str, Any], matrix: bytes) -> bytes:
    """What a mapped result says of itself, its matrix's checksum with it, sealed."""
    whole = {**meta, _CHECKSUM: zlib.crc32(matrix)}
    return _json({**whole, _SEAL: zlib.crc32(_json(whole))})


def read(folder: Path, key: str) -> Content:
    """A result; its arrays are read-only. Raises CorruptResultError, FileNotFoundError."""
    mapped = folder / f"{key}.json"
    return _read_mapped(mapped) if mapped.is_file() else _read_archive(folder / f"{key}.npz")


def checked(path: Path) -> dict[str, Any]:
    """What a result says of itself. Raises CorruptResultError unless every byte is as it was written."""
    return _check_archive(path) if path.suffix == ".npz" else _check_mapped(path)


def stamp(path: Path) -> object:
    """What changes with a result's files. Raises FileNotFoundError."""
    files = [path] if path.suffix == ".npz" else [path, path.with_suffix(".npy")]
    states = [each.lstat() for each in files if each is path or os.path.lexists(each)]
    return [(state.st_mtime_ns, state.st_size, state.st_ino) for state in states]


def _seal(content: bytes) -> bytes:
    return b"%08x" % zlib.crc32(content)


def _content(path: Path) -> bytes:
    """The bytes of a file. Raises FileNotFoundError, CorruptResultError where it is a folder, a pipe, a link to nothing."""
    if not path.is_file() and (path.exists() or path.is_symlink()):
        raise CorruptResultError(f"{path}: not a whole result (no regular file)")
    return path.read_bytes()


def _read_mapped(path: Path) -> Content:
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
    if meta[KEY] != path.stem:
        raise CorruptResultError(f"{path}: the result of another task, {meta[KEY]}")
    return meta


_CHANGED = "its bytes are not those that were written"


def _read_archive(path: Path) -> Content:
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


def _check_mapped(path: Path) -> dict[str, Any]:
    meta, matrix = _meta_of_mapped(path), path.with_suffix(".npy")
    try:
        sound = zlib.crc32(_content(matrix)) == meta[_CHECKSUM]
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


def _json(meta: Mapping[str, Any]) -> bytes:
    return json.dumps(meta, sort_keys=True, default=lambda number: number.item()).encode()
