"""When a rank tells of its tasks: messages cost rank 0 more than what they say, so that news of short tasks travel together."""

import math
from typing import Generic, TypeVar

T = TypeVar("T")


class Outbox(Generic[T]):
    """News that have not been sent."""

    def __init__(self, patience: float) -> None:
        """patience: seconds that news may wait for further ones."""
        self._patience = patience
        self._news: list[T] = []
        self._oldest = math.inf

    def add(self, news: list[T], now: float) -> None:
        """Put news in. now: seconds of a clock; likewise in `due`."""
        if news and not self._news:
            self._oldest = now
        self._news += news

    def due(self, waiting: int, now: float) -> list[T]:
        """Take out what is to be sent now: all if no more tasks wait than have ended, or the oldest was patient enough."""
        if not self._news or (waiting > len(self._news) and now < self._oldest + self._patience):
            return []
        found, self._news = self._news, []
        return found
