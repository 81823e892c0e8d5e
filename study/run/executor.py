"""How a process computes one task of a campaign: inputs from the store, result into it."""

import datetime
import sys
import time
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from importlib import import_module
from pathlib import Path
from typing import Final

from nanoslip.solver.outcome import COMPLETED, UNDONE, Ending, Outcome
from nanoslip.study.origin import arithmetic, here
from nanoslip.study.plan.plan import Plan
from nanoslip.study.plan.task import Task, TaskResult
from nanoslip.study.results import attempts
from nanoslip.study.results.attempts import Attempt
from nanoslip.study.results.entry import CorruptResultError
from nanoslip.study.results.store import Store, StoreError
from nanoslip.study.run.compute import run_task
from nanoslip.study.run.dispatch import CannotGoOnError, Done, Report
from nanoslip.study.run.launch import Settle
from nanoslip.study.run.warm_up import WarmUp

_NUMERICS: Final = (
    "nanoslip.solver.compiling",
    "scipy.linalg",
    "scipy.optimize",
    "scipy.sparse.linalg",
    "scipy.special",
)
"""What the solver computes with and loads when it does. On a crowded file system that takes longer than many a task."""

INPUTS: Final = 4
"""Results that are kept at hand: tasks that follow each other mostly need the same slab, or are drives of one record."""

Read = Callable[[str], TaskResult]


def executor(out: Path) -> Callable[[Task | WarmUp | Settle], Outcome]:
    """The function that computes a task with the results in this folder and returns its outcome.

    Loads all that tasks compute with: a task's time and limit are its own.
    """
    for module in _NUMERICS:
        import_module(module)
    arithmetic()  # while no task has harmed the process: it reads files
    store = Store(out)
    return partial(_execute, store, lru_cache(INPUTS)(partial(_read, store)))


def _execute(store: Store, read: Read, task: Task | WarmUp | Settle) -> Outcome:
    if isinstance(task, WarmUp):
        return task.run()
    if isinstance(task, Settle):
        store.close()
        return COMPLETED
    result = run_task(task, {key: read(key) for key in task.needs})
    if result.key != task.key:
        raise ValueError(f"a defect: what came of task {task.key} is a result of {result.key}")
    if result.outcome.ending is not Ending.OUT_OF_MEMORY:  # another machine, or fewer ranks, may compute it
        try:
            store.write(result, task.shared)
        except StoreError as error:
            raise CannotGoOnError(str(error)) from error
    return result.outcome


def _read(store: Store, key: str) -> TaskResult:
    try:
        return store.read(key)
    except CorruptResultError as error:
        raise OSError(str(error)) from error  # the next run computes it again


def drop_intermediates(plan: Plan, store: Store) -> None:
    """Remove results that only other tasks needed and that no unfinished task still needs. Raises StoreError."""
    if any(task.passing for task in plan.tasks):
        for key in plan.obsolete(store.finished()):
            store.drop(key)


# What a run does about tasks that fail: leaves out those that failed for good before, and writes down those that do now.

VISIBLE: Final = 90.0
"""Seconds after which a network file system shows what another machine has written: clients remember folders for 60 at most."""
LOOK: Final = 1.0
"""Seconds between two looks."""


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


def unseen(tasks: Sequence[Task], undone: Collection[str], store: Store) -> str:
    """Which results of tasks that were reported as done are not in the store, in a line; empty where all are.

    Waits for them as long as a network file system may show a folder as it was. undone: keys of tasks without a result.
    """
    end = time.monotonic() + VISIBLE
    while True:
        there = store.metas()
        missing = [task for task in tasks if task.key not in undone and task.key not in there]
        if not missing or time.monotonic() > end:
            break
        time.sleep(min(LOOK, VISIBLE))
    if not missing:
        return ""
    first = f"{len(missing)} of {len(tasks)} results, first that of {missing[0].label} ({missing[0].key})"
    return f"{store.folder}: not there though they were computed: {first}; run again to continue"


class Diary:
    """Keeps all that is known of attempts that fail, and that a task which has failed has not in the end."""

    def __init__(self, out: Path, report: Report[Task]) -> None:
        """report: callback, called with each task's outcome."""
        self._out, self._report = out, report
        self._failed = set(attempts.final(out, here().solver))
        self.undone: set[str] = set()
        """Keys of the tasks that have ended without a result."""

    def report(self, tasks: Sequence[Task], outcome: Outcome, seconds: Collection[float]) -> None:
        """Note how tasks have ended."""
        if outcome.ending in UNDONE or outcome.ending is Ending.NEEDS_FAILED:
            self.undone.update(task.key for task in tasks)
        elif self._failed:
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
