"""A row of the benchmark table, how it is timed, and how it is written."""

import resource
import time
import tracemalloc
from collections.abc import Callable, Iterable
from dataclasses import astuple, dataclass, fields
from typing import TypeVar

T = TypeVar("T")


@dataclass(frozen=True)
class Row:
    """One figure: what is measured, ours, what it is held against, and what was asked for."""

    what: str
    ours: str
    against: str = ""
    """The peer or the limit, measured in the same run, with its name; empty where there is none."""
    ratio: str = ""
    target: str = ""
    """What was aimed at, and `met` or `missed`."""


def versus(what: str, ours: float, peer: float, name: str, target: str = "", *, ratio: str = "") -> Row:
    """A row of seconds: ours over the peer's of this name, unless the ratio is said otherwise."""
    return Row(what, seconds(ours), f"{seconds(peer)} ({name})", ratio or f"{ours / peer:.2f}", target)


def best(run: Callable[[], object], repeats: int = 5, clock: Callable[[], float] = time.process_time) -> float:
    """Shortest of several timings, in s; the first call warms up and does not count."""
    run()
    return min(timed(run, clock)[1] for _ in range(repeats))


def timed(run: Callable[[], T], clock: Callable[[], float] = time.process_time) -> tuple[T, float]:
    """A result, and the seconds that it took once."""
    start = clock()
    found = run()
    return found, clock() - start


def arrays_of(run: Callable[[], object]) -> float:
    """Peak bytes of arrays made while it runs, beside what was there."""
    tracemalloc.start()
    run()
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return float(peak)


def peak_memory() -> float:
    """Bytes that this process has had at most."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024.0


def seconds(value: float) -> str:
    """A duration with three digits in its natural unit."""
    for scale, unit in ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs"), (1e-9, "ns")):
        if value >= scale:
            return f"{value / scale:.3g} {unit}"
    return f"{value:.3g} s"


def verdict(target: str, met: bool) -> str:
    """The target and whether it was met."""
    return f"{target}: {'met' if met else 'missed'}"


def at_most(value: float, most: float) -> str:
    """The same of seconds that may be so many."""
    return verdict(f"≤ {seconds(most)}", value <= most)


def as_rows(rows: Iterable[Row]) -> list[tuple[str, ...]]:
    """All rows below their header."""
    return [tuple(each.name for each in fields(Row)), *map(astuple, rows)]
