"""Compute one task of a campaign in a process: inputs from the store, result into it; and before all, the kernels."""

import errno
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache, partial
from importlib import import_module
from pathlib import Path
from typing import Final

from nanoslip.solver.outcome import COMPLETED, Ending, Outcome
from nanoslip.study.origin import Origins, arithmetic
from nanoslip.study.plan.plan import Plan
from nanoslip.study.results.attempts import Attempt
from nanoslip.study.results.entry import NOT_OURS, CorruptResultError, UnusableResultError
from nanoslip.study.results.files import looks
from nanoslip.study.results.store import Store, StoreError
from nanoslip.study.run.dispatch import CannotGoOnError
from nanoslip.study.run.launch import Settle
from nanoslip.study.run.warm_up import WarmUp
from nanoslip.study.tasks.compute import run_task
from nanoslip.study.tasks.kind import KINDS
from nanoslip.study.tasks.task import Task, TaskResult

_NUMERICS: Final = (
    "nanoslip.solver.compiling",
    "nanoslip.solver.sliding.slider",
    "nanoslip.solver.dynamics.duration",
    "scipy.linalg",
    "scipy.optimize",
    "scipy.sparse.linalg",
    "scipy.special",
    *(f"nanoslip.study.tasks.{kind}" for kind in KINDS),
)
"""Modules that tasks and the solver load when they compute. On a crowded file system that takes longer than many a task."""

INPUTS: Final = 4
"""Number of results in the cache: successive tasks mostly need the same slab, or are drives of the same record."""

Read = Callable[[str], TaskResult]


def executor(out: Path) -> Callable[[Task | WarmUp | Settle], Outcome]:
    """The function that computes a task with the results in this folder and returns its outcome.

    Loads all modules first, so that a task's measured time and limit cover only its computation.
    """
    for module in _NUMERICS:
        import_module(module)
    # It reads files: before any task can have used up all file descriptors.
    arithmetic()
    store = Store(out)
    return partial(_execute, store, lru_cache(INPUTS)(partial(_read, store)))


def _execute(store: Store, read: Read, task: Task | WarmUp | Settle) -> Outcome:
    if isinstance(task, WarmUp):
        return task.run()
    if isinstance(task, Settle):
        store.close()
        return COMPLETED
    if not any(store.folder.is_dir() for _ in looks()):
        raise FileNotFoundError(errno.ENOENT, NOT_THERE, str(store.folder))
    inputs = {key: read(key) for key in task.needs}
    result = run_task(task, inputs)
    if result.key != task.key:
        raise ValueError(f"a defect: what came of task {task.key} is a result of {result.key}")
    # Another machine, or fewer ranks, may compute the task.
    if result.outcome.ending is not Ending.OUT_OF_MEMORY:
        try:
            store.write(result, task.shared)
        except StoreError as error:
            raise CannotGoOnError(str(error)) from error
    return result.outcome


def _read(store: Store, key: str) -> TaskResult:
    """A result that was reported as done, with its arrays. Raises OSError, so that a later run tries again."""
    try:
        for _ in looks():
            with suppress(FileNotFoundError):
                # Until a network file system shows what another machine has written.
                return _with_arrays(store, store.read(key))
    except CorruptResultError as error:
        # The next run computes the task again.
        raise OSError(str(error)) from error
    raise FileNotFoundError(errno.ENOENT, NOT_THERE, f"{store.folder}/{key}")


NOT_THERE: Final = "not there though another process has made it"
"""Message for a folder or result that a network file system does not show in time."""


def _with_arrays(store: Store, result: TaskResult) -> TaskResult:
    """A result that others are computed from. Raises UnusableResultError if it has lost all its arrays."""
    if result.outcome.usable and not result.arrays:
        store.reject(result.key)
        raise UnusableResultError(f"{store.folder}/{result.key}: {NOT_OURS}")
    return result


def drop_intermediates(plan: Plan, store: Store) -> None:
    """Remove results that only other tasks needed and that no unfinished task still needs. Raises StoreError."""
    if any(task.passing for task in plan.distinct):
        for key in plan.obsolete(store.finished()):
            store.drop(key)


# Remaining tasks of a campaign: one that has failed for good before is not tried again.


@dataclass(frozen=True, slots=True)
class Rest:
    """Remaining tasks of a campaign, or of a shard of it."""

    tasks: tuple[Task, ...]
    """Tasks that a run tries: failed ones come last."""
    given_up: tuple[Task, ...]
    """Tasks that failed for good, and tasks that need them."""
    foreign: Mapping[str, Origins]
    """Finished results of other software."""


def tasks_to_do(
    plan: Plan,
    failures: Mapping[str, Attempt],
    finished: Mapping[str, Origins],
    recompute_foreign: bool = False,
    retry: bool = False,
) -> Rest:
    """Remaining tasks. recompute_foreign: results of other software count as unfinished. retry: try failed tasks again."""
    foreign = plan.foreign(finished)
    ours = finished.keys() - foreign.keys() if recompute_foreign else finished
    tasks = plan.remaining(ours)
    untried = keys_given_up(failures, retry).difference(ours)
    tried = plan.possible(tasks, untried, failures)
    keys = {task.key for task in tried}
    given_up = tuple(task for task in tasks if task.key not in keys)
    return Rest(tried, given_up, foreign)


def keys_given_up(failures: Mapping[str, Attempt], retry: bool = False) -> set[str]:
    """Keys of the tasks that a run does not try again without `retry`; empty with `retry`."""
    return {key for key, attempt in failures.items() if attempt.given_up and not retry}
