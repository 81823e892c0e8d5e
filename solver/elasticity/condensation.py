"""Condensation of a slab's stiffness to the compliance of its surface: parity, elimination, dissection."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from nanoslip.solver.arrays import Dense, Floats, Indices
from nanoslip.solver.elasticity.grid import Grid, Sparse, Stiffness
from nanoslip.solver.outcome import SingularOperator

# Even and odd displacement fields. A slab that is symmetric about its middle does not couple them: each is solved alone.
#
# Reflection x → -x leaves w of an even field as it is and changes the sign of u; for an odd field it is the other way round.
# Two problems of half the size cost half of one.


@dataclass(frozen=True, slots=True, eq=False)
class Fields:
    """Orthonormal displacement fields: every entry of [u; w] belongs to one of them, or to none. Arrays (2·nodes,).

    number: of the entry's field, -1 for none. weight: its displacement in that field.
    """

    number: NDArray[np.int64]
    weight: Floats

    @property
    def count(self) -> int:
        """Number of fields."""
        return int(self.number.max()) + 1

    @property
    def first_entries(self) -> NDArray[np.int64]:
        """The first entry of [u; w] that belongs to each field, (count,): the left one of a pair."""
        return np.unique(self.number, return_index=True)[1][-self.count :]


def families(k: Stiffness) -> list[Fields]:
    """Families of displacement fields that the stiffness does not couple, without restrained displacements.

    There are two, even and odd, where the support is symmetric; otherwise one of all displacements.
    """
    # A support on one side alone couples even and odd fields.
    if not np.array_equal(k.fixed, k.fixed[:, _mirror(k.grid)]):
        weight = np.where(k.fixed.ravel(), 0.0, 1.0)
        return [_number_fields(np.arange(2 * k.grid.nodes), weight)]
    return [_parity_fields(k, sign) for sign in (1.0, -1.0)]


def project_stiffness(matrix: Sparse, fields: Fields) -> Sparse:
    """Project the stiffness between displacements, (2·nodes, 2·nodes), onto fields, (count, count)."""
    entries = scipy.sparse.coo_array(matrix)
    rows, columns = entries.coords
    values = fields.weight[rows] * entries.data * fields.weight[columns]
    kept = values != 0.0
    places = (fields.number[rows[kept]], fields.number[columns[kept]])
    return scipy.sparse.csr_array((values[kept], places), shape=(fields.count, fields.count))


def _mirror(grid: Grid) -> NDArray[np.int64]:
    """Number of the node that is each node's mirror image about the slab's middle, shape (nodes,)."""
    return np.concatenate([grid.row_nodes(row)[::-1] for row in range(grid.rows)])


def _parity_fields(k: Stiffness, sign: float) -> Fields:
    """Fields of which reflection multiplies w by `sign` and u by -`sign`."""
    nodes, mirror = np.arange(k.grid.nodes), _mirror(k.grid)
    # Both of a pair belong to one field, √½ each for the length 1; a node in the middle has no odd part.
    left_nodes = np.minimum(nodes, mirror)
    weights = []
    for parity in (-sign, sign):
        in_pair = np.sqrt(0.5) * np.where(nodes > mirror, parity, 1.0)
        weights.append(np.where(nodes == mirror, max(parity, 0.0), in_pair))
    group = np.concatenate((left_nodes, left_nodes + k.grid.nodes))
    return _number_fields(group, np.where(k.fixed, 0.0, weights).ravel())


def _number_fields(group: NDArray[np.int64], weight: Floats) -> Fields:
    """Fields of the entries of each group that have a weight, in the order of the groups."""
    number, free = np.full(len(group), -1), weight != 0.0
    number[free] = np.unique(group[free], return_inverse=True)[1]
    return Fields(number, weight)


# Eliminate some fields of a stiffness: the stiffness left for the others, and what is added to the surface's compliance.
#
# With K of these fields (c), X of these and the others, F of the surface per displacement of either: of the others' stiffness S
# remains S - Xᵀ K⁻¹ X, of what the surface follows F_b - F_c K⁻¹ X, and F_c K⁻¹ F_cᵀ is added to its compliance.


class Eliminated(NamedTuple):
    """Remainder of a front after elimination of its first fields."""

    stiffness: Dense
    """Stiffness of the other fields."""
    follows: Dense
    """Displacements of the surface per displacement of these."""
    bears: Dense
    """Forces on these per force on the surface."""
    grown: tuple[Dense, Dense]
    """Two factors, whose product is added to the surface's compliance."""
    reciprocal_condition: float
    """Reciprocal condition number of the stiffness that was eliminated."""


