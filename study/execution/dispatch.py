"""Dynamic load balancing: each ready task goes to the rank with the least estimated work. Ranks are numbers here: no MPI."""

import heapq
import math
import time
from collections import defaultdict
from collections.abc import Callable, Sequence
from typing import Any

from study.execution.ledger import Ledger

LOOKAHEAD = 0.2
"""Seconds of work that may wait at a rank beyond the task it computes: hides the latency of messages."""

STRANDED = 1.0
"""Seconds without news from a rank after which the tasks that wait there are handed out again."""

Send = Callable[[list[Any]], None]


class Dispatcher:
    """Tasks given to each rank and not reported yet. Choosing a rank costs the same for two ranks as for thousands."""

    def __init__(self, sends: Sequence[Send]) -> None:
        """sends: `sends[rank]` sends a list of tasks to that rank."""
        self._sends = sends
        self._doing: list[dict[str, tuple[Any, float]]] = [{} for _ in sends]
        self._load = [0.0] * len(sends)
        self._news = [0.0] * len(sends)
        # (load, rank), least first. A rank's entries other than its present load are stale: dropped when they surface or crowd.
        self._least = [(0.0, rank) for rank in range(len(sends))]

    @property
    def busy(self) -> bool:
        """Whether any rank has a task that it has not reported."""
        return any(self._doing)

    def hand_out(self, ledger: Ledger[Any]) -> int:
        """Send ready tasks to the least loaded rank while it is idle or will be within the lookahead; returns how many."""
        parcels: dict[int, list[Any]] = defaultdict(list)
        given = 0
        while (task := ledger.queue.first()) is not None:
            rank, seconds = self._least_loaded(), ledger.expected(task)
            if self._doing[rank] and self._load[rank] + seconds > LOOKAHEAD:
                break
            if not self._doing[rank]:
                self._news[rank] = time.monotonic()
            parcels[rank].append(ledger.take())
            self._doing[rank][task.key] = (task, seconds)
            self._set_load(rank, self._load[rank] + seconds)
            given += 1
        for rank, tasks in parcels.items():
            self._sends[rank](tasks)
        return given

    def take_back(self, rank: int, key: str) -> Any:
        """Remove and return the task of this key, which that rank reported or gave back."""
        task, seconds = self._doing[rank].pop(key)
        self._news[rank] = time.monotonic()
        # Exactly nothing where nothing is left, whatever was rounded, and infinite while unknown.
        self._set_load(rank, self._load[rank] - seconds if self._doing[rank] else 0.0)
        return task

    def stranded(self) -> list[int]:
        """Ranks whose task takes so much longer than expected that those behind it had better go elsewhere; none twice."""
        late = time.monotonic() - STRANDED
        found = [rank for rank, tasks in enumerate(self._doing) if len(tasks) > 1 and self._news[rank] < late]
        for rank in found:
            self._set_load(rank, math.inf)  # until it is idle
            self._news[rank] = math.inf
        return found

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
