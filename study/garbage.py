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
    """Exempt all present objects from garbage collection: modules and millions of planned tasks live as long as the process."""
    gc.freeze()
