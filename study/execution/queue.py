"""A priority queue of tasks with dependencies: a task is ready once all that it needs is finished. No ranks here."""

import heapq
from collections.abc import Sequence
from typing import Final, Generic, Protocol, TypeVar


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

GONE: Final = -1
"""Stands for the missing needs of a task that is not in the queue."""


class TaskQueue(Generic[W]):
    """Tasks not yet handed out. Of the ready ones the first in the given order is next (a plan's: longest chain of work first).

    A need that is not among the tasks counts as finished. Of millions of tasks little is kept: their places in the order.
    """

    def __init__(self, tasks: Sequence[W]) -> None:
        self._tasks = list(tasks)
        needed = {need for task in tasks for need in task.needs}
        needed &= {task.key for task in tasks if task.key in needed}
        self._dependents: dict[str, list[int]] = {key: [] for key in needed}
        self._missing: list[int] = []  # of each task: how many of its needs are not finished, or GONE
        for place, task in enumerate(tasks):
            needs = {need for need in task.needs if need in needed}
            for need in needs:
                self._dependents[need].append(place)
            self._missing.append(len(needs))
        self._ready = [place for place, missing in enumerate(self._missing) if not missing]  # sorted, so it is a heap
        self._taken: dict[str, int] = {}
        self._count = len(self._tasks)
        self._aside = 0

    def __len__(self) -> int:
        """Number of tasks in the queue, ready or not."""
        return self._count

    @property
    def ready(self) -> int:
        """Number of tasks that could be handed out at once."""
        return len(self._ready)

    def first(self) -> W | None:
        """The task to hand out next; None while no task is ready."""
        return self._tasks[self._ready[0]] if self._ready else None

    @property
    def aside(self) -> int:
        """Number of tasks that were set aside."""
        return self._aside

    def set_aside(self) -> None:
        """Leave the task that `first` returns in the queue, and never hand it out."""
        heapq.heappop(self._ready)
        self._aside += 1

    def take(self) -> W:
        """Remove and return the task that `first` returns."""
        place = heapq.heappop(self._ready)
        task = self._tasks[place]
        self._taken[task.key] = place
        self._missing[place] = GONE
        self._count -= 1
        return task

    def put_back(self, task: W) -> None:
        """Undo the taking of a task."""
        place = self._taken.pop(task.key)
        self._missing[place] = 0
        self._count += 1
        heapq.heappush(self._ready, place)

    def put_last(self, task: W) -> None:
        """Put a taken task back, behind all others."""
        self._taken[task.key] = len(self._tasks)
        self._tasks.append(task)
        self._missing.append(GONE)
        self.put_back(task)

    def finish(self, key: str) -> None:
        """Mark a taken task as finished: tasks that needed only this one become ready."""
        self._taken.pop(key, None)
        for place in self._dependents.pop(key, ()):
            if self._missing[place] != GONE:
                self._missing[place] -= 1
                if not self._missing[place]:
                    heapq.heappush(self._ready, place)

    def abandon(self, key: str) -> list[W]:
        """Remove and return all tasks that need a taken task, directly or through others: it will never finish."""
        self._taken.pop(key, None)
        lost = []
        for place in self._dependents.pop(key, ()):
            if self._missing[place] != GONE:
                self._missing[place] = GONE
                self._count -= 1
                task = self._tasks[place]
                lost += [task, *self.abandon(task.key)]
        return lost
