"""Invert a sparse stiffness at the surface alone, by nested dissection (George 1973).

The slab is cut in two, each half in two again. A piece shares with the rest of the slab only the fields along its cuts. They
are few, as the grid has few rows, which are coarser the deeper they lie. Eliminating a piece leaves two matrices: the stiffness
of the fields along its border, and the displacements of its surface per displacement of these. The compliance of its surface
grows by a product of low rank for every cut, from the smallest pieces up to the slab.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from solver.elasticity.condensation.elimination import Eliminated, definitely_eliminated, eliminated
from solver.elasticity.stiffness import Sparse

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
    surface: slice
    """Numbers of surface fields, those inside the piece among them."""
    left: Eliminated
    """Of its border: the stiffness is added to that among these fields; fields outside the piece follow nothing."""
    reciprocal_condition: float
    """The least of all cuts so far."""


class _Front(NamedTuple):
    """Fields of a cut, and behind them those beyond the piece that it meets."""

    cut: Indices
    border: Indices
    place: Indices
    """Of every field of the slab; `size` of those that are not among them."""

    @property
    def size(self) -> int:
        """Number of its fields."""
        return len(self.cut) + len(self.border)


@dataclass(frozen=True, slots=True, eq=False)
class _Slab:
    """Stiffness by rows and by columns; and the surface's compliance as it grows."""

    rows: Sparse
    columns: Sparse
    """The rows themselves of a stiffness that is symmetric and positive definite."""
    places: Dense
    """x and z of each field, (fields, 2)."""
    number: Indices
    """Of surface fields from left to right, -1 elsewhere; (fields,)."""
    compliance: Dense
    """Of a symmetric stiffness on and above the diagonal."""

    @property
    def symmetric(self) -> bool:
        """Whether the stiffness is symmetric and positive definite."""
        return self.columns is self.rows

    def eliminated(self, inside: Indices, last: Indices = NONE) -> _Piece:
        """Eliminate the fields `inside`, sorted: first each side of a cut, then the cut, and with it those that come last.

        Raises SingularOperator.
        """
        cut, *sides = self._cut(inside, last)
        pieces = [self.eliminated(side) for side in sides if len(side)]
        acting = [_entries(each, cut) for each in ((self.rows,) if self.symmetric else (self.rows, self.columns))]
        front = self._front(cut, inside, [*(each.columns for each in acting), *(piece.border for piece in pieces)])
        stiffness = _stiffness(acting, front)
        for piece in pieces:
            at = front.place[piece.border]
            stiffness[np.ix_(at, at)] += piece.left.stiffness
        surface = _range(self.number[inside])
        follows = self._of_surface(surface, front, [(piece, piece.left.follows) for piece in pieces])
        if self.symmetric:
            left = definitely_eliminated(stiffness, len(cut), follows)
        else:
            bears = self._of_surface(surface, front, [(piece, piece.left.bears.T) for piece in pieces])
            left = eliminated(stiffness, len(cut), follows, bears.T)
        self._grow(surface, *left.grown)
        worst = min([left.reciprocal_condition, *(piece.reciprocal_condition for piece in pieces)])
        return _Piece(front.border, surface, left, worst)

    def _front(self, cut: Indices, inside: Indices, met: list[Indices]) -> _Front:
        """The front of a cut through `inside`, whose piece meets these fields, those that lie inside it among them."""
        beyond = np.zeros(len(self.number), np.bool_)
        for fields in met:
            beyond[fields] = True
        beyond[inside] = False
        border = np.flatnonzero(beyond)
        size = len(cut) + len(border)
        place = np.full(len(self.number), size)
        place[cut], place[border] = np.arange(len(cut)), np.arange(len(cut), size)
        return _Front(cut, border, place)

    def _of_surface(self, surface: slice, front: _Front, pieces: list[tuple[_Piece, Dense]]) -> Dense:
        """What a piece's surface follows of a front, (surface, size): of the pieces on either side what theirs does."""
        follows = np.zeros((surface.stop - surface.start, front.size))
        for piece, of_border in pieces:
            within = slice(piece.surface.start - surface.start, piece.surface.stop - surface.start)
            follows[within, front.place[piece.border]] += of_border
        top = np.flatnonzero(self.number[front.cut] >= 0)
        follows[self.number[front.cut[top]] - surface.start, top] = 1.0
        return follows

    def _grow(self, surface: slice, one: Dense, other: Dense) -> None:
        """Add a product to the compliance of part of the surface."""
        for first in range(surface.start, surface.stop, ROWS_AT_ONCE):
            last = min(first + ROWS_AT_ONCE, surface.stop)
            begin = first if self.symmetric else surface.start
            rows = one[first - surface.start : last - surface.start]
            self.compliance[first:last, begin : surface.stop] += rows @ other[:, begin - surface.start :]

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
        acting = _any(self.rows, below, far)
        if not self.symmetric:
            acting |= _any(self.columns, below, far)
        return below[acting], below[~acting], inside[beyond]


