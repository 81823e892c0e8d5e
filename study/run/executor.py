"""Compute tasks of a campaign in a process, their kernels first: inputs from the store, results into it."""

import errno
import gc
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from functools import cache, lru_cache, partial
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from nanoslip.solver.compiled import reporting_compilation
from nanoslip.solver.outcome import COMPLETED, Ending, InvalidInput, Outcome
from nanoslip.study.notices import print_notice
from nanoslip.study.origin import arithmetic
from nanoslip.study.results.entry import NOT_OURS, CorruptResultError, UnusableResultError
from nanoslip.study.results.files import looks
from nanoslip.study.results.store import Store, StoreError
from nanoslip.study.run.child import Agent
from nanoslip.study.run.dispatch import CannotGoOnError
from nanoslip.study.run.launch import Settle, cores, task_program
from nanoslip.study.tasks.compute import run_task
from nanoslip.study.tasks.kind import KINDS
from nanoslip.study.tasks.miniature import compiling_choices, compiling_shape, make_record
from nanoslip.study.tasks.task import Task, TaskResult

# Kernels that a run needs are compiled before it begins, in one task: all processes then load them from numba's cache. Small
# tasks run every kernel of a campaign's tasks: the miniatures of their kinds. Those of drives need no record that was computed,
# so that a second process can compile their kernels meanwhile.


def miniatures(tasks: Sequence[Task]) -> tuple[Task, ...]:
    """Small tasks that run every kernel of these tasks; a drive's needs no more than `make_record`."""
    # One task for each choice of kernels, as numbers decide none.
    unlike = {_kernel_choices(task): task for task in tasks}
    tasks_by_key: dict[str, Task] = {}
    for task in unlike.values():
        # A task that cannot be made small compiles its kernels itself.
        with suppress(InvalidInput):
            small = KINDS[task.kind].miniature(task)
            tasks_by_key |= {miniature.key: miniature for miniature in small}
    return tuple(tasks_by_key.values())


def _kernel_choices(task: Task) -> tuple[object, ...]:
    """Values that decide which kernels a task runs: equal for tasks with equal miniatures."""
    return task.kind, str(compiling_shape(task.case)), *compiling_choices(task).items()


POLL_SECONDS: Final = 0.01
"""Seconds between two looks whether the second process is done."""


@dataclass(frozen=True, slots=True)
class WarmUp:
    """Compilation as a separate task, so that a crash costs no other task."""

    tasks: tuple[Task, ...]
    """Miniature versions of the run's tasks."""
    alone: bool = False
    """True if it neither reports that it compiles nor starts a second process."""
    key: str = "warm_up"
    needs: tuple[str, ...] = ()
    kind: str = "warm_up"
    cost: float = 60.0
    limit: float = 600.0
    label: str = "compiling kernels"

    def run(self) -> Outcome:
        """Run all tasks; drives in a second process if a core is free and other kernels are compiled, too.

        A notice is printed before the first kernel is compiled, and none if all kernels are in the cache.
        """
        drives = [task for task in self.tasks if task.drive]
        others = [task for task in self.tasks if not task.drive]
        with TemporaryDirectory() as folder, ExitStack() as stack:
            beside: list[Agent] = []

            @cache
            def begin() -> None:
                if not self.alone:
                    print_notice(f"{self.label}, once: later runs load them")
                    if others and drives and cores() > 1:
                        beside.append(Agent(task_program(Path(folder)), 0))
                        stack.callback(beside[0].close)
                        of_drives = WarmUp(tuple(drives), alone=True)
                        beside[0].give([of_drives])

            stack.enter_context(reporting_compilation(begin))
            stack.enter_context(_pausing_collection())
            # Meanwhile the second process compiles the kernels of drives, which the last line then
            # loads.
            _compute(others, Path(folder))
            while any(agent.busy for agent in beside):
                beside[0].arrived()
                time.sleep(POLL_SECONDS)
            _compute(drives, Path(folder))
        return COMPLETED


def _compute(tasks: Sequence[Task], folder: Path) -> None:
    """Through a store: kernels are compiled for its read-only arrays."""
    store = Store(folder)
    store.prepare()
    for task in tasks:
        # A kernel that fails here fails again in a task of the run, where it is reported.
        with suppress(Exception):
            needs = {key: make_record(key) if task.drive else store.read(key) for key in task.needs}
            store.write(run_task(task, needs), task.shared)


@contextmanager
def _pausing_collection() -> Iterator[None]:
    """Stop garbage collection, which takes an eighth of the time of a compiler that makes and keeps millions of objects."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()


# Tasks of the run itself.

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
