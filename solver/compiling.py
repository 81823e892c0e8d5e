"""Compile kernels and keep them on disk; the only place that loads numba, and is loaded when a kernel is called.

Numba's own disk cache watches one file. Kernels call each other across files, so here a change in any file compiles all afresh.
"""

import hashlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any, Final

from numba import njit
from numba.core import event
from numba.core.caching import CompileResultCacheImpl, FunctionCache

__all__ = ["dispatcher_of", "reporting_compilation", "source_stamp"]

KERNEL_FILES: Final = ("compiled.py", "compiling.py", "*/kernels/*.py")
"""What holds kernels, all that kernels import from this package, and what makes them: relative to the package."""
_PACKAGE = Path(__file__).parent


def dispatcher_of(function: Callable[..., object], allocates: bool, options: dict[str, Any]) -> Any:
    """Numba's dispatcher of a kernel, which counts references to arrays if it allocates some.

    Where no folder for what is compiled can be written or read, every process compiles for itself.
    """
    dispatcher: Any = njit(**{"nogil": True, "_nrt": allocates, **options})(function)
    with suppress(RuntimeError, OSError):  # no folder to keep it in, or no files to watch
        dispatcher._cache = _KernelCache(function)  # what njit(cache=True) does, with a cache of our own
    return dispatcher


@cache
def source_stamp() -> str:
    """Hash of the names and contents of all kernel files, as they were when this process first asked."""
    stamp = hashlib.sha256()
    for path in (path for files in KERNEL_FILES for path in sorted(_PACKAGE.glob(files))):
        content = path.read_bytes()
        stamp.update(f"{path.relative_to(_PACKAGE)} {len(content)} ".encode())
        stamp.update(content)
    return stamp.hexdigest()


@contextmanager
def reporting_compilation(tell: Callable[[], object]) -> Iterator[None]:
    """While entered, `tell` is called as a kernel begins to be compiled; not for one that is kept on disk."""
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
        """Tell it."""
        self._tell()

    def on_end(self, event: object) -> None:
        """Nothing is told of ends."""


class _StampedResults(CompileResultCacheImpl):
    """Compiled functions on disk, valid for one `source_stamp`."""

    def __init__(self, function: Callable[..., object]) -> None:
        super().__init__(function)
        self.locator.get_source_stamp = source_stamp


class _KernelCache(FunctionCache):
    """Numba's cache of one function; a disk that does not answer is as good as an empty cache."""

    _impl_class = _StampedResults

    def load_overload(self, sig: object, target_context: object) -> object:
        """The compiled function for these argument types, None where there is none."""
        with suppress(OSError):
            try:
                return super().load_overload(sig, target_context)
            except (ImportError, AttributeError):  # kept by older sources, whose types had other names
                self.flush()
        return None

    def save_overload(self, sig: object, data: object) -> None:
        """Keep a compiled function, if that is possible."""
        with suppress(OSError):
            super().save_overload(sig, data)
