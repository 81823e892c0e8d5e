"""A priority queue of tasks with dependencies: a task is ready once all that it needs is finished. No ranks here."""

import heapq
from collections import defaultdict
from collections.abc import Sequence
from typing import Generic, Protocol, TypeVar


class Work(Protocol):
    """The attributes of a task that scheduling uses; `study.plan.tasks.Task` has them."""

    @property
    def key(self) -> str:
        """Name of the task, different for each."""
        ...

    @property
    def kind(self) -> str:
        """One of study.plan.tasks.KINDS."""
        ...

    @property
    def needs(self) -> tuple[str, ...]:
        """Keys of the tasks that have to be finished before it."""
        ...

    @property
    def cost(self) -> float:
        """Estimated seconds on one core."""
        ...

    @property
    def limit(self) -> float:
        """Seconds after which it is taken to hang."""
        ...

    @property
    def label(self) -> str:
        """Text that messages and progress name the task by."""
        ...


W = TypeVar("W", bound=Work)


class TaskQueue(Generic[W]):
    """Tasks not yet handed out. Of the ready ones the first in the given order is next (a plan's: longest chain of work first).

    A need that is not among the tasks counts as finished.
    """

    def __init__(self, tasks: Sequence[W]) -> None:
        self._tasks = tuple(tasks)
        self._position = {task.key: position for position, task in enumerate(tasks)}
        self._missing = {task.key: {need for need in task.needs if need in self._position} for task in tasks}
        self._dependents: dict[str, list[str]] = defaultdict(list)
        for key, needs in self._missing.items():
            for need in needs:
                self._dependents[need].append(key)
        self._ready = [self._position[key] for key, needs in self._missing.items() if not needs]
        heapq.heapify(self._ready)

    def __len__(self) -> int:
        """Number of tasks in the queue, ready or not."""
        return len(self._missing)

    def first(self) -> W | None:
        """The task to hand out next; None while no task is ready."""
        return self._tasks[self._ready[0]] if self._ready else None

    def take(self) -> W:
        """Remove and return the task that `first` returns."""
        task = self._tasks[heapq.heappop(self._ready)]
        del self._missing[task.key]
        return task

    def put_back(self, task: W) -> None:
        """Undo the taking of a task."""
        self._missing[task.key] = set()
        heapq.heappush(self._ready, self._position[task.key])

    def put_last(self, task: W) -> None:
        """Put a taken task back, behind all others."""
        self._tasks += (task,)
        self._position[task.key] = len(self._tasks) - 1
        self.put_back(task)

    def finish(self, key: str) -> None:
        """Mark a taken task as finished: tasks that needed only this one become ready."""
        for dependent in self._dependents[key]:
            needs = self._missing.get(dependent)
            if needs is not None:
                needs.discard(key)
                if not needs:
                    heapq.heappush(self._ready, self._position[dependent])

    def abandon(self, key: str) -> list[W]:
        """Remove and return all tasks that need a taken task, directly or through others: it will never finish."""
        lost = []
        for dependent in self._dependents[key]:
            if self._missing.pop(dependent, None) is not None:
                lost += [self._tasks[self._position[dependent]], *self.abandon(dependent)]
        return lost
