"""Logs of a folder: a line for each run, and a line for each failed attempt of a task.

Only this file has place, time and number of failures. The last line of a task counts; a later success gets a line, too. A failure
holds for its version of the solver: another version tries again.
"""

import json
import zlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any, Final, TypeVar

from nanoslip.solver.outcome import Ending, Outcome
from nanoslip.study.results import files

FILE: Final = "attempts.jsonl"
ADVICE: Final = "; `nanoslip run --retry` tries again"


@dataclass(frozen=True, slots=True)
class Attempt:
    """One attempt at a task that failed."""

    task: str
    """Key of the task."""
    label: str
    ending: str
    message: str
    final: bool
    """True if that run did not try again."""
    passing: bool
    """True if the machine was at fault, not the task: the next run tries again."""
    solver: str
    """Name of the software that failed (nanoslip.study.origin.Origin.solver)."""
    where: str
    """Rank and host."""
    ended: str
    """Time of the end, in UTC."""
    trace: str = ""
    cause: str = ""
    """Name of the fact in the message."""

    @property
    def outcome(self) -> Outcome:
        """Outcome of the task, the same on every machine."""
        message = self.message
        if self.given_up:
            message += ADVICE
        return Outcome(Ending(self.ending), message, cause=self.cause)

    @property
    def given_up(self) -> bool:
        """True if no further run tries it without `retry`."""
        return self.final and not self.passing


def add_attempt(out: Path, attempt: Attempt) -> str:
    """Append an attempt; returns the reason if that failed, else ""."""
    return _add(out / FILE, attempt, "the next run tries again what failed")


def final(out: Path, solver: str) -> dict[str, Attempt]:
    """Key -> the last attempt of this solver at each task, where that was final; lines that no run wrote are left out."""
    attempts = map(_attempt, files.read_lines(out / FILE))
    last = {attempt.task: attempt for attempt in attempts if attempt and attempt.solver == solver}
    return {key: attempt for key, attempt in last.items() if attempt.final}


def lost(out: Path) -> str:
    """Damaged lines, whose failures are unknown; empty without any."""
    path = out / FILE
    if files.is_no_file(path):
        return f"{path}: {files.NO_FILE}; {_UNKNOWN}"
    lines = enumerate(files.read_lines(path), 1)
    unsound = [number for number, line in lines if _attempt(line) is None]
    if not unsound:
        return ""
    said = "1 line is none" if len(unsound) == 1 else f"{len(unsound)} lines are none"
    return f"{path}: {said} that a run wrote (line {', '.join(map(str, unsound[:_SHOWN]))}); {_UNKNOWN}"


def _attempt(line: str) -> Attempt | None:
    attempt = _read(line, Attempt)
    return attempt if attempt and attempt.ending in tuple(Ending) else None


_UNKNOWN: Final = "what failed there is tried again"
_SHOWN: Final = 3

# Lines have a checksum: no bit of them can change without being found.

Record = TypeVar("Record", Attempt, "RunRecord")


def _add(path: Path, record: "Attempt | RunRecord", what: str) -> str:
    """Append a line; returns the reason and consequence of a failure, empty after success."""
    try:
        files.append_lines(path, f"{_line(asdict(record))}\n".encode("ascii"))
    except OSError as error:
        return f"{path}: cannot be written, {what}: {error.strerror or error}"
    return ""


def _line(content: Mapping[str, Any]) -> str:
    text = json.dumps(content)
    checksum = zlib.crc32(text.encode("ascii"))
    return json.dumps({**content, "checksum": checksum})


def _read(line: str, kind: type[Record]) -> Record | None:
    """Parse a line, perhaps of another version; None for a damaged or foreign line."""
    try:
        content = json.loads(line)
        del content["checksum"]
        if line != _line(content):
            return None
        # A line of another version: fields that it lacks have their defaults, others are passed over.
        names = [item.name for item in fields(kind) if item.name in content]
        return kind(**{name: content[name] for name in names})
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError):
        return None


# The journal of a folder: who computed there, where, when, with what else, and how that ended.
#
# It stands beside the dataset and never in it: the same results are the same bytes, whoever computed them, on however many
# ranks. A run adds a line when it begins to compute, one when it has ended, and a few on the way, at ever longer intervals.
# Each line is complete; the last one of a run counts.

RUNS_FILE: Final = "runs.jsonl"


@dataclass(frozen=True, slots=True)
class RunRecord:
    """One run that computed tasks. Times are UTC."""

    run: str
    """A name that no other has: at random."""
    begun: str
    processes: int
    """Number of computing processes, one thread each."""
    unit: str = "process"
    """Name of a process: rank, process."""
    user: str = ""
    command: str = ""
    nanoslip: str = ""
    """Version as its users see it."""
    solver: str = ""
    """Name of the software that decides results (nanoslip.study.origin.Origin.solver)."""
    source_commit: str = ""
    host: str = ""
    """Host of the first process."""
    hosts: dict[str, int] = field(default_factory=dict)
    """Host -> number of processes there that have ended a task; filled when the run has ended."""
    launcher: str = ""
    mpi: str = ""
    """The MPI library and its version; empty without one."""
    slurm_job: str = ""
    processor: str = ""
    """Model of the first process's."""
    features: str = ""
    """Processor features that can change a last bit."""
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
    """Tasks that failed, or needed a failed task."""
    wall_seconds: float = 0.0
    core_seconds: float = 0.0
    """Elapsed seconds of all tasks together: what they would have taken one after another."""
    processor_seconds: float = 0.0
    """Processor time of all tasks together: less than `core_seconds` where other programs share the cores."""
    kinds: dict[str, list[float]] = field(default_factory=dict)
    """Kind of task -> number of tasks with a result, their predicted seconds, their measured seconds."""
    exit_code: int = 0


def add_run(out: Path, run: RunRecord) -> str:
    """Append a line on the run; returns the reason if that failed, else "": no result depends on it."""
    return _add(out / RUNS_FILE, run, "who computed here and how long is not known")


def read_runs(out: Path) -> list[RunRecord]:
    """All runs that are written down in a folder, by their begin; lines that no run wrote are passed over."""
    lines = files.read_lines(out / RUNS_FILE)
    runs = (_read(line, RunRecord) for line in lines)
    last = {run.run: run for run in runs if run}
    return sorted(last.values(), key=lambda run: (run.begun, run.run))
