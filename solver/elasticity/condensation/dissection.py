"""Invert a sparse stiffness at the surface alone, by nested dissection (George 1973).

The slab is cut in two, each half in two again. A piece meets the rest of the slab only in the fields along its cuts, and
those are few: the grid has few rows, and they are the coarser the deeper they lie. Eliminating a piece leaves what the rest
sees of it: a stiffness of the fields along its border, and how its surface follows them. Its own surface's compliance grows
by a product of low rank for every cut, from the smallest pieces up to the slab.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from solver.elasticity.stiffness import Sparse
from solver.outcome import SingularOperator

Dense = NDArray[np.float64]
Indices = NDArray[np.int64]

SMALLEST = 160
"""A piece of at most so many fields is eliminated at once: below, more time goes into calls than into arithmetic."""
NONE: Indices = np.empty(0, np.int64)
ROWS_AT_ONCE = 64
"""Rows of a product that are added at once: they stay in the cache."""


class _Piece(NamedTuple):
    """What the rest of the slab sees of a piece that is eliminated."""

    border: Indices
    """Fields outside that it acts on."""
    stiffness: Dense
    """Added to that of the border's fields among each other."""
    surface: slice
    """Numbers of surface fields, those inside the piece among them."""
    follows: Dense
    """Displacements of these per displacement of the border; zero of fields outside the piece."""
    bears: Dense
    """Forces on the border's fields per force on these."""
    reciprocal_condition: float
    """The least of all cuts so far."""


