"""Address space that this process may use, and errors that come from too little of it."""

import errno
import math
from contextlib import suppress


def address_limit() -> float:
    """Largest address space of this process in GB, as `ulimit -v` sets it; infinite without a limit and outside Unix."""
    with suppress(ImportError):
        import resource  # noqa: PLC0415  not everywhere

        limit, _ = resource.getrlimit(resource.RLIMIT_AS)
        return math.inf if limit == resource.RLIM_INFINITY else limit / 1e9
    return math.inf


def is_shortage(error: BaseException) -> bool:
    """True if an error comes from too little memory.

    A library that finds no room is an ImportError, a SystemError, or an OSError without a number: no other reason is likely under
    a limit. A thread that finds no room for its stack is a RuntimeError of these words.
    """
    unnumbered = isinstance(error, ImportError | SystemError)
    if isinstance(error, OSError):
        unnumbered = unnumbered or error.errno is None
    threadless = isinstance(error, RuntimeError) and str(error) == "can't start new thread"
    refused = isinstance(error, OSError) and error.errno == errno.ENOMEM
    by_limit = (unnumbered or threadless) and address_limit() < math.inf
    return isinstance(error, MemoryError) or refused or by_limit


def describe_shortage() -> str:
    """The shortage of memory, and advice."""
    limit = address_limit()
    if limit < math.inf:
        return f"not enough memory: a process may use {limit:.2g} GB; raise the limit, as by `ulimit -v unlimited`"
    return "not enough memory: start fewer processes, or choose a smaller n_x"
