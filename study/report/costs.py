"""What the runs of a campaign cost: a line for each, beside the dataset and never in it: the same results are the same bytes."""

import csv
import datetime
from dataclasses import astuple, dataclass, fields
from pathlib import Path
from typing import Final

from study.dataset.store import StoreError

FILE: Final = "runs.csv"


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


def add(out: Path, cost: Cost) -> None:
    """Write a run down behind the others. Raises StoreError."""
    path = out / FILE
    try:
        new = not path.exists()
        with path.open("a", encoding="utf-8", newline="") as opened:
            writer = csv.writer(opened, lineterminator="\n")
            if new:
                writer.writerow(item.name for item in fields(Cost))
            writer.writerow(astuple(cost))
    except OSError as error:
        raise StoreError(f"{path}: cannot be written: {error.strerror or error}") from None


def read(out: Path) -> list[Cost]:
    """All runs that are written down beside a dataset; none where nobody did. Raises StoreError."""
    path = out / FILE
    if not path.exists():
        return []
    try:
        with path.open(encoding="utf-8", newline="") as opened:
            return [
                Cost(
                    row["started"],
                    int(row["processes"]),
                    float(row["wall_seconds"]),
                    float(row["core_seconds"]),
                    int(row["tasks"]),
                )
                for row in csv.DictReader(opened)
            ]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise StoreError(f"{path}: not what a run wrote there: {error}; remove it, nothing else needs it") from None
