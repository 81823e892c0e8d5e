"""What became of tasks that failed: a line for each attempt, beside the results. Only this file says where, when and how often.

The last line of a task decides; one that ends well after it has failed gets a line, too. A failure holds for the solver that it
happened to: another one tries again.
"""

import json
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
        lines.add(out / FILE, json.dumps(asdict(attempt)).encode() + b"\n")
    except OSError as error:
        return f"{out / FILE}: cannot be written, the next run tries again what failed: {error.strerror or error}"
    return ""


def final(out: Path, solver: str) -> dict[str, Attempt]:
    """Key -> the last attempt of this solver at each task, where that was final; lines that no run wrote are left out."""
    try:
        told = (out / FILE).read_text("utf-8", errors="replace").splitlines()
    except OSError:
        return {}
    found = (attempt for line in told if (attempt := _attempt(line)) and attempt.solver == solver)
    last = {attempt.task: attempt for attempt in found}
    return {key: attempt for key, attempt in last.items() if attempt.final}


def _attempt(line: str) -> Attempt | None:
    try:
        data: Any = json.loads(line)
        if not isinstance(data, Mapping) or any(not isinstance(data[item.name], item.type) for item in _FIELDS):
            return None
        Ending(data["ending"])
    except (ValueError, KeyError, RecursionError):
        return None
    return Attempt(**{item.name: data[item.name] for item in _FIELDS})


_FIELDS: Final[Any] = fields(Attempt)
