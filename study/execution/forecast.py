"""How long tasks take on several ranks, from what each is estimated to cost."""

import heapq
from collections.abc import Sequence
from typing import Any

from study.execution.queue import TaskQueue, Work


def makespan(tasks: Sequence[Work], ranks: int) -> float:
    """Seconds until so many ranks have done all tasks, each after its needs, every rank taking the next ready one."""
    queue: TaskQueue[Any] = TaskQueue(tasks)
    running: list[tuple[float, str]] = []
    now = 0.0
    while len(queue) or running:
        while len(running) < ranks and queue.first() is not None:
            task = queue.take()
            heapq.heappush(running, (now + task.cost, task.key))
        now, key = heapq.heappop(running)
        queue.finish(key)
    return now


def duration(seconds: float) -> str:
    """Seconds as text: `0.05 s`, `83 s`, `1:23:20`, `12 days`."""
    if seconds < 100.0:
        return f"{seconds:.2g} s"
    if seconds >= 100.0 * 3600.0:
        return f"{seconds / 86400.0:.3g} days"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}"