def eliminate(stiffness: Dense, count: int, follows: Dense, bears: Dense) -> Eliminated:
    """Eliminate the first `count` fields of a front. Raises SingularOperator."""
    norm = _norm(stiffness[:count, :count])
    factors, pivots, info = scipy.linalg.lapack.dgetrf(stiffness[:count, :count])
    reciprocal_condition = _check_condition(0.0 if info else scipy.linalg.lapack.dgecon(factors, norm)[0])
    # One solution for both: calls take their time on small pieces.
    beside = stiffness[:count, count:]
    right = np.concatenate((bears[:count], beside), axis=1)
    solved = scipy.linalg.lapack.dgetrs(factors, pivots, right)[0]
    of_surface, of_others = solved[:, : bears.shape[1]], solved[:, bears.shape[1] :]
    return Eliminated(
        stiffness[count:, count:] - stiffness[count:, :count] @ of_others,
        follows[:, count:] - follows[:, :count] @ of_others,
        bears[count:] - stiffness[count:, :count] @ of_surface,
        (follows[:, :count], of_surface),
        reciprocal_condition,
    )


def eliminate_definite(stiffness: Dense, count: int, follows: Dense) -> Eliminated:
    """Eliminate a symmetric, positive definite front with half the arithmetic: K = L Lᵀ, and L⁻¹ is enough."""
    norm = _norm(stiffness[:count, :count])
    root, info = scipy.linalg.lapack.dpotrf(stiffness[:count, :count], lower=1)
    reciprocal_condition = _check_condition(0.0 if info else scipy.linalg.lapack.dpocon(root, norm, uplo="L")[0])
    # With Y = L⁻¹ X and Z = L⁻¹ F_cᵀ the three products of K⁻¹ above are Yᵀ Y, Zᵀ Y and Zᵀ Z.
    # By columns, as BLAS has it: the result takes its place.
    below = stiffness[count:, :count]
    right = np.concatenate((follows[:, :count], below)).T
    solved = scipy.linalg.blas.dtrsm(1.0, root, right, lower=1, overwrite_b=1)
    of_surface, of_others = solved[:, : len(follows)], solved[:, len(follows) :]
    complement = follows[:, count:] - of_surface.T @ of_others
    remaining = stiffness[count:, count:] - of_others.T @ of_others
    return Eliminated(remaining, complement, complement.T, (of_surface.T, of_surface), reciprocal_condition)


def _norm(square: Dense) -> float:
    return float(np.abs(square).sum(axis=0).max(initial=0.0))


def _check_condition(reciprocal_condition: float) -> float:
    """The reciprocal condition. Raises SingularOperator if it is below machine precision."""
    if reciprocal_condition < np.finfo(float).eps:
        raise SingularOperator(
            f"the slab's stiffness is singular (reciprocal condition {reciprocal_condition:.1e}): "
            "check that the support restrains it, and that poisson is not too close to 0.5",
            cause="singular_stiffness",
        )
    return reciprocal_condition


# Invert a sparse stiffness at the surface alone, by nested dissection (George 1973).
#
# The slab is cut in two, each half in two again. A piece shares with the rest of the slab only the fields along its cuts. They
# are few, as the grid has few rows, which are coarser the deeper they lie. Eliminating a piece leaves two matrices: the
# stiffness of the fields along its border, and the displacements of its surface per displacement of these. The compliance of
# its surface grows by a product of low rank for every cut, from the smallest pieces up to the slab.