@dataclass(frozen=True, slots=True, eq=False)
class _Slab:
    """Stiffness by rows and by columns, where its two differ or not; and the surface's compliance as it grows."""

    rows: Sparse
    columns: Sparse
    places: Dense
    """x and z of each field, (fields, 2)."""
    number: Indices
    """Of surface fields from left to right, -1 elsewhere; (fields,)."""
    compliance: Dense

    def eliminated(self, inside: Indices, last: Indices = NONE) -> _Piece:
        """Eliminate the fields `inside`, sorted: first each side of a cut, then the cut, and with it those that come last.

        Raises SingularOperator.
        """
        cut, *sides = self._cut(inside, last)
        pieces = [self.eliminated(side) for side in sides if len(side)]
        rows, columns = self.rows[cut], self.columns[cut]
        met = np.concatenate((rows.indices, columns.indices, *(piece.border for piece in pieces)))
        border, count = np.setdiff1d(met, inside), len(cut)
        front = np.concatenate((cut, border))
        place = np.full(len(self.number), len(front))
        place[front] = np.arange(len(front))
        stiffness = np.zeros((len(front), len(front)))
        stiffness[:count] = _dense(rows, place, len(front))
        stiffness[:, :count] = _dense(columns, place, len(front)).T
        surface = _range(self.number[inside])
        follows, bears = (np.zeros((surface.stop - surface.start, len(front))) for _ in range(2))
        for piece in pieces:
            at = place[piece.border]
            stiffness[np.ix_(at, at)] += piece.stiffness
            within = slice(piece.surface.start - surface.start, piece.surface.stop - surface.start)
            follows[within, at] += piece.follows
            bears[within, at] += piece.bears.T
        top = np.flatnonzero(self.number[cut] >= 0)
        at = self.number[cut[top]] - surface.start
        follows[at, top] = bears[at, top] = 1.0
        found = self._without(stiffness, surface, follows, bears.T, border)
        return found._replace(reciprocal_condition=min(one.reciprocal_condition for one in (found, *pieces)))

    def _without(self, stiffness: Dense, surface: slice, follows: Dense, bears: Dense, border: Indices) -> _Piece:
        """The piece once its cut's fields, which stand first, are eliminated as well."""
        cut = len(stiffness) - len(border)
        solved, reciprocal_condition = _solved(
            stiffness[:cut, :cut], np.concatenate((bears[:cut], stiffness[:cut, cut:]), axis=1)
        )
        of_surface, of_border = solved[:, : bears.shape[1]], solved[:, bears.shape[1] :]
        for first in range(surface.start, surface.stop, ROWS_AT_ONCE):
            some = slice(first, min(first + ROWS_AT_ONCE, surface.stop))
            within = slice(some.start - surface.start, some.stop - surface.start)
            self.compliance[some, surface] += follows[within, :cut] @ of_surface
        return _Piece(
            border,
            stiffness[cut:, cut:] - stiffness[cut:, :cut] @ of_border,
            surface,
            follows[:, cut:] - follows[:, :cut] @ of_border,
            bears[cut:] - stiffness[cut:, :cut] @ of_surface,
            reciprocal_condition,
        )

    def _cut(self, inside: Indices, last: Indices) -> tuple[Indices, Indices, Indices]:
        """Fields of the shorter cut, upright or level, through the middle, and with it the last; and those on either side."""
        if len(last):
            cut, left, right = self._cut(np.setdiff1d(inside, last, assume_unique=True), NONE)
            return np.sort(np.concatenate((cut, last))), left, right
        if len(inside) <= SMALLEST:
            return inside, inside[:0], inside[:0]
        ways = [self._cut_along(inside, self.places[inside, axis]) for axis in (0, 1)]
        return min(ways, key=lambda way: len(way[0]))

    def _cut_along(self, inside: Indices, places: Dense) -> tuple[Indices, Indices, Indices]:
        """All fields of one side that act on the other are cut: the side further left, or deeper, without surface."""
        beyond = places >= np.partition(places, len(places) // 2)[len(places) // 2]
        below = inside[~beyond]
        if not len(below):
            return inside, below, below
        far = np.zeros(len(self.number), dtype=np.bool_)
        far[inside[beyond]] = True
        acting = _any(self.rows[below], far) | _any(self.columns[below], far)
        return below[acting], below[~acting], inside[beyond]


def surface_inverse(matrix: Sparse, places: Dense, surface: Indices, last: Indices = NONE) -> tuple[Dense, float]:
    """matrix⁻¹ at the fields `surface` alone, (len(surface), len(surface)); and the least reciprocal condition of the cuts.

    places: x and z of every field, (fields, 2). The surface, given from left to right, has the largest z. last: fields that act
    far and wide, eliminated after all others. Raises SingularOperator where a cut's fields cannot be solved for.
    """
    number = np.full(len(places), -1)
    number[surface] = np.arange(len(surface))
    found = np.zeros((len(surface), len(surface)))
    by_columns = scipy.sparse.csr_array(matrix.T)
    whole = _Slab(matrix, by_columns, places, number, found).eliminated(np.arange(len(places)), last)
    return found, whole.reciprocal_condition


def _dense(rows: Sparse, place: Indices, count: int) -> Dense:
    """Sparse rows with their columns where `place` says, (rows, count); what has no place is left out."""
    found = np.zeros((rows.shape[0], count + 1))
    found[np.repeat(np.arange(rows.shape[0]), np.diff(rows.indptr)), place[rows.indices]] = rows.data
    return found[:, :count]


def _any(rows: Sparse, marked: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which of the sparse rows have an entry in a marked column, (rows,)."""
    counted = np.concatenate(([0], np.cumsum(marked[rows.indices])))
    return np.asarray(np.diff(counted[rows.indptr]) > 0)


def _range(numbers: Indices) -> slice:
    """From the least to the largest number that is not negative."""
    found = numbers[numbers >= 0]
    return slice(int(found.min()), int(found.max()) + 1) if len(found) else slice(0, 0)


def _solved(matrix: Dense, right: Dense) -> tuple[Dense, float]:
    """matrix⁻¹ right, and the matrix's reciprocal condition. Raises SingularOperator where that is below machine precision."""
    norm = np.abs(matrix).sum(axis=0).max(initial=0.0)
    factors, pivots, info = scipy.linalg.lapack.dgetrf(matrix)
    reciprocal_condition = 0.0 if info else float(scipy.linalg.lapack.dgecon(factors, norm)[0])
    if reciprocal_condition < np.finfo(float).eps:
        raise SingularOperator(
            f"the slab's stiffness is singular (reciprocal condition {reciprocal_condition:.1e}): "
            "check that the support restrains it, and that poisson is not too close to 0.5"
        )
    return scipy.linalg.lapack.dgetrs(factors, pivots, right)[0], reciprocal_condition
