"""What a run does about tasks that fail: leaves out those that failed for good before, and writes down those that do now."""

import datetime
import sys
from collections.abc import Callable, Collection
from dataclasses import dataclass
from pathlib import Path

from study.execution.ledger import Done
from study.origin import here
from study.plan.plan import Plan
from study.plan.tasks import Task
from study.results import attempts
from study.results.attempts import Attempt
from study.results.store import Store


@dataclass(frozen=True, slots=True)
class Left:
    """What is left of a campaign."""

    tasks: tuple[Task, ...]
    """Those that a run tries: what has failed comes last."""
    given_up: tuple[Task, ...]
    """Those that failed for good, and those that need one of them."""


def left(plan: Plan, store: Store, finished: Collection[str], retry: bool = False) -> Left:
    """What is left, given the keys that are finished. retry: nothing is given up."""
    tasks, failures = plan.remaining(finished), store.failures()
    given_up = [] if retry else [key for key, attempt in failures.items() if attempt.given_up]
    tried = plan.possible(tasks, given_up, failures)
    keys = {task.key for task in tried}
    return Left(tried, tuple(task for task in tasks if task.key not in keys))


def diary(out: Path) -> Callable[[Task, Done, bool], None]:
    """What keeps all that is known of an attempt that failed."""

    def note(task: Task, done: Done, final: bool) -> None:
        ended = datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
        ending, message = done.outcome.ending.value, done.outcome.message
        attempt = Attempt(task.key, task.label, ending, message, final, here().name, done.where, ended, done.trace)
        if problem := attempts.add(out, attempt):
            sys.stderr.write(f"{problem}\n")

    return note
