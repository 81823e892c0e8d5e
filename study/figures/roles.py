"""Roles of the axes of a campaign in a figure: x axis, colours, panels, or one value; and their scales."""

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np
from matplotlib.ticker import LogLocator, NullFormatter
from numpy.typing import NDArray

from nanoslip.study.dataset.units import format_value
from nanoslip.study.figures.points import Points, format_in_figure, sort_values, unevenness

# Assignment of coordinates to a figure: x axis, colours, panels. Those left over are held at one value.

MOST_HUES: Final = 6
"""Most lines in one panel that colours distinguish; more values make a map."""
MOST_PANELS: Final = 9
FILLED: Final = 0.5
"""Share of a full product from which a design counts as a product; sparser designs are scattered."""


@dataclass(frozen=True, slots=True)
class Roles:
    """Coordinates by their place in a figure."""

    x: str
    hue: str = ""
    panels: tuple[str, ...] = ()
    held: Mapping[str, Any] = field(default_factory=dict)
    """Coordinates with too many values for panels, at the value that is shown."""
    mapped: bool = False
    """True if tiles are drawn: words, or many values of the hue, would make too many lines."""


def axis_sizes(points: Points) -> dict[str, int]:
    """Coordinate -> its number of values; numbers first, then by falling number."""
    counts = {name: len(set(values.tolist())) for name, values in points.axes.items()}
    is_text = {name: values.dtype.kind in "OUb" for name, values in points.axes.items()}
    names = sorted(counts, key=lambda name: (is_text[name], -counts[name]))
    return {name: counts[name] for name in names}


def merge_zipped(points: Points, chosen: Collection[str] = ()) -> tuple[Points, str]:
    """Merge zipped coordinates to one, and return its name; unchanged, and "", if no single one distinguishes the cases.

    chosen: coordinates of which one is taken before others.
    """
    columns = [points.axes[name].tolist() for name in points.zipped]
    cases = len(set(zip(*columns, strict=True)))
    counts = axis_sizes(points)
    # Only a coordinate with as many values as there are cases can label all of them alone.
    telling = [name for name in counts if name in points.zipped and counts[name] == cases]
    wanted = [name for name in chosen if name in points.zipped] or telling[:1]
    if len(points.zipped) < 2 or len(wanted) != 1 or wanted[0] not in telling:
        return points, ""
    merged = set(points.zipped) - set(wanted)
    axes = {name: values for name, values in points.axes.items() if name not in merged}
    return replace(points, axes=axes), wanted[0]


def is_scattered(points: Points) -> bool:
    """True if the cases fill so little of the product of their coordinates that there are no lines to draw."""
    counts = axis_sizes(points)
    product = math.prod(counts.values())
    # Along a single coordinate any design is a line.
    return len(counts) > 1 and len(points.values) < FILLED * product


def assign_roles(points: Points, x: str = "", hue: str = "") -> Roles:
    """Assign roles to all coordinates in which the cases differ: at least one. x, hue: chosen already.

    Raises ValueError if one is chosen twice, or the only one as hue.
    """
    counts = axis_sizes(points)
    others = [name for name in counts if name not in (x, hue)]
    if x == hue and x:
        raise ValueError(f"{x}: is x and hue: needs two axes")
    if not (x or others):
        raise ValueError(f"{hue}: the only axis: needs to be x, not hue")
    if not x:
        x = others.pop(0)
    if others and not hue:
        hue = others.pop(0)
    panels: list[str] = []
    fixed: dict[str, Any] = {}
    # The axes come by falling number of values, so those with few, which come last, get the panels.
    for name in others:
        count = math.prod(counts[axis] for axis in (*panels, name))
        if count <= MOST_PANELS:
            panels.append(name)
        else:
            values = axis_values(points, name)
            # The value in the middle, as an end of a range is often a limiting case.
            fixed[name] = values[len(values) // 2]
    mapped = bool(hue) and (points.text or counts[hue] > MOST_HUES)
    return Roles(x, hue, tuple(panels), fixed, mapped)


def axis_values(points: Points, name: str) -> list[Any]:
    """The values of a coordinate, as `sort_values` has them."""
    return sort_values(points.axes[name].tolist())


def select_points(points: Points, values: Mapping[str, Any]) -> Points:
    """The points with these values of coordinates."""
    chosen: NDArray[np.bool_] = np.ones(len(points.values), np.bool_)
    for name, value in values.items():
        chosen &= points.axes[name] == value
    return points.select(chosen)


# Positions of values along an axis: numbers on a linear or logarithmic scale, texts at equal distances.
#
# Beside a 0 such a scale is linear up to the smallest other number.

SPAN: Final = 8.0
"""Ratio of the largest to the smallest number from which a scale is logarithmic."""
CLOSE: Final = 30.0
"""Ratio of the largest to the smallest positive number above which the smallest is not visible beside a 0 on a linear scale."""
_TICKS: Final = 6
"""Values of a coordinate up to which each has its tick."""


def is_logarithmic(values: NDArray[Any]) -> bool:
    """True if numbers are positive, span at least the ratio `SPAN`, and lie more evenly in their logarithm."""
    numbers = np.unique(values[np.isfinite(values)])
    if len(numbers) < 2 or numbers[0] <= 0.0 or numbers[-1] < SPAN * numbers[0]:
        return False
    # Two numbers are even on any scale.
    if len(numbers) == 2:
        return True
    return unevenness(np.log(numbers)) < unevenness(numbers)


def begins_with_zero(values: NDArray[Any]) -> bool:
    """True if numbers are 0 and positive, and the smallest positive number would coincide with 0 on a linear
    scale."""
    numbers = np.unique(values[np.isfinite(values)])
    begins = len(numbers) > 2 and numbers[0] == 0.0
    return begins and bool(numbers[-1] > CLOSE * numbers[1])


def axis_positions(points: Points, name: str, chosen: Points) -> NDArray[Any]:
    """Positions of some of the points along a coordinate."""
    values = chosen.axes[name]
    if values.dtype.kind not in "Ob":
        return values
    # Words and switches have no size: they stand at equal distances, in the order of the axis.
    order = axis_values(points, name)
    places = [order.index(value) for value in values.tolist()]
    return np.array(places, dtype=float)


def set_axis(axis: Any, points: Points, name: str) -> None:
    """Scale and ticks of an axis (matplotlib's) along which a coordinate runs."""
    values = axis_values(points, name)
    if points.axes[name].dtype.kind in "Ob":
        names = list(map(format_in_figure, values))
        axis.set_ticks(range(len(values)), names)
        return
    if begins_with_zero(points.axes[name]):
        least, most = values[1], values[-1]
        # The linear part gets a decade, or its share among the values if these span more.
        room = max(math.log10(most / least) / len(values), 1.0)
        # Axes.set_xscale and set_yscale are two methods; this one serves either axis.
        axis._set_axes_scale("symlog", linthresh=least, linscale=room)
    elif is_logarithmic(points.axes[name]):
        axis._set_axes_scale("log")
        if values[-1] < 100.0 * values[0]:
            set_few_ticks(axis)
    if len(values) <= _TICKS:
        axis.set_ticks(values, list(map(format_value, values)))
        # Between the values of a coordinate there are no cases, so there are no minor ticks.
        axis.set_ticks([], minor=True)


def set_few_ticks(axis: Any) -> None:
    """Ticks of a logarithmic axis at 1, 2 and 5, as of powers of ten there would be one or two."""
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(lambda value, _: format_value(float(value)))
    axis.set_minor_formatter(NullFormatter())
