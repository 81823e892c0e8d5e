"""How long tasks take on several ranks, from what each is estimated to cost and what others of its kind have cost so far."""

import heapq
import math
from collections import Counter, defaultdict
from collections.abc import Sequence
from typing import Any, Final

from study.execution.queue import TaskQueue, Work

MEMORY: Final = 0.05
"""Share of the tasks of a kind after which an ended one counts half: what is left is like those that ended last."""
DOUBT: Final = 2.0
"""An estimate counts as much as so many finished tasks of its kind."""


LEAST: Final = 1e-3
"""Lower bound of a task's expected seconds: its files and messages, however little it computes."""


class Expectation:
    """How long a task will take: its estimate, scaled by what tasks of its kind took over what they were estimated to."""

    def __init__(self) -> None:
        self._estimated: defaultdict[str, float] = defaultdict(float)
        self._measured: defaultdict[str, float] = defaultdict(float)
        self._scales: dict[str, float] = {}

    def learn(self, task: Work, seconds: float) -> None:
        """Note that a task has ended after so many seconds."""
        kind = task.kind
        self._estimated[kind] += task.cost
        self._measured[kind] += seconds
        if self._estimated[kind] > 0.0:
            self._scales[kind] = self._measured[kind] / self._estimated[kind]

    def seconds(self, task: Work) -> float:
        """Expected seconds of a task; infinite before any of its kind has ended."""
        scale = self._scales.get(task.kind)
        return math.inf if scale is None else max(task.cost * scale, LEAST)


class Forecast:
    """Time that a run still takes: estimates, each scaled by what tasks of its kind took over what they were estimated to.

    A kind of which little is done is scaled as all kinds together, and at first not at all.
    """

    def __init__(self, tasks: Sequence[Work], ranks: int = 1) -> None:
        self._ranks = ranks
        self._left: defaultdict[str, float] = defaultdict(float)
        count: Counter[str] = Counter()
        for task in tasks:
            self._left[task.kind] += task.cost
            count[task.kind] += 1
        self._keep = {kind: 0.5 ** (1.0 / max(MEMORY * number, 1.0)) for kind, number in count.items()}
        self._doubt = {kind: DOUBT * cost / count[kind] for kind, cost in self._left.items()}
        self._done = 0.0
        self._estimated: defaultdict[str, float] = defaultdict(float)
        self._measured: defaultdict[str, float] = defaultdict(float)

    def learn(self, task: Work, seconds: float) -> None:
        """Note that a task has ended after so many seconds."""
        self._left[task.kind] -= task.cost
        self._done += seconds
        keep = self._keep[task.kind]
        self._estimated[task.kind] = keep * self._estimated[task.kind] + task.cost
        self._measured[task.kind] = keep * self._measured[task.kind] + seconds

    @property
    def seconds(self) -> float:
        """Seconds until all ranks together have done what is left."""
        return self._core_seconds() / self._ranks

    @property
    def share(self) -> float:
        """Share of the work that is done, 0 to 1."""
        left = self._core_seconds()
        return self._done / (self._done + left) if left > 0.0 else 1.0

    def _core_seconds(self) -> float:
        least = min(self._doubt.values(), default=0.0)
        speed = _scaled(sum(self._measured.values()), sum(self._estimated.values()), least, 1.0)
        return sum(
            max(left, 0.0) * _scaled(self._measured[kind], self._estimated[kind], self._doubt[kind], speed)
            for kind, left in self._left.items()
        )


def _scaled(measured: float, estimated: float, doubt: float, else_: float) -> float:
    """Measured over estimated, drawn towards what is known otherwise."""
    return (measured + doubt * else_) / (estimated + doubt) if estimated + doubt > 0.0 else else_


def makespan(tasks: Sequence[Work], ranks: int) -> float:
    """Seconds until so many ranks have done all tasks, each after its needs, every rank taking the next ready one."""
    if ranks == 1:
        return sum((task.cost for task in tasks), 0.0)
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
    """Seconds as text: `0.05 s`, `83 s`, `1:23:20`, `11.6 days`."""
    if seconds < 99.5:
        return f"{seconds:.2g} s" if seconds > 1e-3 else "0 s"
    if seconds >= 100.0 * 3600.0:
        return f"{seconds / 86400.0:.3g} days"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}"
