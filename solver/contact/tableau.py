"""The tableau of a contact: the slab's compliance after a principal pivot on the nodes in contact, load given, approach unknown.

With v = w + approach and the load W, the slab obeys [u; v; -W] = B [f_x; f_z; approach], where B is the compliance bordered
by ones (ΣN = W, constraint of the load). Exchanging the contact's displacements and -W for their forces and the approach
gives the tableau that contact and sliding work with: prescribed values in, unknown values out.
"""

import math
from dataclasses import dataclass
from functools import partial

import numpy as np
import scipy
from numpy.typing import NDArray

from nanoslip.solver.arrays import Dense, Indices, Nodes, Window
from nanoslip.solver.contact.disc import CHARACTERS, Quarter, node_disc, quarter, wider
from nanoslip.solver.elasticity.compliance import (
    Compliance,
    EndlessCompliance,
    Entries,
    border_matrix,
    inverse,
    invert_bordered,
    portions,
    take_entries,
)
from nanoslip.solver.elasticity.schemes.endless import SurfaceConvolution
from nanoslip.solver.layout import RINGS

LINE = 8
"""Floats in a cache line of 64 bytes."""


def zero_lines(entries: int) -> NDArray[np.float64]:
    """Zeros for a matrix with this number of rows and at least as many columns. Every row begins at a cache line, as
    adding a row that straddles lines takes a third longer."""
    stride = -(-entries // LINE) * LINE
    room = np.zeros(entries * stride + LINE)
    first = -room.ctypes.data // room.itemsize % LINE
    return room[first : first + entries * stride].reshape(entries, stride)


def tableau(compliance: Entries, contact: Nodes, into: Dense, reciprocal: bool = False) -> None:
    """Write the bordered compliance pivoted on `contact` (shape (n,)) and on the load, transposed, (2n + 1, 2n + 1),
    into the first columns of `into`.

    reciprocal: the compliance is symmetric to the last bit, so that half of the tableau is the other half.
    """
    touching, free = np.flatnonzero(contact), np.flatnonzero(~contact)
    n, count = len(contact), len(touching)
    pivoted = np.concatenate((touching, touching + n))
    kept = np.concatenate((free, free + n))
    normal = (kept >= n).astype(float)
    system = border_matrix(compliance, pivoted, n)
    stiffness = invert_bordered(system, f"compliance of {count} nodes", into)
    reached = np.column_stack((compliance(kept, pivoted), normal))
    from_kept = reached @ stiffness
    with_load = np.append(pivoted, 2 * n)
    into[np.ix_(with_load, with_load)] = stiffness.T
    into[np.ix_(with_load, kept)] = from_kept.T
    for some in portions(len(kept)):  # of thousands of nodes all at once are a tenth of a GB
        entries = kept[some]
        if reciprocal:
            into[np.ix_(entries, with_load)] = -from_kept[some]
            complement = compliance(entries, kept) - from_kept[some] @ reached.T
        else:
            back = np.vstack((-compliance(pivoted, entries), -normal[some]))
            into[np.ix_(entries, with_load)] = (stiffness @ back).T
            complement = (compliance(kept, entries) + from_kept @ back).T
        into[np.ix_(entries, kept)] = complement
    into[:, len(into) :] = 0.0  # where the inverse had its room


def window_entries(compliance: Compliance, window: Window, matrix: Dense | None = None) -> Entries:
    """Entries of the compliance of a window's nodes among each other: of its matrix, if there is one."""
    if matrix is not None and len(matrix):
        return partial(take_entries, matrix)
    both = np.concatenate((window, window + compliance.slab.nodes))
    return lambda rows, columns: compliance.entries(both[rows], both[columns])


# On a plane of nodes without ends the compliance of two nodes follows from their offset. A contact that is shifted by whole
# spacings has the same tableau, and contacts under one pin are nearly the same: some dozens of a thousand nodes differ. So the
# tableau of a disc of nodes in contact, the base, is computed once, and the set E of nodes that differ is exchanged in it. With
# T the tableau, E its entries of these nodes and R all others, a principal pivot on A = T[E, E] leaves
#
#     T[E, E] = A⁻¹,    T[E, R] = -A⁻¹ T[E, R],    T[R, E] = T[R, E] A⁻¹,    T[R, R] = T[R, R] - T[R, E] A⁻¹ T[E, R].
#
# Pivots in any order lead to the same tableau, so it does not matter how the contact came about. Which disc follows from the case
# and the contact alone, not from what this process has set up before: results have the same bits wherever they are computed.

BASE_RINGS = RINGS + 1
"""Rings of free nodes around a base: a contact may reach one ring beyond the disc and has RINGS around it."""
MOST_DIFFERENT = 1 / 3
"""Share of c nodes in contact that may differ from their base. Exchanging d nodes takes 4 d N² operations, N = 2.3 c, inverting
them all and their effect on free nodes about 12 c³: as many at d = c/2."""
SIZES_APART = 1.05
"""Ratio of the numbers of nodes of successive bases, for contacts that do not have the expected size."""


@dataclass(frozen=True, slots=True, eq=False)
class Base:
    """The tableau of a disc of nodes in the middle of a plane, with BASE_RINGS of free nodes around it: N entries, k of them in a
    quarter."""

    nodes: Window
    """Numbers of the nodes in the tableau."""
    quarter: Quarter
    rows: Dense
    """(k, 4, k) rows of the quarter, in the columns of its images (`Quarter.from_parts`), read-only."""

    def part(self, entries: Indices) -> Dense:
        """The tableau in these rows and columns, and padding."""
        images, signs = self.quarter.images, self.quarter.signs
        k = len(self.quarter.entries)
        places, reflections = np.empty((2, 2 * len(self.nodes) + 1), np.int64)
        places[images], reflections[images] = np.arange(k), np.arange(4)[:, None]
        place, reflection = places[entries], reflections[entries]
        # Row ga in column hb is row a in column (gh)b, with the signs that both entries have under g.
        columns = [(reflection ^ g) * k + place for g in range(4)]
        turned = signs[:, place]
        found, rows = zero_lines(len(entries)), self.rows.reshape(k, 4 * k)
        for row, a, g in zip(found[:, : len(entries)], place, reflection, strict=True):
            rows[a].take(columns[g], out=row, mode="clip")  # "raise" buffers
            np.multiply(row, signs[g, a] * turned[g], out=row)
        return found


_last_base: dict[tuple[SurfaceConvolution, float], Base] = {}
"""The base that was used last, shared by all contacts that come next: windows of a record, members, cases of a campaign."""


def find_base(compliance: EndlessCompliance, nodes: float) -> Base:
    """The base with about this number of nodes in contact."""
    key = (compliance.convolution, nodes)
    base = _last_base.get(key)
    if base is None:
        _last_base.clear()  # first: two bases of thousands of nodes may be more than the memory holds
        base = _last_base[key] = _base(compliance, nodes)
    return base


def _base(compliance: EndlessCompliance, nodes: float) -> Base:
    n = compliance.slab.n_x
    disc = node_disc(n, nodes)
    followed = wider(disc, BASE_RINGS).ravel().nonzero()[0]
    entries, some = window_entries(compliance, followed), quarter(followed, n)
    normal = some.entries[:-1] >= len(followed)

    def bordered_entries(rows: Indices, columns: Indices) -> Dense:
        """The compliance and the load's row and column, which are the last, in the rows of a quarter and an image's columns."""
        found = np.zeros((len(rows), len(columns)))
        found[:-1, :-1] = entries(rows[:-1], columns[:-1])
        found[:-1, -1] = found[-1, :-1] = normal
        return found

    parts = some.parts(bordered_entries)
    in_contact = np.append(np.tile(disc.ravel()[followed], 2), True)[some.entries]
    for part, character in zip(parts, CHARACTERS, strict=True):
        members = some.members(character)
        pivoted = pivot_symmetric(part[np.ix_(members, members)], in_contact[members])
        part[:] = 0.0  # what rounding has left of sums over images that cancel
        part[np.ix_(members, members)] = pivoted
    rows = some.from_parts(parts)
    rows.setflags(write=False)
    return Base(followed, some, rows)


def tableau_from_base(compliance: EndlessCompliance, nodes: Window, contact: Nodes, expected: float) -> Dense | None:
    """The `tableau` of a window's nodes, of which these are in contact, (n,), and padding, from a base; None if none is near.

    expected: number of nodes in contact that follows from the case.
    """
    n, count = compliance.slab.n_x, int(contact.sum())
    if not 1.0 / SIZES_APART < count / expected < SIZES_APART:
        expected = SIZES_APART ** round(math.log(count, SIZES_APART))
    disc = node_disc(n, expected)
    # Places of the window's nodes on the plane, shifted by whole spacings until the contact is in the middle.
    places = np.array(divmod(nodes, n))
    mean_place = places[:, contact].mean(axis=1)
    middle = np.rint(mean_place).astype(np.int64)
    shifted = places - middle[:, None] + n // 2
    under_disc = _sample_mask(disc, shifted)
    different = np.flatnonzero(under_disc != contact)
    is_on_plane = under_disc.sum() == disc.sum()
    covered = _sample_mask(wider(disc, BASE_RINGS), shifted).all() and is_on_plane
    if not covered or len(different) > MOST_DIFFERENT * count:
        _last_base.clear()  # the inverse needs the room
        return None
    base = find_base(compliance, expected)
    in_base = np.searchsorted(base.nodes, shifted[0] * n + shifted[1])
    lines = base.part(np.append(_both(in_base, len(base.nodes)), 2 * len(base.nodes)))
    exchange(lines, _both(different, len(nodes)))
    return lines


def _both(nodes: Indices, n: int) -> Indices:
    """Entries of these of n nodes, tangential and normal."""
    return np.concatenate((nodes, n + nodes))


def _sample_mask(mask: Nodes, places: Indices) -> Nodes:
    """The values of a mask (n, n) at places (2, k); False beyond it."""
    moved = np.zeros(places.shape[1], np.bool_)
    inside = ((places >= 0) & (places < len(mask))).all(axis=0)
    moved[inside] = mask[tuple(places[:, inside])]
    return moved


def pivot_symmetric(matrix: Dense, pivoted: Nodes) -> Dense:
    """The matrix, symmetric but for rounding, after a principal pivot on these of its entries, transposed as a tableau is. Raises
    SingularOperator."""
    some, others = np.flatnonzero(pivoted), np.flatnonzero(~pivoted)
    beside = matrix[np.ix_(some, others)]
    own = inverse(matrix[np.ix_(some, some)], "compliance of nodes")
    reached = own @ beside
    found = np.empty_like(matrix)
    found[np.ix_(some, some)] = own
    found[np.ix_(some, others)] = reached
    found[np.ix_(others, some)] = -reached.T
    found[np.ix_(others, others)] = matrix[np.ix_(others, others)] - beside.T @ reached
    return found


def exchange(table: Dense, entries: Indices) -> None:
    """Exchange inputs and responses of these entries of a tableau, all at once and in place. Raises SingularOperator."""
    own = inverse(table[np.ix_(entries, entries)], "compliance of nodes")
    columns = table[:, entries]
    rows = own @ table[entries]
    # BLAS counts along columns: this is table -= columns @ rows, without another matrix of its size.
    scipy.linalg.blas.dgemm(-1.0, rows.T, columns.T, 1.0, table.T, overwrite_c=1)
    table[:, entries] = -(columns @ own)
    table[entries] = rows
    table[np.ix_(entries, entries)] = own
