"""Assignment of coordinates to a figure: x axis, colours, panels. Those left over are held at one value."""

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from nanoslip.study.figures.sweep.points import LACKING, Points

MOST_HUES: Final = 6
"""Lines in one panel that are told apart by colour; more values make a map."""
MOST_PANELS: Final = 9
FILLED: Final = 0.5
"""Share of a full product from which a design counts as one; sparser ones are scattered."""


@dataclass(frozen=True, slots=True)
class Roles:
    """Coordinates by their place in a figure."""

    x: str
    hue: str = ""
    panels: tuple[str, ...] = ()
    held: Mapping[str, Any] = field(default_factory=dict)
    """Those with too many values for panels, at the value that is shown."""


def counts_of(points: Points) -> dict[str, int]:
    """Coordinate -> its number of values; numbers first, then by falling number."""
    counts = {name: len(set(values.tolist())) for name, values in points.axes.items()}
    return dict(sorted(counts.items(), key=lambda item: (points.axes[item[0]].dtype.kind in "OUb", -item[1])))


def together(points: Points, chosen: Collection[str] = ()) -> tuple[Points, str]:
    """Points whose zipped coordinates are one, and its name; as they are, and "", where no single one tells the cases apart.

    chosen: coordinates of which one is taken before others.
    """
    cases = len(set(zip(*(points.axes[name].tolist() for name in points.zipped), strict=True)))
    telling = [name for name, count in counts_of(points).items() if name in points.zipped and count == cases]
    wanted = [name for name in chosen if name in points.zipped] or telling[:1]
    if len(points.zipped) < 2 or len(wanted) != 1 or wanted[0] not in telling:
        return points, ""
    return points.without([name for name in points.zipped if name != wanted[0]]), wanted[0]


def scattered(points: Points) -> bool:
    """Whether the cases fill so little of the product of their coordinates that there are no lines to draw."""
    counts = counts_of(points)
    return len(counts) > 1 and len(points.values) < FILLED * math.prod(counts.values())


def roles_of(points: Points, x: str = "", hue: str = "") -> Roles:
    """Roles of all coordinates in which the cases differ: at least one. x, hue: those that are chosen already.

    Raises ValueError where one is chosen twice, or the only one as hue.
    """
    counts = counts_of(points)
    left = [name for name in counts if name not in (x, hue)]
    if x == hue and x:
        raise ValueError(f"{x}: is x and hue: needs two axes")
    if not (x or left):
        raise ValueError(f"{hue}: the only axis: needs to be x, not hue")
    x = x or left.pop(0)
    hue = hue or (left.pop(0) if left else "")
    panels: list[str] = []
    held: dict[str, Any] = {}
    for name in left:
        if math.prod(counts[each] for each in (*panels, name)) <= MOST_PANELS:
            panels.append(name)
        else:
            values = values_of(points, name)
            held[name] = values[len(values) // 2]
    return Roles(x, hue, tuple(panels), held)


def values_of(points: Points, name: str) -> list[Any]:
    """The values of a coordinate: numbers in their order, also where some cases lack them, last; texts as they come."""
    found = list(dict.fromkeys(points.axes[name].tolist()))
    if points.axes[name].dtype.kind != "O":
        return sorted(found)
    try:
        return sorted(found, key=lambda value: (value == LACKING, 0.0 if value == LACKING else float(value)))
    except ValueError:
        return found


def held_at(points: Points, values: Mapping[str, Any]) -> Points:
    """The points with these values of coordinates."""
    chosen: NDArray[np.bool_] = np.ones(len(points.values), np.bool_)
    for name, value in values.items():
        chosen &= points.axes[name] == value
    return points.at(chosen)
