"""What a folder says of its runs, a line for each, and of tasks that failed, a line for each attempt.

Only this file says where, when and how often tasks failed. The last line of a task decides; one that ends well after it has
failed gets a line, too. A failure holds for the solver that it happened to: another one tries again.
"""

import json
import zlib
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any, Final

from nanoslip.solver.outcome import Ending, Outcome
from nanoslip.study.results import entry as lines

FILE: Final = "attempts.jsonl"
ADVICE: Final = "; `nanoslip run --retry` tries again"


@dataclass(frozen=True, slots=True)
class Attempt:
    """One attempt at a task that failed."""

    task: str
    """Its key."""
    label: str
    ending: str
    message: str
    final: bool
    """Whether that run did not try again."""
    passing: bool
    """Whether the machine was at fault, not the task: the next run tries again."""
    solver: str
    """Name of what failed (nanoslip.study.origin.Origin.solver)."""
    where: str
    """Rank and host."""
    ended: str
    """When, in UTC."""
    trace: str = ""

    @property
    def outcome(self) -> Outcome:
        """What it means for the task. The same on every machine."""
        return Outcome(Ending(self.ending), self.message + (ADVICE if self.given_up else ""))

    @property
    def given_up(self) -> bool:
        """Whether no further run tries it by itself."""
        return self.final and not self.passing


def add(out: Path, attempt: Attempt) -> str:
    """Write an attempt down behind the others; returns why that could not be, empty where it was."""
    try:
        lines.add(out / FILE, f"{_line(attempt)}\n".encode("ascii"))
    except OSError as error:
        return f"{out / FILE}: cannot be written, the next run tries again what failed: {error.strerror or error}"
    return ""


def final(out: Path, solver: str) -> dict[str, Attempt]:
    """Key -> the last attempt of this solver at each task, where that was final; lines that no run wrote are left out."""
    found = (attempt for line in lines.read(out / FILE) if (attempt := _attempt(line)) and attempt.solver == solver)
    last = {attempt.task: attempt for attempt in found}
    return {key: attempt for key, attempt in last.items() if attempt.final}


def lost(out: Path) -> str:
    """Which lines no run wrote, so that nobody knows what failed there; empty where all is well."""
    path = out / FILE
    if lines.is_no_file(path):
        return f"{path}: {lines.NO_FILE}; {_UNKNOWN}"
    unsound = [number for number, line in enumerate(lines.read(path), 1) if _attempt(line) is None]
    if not unsound:
        return ""
    said = "1 line is none" if len(unsound) == 1 else f"{len(unsound)} lines are none"
    return f"{path}: {said} that a run wrote (line {', '.join(map(str, unsound[:_SHOWN]))}); {_UNKNOWN}"


def _attempt(line: str) -> Attempt | None:
    try:
        data: Any = json.loads(line)
        if not isinstance(data, Mapping) or any(not isinstance(data[item.name], item.type) for item in _FIELDS):
            return None
        Ending(data["ending"])
    except (ValueError, KeyError, RecursionError):
        return None
    found = Attempt(**{item.name: data[item.name] for item in _FIELDS})
    return found if line == _line(found) else None


def _line(attempt: Attempt) -> str:
    """What stands in the file, with a checksum: no bit of it can change without being found."""
    content = asdict(attempt)
    return json.dumps({**content, "checksum": zlib.crc32(json.dumps(content).encode("ascii"))})


_UNKNOWN: Final = "what failed there is tried again"
_SHOWN: Final = 3
_FIELDS: Final[Any] = fields(Attempt)


# The journal of a folder: who computed there, where, when, with what else, and how that ended.
#
# It stands beside the dataset and never in it: the same results are the same bytes, whoever computed them, on however many
# ranks. A run adds a line when it begins to compute, one when it has ended, and a few on the way, at ever longer intervals.
# Each says all of it again; the last line of a run counts.

RUNS_FILE: Final = "runs.jsonl"
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
    """Name of what decides results (nanoslip.study.origin.Origin.solver)."""
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


def add_run(out: Path, *runs: Run) -> str:
    """Write lines behind the others; returns why that could not be, empty where it was: no result depends on it."""
    try:
        lines.add(out / RUNS_FILE, b"".join(json.dumps(asdict(run)).encode() + b"\n" for run in runs))
    except OSError as error:
        return f"{out / RUNS_FILE}: cannot be written, who computed here and how long is not known: {error.strerror or error}"
    return ""


def read(out: Path) -> list[Run]:
    """All runs that are written down in a folder, by their begin; lines that no run wrote are passed over."""
    return _last(found for line in lines.read(out / RUNS_FILE) if (found := _run(line)))


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
