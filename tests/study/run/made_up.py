"""Made-up tasks, and what notes what becomes of them."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

from nanoslip.solver.outcome import COMPLETED, Outcome

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


class Diary:
    """Notes what is executed and reported."""

    def __init__(self, crash: str = "") -> None:
        self.executed: list[str] = []
        self.reported: dict[str, Outcome] = {}
        self._crash = crash

    def execute(self, task: Work) -> Outcome:
        self.executed.append(task.key)
        if task.key == self._crash:
            raise ZeroDivisionError("a defect")
        return COMPLETED

    def report(self, tasks: Sequence[Work], outcome: Outcome, seconds: Collection[float]) -> None:
        for task in tasks:
            assert task.key not in self.reported
            self.reported[task.key] = outcome
