"""A parameter of every case: its distinct values, and which of them each case has."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray


class Values(NamedTuple):
    """Values of cases one behind the other."""

    distinct: Sequence[Any]
    """None where a case has none."""
    which: NDArray[np.int32]
    """Of each case: the number of its value."""


def values_of(each: Sequence[Any]) -> Values:
    """Those of every case, the distinct ones once."""
    numbers = {value: number for number, value in enumerate(dict.fromkeys(each))}
    if len(numbers) == 1:
        return Values(list(numbers), np.zeros(len(each), np.int32))
    return Values(list(numbers), np.fromiter(map(numbers.__getitem__, each), np.int32, len(each)))


class Column:
    """The values of all cases. Little is kept of a parameter that is constant."""

    def __init__(self, cases: int) -> None:
        self._cases = cases
        self._numbers: dict[Any, int] = {}
        self._seen = 0
        self._of_case: NDArray[np.int32] | None = None

    def add(self, values: Values) -> None:
        """The values of the next cases."""
        numbers = [self._numbers.setdefault(value, len(self._numbers)) for value in values.distinct]
        if any(numbers) and self._of_case is None:  # all before had the first
            self._of_case = np.zeros(self._cases, np.int32)
        count = len(values.which)
        if self._of_case is not None:
            self._of_case[self._seen : self._seen + count] = np.array(numbers, np.int32)[values.which]
        self._seen += count

    @property
    def values(self) -> list[Any]:
        """The distinct ones."""
        return [value for value in self._numbers if value is not None]

    @property
    def count(self) -> int:
        """Cases that have one."""
        return int(np.count_nonzero(self._having()))

    def spread(self, places: NDArray[np.intp], size: int) -> NDArray[Any]:
        """The values at the places of their cases, which are so many at least."""
        sample, having = self.values[0], self._having()
        # Whole numbers stay whole, as floats lose digits beyond 2^53, except where some are missing.
        whole = isinstance(sample, int) and bool(having.all())
        kind: Any = object if isinstance(sample, str) else np.int64 if whole else float
        missing: Any = "" if isinstance(sample, str) else 0 if whole else np.nan
        known = np.array([missing if value is None else value for value in self._numbers], kind)
        found = np.full(size, missing, kind)
        found[places] = known[self._of_each()]
        return found

    def _of_each(self) -> NDArray[np.int32]:
        return np.zeros(self._cases, np.int32) if self._of_case is None else self._of_case

    def _having(self) -> NDArray[np.bool_]:
        return np.not_equal(self._of_each(), self._numbers.get(None, -1))
