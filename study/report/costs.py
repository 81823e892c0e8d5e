"""What the runs of a campaign cost: a line for each, beside the dataset and never in it: the same results are the same bytes."""

import csv
import datetime
import math
from dataclasses import astuple, dataclass, fields
from pathlib import Path
from typing import Final

FILE: Final = "runs.csv"
MOST_PROCESSES: Final = 10**7
"""More than any machine has."""


@dataclass(frozen=True, slots=True)
class Cost:
    """One run: start (UTC), processes, seconds on the clock, seconds of all processes in tasks, tasks that ended."""

    started: str
    processes: int
    wall_seconds: float
    core_seconds: float
    tasks: int


def since(started: float, now: float, processes: int, core_seconds: float, tasks: int) -> Cost:
    """The cost of a run between two times (s since the epoch)."""
    start = datetime.datetime.fromtimestamp(started, datetime.UTC).isoformat(timespec="seconds")
    return Cost(start, processes, round(now - started, 3), round(core_seconds, 3), tasks)


def add(out: Path, cost: Cost) -> str:
    """Write a run down behind the others; returns why that could not be, empty where it was: no result depends on it."""
    path = out / FILE
    try:
        whole = path.read_bytes().endswith(b"\n") if path.exists() else None
        with path.open("a", encoding="utf-8", newline="") as opened:
            writer = csv.writer(opened, lineterminator="\n")
            if whole is None:
                writer.writerow(item.name for item in fields(Cost))
            elif not whole:  # the end of a line that was cut short
                opened.write("\n")
            writer.writerow(astuple(cost))
    except OSError as error:
        return f"{path}: cannot be written, what runs take is not known: {error.strerror or error}"
    return ""


def read(out: Path) -> list[Cost]:
    """All runs that are written down beside a dataset, less lines that no run wrote; none where there is no such file."""
    try:
        lines = (out / FILE).read_text("utf-8", errors="replace").splitlines()[1:]
    except OSError:
        return []
    return [cost for line in lines if (cost := _cost(line.split(","))) is not None]


def _cost(cells: list[str]) -> Cost | None:
    """A line as a run; None of one that is cut short, or that no run can have taken."""
    try:
        started, processes, wall, core, tasks = cells
        found = Cost(started, int(processes), float(wall), float(core), int(tasks))
    except ValueError:
        return None
    possible = 0 < found.processes < MOST_PROCESSES and found.tasks >= 0
    return found if possible and 0.0 <= found.wall_seconds < math.inf and 0.0 <= found.core_seconds < math.inf else None
