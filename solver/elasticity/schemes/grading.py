"""The graded hierarchy of node rows: from the surface down each level has half the intervals of the one above.

Head: `rows_per_level` rows of every level that is finer than the coarsest, each as thick as 3/2 of its node spacing.
Middle: rows of the coarsest level, at most twice as thick as their spacing; further than L_x from surface and bottom only
slowly varying fields are left (Saint-Venant), and rows thicken in proportion to that distance. Tail: the head mirrored,
up to the bottom row's level: where a held bottom meets a free side, stresses are singular (displacements as r^0.69 at
ν = 1/3, r^0.60 at 0.49: Williams), and what they add to a surface load's energy falls as the spacing there to the power 1.4 or
1.2. So the bottom row is by default eight times as fine as the coarsest, if the surface is: for a fifth more time than four
times as fine (n_x = 129, height 1; 8 nodes per surface node instead of 6) it halves the error, to 0.03 % at ν = 1/3 and
0.13 % at 0.49; sixteen times halves it again, where n_x is large enough.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solver.elasticity.grid import Grid

_THICKNESS = 1.5
"""Thickness of a row of head or tail, in its node spacings."""
_MIDDLE_THICKNESS = 2.0
"""Largest thickness of a row of the middle, in its node spacings, nearer than L_x to surface or bottom.

Where sixteen of the coarsest node spacings are more than L_x, they take its place.
"""
_THICKEST = 8.0
"""Largest thickness of a row further away, over that near the ends."""


def graded_hierarchy(n_x: int, aspect_ratio: float, rows_per_level: int, coarsest_row: int, bottom_row: int) -> Grid:
    """The graded grid of a slab: an odd number of rows, at least three. The nodes of two neighbouring rows are nested.

    rows_per_level: rows until the next has half the intervals; coarsest_row, bottom_row: nodes of these rows. Where the slab is
    too thin for all levels, the coarsest are left out.
    """
    coarsest, bottom = (round(math.log2((n_x - 1) // (nodes - 1))) for nodes in (coarsest_row, bottom_row))
    fitting = (_Ends(n_x, rows_per_level, level, bottom) for level in range(coarsest, -1, -1))
    ends = next(ends for ends in fitting if not ends.coarsest or ends.left_of(aspect_ratio) >= ends.spacing / 2)
    head, tail = ends.head, ends.tail
    middle = _middle_depths(ends, aspect_ratio)
    depths = np.concatenate(
        (
            np.concatenate(([0.0], np.cumsum(ends.thickness(head))))[:-1],
            middle,
            aspect_ratio - np.concatenate(([0.0], np.cumsum(ends.thickness(tail)[::-1])))[::-1][1:],
        )
    )
    levels = np.concatenate((head, np.full(len(middle), ends.coarsest), tail))
    return Grid(counts=(n_x - 1) // 2**levels + 1, depths=-depths)


@dataclass(frozen=True, slots=True)
class _Ends:
    """Head and tail of a hierarchy, as levels of their rows. The node spacing of level k is 2^k times the surface's."""

    n_x: int
    rows_per_level: int
    coarsest: int
    bottom: int

    @property
    def head(self) -> NDArray[np.int64]:
        """Levels of the head's rows, each with the spacing below it."""
        return np.repeat(np.arange(self.coarsest), self.rows_per_level)

    @property
    def tail(self) -> NDArray[np.int64]:
        """Levels of the tail's rows, each with the spacing above it."""
        return np.repeat(np.arange(self.coarsest - 1, self.bottom - 1, -1), self.rows_per_level)

    @property
    def spacing(self) -> float:
        """Node spacing of the coarsest level."""
        return 2.0**self.coarsest / (self.n_x - 1)

    def thickness(self, levels: NDArray[np.int64]) -> NDArray[np.float64]:
        """Thickness of rows of these levels, in L_x."""
        return _THICKNESS * 2.0**levels / (self.n_x - 1)

    def left_of(self, height: float) -> float:
        """Height that head and tail of a slab leave for the middle, in L_x."""
        return height - float(self.thickness(self.head).sum() + self.thickness(self.tail).sum())


def _middle_depths(ends: _Ends, height: float) -> NDArray[np.float64]:
    """Depths of the middle's rows in L_x, its two borders included. Their number makes that of all rows odd."""
    near = max(1.0, 16.0 * ends.spacing)
    upper = float(ends.thickness(ends.head).sum()) / near
    whole = height / near
    lower = whole - float(ends.thickness(ends.tail).sum()) / near
    first, last = _rows_above(upper, whole), _rows_above(lower, whole)
    odd = (len(ends.head) + len(ends.tail)) % 2
    wanted = (last - first) * near / (_MIDDLE_THICKNESS * ends.spacing)
    rows = max(2 - odd, 2 * math.ceil((wanted - odd) / 2 - 1e-9) + odd)
    inner = [near * _depth_of(place, whole) for place in np.linspace(first, last, rows + 1)[1:-1]]
    return np.array([near * upper, *inner, near * lower])


def _rows_above(depth: float, height: float) -> float:
    """Number of rows above a depth, a real number. Rows are as thick as they are far from surface or bottom, 1 to _THICKEST."""
    if depth > height / 2:
        return 2 * _rows_above(height / 2, height) - _rows_above(height - depth, height)
    if depth <= 1.0:
        return depth
    return 1.0 + math.log(min(depth, _THICKEST)) + max(0.0, depth / _THICKEST - 1.0)


def _depth_of(rows: float, height: float) -> float:
    """Inverse of `_rows_above`."""
    middle = _rows_above(height / 2, height)
    if rows > middle:
        return height - _depth_of(2 * middle - rows, height)
    if rows <= 1.0:
        return rows
    logarithm = math.log(_THICKEST)
    return math.exp(min(rows - 1.0, logarithm)) + _THICKEST * max(0.0, rows - 1.0 - logarithm)
