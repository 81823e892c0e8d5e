"""A priority queue of tasks with dependencies: a task is ready once all that it needs is finished. No ranks here."""

import heapq
import itertools
from collections import defaultdict
from collections.abc import Sequence
from typing import Protocol


class Work(Protocol):
    """The attributes of a task that scheduling uses; `nanoslip.study.plan.task.Task` has them."""

    @property
    def key(self) -> str:
        """Name of the task, different for each."""

    @property
    def kind(self) -> str:
        """One of nanoslip.study.plan.kinds.KINDS."""

    @property
    def needs(self) -> tuple[str, ...]:
        """Keys of the tasks that have to be finished before it."""

    @property
    def cost(self) -> float:
        """Estimated seconds on one core."""

    @property
    def limit(self) -> float:
        """Seconds after which it is taken to hang."""

    @property
    def label(self) -> str:
        """Text that messages and progress name the task by."""


class TaskQueue:
    """Tasks not yet handed out. Of the ready ones the first in the given order is next (a plan's: longest chain of work first).

    A need that is not among the tasks counts as finished.
    """

    def __init__(self, tasks: Sequence[Work]) -> None:
        self.tasks = {task.key: task for task in tasks}
        """By key: those in the queue, and those that were taken and are not finished."""
        self.aside = 0
        """Number of tasks that were taken and set aside, now and for good."""
        self._places = {key: place for place, key in enumerate(self.tasks)}
        self._behind = itertools.count(len(tasks))
        self._missing: dict[str, set[str]] = {}  # of each task that has to wait: its needs that are not finished
        self._dependents: defaultdict[str, list[str]] = defaultdict(list)
        self._ready: list[tuple[int, str]] = []  # a heap: in order when it is made
        for task in tasks:
            needs = {need for need in task.needs if need in self.tasks}
            for need in needs:
                self._dependents[need].append(task.key)
            if needs:
                self._missing[task.key] = needs
            else:
                self._ready.append((self._places[task.key], task.key))

    def __len__(self) -> int:
        """Number of tasks in the queue, ready or not."""
        return len(self._ready) + len(self._missing) + self.aside

    @property
    def ready(self) -> int:
        """Number of tasks that could be handed out at once."""
        return len(self._ready)

    def take(self) -> Work:
        """Remove and return the next of the ready tasks, of which there is one."""
        return self.tasks[heapq.heappop(self._ready)[1]]

    def put_back(self, key: str) -> None:
        """Undo the taking of a task."""
        heapq.heappush(self._ready, (self._places[key], key))

    def put_last(self, key: str) -> None:
        """Put a taken task back, behind all others."""
        self._places[key] = next(self._behind)
        self.put_back(key)

    def finish(self, key: str) -> Work:
        """Mark a taken task as finished, and return it: tasks that needed only this one become ready."""
        finished = self.tasks.pop(key)
        for each in self._dependents.pop(key, ()):
            if (missing := self._missing.get(each)) is not None:
                missing.remove(key)
                if not missing:
                    del self._missing[each]
                    self.put_back(each)
        return finished

    def abandon(self, key: str) -> list[Work]:
        """Remove a taken task, which will never finish; return all that need it, directly or through others, and go with it."""
        del self.tasks[key]
        lost = [each for each in self._dependents.pop(key, ()) if self._missing.pop(each, None) is not None]
        return [task for each in lost for task in (self.tasks[each], *self.abandon(each))]
