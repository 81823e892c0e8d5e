"""What a run does about tasks that fail: leaves out those that failed for good before, and writes down those that do now."""

import datetime
import sys
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from solver.outcome import UNDONE, Ending, Outcome
from study.execution.ledger import Done, Report
from study.origin import here
from study.plan.plan import Plan
from study.plan.tasks import Task
from study.results import attempts
from study.results.attempts import Attempt


@dataclass(frozen=True, slots=True)
class Left:
    """What is left of a campaign."""

    tasks: tuple[Task, ...]
    """Those that a run tries: what has failed comes last."""
    given_up: tuple[Task, ...]
    """Those that failed for good, and those that need one of them."""


def left(plan: Plan, failures: Mapping[str, Attempt], finished: Collection[str], retry: bool = False) -> Left:
    """What is left, given the keys that are finished and the tasks that have failed. retry: nothing is given up."""
    tasks = plan.remaining(finished)
    tried = plan.possible(tasks, given_up(failures, retry).difference(finished), failures)
    if len(tried) == len(tasks):
        return Left(tried, ())
    keys = {task.key for task in tried}
    return Left(tried, tuple(task for task in tasks if task.key not in keys))


def given_up(failures: Mapping[str, Attempt], retry: bool = False) -> set[str]:
    """Keys of the tasks that a run does not try again by itself; none where it is to retry."""
    return {key for key, attempt in failures.items() if attempt.given_up and not retry}


class Diary:
    """Keeps all that is known of attempts that fail, and that a task which has failed has not in the end."""

    def __init__(self, out: Path, report: Report[Task]) -> None:
        """report: hears how tasks end, as this does."""
        self._out, self._report = out, report
        self._failed = set(attempts.final(out, here().solver))

    def report(self, tasks: Sequence[Task], outcome: Outcome, seconds: Collection[float]) -> None:
        """Note how tasks have ended."""
        if self._failed and outcome.ending not in UNDONE and outcome.ending is not Ending.NEEDS_FAILED:
            for task, took in zip(tasks, seconds, strict=True):
                if task.key in self._failed:
                    self._note(task, Done(task.key, outcome, took), final=False)
        self._report(tasks, outcome, seconds)

    def fail(self, task: Task, done: Done, final: bool) -> None:
        """Note an attempt that has failed."""
        self._failed.add(task.key)
        self._note(task, done, final)

    def _note(self, task: Task, done: Done, final: bool) -> None:
        ended = datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
        attempt = Attempt(
            task=task.key,
            label=task.label,
            ending=done.outcome.ending.value,
            message=done.outcome.message,
            final=final,
            passing=done.passing,
            solver=here().solver,
            where=done.where,
            ended=ended,
            trace=done.trace,
        )
        if problem := attempts.add(self._out, attempt):
            sys.stderr.write(f"{problem}\n")
