"""What became of tasks that failed: a line for each attempt, beside the results. Only this file says where, when and how often.

The last line of a task decides; one that ends well after it has failed gets a line, too. A failure holds for the solver that it
happened to: another one tries again.
"""

import json
import zlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any, Final

from solver.outcome import Ending, Outcome
from study.results import lines

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
    """Name of what failed (study.origin.Origin.solver)."""
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
