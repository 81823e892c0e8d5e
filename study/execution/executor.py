"""How a process computes one task of a campaign: inputs from the store, result into it."""

from collections.abc import Callable
from functools import lru_cache, partial
from importlib import import_module
from pathlib import Path
from typing import Final

from nanoslip.solver.outcome import COMPLETED, Ending, Outcome
from nanoslip.study.execution.compiling.warm_up import WarmUp
from nanoslip.study.execution.ledger import CannotGoOnError
from nanoslip.study.execution.program import Settle
from nanoslip.study.origin import arithmetic
from nanoslip.study.plan.plan import Plan
from nanoslip.study.plan.task import TaskResult
from nanoslip.study.plan.tasks import Task, run_task
from nanoslip.study.results.entry import CorruptResultError
from nanoslip.study.results.store import Store, StoreError

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
    """Remove records that only other tasks needed and that no unfinished task still needs. Raises StoreError."""
    if any(task.intermediate and task.kind == "record" for task in plan.tasks):
        for key in plan.obsolete(store.finished()):
            store.drop(key)
