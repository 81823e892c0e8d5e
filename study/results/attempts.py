"""What became of tasks that failed: a line for each attempt, beside the results. Only this file says where, when and how often.

A failure holds for the software that it happened to: another state of it tries again.
"""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any, Final

from solver.outcome import Ending, Outcome

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
    """Whether the task is not tried again by itself."""
    software: str
    """Name of the origin (study.origin) that failed."""
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
        """Whether no further run tries it. Memory may be there next time, and what it needs may be."""
        return self.final and self.ending in (Ending.CRASHED, Ending.TIMED_OUT)


def add(out: Path, attempt: Attempt) -> str:
    """Write an attempt down behind the others; returns why that could not be, empty where it was."""
    try:
        with (out / FILE).open("ab") as file:
            torn = file.tell() > 0 and not (out / FILE).read_bytes().endswith(b"\n")
            file.write(b"\n" * torn + json.dumps(asdict(attempt)).encode() + b"\n")
    except OSError as error:
        return f"{out / FILE}: cannot be written, the next run tries again what failed: {error.strerror or error}"
    return ""


def final(out: Path, software: str) -> dict[str, Attempt]:
    """Key -> the last attempt of this software at each task, where that was final; lines that no run wrote are left out."""
    try:
        lines = (out / FILE).read_text("utf-8", errors="replace").splitlines()
    except OSError:
        return {}
    found = (attempt for line in lines if (attempt := _attempt(line)) and attempt.software == software)
    return {attempt.task: attempt for attempt in found if attempt.final}


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
