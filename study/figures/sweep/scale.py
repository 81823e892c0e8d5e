"""Positions of values along an axis: numbers on a linear or logarithmic scale, texts at equal distances.

Beside a 0 such a scale is linear up to the smallest other number.
"""

import math
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from nanoslip.study.figures.sweep.label import said
from nanoslip.study.figures.sweep.points import Points
from nanoslip.study.figures.sweep.roles import values_of

SPAN: Final = 8.0
"""Ratio of the largest to the smallest number from which a scale is logarithmic."""
CLOSE: Final = 30.0
"""Ratio of the largest to the smallest positive number from which that one could not be told from a 0 on a linear scale."""
_TICKS: Final = 6
"""Values of a coordinate up to which each has its tick."""


def is_logarithmic(values: NDArray[Any]) -> bool:
    """Whether numbers are positive, span at least the ratio `SPAN`, and lie more evenly in their logarithm."""
    numbers = np.unique(values[np.isfinite(values)])
    if len(numbers) < 2 or numbers[0] <= 0.0 or numbers[-1] < SPAN * numbers[0]:
        return False
    return len(numbers) == 2 or _unevenness(np.log(numbers)) < _unevenness(numbers)


def begins_with_zero(values: NDArray[Any]) -> bool:
    """Whether numbers are a 0 and positive ones of which the smallest would lie on it, were the scale linear."""
    numbers = np.unique(values[np.isfinite(values)])
    return len(numbers) > 2 and numbers[0] == 0.0 and bool(numbers[-1] > CLOSE * numbers[1])


def _unevenness(numbers: NDArray[Any]) -> float:
    steps = np.diff(numbers)
    return float(np.std(steps) / np.mean(steps))


def places_of(points: Points, name: str, chosen: Points) -> NDArray[Any]:
    """Where some of the points lie along a coordinate."""
    values = chosen.axes[name]
    if values.dtype.kind not in "Ob":
        return values
    order = values_of(points, name)
    return np.array([order.index(value) for value in values.tolist()], dtype=float)


def set_axis(axis: Any, points: Points, name: str) -> None:
    """Scale and ticks of an axis (matplotlib's) along which a coordinate runs."""
    values = values_of(points, name)
    if points.axes[name].dtype.kind in "Ob":
        axis.set_ticks(range(len(values)), list(map(said, values)))
        return
    if begins_with_zero(points.axes[name]):
        least, most = values[1], values[-1]
        room = max(math.log10(most / least) / len(values), 1.0)
        axis._set_axes_scale("symlog", linthresh=least, linscale=room)
    elif is_logarithmic(points.axes[name]):
        axis._set_axes_scale("log")
    if len(values) <= _TICKS:
        axis.set_ticks(values, list(map(said, values)))
        axis.set_ticks([], minor=True)
