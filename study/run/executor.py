"""How a process computes one task of a campaign: inputs from the store, result into it; and before all, the kernels."""

import errno
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache, lru_cache, partial
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from nanoslip.solver.case import Case
from nanoslip.solver.compiled import reporting_compilation
from nanoslip.solver.drive import Drive
from nanoslip.solver.outcome import COMPLETED, Ending, InvalidInput, Outcome
from nanoslip.study.notices import print_notice
from nanoslip.study.origin import arithmetic
from nanoslip.study.plan.kinds import compliance_task, contact_task, drive_task, record_task
from nanoslip.study.plan.plan import Plan
from nanoslip.study.plan.task import Task, TaskResult
from nanoslip.study.results.attempts import Attempt
from nanoslip.study.results.entry import CorruptResultError
from nanoslip.study.results.files import looks
from nanoslip.study.results.store import Store, StoreError
from nanoslip.study.run.compute import run_task
from nanoslip.study.run.dispatch import CannotGoOnError
from nanoslip.study.run.launch import Settle

# Kernels that a run needs are compiled before it begins, in one process: the others load them from numba's cache.

# Small tasks that run every kernel of a campaign's tasks.


_NUMBERS = {"n_x": 17, "radius": 50.0, "max_events": 300}
"""Numbers of a small case, whose record has a steady part."""
_SMALL = Case.of(_NUMBERS)
_COMPLIANCE, _OF_SLABS = compliance_task(_SMALL.slab), _SMALL.slab.flat
_ROUGH = ((-0.1, 0.0), (0.1, 0.0))
"""A rough pin has kernels of its own, whatever its profile."""


def miniatures(tasks: Sequence[Task]) -> tuple[Task, ...]:
    """Small tasks that run every kernel of these tasks, needs first."""
    found: dict[str, Task] = {}
    for (*_, choices), task in {(task.kind, _is_rough(task), _choices_of(task)): task for task in tasks}.items():
        with suppress(InvalidInput):  # what cannot be made small compiles its kernels itself
            found |= {each.key: each for each in _small(task, dict(choices))}
    return tuple(found.values())


def _choices_of(task: Task) -> tuple[tuple[str, object], ...]:
    """Words and switches of a task's drive, or of its case: they decide which kernels run, the numbers do not.

    The slab's are left out: nothing of a compliance is compiled.
    """
    part = task.drive or task.case
    flat = part.flat if part else {}
    return tuple([each for each in flat.items() if isinstance(each[1], str | bool) and each[0] not in _OF_SLABS])


def _is_rough(task: Task) -> bool:
    return task.case is not None and bool(task.case.heterogeneity.roughness)


def _small(task: Task, choices: Mapping[str, object]) -> list[Task]:
    if task.drive is not None:
        return [_COMPLIANCE, record_task(_SMALL), _short(task.drive)]
    if task.case is None:
        return []
    case = Case.of({**_NUMBERS, **choices, "roughness": _ROUGH if _is_rough(task) else ()})
    return [_COMPLIANCE, (contact_task if task.kind == "contact" else record_task)(case)]


def _short(drive: Drive) -> Task:
    """The drive over a hundredth of its duration, or all of it where that is less than a step of its integrator."""
    with suppress(InvalidInput):
        return drive_task(_SMALL, replace(drive, duration=(drive.duration or 100.0) / 100, samples=2))
    return drive_task(_SMALL, replace(drive, samples=2))


@dataclass(frozen=True, slots=True)
class WarmUp:
    """Compilation as a separate task, so that a crash costs no other task."""

    tasks: tuple[Task, ...]
    """Miniatures of those that a run computes."""
    key: str = "warm_up"
    needs: tuple[str, ...] = ()
    kind: str = "warm_up"
    cost: float = 60.0
    limit: float = 600.0
    label: str = "compiling kernels"

    def run(self) -> Outcome:
        """Run all of them, through a store: kernels are compiled for its read-only arrays.

        It is said before the first kernel is compiled, not where all are in the cache.
        """
        notice = cache(partial(print_notice, f"{self.label}, once: later runs load them"))
        with TemporaryDirectory() as folder, reporting_compilation(notice):
            store = Store(Path(folder))
            store.prepare()
            for task in self.tasks:
                with suppress(Exception):  # it fails again in a task of the run, where it is reported
                    store.write(run_task(task, {key: store.read(key) for key in task.needs}), task.shared)
        return COMPLETED


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
    if not any(store.folder.is_dir() for _ in looks()):
        raise FileNotFoundError(errno.ENOENT, NOT_THERE, str(store.folder))
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
    """A result that was reported as done. Raises OSError, so that a later run tries again."""
    try:
        for _ in looks():
            with suppress(FileNotFoundError):
                return store.read(key)
    except CorruptResultError as error:
        raise OSError(str(error)) from error  # the next run computes it again
    raise FileNotFoundError(errno.ENOENT, NOT_THERE, f"{store.folder}/{key}")


NOT_THERE: Final = "not there though another process has made it"
"""Of a folder or result that a network file system does not show in time."""


def drop_intermediates(plan: Plan, store: Store) -> None:
    """Remove results that only other tasks needed and that no unfinished task still needs. Raises StoreError."""
    if any(task.passing for task in plan.distinct):
        for key in plan.obsolete(store.finished()):
            store.drop(key)


# What is left of a campaign: what has failed for good before is not tried again.


@dataclass(frozen=True, slots=True)
class Left:
    """Remaining tasks of a campaign."""

    tasks: tuple[Task, ...]
    """Those that a run tries: what has failed comes last."""
    given_up: tuple[Task, ...]
    """Those that failed for good, and those that need one of them."""


def left(plan: Plan, failures: Mapping[str, Attempt], finished: Collection[str], retry: bool = False) -> Left:
    """Remaining tasks, given finished keys and failed tasks. retry: try failed tasks again."""
    tasks = plan.remaining(finished)
    tried = plan.possible(tasks, given_up(failures, retry).difference(finished), failures)
    if len(tried) == len(tasks):
        return Left(tried, ())
    keys = {task.key for task in tried}
    return Left(tried, tuple(task for task in tasks if task.key not in keys))


def given_up(failures: Mapping[str, Attempt], retry: bool = False) -> set[str]:
    """Keys of the tasks that a run does not try again by itself; none where it is to retry."""
    return {key for key, attempt in failures.items() if attempt.given_up and not retry}
