"""A priority queue of tasks with dependencies: a task is ready once all that it needs is finished. No ranks here."""

import heapq
from collections.abc import Sequence
from typing import Final, Generic, Protocol, TypeVar


class Work(Protocol):
    """The attributes of a task that scheduling uses; `nanoslip.study.plan.task.Task` has them."""

    @property
    def key(self) -> str:
        """Name of the task, different for each."""
        ...

    @property
    def kind(self) -> str:
        """One of nanoslip.study.plan.kinds.KINDS."""
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

_NONE: Final[list[int]] = []
"""The dependents of all tasks that nobody needs: of millions of tasks most."""


class TaskQueue(Generic[W]):
    """Tasks not yet handed out. Of the ready ones the first in the given order is next (a plan's: longest chain of work first).

    A need that is not among the tasks counts as finished. Of millions of tasks little is kept: their places in the order.
    """

    def __init__(self, tasks: Sequence[W]) -> None:
        self._tasks = list(tasks)
        needed = {need for task in tasks for need in task.needs}
        places = {task.key: place for place, task in enumerate(tasks) if task.key in needed}
        self._dependents: list[list[int]] = [_NONE] * len(self._tasks)  # of each task: the places of those that need it
        for place in places.values():
            self._dependents[place] = []
        self._missing: list[int] = []  # of each task: how many of its needs are not finished, or GONE
        for place, task in enumerate(tasks):
            needs = {places[need] for need in task.needs if need in places}
            for need in needs:
                self._dependents[need].append(place)
            self._missing.append(len(needs))
        # The next ready task is the last of a sorted list, which costs nothing to take, or else the first of a heap, which does.
        self._ready = [place for place, missing in enumerate(self._missing) if not missing][::-1]
        self._later: list[int] = []
        self._taken: dict[str, int] = {}
        self._count = len(self._tasks)
        self._aside = 0

    def __len__(self) -> int:
        """Number of tasks in the queue, ready or not."""
        return self._count

    @property
    def ready(self) -> int:
        """Number of tasks that could be handed out at once."""
        return len(self._ready) + len(self._later)

    @property
    def aside(self) -> int:
        """Number of tasks that were set aside."""
        return self._aside

    def take(self) -> W:
        """Remove and return the next of the ready tasks, of which there is one."""
        if not self._ready:
            self._ready, self._later = sorted(self._later, reverse=True), []
        late = self._later and self._later[0] < self._ready[-1]
        place = heapq.heappop(self._later) if late else self._ready.pop()
        task = self._tasks[place]
        self._taken[task.key] = place
        self._missing[place] = GONE
        self._count -= 1
        return task

    def taken(self, key: str) -> W:
        """The taken task of this key."""
        return self._tasks[self._taken[key]]

    def put_back(self, key: str) -> None:
        """Undo the taking of a task."""
        self._make_ready(self._untake(key))

    def set_aside(self, key: str) -> None:
        """Undo the taking of a task, and never hand it out again."""
        self._untake(key)
        self._aside += 1

    def put_last(self, key: str) -> None:
        """Put a taken task back, behind all others."""
        place = self._taken[key]
        self._taken[key] = len(self._tasks)
        self._tasks.append(self._tasks[place])
        self._dependents.append(self._dependents[place])
        self._missing.append(GONE)
        self.put_back(key)

    def finish(self, key: str) -> W:
        """Mark a taken task as finished, and return it: tasks that needed only this one become ready."""
        finished = self._taken.pop(key)
        for place in self._dependents[finished]:
            if self._missing[place] != GONE:
                self._missing[place] -= 1
                if not self._missing[place]:
                    self._make_ready(place)
        return self._tasks[finished]

    def abandon(self, key: str) -> list[W]:
        """Remove and return all tasks that need a taken task, directly or through others: it will never finish."""
        return self._without(self._taken.pop(key))

    def _without(self, lost: int) -> list[W]:
        found = []
        for place in self._dependents[lost]:
            if self._missing[place] != GONE:
                self._missing[place] = GONE
                self._count -= 1
                found += [self._tasks[place], *self._without(place)]
        return found

    def _untake(self, key: str) -> int:
        place = self._taken.pop(key)
        self._missing[place] = 0
        self._count += 1
        return place

    def _make_ready(self, place: int) -> None:
        if self._ready and self._ready[-1] < place:
            heapq.heappush(self._later, place)
        else:
            self._ready.append(place)
