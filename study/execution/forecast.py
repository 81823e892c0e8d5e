"""How long tasks take on several ranks, from what each is predicted to cost and what others of its kind have cost so far."""

import heapq
import math
from collections import defaultdict
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import Any, Final

from study.execution.queue import TaskQueue, Work

MEMORY: Final = 0.05
"""Share of the tasks of a kind after which an ended one counts half: what is left is like those that ended last."""
DOUBT: Final = 2.0
"""An estimate counts as much as so many finished tasks of its kind."""


LEAST: Final = 1e-3
"""Lower bound of a task's expected seconds: its files and messages, however little it computes."""


@dataclass(slots=True)
class _Account:
    """What tasks of one kind were estimated to take, and took, s."""

    estimated: float = 0.0
    measured: float = 0.0
    tasks: float = 0


class Measured:
    """What finished tasks of a campaign took, kind by kind, over what they were predicted to."""

    def __init__(self, *data: Mapping[str, Sequence[float]]) -> None:
        """data: kind -> number of tasks, seconds predicted, seconds measured; of several runs, which are added up."""
        self._accounts: defaultdict[str, _Account] = defaultdict(_Account)
        for each in data:
            for kind, (tasks, estimated, measured) in each.items():
                self._add(kind, tasks, estimated, measured)

    def learn(self, tasks: Sequence[Work], seconds: Collection[float]) -> None:
        """Note that tasks have ended, each after so many seconds."""
        for task, took in zip(tasks, seconds, strict=True):
            self._add(task.kind, 1, task.cost, took)

    def as_data(self) -> dict[str, list[float]]:
        """The sums, as a journal holds them."""
        return {
            kind: [each.tasks, round(each.estimated, 6), round(each.measured, 6)]
            for kind, each in self._accounts.items()
        }

    def factor(self, kind: str) -> float:
        """Measured over predicted seconds: of this kind, else of all kinds together; 1 where nothing is measured."""
        known = self._accounts.get(kind, _Account())
        several = [known] if known.estimated > 0.0 else list(self._accounts.values())
        estimated = sum(each.estimated for each in several)
        return sum(each.measured for each in several) / estimated if estimated > 0.0 else 1.0

    def seconds(self, task: Work) -> float:
        """Expected seconds of a task."""
        return task.cost * self.factor(task.kind)

    def tasks(self, kinds: Collection[str]) -> int:
        """Number of measured tasks of these kinds; 0 unless there are some of each."""
        found = [int(self._accounts[kind].tasks) if kind in self._accounts else 0 for kind in kinds]
        return sum(found) if all(found) else 0

    def _add(self, kind: str, tasks: float, estimated: float, measured: float) -> None:
        account = self._accounts[kind]
        account.tasks += tasks
        account.estimated += estimated
        account.measured += measured


class Expectation(Measured):
    """How long tasks in hand will take; nothing is expected of a kind of which none has ended."""

    def seconds(self, task: Work) -> float:
        """Expected seconds of a task; infinite before any of its kind has ended."""
        account = self._accounts[task.kind]
        if account.estimated == 0.0:
            return math.inf
        seconds = task.cost * account.measured / account.estimated
        return seconds if seconds > LEAST else LEAST  # not `max`: this is asked of every task


@dataclass(slots=True)
class _Fading(_Account):
    """Of a kind: what is left, and what has ended, which counts the less the longer ago."""

    left: float = 0.0
    """Estimated seconds of those that have not ended."""
    count: int = 0
    """Number of all tasks."""
    keep: float = 1.0
    """What an ended task still counts after another one."""
    doubt: float = 0.0
    """Seconds of ended tasks as which the estimate counts."""


class Forecast:
    """Time that a run still takes: estimates, each scaled by what tasks of its kind took over what they were estimated to.

    A kind of which little is done is scaled as in earlier runs, without those as all kinds together, and at first not at all.
    """

    def __init__(self, tasks: Sequence[Work], ranks: int = 1, measured: Measured | None = None) -> None:
        """measured: what tasks of the campaign took in earlier runs, if any."""
        self._ranks = ranks
        self._before = measured or Measured()
        self._kinds: defaultdict[str, _Fading] = defaultdict(_Fading)
        for task in tasks:
            kind = self._kinds[task.kind]
            kind.left += task.cost
            kind.count += 1
        for kind in self._kinds.values():
            kind.keep = 0.5 ** (1.0 / max(MEMORY * kind.count, 1.0))
            kind.doubt = DOUBT * kind.left / kind.count
        self._done = 0.0

    def learn(self, tasks: Sequence[Work], seconds: Collection[float]) -> None:
        """Note that tasks have ended, each after so many seconds."""
        for task, took in zip(tasks, seconds, strict=True):
            kind, cost = self._kinds[task.kind], task.cost
            kind.left -= cost
            kind.estimated = kind.keep * kind.estimated + cost
            kind.measured = kind.keep * kind.measured + took
        self._done += sum(seconds)

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
        kinds = {kind: (each, self._before.factor(kind)) for kind, each in self._kinds.items()}
        least = min((kind.doubt for kind, _ in kinds.values()), default=0.0)
        measured = sum(kind.measured for kind, _ in kinds.values())
        # Over what earlier runs lead to expect.
        speed = _scaled(measured, sum(before * kind.estimated for kind, before in kinds.values()), least, 1.0)
        return sum(
            max(kind.left, 0.0) * _scaled(kind.measured, kind.estimated, kind.doubt, before * speed)
            for kind, before in kinds.values()
        )


def _scaled(measured: float, estimated: float, doubt: float, else_: float) -> float:
    """Measured over estimated, drawn towards what is known otherwise."""
    return (measured + doubt * else_) / (estimated + doubt) if estimated + doubt > 0.0 else else_


def makespan(tasks: Sequence[Work], ranks: int, seconds: Callable[[Work], float] = attrgetter("cost")) -> float:
    """Seconds until so many ranks have done all tasks, each after its needs, every rank taking the next ready one.

    seconds: of each task.
    """
    if ranks == 1:
        return sum(map(seconds, tasks), 0.0)
    queue: TaskQueue[Any] = TaskQueue(tasks)
    running: list[tuple[float, str]] = []
    now = 0.0
    while len(queue) or running:
        while len(running) < ranks and queue.ready:
            task = queue.take()
            heapq.heappush(running, (now + seconds(task), task.key))
        now, key = heapq.heappop(running)
        queue.finish(key)
    return now


def roughly(seconds: float) -> str:
    """Seconds as text to one digit: `about 0.05 s`, `about 3 min`, `about 2 h`, `about 4 days`."""
    units = ((95.0, 1.0, "s"), (95.0, 60.0, "min"), (47.0, 3600.0, "h"), (math.inf, 86400.0, "days"))
    number, word = next((seconds / unit, word) for most, unit, word in units if seconds / unit < most)
    return f"about {float(f'{number:.1g}'):g} {word}"


def duration(seconds: float) -> str:
    """Seconds as text: `0.05 s`, `83 s`, `1:23:20`, `11.6 days`."""
    if seconds < 99.5:
        return f"{seconds:.2g} s" if seconds > 1e-3 else "0 s"
    if seconds >= 100.0 * 3600.0:
        return f"{seconds / 86400.0:.3g} days"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}"
