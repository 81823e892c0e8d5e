"""Compile kernels and keep them on disk; the only place that loads numba, and is loaded when a kernel is called.

Numba's own disk cache watches one file. Kernels call each other across files, so here a change recompiles every
kernel that may call the changed code: the kernels of its folder, and of folders that import from it.
"""

import hashlib
import os
import re
import stat
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache, partial
from pathlib import Path
from pickle import UnpicklingError
from typing import Any, Final

from numba import njit
from numba.core import event
from numba.core.caching import CompileResultCacheImpl, FunctionCache
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler

__all__ = ["find_dispatcher", "listening", "source_stamp"]

KERNEL_FILES: Final = ("arrays.py", "compiled.py", "compiling.py", "*/kernels/*.py")
"""Files of kernels, of all that kernels import from this package, and of their compilation; relative to the package."""
_PACKAGE = Path(__file__).parent
_IMPORTED: Final = re.compile(r"^from nanoslip\.solver\.(\w+)\.kernels", re.MULTILINE)


def find_dispatcher(function: Callable[..., object], allocates: bool, options: dict[str, Any]) -> Any:
    """Numba's dispatcher of a kernel, which counts references to arrays if it allocates some.

    If no cache folder can be written or read, every process compiles for itself.
    """
    internal = options["no_cpython_wrapper"]
    compiler = _PartCompiler if internal else Compiler
    # Without the interpreter's lock: a thread that reports progress goes on while a kernel runs.
    dispatcher: Any = njit(**{"nogil": True, "_nrt": allocates, **options}, pipeline_class=compiler)(function)
    if dispatcher is function:
        raise RuntimeError("NUMBA_DISABLE_JIT: needs to be unset, as kernels work on numba's records")
    with suppress(RuntimeError, OSError):  # no folder to keep it in, or no files to watch
        dispatcher._cache = _KernelCache(function, internal)  # what njit(cache=True) does, with a cache of our own
    return dispatcher


@cache
def source_stamp(folder: Path) -> str:
    """Hash of all kernel files that kernels of a folder may call, at the first call in this process."""
    stamp = hashlib.sha256()
    for path in kernel_imports(folder):
        content = path.read_bytes()
        # With its length, so that no text could move from one file to the next unseen.
        stamp.update(f"{path.relative_to(_PACKAGE)} {len(content)} ".encode())
        stamp.update(content)
    return stamp.hexdigest()


def kernel_imports(folder: Path) -> list[Path]:
    """The kernel files of a folder and of all from which they import, and what compiles them; all files for another folder."""
    every = sorted(path for files in KERNEL_FILES for path in _PACKAGE.glob(files))
    folders, new = set[Path](), {folder}
    # Until no import leads to another folder: what a kernel calls may itself call further.
    while new:
        folders |= new
        text = "\n".join(path.read_text("utf-8") for path in every if path.parent in new)
        new = {_PACKAGE / name / "kernels" for name in _IMPORTED.findall(text)} - folders
    return (
        [path for path in every if path.parent in {*folders, _PACKAGE}] if folder.parent.parent == _PACKAGE else every
    )


@contextmanager
def listening(tell: Callable[[], object]) -> Iterator[None]:
    """Call `tell`, inside this context, when a kernel begins to be compiled; not for a kernel cached on disk."""
    listener = _Starts(tell)
    event.register("numba:compile", listener)
    try:
        yield
    finally:
        event.unregister("numba:compile", listener)


class _Starts(event.Listener):
    """Calls a function at the start of every event."""

    def __init__(self, tell: Callable[[], object]) -> None:
        self._tell = tell

    def on_start(self, event: object) -> None:
        """Report the start."""
        self._tell()

    def on_end(self, event: object) -> None:
        """Report no end."""


class _StampedResults(CompileResultCacheImpl):
    """Compiled functions on disk, valid for the `source_stamp` of their folder."""

    def __init__(self, function: Callable[..., object]) -> None:
        source = Path(function.__code__.co_filename)
        with private_folders():
            super().__init__(function)
        require_own_folder(Path(self.locator.get_cache_path()), source)
        self.locator.get_source_stamp = partial(source_stamp, source.parent)


# The folder of compiled kernels. Numba unpickles every file in it: whoever can write there can run code as its reader.

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


# The cache of kernels in that folder.

_CUT: Final = (EOFError, UnpicklingError)
"""Errors of a file of which a part was kept."""


class _KernelCache(FunctionCache):
    """Numba's cache of a function; an unreadable disk or a truncated file counts as an empty cache."""

    _impl_class = _StampedResults

    def __init__(self, function: Callable[..., object], internal: bool) -> None:
        """internal: whether kernels alone call it; a test may compile the same function for Python."""
        super().__init__(function)
        self._internal = internal

    def _index_key(self, sig: object, codegen: object) -> tuple[object, ...]:
        # Internal code is bitcode without wrappers: Python cannot call what a kernel has cached.
        return *super()._index_key(sig, codegen), self._internal

    def load_overload(self, sig: object, target_context: object) -> object:
        """The compiled function for these argument types, None if there is none."""
        with suppress(OSError):
            try:
                return super().load_overload(sig, target_context)
            except (ImportError, AttributeError, *_CUT):  # of older sources, whose types had other names, or a part
                self.flush()
        return None

    def save_overload(self, sig: object, data: object) -> None:
        """Keep a compiled function, if that is possible."""
        with suppress(OSError, *_CUT):
            super().save_overload(sig, data)


class _Part(JITCodeLibrary):
    """Code of a kernel that only kernels call: LLVM optimizes and translates it only as a part of the kernels that
    Python calls.

    Numba by itself would optimize and translate each kernel together with all kernels that it calls.
    """

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        # Numba's own method would besides have LLVM translate the code to the machine's.
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """None, as there is no machine code."""
        return 0

    @property
    def codegen(self) -> "_Part":
        """Owner of the variables of machine code, of which there is none."""
        return self

    def set_env(self, name: str, environment: object) -> None:
        """Set none."""

    def serialize_using_object_code(self) -> object:
        """Code as LLVM has it, for kernels that call it and are compiled later."""
        return self.serialize_using_bitcode()


class _PartCompiler(Compiler):
    """Numba's compiler of a `_Part`."""

    def __init__(self, typing: Any, target: Any, library: object, *how: Any) -> None:
        super().__init__(typing, target, library or _Part(target.codegen(), "part"), *how)
