"""Dynamic load balancing: ready tasks go in parcels to the rank with the least estimated work. Ranks are numbers here: no MPI."""

import heapq
import math
import time
from collections import defaultdict
from collections.abc import Callable, Collection, Sequence
from typing import Any, Final

from nanoslip.study.execution.ledger import Begin, Ledger

LOOKAHEAD: Final = 0.2
"""Seconds of work that may wait at a rank beyond the task it computes, of few ranks: hides the latency of messages."""

INTERVAL: Final = 5e-4
"""Seconds between two parcels, of all ranks together: so long that messages cost rank 0 less than the tasks in them."""

STRANDED: Final = 1.0
"""Seconds (or twice the lookahead) without news from a rank after which the tasks that wait there are handed out again."""

PARCELS: Final = 2
"""Each rank's share of the ready tasks comes in at least so many parcels: towards the end they become smaller."""

REFILL: Final = 0.75
"""Share of the lookahead from which on a rank is not given more: one task at a time would be a message each."""

Send = Callable[[list[Any]], None]


def lookahead(ranks: int) -> float:
    """Seconds of work that may wait at one of so many ranks."""
    return max(LOOKAHEAD, INTERVAL * ranks)


class Dispatcher:
    """Tasks given to each rank and not reported yet. Choosing a rank costs the same for two ranks as for thousands."""

    def __init__(self, sends: Sequence[Send], begin: Begin[Any] = lambda *_: None) -> None:
        """sends: `sends[rank]` sends a list of tasks to that rank. begin: callback, called with them."""
        self._sends, self._begin = sends, begin
        self._lookahead = lookahead(len(sends))
        self._doing: list[dict[str, float]] = [{} for _ in sends]  # key -> expected seconds
        self._load = [0.0] * len(sends)
        self._news = [0.0] * len(sends)
        self._next_look = 0.0
        # (load, rank), least first. A rank's entries other than its present load are stale: dropped when they surface or crowd.
        self._least = [(0.0, rank) for rank in range(len(sends))]
        self._lighter: set[int] = set()  # ranks whose present load has no entry

    @property
    def busy(self) -> bool:
        """Whether any rank has a task that it has not reported."""
        return any(self._doing)

    def hand_out(self, ledger: Ledger[Any]) -> None:
        """Send ready tasks to the least loaded rank while it is idle or will be within the lookahead."""
        for rank in self._lighter:
            self._set_load(rank, self._load[rank])
        self._lighter.clear()
        parcels: dict[int, list[Any]] = defaultdict(list)
        enough = REFILL * self._lookahead
        while self._load[rank := self._least_loaded()] < enough and (tasks := self._parcel(rank, ledger)):
            parcels[rank] += tasks
        for rank, tasks in parcels.items():
            self._sends[rank](tasks)

    def take_back(self, rank: int, keys: Collection[str]) -> None:
        """Note that a rank has reported or given back the tasks of these keys."""
        if not keys:
            return
        doing = self._doing[rank]
        seconds = sum(map(doing.pop, keys))
        self._news[rank] = time.monotonic()
        # Exactly nothing where nothing is left, whatever was rounded, and infinite while unknown.
        self._load[rank] = self._load[rank] - seconds if doing else 0.0
        self._lighter.add(rank)

    def stranded(self) -> list[int]:
        """Ranks whose task takes so much longer than expected that those behind it had better go elsewhere; none twice."""
        now = time.monotonic()
        if now < self._next_look:
            return []
        self._next_look = now + 0.1 * STRANDED  # a look at all ranks takes its time
        late = now - max(STRANDED, 2.0 * self._lookahead)
        found = [rank for rank, tasks in enumerate(self._doing) if len(tasks) > 1 and self._news[rank] < late]
        for rank in found:
            self._set_load(rank, math.inf)  # until it is idle
            self._news[rank] = math.inf
        return found

    def _parcel(self, rank: int, ledger: Ledger[Any]) -> list[Any]:
        """Take the next tasks for a rank: one if it is idle, and more while they are short and enough are left for others.

        Nothing where no task is ready, or the rank has enough to do.
        """
        doing, load = self._doing[rank], self._load[rank]
        if not doing:
            self._news[rank] = time.monotonic()
        most = max(ledger.queue.ready // (PARCELS * len(self._load)), 1)
        taken = ledger.parcel(most, self._lookahead - load, at_least_one=not doing)
        if taken:
            self._begin(taken)
            doing |= ((task.key, seconds) for task, seconds in taken)
            self._set_load(rank, load + sum(seconds for _, seconds in taken))
        return [task for task, _ in taken]

    def _set_load(self, rank: int, seconds: float) -> None:
        self._load[rank] = seconds
        heapq.heappush(self._least, (seconds, rank))
        if len(self._least) > 4 * len(self._load):
            self._least = [(each, rank) for rank, each in enumerate(self._load)]
            heapq.heapify(self._least)

    def _least_loaded(self) -> int:
        while self._load[self._least[0][1]] != self._least[0][0]:
            heapq.heappop(self._least)
        return self._least[0][1]
