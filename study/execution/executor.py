"""How a process computes one task of a campaign: inputs from the store, result into it."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from solver.outcome import Ending, Outcome
from study.dataset.store import Store
from study.plan.plan import Plan
from study.plan.tasks import Task, run_task


def executor(out: Path) -> Callable[[Task], Outcome]:
    """The function that computes a task with the results in this folder and returns its outcome. It can be pickled."""
    return partial(_execute, Store(out))


def _execute(store: Store, task: Task) -> Outcome:
    result = run_task(task, {key: store.read(key) for key in task.needs})
    if result.outcome.ending is not Ending.OUT_OF_MEMORY:  # another machine, or fewer ranks, may compute it
        store.write(result)
    return result.outcome


def drop_intermediates(plan: Plan, computed: Sequence[Task], store: Store) -> None:
    """Remove records that only other tasks needed and that no unfinished task still needs. Raises StoreError."""
    if any(task.intermediate and task.kind == "record" for task in computed):
        for key in plan.obsolete(store.finished()):
            store.drop(key)
