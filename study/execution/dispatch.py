"""Who does what: ready tasks go to the rank with the least to do. No ranks here, only their numbers."""

import heapq
from collections import defaultdict
from collections.abc import Callable, Sequence
from typing import Any

from study.execution.ledger import Ledger

LOOKAHEAD = 0.2
"""Seconds of work that may wait at a rank beyond the task it computes: hides the way there and back of tiny tasks."""

Send = Callable[[list[Any]], None]


class Crew:
    """What each rank was given and has not reported yet. A choice costs the same for two ranks as for thousands."""

    def __init__(self, sends: Sequence[Send]) -> None:
        """`sends[rank]` hands some tasks to that rank."""
        self._sends = sends
        self._doing: list[dict[str, tuple[Any, float]]] = [{} for _ in sends]
        self._load = [0.0] * len(sends)
        # (load, rank), least first. A rank's entries other than its present load are stale: dropped when they surface or crowd.
        self._least = [(0.0, rank) for rank in range(len(sends))]

    @property
    def busy(self) -> bool:
        """True while any rank has something to do."""
        return any(self._doing)

    def hand_out(self, ledger: Ledger[Any]) -> int:
        """Give each ready task to the least laden rank, as long as one is idle or will be within the lookahead."""
        parcels: dict[int, list[Any]] = defaultdict(list)
        given = 0
        while (task := ledger.backlog.first()) is not None:
            rank, seconds = self._least_laden(), ledger.expected(task)
            if self._doing[rank] and self._load[rank] + seconds > LOOKAHEAD:
                break
            parcels[rank].append(ledger.take())
            self._doing[rank][task.key] = (task, seconds)
            self._note(rank, self._load[rank] + seconds)
            given += 1
        for rank, tasks in parcels.items():
            self._sends[rank](tasks)
        return given

    def take_back(self, rank: int, key: str) -> Any:
        """The task of this key, which that rank has no more."""
        task, seconds = self._doing[rank].pop(key)
        # Exactly nothing where nothing is left, whatever was rounded, and infinite while unknown.
        self._note(rank, self._load[rank] - seconds if self._doing[rank] else 0.0)
        return task

    def forget(self, rank: int) -> None:
        """Count all of a rank's tasks as dropped."""
        self._doing[rank].clear()
        self._note(rank, 0.0)

    def _note(self, rank: int, normal_load: float) -> None:
        self._load[rank] = normal_load
        heapq.heappush(self._least, (normal_load, rank))
        if len(self._least) > 4 * len(self._load):
            self._least = [(each, rank) for rank, each in enumerate(self._load)]
            heapq.heapify(self._least)

    def _least_laden(self) -> int:
        while self._load[self._least[0][1]] != self._least[0][0]:
            heapq.heappop(self._least)
        return self._least[0][1]
