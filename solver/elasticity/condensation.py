"""Condense a stiffness to the surface (§2.1.4, Eq. 11): [u; w] = C [f_x; f_z] for nodal forces on the top row.

Even and odd fields are condensed separately (parity.py), each by nested dissection (dissection.py).
"""

import numpy as np
from numpy.typing import NDArray

from solver.elasticity.dissection import surface_inverse
from solver.elasticity.parity import families, projected
from solver.elasticity.stiffness import Stiffness

Dense = NDArray[np.float64]

ROWS_AT_ONCE = 32
"""Rows of the compliance that are added to at once: they stay in the cache."""


def condensed(k: Stiffness) -> Dense:
    """The compliance of the surface row, shape (2n, 2n), in 1/G: the sum over even and odd fields. Raises SingularOperator.

    Exactly symmetric where the stiffness is.
    """
    top = k.grid.row_nodes(0)
    surface, matrix = np.concatenate((top, k.grid.nodes + top)), k.matrix
    places = np.tile(k.grid.coordinates(), (2, 1))
    total = np.zeros((len(surface), len(surface)))
    for fields in families(k):
        number, weight = fields.number[surface], fields.weight[surface]
        where = places[fields.first_entries]
        on_top = np.unique(number[number >= 0])
        on_top = on_top[np.argsort(where[on_top, 0], kind="stable")]
        compliance = surface_inverse(projected(matrix, fields), where, on_top)
        if k.symmetric:
            _symmetrize(compliance)
        # A displacement without a field has no weight either: any place will do.
        place = np.zeros(fields.count, np.int64)
        place[on_top] = np.arange(len(on_top))
        _add(total, compliance, place[number], weight)
    return total


def _symmetrize(square: Dense) -> None:
    """Replace a matrix by the mean of itself and its transpose, in place."""
    for first in range(0, len(square), ROWS_AT_ONCE):
        some, rest = slice(first, first + ROWS_AT_ONCE), slice(first, None)
        mean = (square[some, rest] + square[rest, some].T) / 2.0
        square[some, rest] = mean
        square[rest, some] = mean.T


def _add(total: Dense, compliance: Dense, place: NDArray[np.int64], weight: Dense) -> None:
    """Add what a family contributes, a few rows at a time: weight and place among its fields of every displacement."""
    for first in range(0, len(total), ROWS_AT_ONCE):
        some = slice(first, first + ROWS_AT_ONCE)
        rows = compliance.take(place[some], 0).take(place, 1)
        rows *= weight[some, None]
        rows *= weight
        total[some] += rows
