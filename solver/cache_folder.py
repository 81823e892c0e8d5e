"""Folder of compiled kernels. Numba unpickles every file in it: whoever can write there can run code as its
reader."""

import os
import stat
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Final

OTHERS_MAY_WRITE: Final = stat.S_IWGRP | stat.S_IWOTH


class UnsafeFolderError(OSError):
    """Refusal of a folder that another user owns, or may write."""


def require_own_folder(folder: Path, source: Path) -> None:
    """Raise UnsafeFolderError, and warn once, unless only this user, or the administrator, can write to a cache folder.

    source: file of the kernel. Beside it, in `__pycache__`, Python itself loads code: who writes there needs no kernel.
    """
    if folder == source.parent / "__pycache__":
        return
    # Whoever owns the folder above could put another one in its place.
    for place in (folder, folder.parent):
        problem = _problem(place)
        if problem:
            _warn(f"{place}: compiled kernels are neither kept nor read there: {problem}")
            raise UnsafeFolderError(f"{place}: {problem}")


def _problem(folder: Path) -> str:
    """Reason why others can write to a folder, with the way out; empty if they cannot."""
    state = folder.stat()
    if state.st_uid not in (os.geteuid(), 0):
        return "it belongs to another user; set NUMBA_CACHE_DIR to a folder of your own"
    # With the sticky bit, as in the shared temporary folder, others may add names, and change none of ours.
    if state.st_mode & OTHERS_MAY_WRITE and not state.st_mode & stat.S_ISVTX:
        return f"others may write to it; chmod go-w {folder}"
    return ""


@cache
def _warn(text: str) -> None:
    warnings.warn(text, RuntimeWarning, stacklevel=2)


@contextmanager
def private_folders() -> Iterator[None]:
    """Have folders that are made in this context writable to their owner alone, whatever the umask."""
    before = os.umask(0o022)
    os.umask(before | OTHERS_MAY_WRITE)
    try:
        yield
    finally:
        os.umask(before)
