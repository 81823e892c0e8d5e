"""Made-up tasks, and what notes what becomes of them."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from nanoslip.solver.outcome import COMPLETED, Outcome
from nanoslip.solver.progress import report_progress
from nanoslip.study.run.dispatch import REPORT, Done, Watch

LIMIT = 4.0
"""Seconds that a task may take that never ends."""


@dataclass(frozen=True)
class Work:
    """A task for any program: what its key or its cost means is the program's own affair."""

    key: str
    needs: tuple[str, ...] = ()
    cost: float = 0.01
    kind: str = "any"
    limit: float = LIMIT

    @property
    def label(self) -> str:
        return f"task {self.key}"


DIAMOND = (Work("a"), Work("b", ("a",)), Work("c", ("a",)), Work("d", ("b", "c")), Work("e", ("elsewhere",)))


class Diary(Watch):
    """Notes what is executed and what becomes of it."""

    def __init__(self, crash: str = "") -> None:
        super().__init__()
        self.attempts: list[tuple[str, Done, bool]] = []
        """Failed ones: key, how it ended, whether that was final."""
        self.executed: list[str] = []
        self.reported: dict[str, Outcome] = {}
        self._crash = crash

    def execute(self, task: Work) -> Outcome:
        self.executed.append(task.key)
        if task.key == self._crash:
            raise ZeroDivisionError("a defect")
        return COMPLETED

    def ended(self, task: Any, outcome: Outcome, seconds: float) -> None:
        assert task.key not in self.reported
        self.reported[task.key] = outcome

    def failed(self, task: Any, done: Done, final: bool) -> None:
        self.attempts.append((task.key, done, final))


def advancing(_: Any) -> Callable[[Work], Outcome]:
    """What computes a task that sleeps in parts, and reports each, until progress is due."""

    def execute(task: Work) -> Outcome:
        parts = 12
        for part in range(parts):
            time.sleep(1.1 * REPORT / parts)
            report_progress((part + 1) / parts)
        return COMPLETED

    return execute
