"""The journal of a folder: who computed there, where, when, with what else, and how that ended.

It stands beside the dataset and never in it: the same results are the same bytes, whoever computed them, on however many ranks.
A run adds a line when it begins to compute, one when it has ended, and a few on the way, at ever longer intervals. Each says all
of it again; the last line of a run counts.
"""

import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any, Final

from study.results import lines

FILE: Final = "runs.jsonl"
MOST_PROCESSES: Final = 10**7
"""More than any machine has."""
MOST: Final = 10**18
"""More than any run takes: seconds, predicted or measured, and tasks."""


@dataclass(frozen=True, slots=True)
class Run:
    """One run that computed tasks. Times are UTC."""

    run: str
    """A name that no other has: at random."""
    begun: str
    processes: int
    """How many computed, one thread each."""
    unit: str = "process"
    """What they are: ranks, processes."""
    user: str = ""
    command: str = ""
    nanoslip: str = ""
    """Version as its users see it."""
    solver: str = ""
    """Name of what decides results (study.origin.Origin.solver)."""
    source_commit: str = ""
    host: str = ""
    """Where the first process was."""
    hosts: dict[str, int] = field(default_factory=dict)
    """Host -> how many processes there have ended a task; known when the run has ended."""
    launcher: str = ""
    mpi: str = ""
    """The MPI library and its version; empty without one."""
    slurm_job: str = ""
    threads: int = 1
    """Of each process."""
    processor: str = ""
    """Model of the first process's."""
    features: str = ""
    """Of that processor, those that can change a last bit."""
    blas: str = ""
    """Version, and the kernel that it has chosen for that processor."""
    python: str = ""
    libraries: dict[str, str] = field(default_factory=dict)
    """Name -> version."""
    ended: str = ""
    """Empty of a run that is at work, or was killed."""
    done: int = 0
    """Tasks that ended with a result."""
    failed: int = 0
    """Tasks that failed, or needed one that did."""
    wall_seconds: float = 0.0
    core_seconds: float = 0.0
    """Of all processes together, in tasks."""
    kinds: dict[str, list[float]] = field(default_factory=dict)
    """Kind of task -> of those with a result: number, seconds predicted, seconds measured."""
    exit_code: int = 0


def add(out: Path, *runs: Run) -> str:
    """Write lines behind the others; returns why that could not be, empty where it was: no result depends on it."""
    try:
        lines.add(out / FILE, b"".join(json.dumps(asdict(run)).encode() + b"\n" for run in runs))
    except OSError as error:
        return (
            f"{out / FILE}: cannot be written, who computed here and how long is not known: {error.strerror or error}"
        )
    return ""


def read(out: Path) -> list[Run]:
    """All runs that are written down in a folder, by their begin; lines that no run wrote are passed over."""
    return _last(found for line in lines.read(out / FILE) if (found := _run(line)))


def _last(runs: Iterable[Run]) -> list[Run]:
    return sorted({each.run: each for each in runs}.values(), key=lambda each: (each.begun, each.run))


def _run(line: str) -> Run | None:
    """A line as a run; None of one that is cut short, or that no run can have taken."""
    try:
        data: Any = json.loads(line)
        if not isinstance(data, Mapping):
            return None
        found = Run(**{item.name: data[item.name] for item in fields(Run) if item.name in data})
    except (ValueError, TypeError, RecursionError):
        return None
    return found if _possible(found) else None


def _possible(run: Run) -> bool:
    for item in fields(Run):
        if type(getattr(run, item.name)) is not _TYPES[item.name]:
            return False
    numbers = (run.done, run.failed, run.wall_seconds, run.core_seconds)
    counts = run.hosts.values()
    return (
        0 < run.processes < MOST_PROCESSES
        and all(0 <= number < MOST for number in numbers)
        and all(type(count) is int and 0 < count < MOST_PROCESSES for count in counts)
        and all(isinstance(version, str) for version in run.libraries.values())
        and all(_is_account(account) for account in run.kinds.values())
    )


def _is_account(account: object) -> bool:
    numbers = account if isinstance(account, list) else []
    return len(numbers) == 3 and all(type(each) in (int, float) and 0 <= each < MOST for each in numbers)


_TYPES: Final = {name: type(value) for name, value in asdict(Run("", "", 1)).items()}
