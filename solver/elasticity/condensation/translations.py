"""Translations of whole rows of nodes, as unknowns in place of one displacement of each row.

Cells much higher than wide resist stretching along x by λ·dz/dx, and shear by dx/dz. The force that moves a row as a whole is a
sum of entries that are larger than the sum by λ(dz/dx)². Rounding loses as many digits of it: all of them in a slab stretched
10 000 times at ν = 0.4999. Where a scheme knows that sum exactly, one node of the row, its anchor, stands for the row's
translation. Displacements of the row's other nodes are counted relative to it.
"""

from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from solver.elasticity.condensation.parity import Fields, projected
from solver.elasticity.stiffness import Sparse, Stiffness

Dense = NDArray[np.float64]
Indices = NDArray[np.int64]


class Translation(NamedTuple):
    """A row of nodes that moves along x or z as a whole."""

    anchor: int
    """Field in whose place it stands."""
    members: Indices
    """Fields of the row, the anchor among them."""
    motion: Dense
    """Displacements of these per unknown."""


def with_translations(k: Stiffness, fields: Fields) -> tuple[Sparse, list[Translation]]:
    """The stiffness between fields, (count, count), and the translations whose forces stand in its anchors' columns."""
    matrix = projected(k.matrix, fields)
    if k.per_row is None:
        return matrix, []
    stiffest = np.abs(matrix.diagonal())
    moving, columns = [], []
    for row, members in _free_rows(k, fields):
        anchor = int(members[len(members) // 2])
        forces = forces_on(fields, k.per_row[:, row])
        # A power of two rounds nothing, and makes the column as large as the one that it replaces.
        unit = 2.0 ** np.round(np.log2(stiffest[anchor] / np.abs(forces).max()))
        moving.append(Translation(anchor, members, unit / fields.weight[fields.first_entries[members]]))
        columns.append(unit * forces)
    return _replaced(matrix, [one.anchor for one in moving], columns), moving


def displace(compliance: Dense, place: Indices, moving: list[Translation]) -> None:
    """Turn a compliance that answers in these unknowns into one of displacements, in place.

    place: row of the compliance of every field, -1 for none.
    """
    for translation in moving:
        at = place[translation.anchor]
        if at >= 0:
            common = compliance[at].copy()
            compliance[at] = 0.0
            compliance[place[translation.members]] += np.outer(translation.motion, common)


def _free_rows(k: Stiffness, fields: Fields) -> list[tuple[int, Indices]]:
    """Rows that these fields can move as a whole, along x or z: their column of `per_row`; their fields from left to right."""
    of_node = np.repeat(np.arange(k.grid.rows), k.grid.counts)
    row_of = np.concatenate((of_node, of_node + k.grid.rows))
    held = np.bincount(row_of, weights=fields.weight <= 0.0) > 0
    return [(int(row), np.unique(fields.number[row_of == row])) for row in np.flatnonzero(~held)]


def forces_on(fields: Fields, forces: Dense) -> Dense:
    """Forces on the fields, (count,), of forces on displacements, (2·nodes,)."""
    kept = fields.number >= 0
    found = np.bincount(fields.number[kept], weights=(fields.weight * forces)[kept], minlength=fields.count)
    return np.asarray(found, np.float64)


def _replaced(matrix: Sparse, places: list[int], columns: list[Dense]) -> Sparse:
    """The matrix with other columns in these places."""
    entries = scipy.sparse.coo_array(matrix)
    rows, others = entries.coords
    kept = ~np.isin(others, places)
    filled = [np.flatnonzero(column) for column in columns]
    values = [entries.data[kept], *(column[at] for column, at in zip(columns, filled, strict=True))]
    new = [np.full(len(at), place) for place, at in zip(places, filled, strict=True)]
    coordinates = (np.concatenate((rows[kept], *filled)), np.concatenate((others[kept], *new)))
    return scipy.sparse.csr_array((np.concatenate(values), coordinates), shape=matrix.shape)
