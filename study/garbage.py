"""Pause Python's garbage collector while millions of objects are made: it would visit all of them again and again."""

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def all_kept() -> Iterator[None]:
    """No search while millions of objects are made that are kept."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()


def keep_for_good() -> None:
    """Search nothing again of what there is by now: a process holds its modules to its end, and millions of planned tasks."""
    gc.freeze()
