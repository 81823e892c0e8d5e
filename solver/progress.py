"""Share of a computation that is done, reported between its parts to whoever watches. No result depends on it."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Final

Watcher = Callable[[float], object]
"""Called with the share that is done, 0 to 1."""

_WATCHER: Final[ContextVar[Watcher | None]] = ContextVar("watcher", default=None)


def report_progress(share: float) -> None:
    """Report the share of the current part that is done, 0 to 1."""
    watcher = _WATCHER.get()
    if watcher is not None:
        watcher(share)


@contextmanager
def watch_progress(watcher: Watcher) -> Iterator[None]:
    """Call `watcher` with the progress of the computation in this context."""
    token = _WATCHER.set(watcher)
    try:
        yield
    finally:
        _WATCHER.reset(token)


@contextmanager
def part_of_progress(first: float, last: float) -> Iterator[None]:
    """Map the progress of the computation in this context to shares `first` to `last` of the current part."""
    watcher = _WATCHER.get()
    if watcher is None:
        yield
        return
    with watch_progress(lambda share: watcher(first + (last - first) * share)):
        yield