def surface_inverse(
    matrix: Sparse, places: Dense, surface: Indices, last: Indices = NONE, symmetric: bool = False
) -> tuple[Dense, float]:
    """matrix⁻¹ at the fields `surface` alone, (len(surface), len(surface)); and the least reciprocal condition of the cuts.

    places: x and z of every field, (fields, 2). The surface, given from left to right, has the largest z. last: fields that act
    far and wide, eliminated after all others. symmetric: whether the matrix is symmetric and positive definite, as what is
    found then is exactly. Raises SingularOperator where a cut's fields cannot be solved for.
    """
    number = np.full(len(places), -1)
    number[surface] = np.arange(len(surface))
    found = np.zeros((len(surface), len(surface)))
    columns = matrix if symmetric else scipy.sparse.csr_array(matrix.T)
    whole = _Slab(matrix, columns, places, number, found).eliminated(np.arange(len(places)), last)
    if symmetric:
        _mirror(found)
    return found, whole.reciprocal_condition


class _Entries(NamedTuple):
    """Entries of some rows of a sparse matrix."""

    rows: Indices
    """Number of each one's row among these."""
    columns: Indices
    values: Dense


def _entries(matrix: Sparse, rows: Indices) -> _Entries:
    """Faster than scipy's for few rows, of which there are many lots."""
    begin = matrix.indptr[rows]
    counts = matrix.indptr[rows + 1] - begin
    of_row = np.repeat(np.arange(len(rows)), counts)
    at = np.arange(len(of_row)) + (begin - np.cumsum(counts) + counts)[of_row]
    return _Entries(of_row, matrix.indices[at], matrix.data[at])


def _stiffness(acting: list[_Entries], front: _Front) -> Dense:
    """Stiffness of a front without that of its border's fields among each other, (size, size).

    acting: entries of the cut's rows, and of its columns where these differ.
    """
    size, cut = front.size, len(front.cut)
    found = np.zeros((size + 1, size + 1))
    for entries, way in zip(acting, (found, found.T), strict=False):
        way[entries.rows, front.place[entries.columns]] = entries.values
    if len(acting) == 1:
        found[cut:, :cut] = found[:cut, cut:].T
    return found[:size, :size]


def _any(matrix: Sparse, rows: Indices, marked: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which of these rows of a sparse matrix have an entry in a marked column, (rows,)."""
    entries = _entries(matrix, rows)
    found = np.zeros(len(rows), np.bool_)
    found[entries.rows[marked[entries.columns]]] = True
    return found


def _mirror(square: Dense) -> None:
    """Fill what lies below the diagonal with what lies above it, in place."""
    for first in range(0, len(square), ROWS_AT_ONCE):
        some, rest = slice(first, first + ROWS_AT_ONCE), slice(first + ROWS_AT_ONCE, None)
        block = np.triu(square[some, some])
        square[some, some] = block + np.triu(block, 1).T
        square[rest, some] = square[some, rest].T


def _range(numbers: Indices) -> slice:
    """From the least to the largest number that is not negative."""
    found = numbers[numbers >= 0]
    return slice(int(found.min()), int(found.max()) + 1) if len(found) else slice(0, 0)
