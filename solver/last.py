"""Cache of a function's last answer, for values that several estimates or steps of a case share."""

from collections.abc import Callable
from functools import wraps
from typing import TypeVar

Of = TypeVar("Of")
Answer = TypeVar("Answer")


def cache_last(function: Callable[[Of], Answer]) -> Callable[[Of], Answer]:
    """The function of a frozen value, cached for its last argument."""
    known: tuple[Of, Answer] | None = None

    @wraps(function)
    def look_up(value: Of) -> Answer:
        nonlocal known
        last = known  # another thread may ask meanwhile
        if last is None or last[0] is not value:
            known = last = value, function(value)
        return last[1]

    return look_up
