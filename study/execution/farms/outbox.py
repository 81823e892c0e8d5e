"""What a rank tells of its tasks, and when: a message costs rank 0 more than what it says, so short tasks travel together."""

import math
from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from nanoslip.solver.outcome import UNDONE, Ending
from nanoslip.study.execution.ledger import Done


@dataclass(frozen=True, slots=True)
class News:
    """What a rank tells of its tasks, in as few objects as can be: rank 0 reads what thousands of ranks tell."""

    ended: Mapping[Ending, Mapping[str, float]]
    """Seconds that tasks took, by their keys, and these by how the tasks ended. Their results say the rest."""
    failed: tuple[Done, ...] = ()
    """The tasks that failed."""
    returned: tuple[str, ...] = ()
    """Keys of the tasks that the rank has not begun and will not."""
    where: str = ""
    """Rank and host."""


def news_of(done: Iterable[Done], returned: tuple[str, ...] = ()) -> News:
    """What is to be told of tasks of one rank."""
    ended: defaultdict[Ending, dict[str, float]] = defaultdict(dict)
    failed = []
    where = ""
    for each in done:
        where = each.where
        if each.outcome.ending in UNDONE:
            failed.append(each)
        else:
            ended[each.outcome.ending][each.key] = each.seconds
    return News(dict(ended), tuple(failed), returned, where)


class Outbox:
    """News that have not been sent."""

    def __init__(self, patience: float) -> None:
        """patience: seconds that news may wait for further ones."""
        self._patience = patience
        self._done: list[Done] = []
        self._returned: tuple[str, ...] = ()
        self._oldest = math.inf

    def add(self, done: list[Done], returned: tuple[str, ...], now: float) -> None:
        """Put in what has ended or is returned. now: seconds of a clock; likewise in `due`."""
        if done or returned:
            self._oldest = min(self._oldest, now)
        self._done += done
        self._returned += returned

    def due(self, waiting: int, now: float) -> News | None:
        """Take out what is to be sent now: all if no more tasks wait than have ended, or the oldest was patient enough."""
        if self._oldest == math.inf or (waiting > len(self._done) and now < self._oldest + self._patience):
            return None
        news = news_of(self._done, self._returned)
        self._done, self._returned, self._oldest = [], (), math.inf
        return news