SMALLEST_PART = 160
"""Largest number of fields of a piece that is eliminated at once: below, calls take longer than arithmetic."""
ROWS_AT_ONCE = 64
"""Rows of a product, or of the compliance, that are added at once: they stay in the cache."""


class _Piece(NamedTuple):
    """Boundary of an eliminated piece, as seen by the rest of the slab."""

    border: Indices
    """Fields outside that it acts on."""
    surface: slice
    """Numbers of surface fields, including fields inside the piece."""
    left: Eliminated
    """Elimination of its border: the stiffness is added to that among these fields; fields outside the piece follow nothing."""
    reciprocal_condition: float
    """Smallest value of all cuts so far."""


class _Front(NamedTuple):
    """Fields of a cut, followed by the fields beyond the piece that it meets."""

    cut: Indices
    border: Indices
    place: Indices
    """Place in the front of every field of the slab; `size` for fields that are not in the front."""

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
    """Number of each surface field from left to right, -1 for other fields; (fields,)."""
    compliance: Dense
    """Entries of a symmetric stiffness on and above the diagonal."""

    @property
    def symmetric(self) -> bool:
        """True if the stiffness is symmetric and positive definite."""
        return self.columns is self.rows

    def eliminate_fields(self, inside: Indices) -> _Piece:
        """Eliminate the fields `inside`, sorted: first each side of a cut, then the cut. Raises SingularOperator."""
        cut, *sides = self._cut(inside)
        # Neither side acts on the other but through the cut: each is eliminated as if it were alone.
        pieces = [self.eliminate_fields(side) for side in sides if len(side)]
        acting = [_entries(self.rows, cut)]
        # Where the stiffness is not symmetric, fields that feel the cut are others than those that it feels.
        if not self.symmetric:
            acting.append(_entries(self.columns, cut))
        touched = [entries.columns for entries in acting]
        borders = [piece.border for piece in pieces]
        front = self._front(cut, inside, touched + borders)
        stiffness = _stiffness(acting, front)
        # Beside its own entries the front has what each eliminated side left on its border (Schur complement).
        for piece in pieces:
            at = front.place[piece.border]
            stiffness[np.ix_(at, at)] += piece.left.stiffness
        surface = _range(self.number[inside])
        of_pieces = [(piece, piece.left.follows) for piece in pieces]
        follows = self._surface_response(surface, front, of_pieces)
        if self.symmetric:
            complement = eliminate_definite(stiffness, len(cut), follows)
        else:
            of_pieces = [(piece, piece.left.bears.T) for piece in pieces]
            bears = self._surface_response(surface, front, of_pieces)
            complement = eliminate(stiffness, len(cut), follows, bears.T)
        self._grow(surface, *complement.grown)
        worst = min([complement.reciprocal_condition, *(piece.reciprocal_condition for piece in pieces)])
        return _Piece(front.border, surface, complement, worst)

    def _front(self, cut: Indices, inside: Indices, met: list[Indices]) -> _Front:
        """The front of a cut through the piece `inside`. met: fields that touch the piece, including fields inside
        it."""
        beyond = np.zeros(len(self.number), np.bool_)
        for fields in met:
            beyond[fields] = True
        beyond[inside] = False
        border = np.flatnonzero(beyond)
        size = len(cut) + len(border)
        place = np.full(len(self.number), size)
        place[cut] = np.arange(len(cut))
        place[border] = np.arange(len(cut), size)
        return _Front(cut, border, place)

    def _surface_response(self, surface: slice, front: _Front, pieces: list[tuple[_Piece, Dense]]) -> Dense:
        """Response of a piece's surface to a front, (surface, size), from the responses of the pieces on either side."""
        follows = np.zeros((surface.stop - surface.start, front.size))
        for piece, of_border in pieces:
            within = slice(piece.surface.start - surface.start, piece.surface.stop - surface.start)
            follows[within, front.place[piece.border]] += of_border
        top = np.flatnonzero(self.number[front.cut] >= 0)
        # A surface field of the cut follows itself.
        follows[self.number[front.cut[top]] - surface.start, top] = 1.0
        return follows

    def _grow(self, surface: slice, one: Dense, other: Dense) -> None:
        """Add a product to the compliance of part of the surface."""
        for first in range(surface.start, surface.stop, ROWS_AT_ONCE):
            last = min(first + ROWS_AT_ONCE, surface.stop)
            # Of a symmetric one the upper triangle is enough; it is mirrored in the end.
            begin = first if self.symmetric else surface.start
            rows = one[first - surface.start : last - surface.start]
            self.compliance[first:last, begin : surface.stop] += rows @ other[:, begin - surface.start :]

    def _cut(self, inside: Indices) -> tuple[Indices, Indices, Indices]:
        """Fields of the shorter cut, upright or level, through the middle; and those on either side."""
        if len(inside) <= SMALLEST_PART:
            return inside, inside[:0], inside[:0]
        ways = [self._split_fields(inside, self.places[inside, axis]) for axis in (0, 1)]
        return min(ways, key=lambda way: len(way[0]))

    def _split_fields(self, inside: Indices, places: Dense) -> tuple[Indices, Indices, Indices]:
        """Cut all fields of the left (or lower) side that act on the other side; returns the cut and both sides."""
        # The median, not the middle: grids are finer near the surface, and halves are to be equally large.
        beyond = places >= np.partition(places, len(places) // 2)[len(places) // 2]
        below = inside[~beyond]
        # All at one place along this axis, no cut: the other axis, or the whole piece at once.
        if not len(below):
            return inside, below, below
        far = np.zeros(len(self.number), dtype=np.bool_)
        far[inside[beyond]] = True
        acting = _any(self.rows, below, far)
        if not self.symmetric:
            acting |= _any(self.columns, below, far)
        return below[acting], below[~acting], inside[beyond]


def surface_inverse(matrix: Sparse, places: Dense, surface: Indices, symmetric: bool = False) -> tuple[Dense, float]:
    """matrix⁻¹ at the fields `surface` alone, (len(surface), len(surface)); and the least reciprocal condition of the cuts.

    places: x and z, (fields, 2); surface fields from left to right, with the largest z. symmetric: the matrix is symmetric
    positive definite, so the inverse is exactly. Raises SingularOperator if a cut cannot be solved.
    """
    number = np.full(len(places), -1)
    number[surface] = np.arange(len(surface))
    inverse_at_surface = np.zeros((len(surface), len(surface)))
    columns = matrix if symmetric else scipy.sparse.csr_array(matrix.T)
    eliminated_slab = _Slab(matrix, columns, places, number, inverse_at_surface).eliminate_fields(
        np.arange(len(places))
    )
    if symmetric:
        _dissection_mirror(inverse_at_surface)
    return inverse_at_surface, eliminated_slab.reciprocal_condition


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
    # Entry k of all lots is entry k less the entries of all rows before of its own row.
    at = np.arange(len(of_row)) + (begin - np.cumsum(counts) + counts)[of_row]
    return _Entries(of_row, matrix.indices[at], matrix.data[at])


def _stiffness(acting: list[_Entries], front: _Front) -> Dense:
    """Stiffness of a front without that of its border's fields among each other, (size, size).

    acting: entries of the cut's rows, and of its columns where these differ.
    """
    size, cut = front.size, len(front.cut)
    assembled = np.zeros((size + 1, size + 1))
    for entries, way in zip(acting, (assembled, assembled.T), strict=False):
        # Fields outside of the front have the place `size`: a row and column more, cut off below.
        way[entries.rows, front.place[entries.columns]] = entries.values
    if len(acting) == 1:
        assembled[cut:, :cut] = assembled[:cut, cut:].T
    return assembled[:size, :size]


def _any(matrix: Sparse, rows: Indices, marked: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Mask of the rows of a sparse matrix that have an entry in a marked column, (rows,)."""
    entries = _entries(matrix, rows)
    is_marked = np.zeros(len(rows), np.bool_)
    is_marked[entries.rows[marked[entries.columns]]] = True
    return is_marked


def _dissection_mirror(square: Dense) -> None:
    """Copy the upper triangle into the lower one, in place."""
    for first in range(0, len(square), ROWS_AT_ONCE):
        some, rest = slice(first, first + ROWS_AT_ONCE), slice(first + ROWS_AT_ONCE, None)
        block = np.triu(square[some, some])
        square[some, some] = block + np.triu(block, 1).T
        square[rest, some] = square[some, rest].T


def _range(numbers: Indices) -> slice:
    """Range from the least to the largest number that is not negative."""
    positive = numbers[numbers >= 0]
    return slice(int(positive.min()), int(positive.max()) + 1) if len(positive) else slice(0, 0)


# Condense a stiffness to the surface (§2.1.4, Eq. 11): [u; w] = C [f_x; f_z] for nodal forces on the top row.
#
# Even and odd fields are condensed separately, each by nested dissection.

DOUBTFUL = 1e-10
"""Reciprocal condition of a cut below which a compliance is found twice. Of 1078 slabs of all shapes, none without such a cut was
off by more than 2e-6 of its largest entry. Ordinary ones, ν up to 0.49, have 1e-9 and more."""
OTHERWISE = 1.1
"""Factor that rounds every stiffness otherwise."""
COARSEST = 1e-5
"""Largest change of a compliance, over its largest entry, that rounding may cause. None of
those slabs that pass was off by more than 1e-4."""


def condense_surface(k: Stiffness) -> Dense:
    """The compliance of the surface row, shape (2n, 2n), in 1/G: the sum over even and odd fields. Raises SingularOperator.

    Exactly symmetric where the stiffness is.
    """
    top = k.grid.row_nodes(0)
    surface = np.concatenate((top, k.grid.nodes + top))
    places = np.tile(k.grid.coordinates(), (2, 1))
    total = np.zeros((len(surface), len(surface)))
    for fields in families(k):
        number, weight = fields.number[surface], fields.weight[surface]
        where = places[fields.first_entries]
        on_top = np.unique(number[number >= 0])
        # From left to right, so that the surface of a piece is one range.
        on_top = on_top[np.argsort(where[on_top, 0], kind="stable")]
        compliance = _inverse(project_stiffness(k.matrix, fields), where, on_top, k.symmetric)
        place = np.full(fields.count, -1)
        place[on_top] = np.arange(len(on_top))
        # A displacement without a field has no weight either: any place will do.
        _add(total, compliance, place[number], weight)
    return total


def _inverse(matrix: Sparse, places: Dense, surface: Indices, symmetric: bool) -> Dense:
    """Compute `surface_inverse`, a second time if the first may have lost digits. Raises SingularOperator.

    The second time, all stiffnesses are multiplied by a number that is no power of two, so that each is rounded
    differently (equal entries stay equal). The change of the compliance measures its uncertainty.
    """
    surface_part, reciprocal_condition = surface_inverse(matrix, places, surface, symmetric)
    if reciprocal_condition < DOUBTFUL:
        change = surface_inverse(OTHERWISE * matrix, places, surface, symmetric)[0]
        change *= OTHERWISE
        change -= surface_part
        share = float(np.abs(change, out=change).max() / np.abs(surface_part).max())
        if not share <= COARSEST:
            raise SingularOperator(
                f"the slab's stiffness leaves its compliance uncertain by {share:.0e} of the largest, {COARSEST:g} is needed: "
                "use a poisson further from 0.5, or an aspect_ratio nearer 1",
                cause="uncertain_compliance",
            )
    return surface_part


def _add(total: Dense, compliance: Dense, place: NDArray[np.int64], weight: Dense) -> None:
    """Add the contribution of a family, a few rows at a time: weight and place among its fields of every displacement."""
    for first in range(0, len(total), ROWS_AT_ONCE):
        some = slice(first, first + ROWS_AT_ONCE)
        rows = compliance.take(place[some], 0).take(place, 1)
        rows *= weight[some, None]
        rows *= weight
        total[some] += rows
