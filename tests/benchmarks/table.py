"""A row of the benchmark table, and how it is timed and written."""

import time
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Row:
    """One figure: what is measured, ours, what it is held against, and what was asked for."""

    what: str
    ours: str
    against: str
    """The peer or the limit, measured in the same run, with its name; empty where there is none."""
    ratio: str
    target: str
    """What was aimed at, and `met` or `missed`."""


def best(run: Callable[[], object], repeats: int = 5, clock: Callable[[], float] = time.process_time) -> float:
    """Shortest of several timings, in s; the first call warms up and does not count."""
    run()
    durations = []
    for _ in range(repeats):
        start = clock()
        run()
        durations.append(clock() - start)
    return min(durations)


def seconds(value: float) -> str:
    """A duration with three digits in its natural unit."""
    for scale, unit in ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs"), (1e-9, "ns")):
        if value >= scale:
            return f"{value / scale:.3g} {unit}"
    return f"{value:.3g} s"


def verdict(target: str, met: bool) -> str:
    """The target and whether it was met."""
    return f"{target}: {'met' if met else 'missed'}"


def as_markdown(rows: list[Row]) -> str:
    """All rows as a table."""
    lines = ["| what | ours | against | ratio | target |", "|---|---|---|---|---|"]
    lines += [f"| {row.what} | {row.ours} | {row.against} | {row.ratio} | {row.target} |" for row in rows]
    return "\n".join(lines)
