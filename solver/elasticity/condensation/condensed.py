"""Condense a stiffness to the surface (§2.1.4, Eq. 11): [u; w] = C [f_x; f_z] for nodal forces on the top row.

Even and odd fields are condensed separately (parity.py), each by nested dissection (dissection.py).
"""

import numpy as np
from numpy.typing import NDArray

from solver.elasticity.condensation.dissection import surface_inverse
from solver.elasticity.condensation.parity import families
from solver.elasticity.condensation.translations import displace, with_translations
from solver.elasticity.stiffness import Sparse, Stiffness
from solver.outcome import SingularOperator

Dense = NDArray[np.float64]
Indices = NDArray[np.int64]

DOUBTFUL = 1e-10
"""Reciprocal condition of a cut below which a compliance is found twice. Of 1078 slabs of all shapes, none without such a cut was
off by more than 2e-6 of its largest entry. Ordinary ones, ν up to 0.49, have 1e-9 and more."""
OTHERWISE = 1.1
"""Factor that rounds every stiffness otherwise."""
COARSEST = 1e-5
"""Largest change of a compliance, over its largest entry, that rounding may cause. None of
those slabs that pass was off by more than 1e-4."""
ROWS_AT_ONCE = 32
"""Rows of the compliance that are added to at once: they stay in the cache."""


def condensed(k: Stiffness) -> Dense:
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
        on_top = on_top[np.argsort(where[on_top, 0], kind="stable")]
        matrix, moving = with_translations(k, fields)
        anchors = np.array([translation.anchor for translation in moving], np.int64)
        compliance = _inverse(matrix, where, on_top, anchors, k.symmetric and not moving)
        place = np.full(fields.count, -1)
        place[on_top] = np.arange(len(on_top))
        displace(compliance, place, moving)
        # A displacement without a field has no weight either: any place will do.
        _add(total, compliance, place[number], weight)
    return total


def _inverse(matrix: Sparse, places: Dense, surface: Indices, last: Indices, symmetric: bool) -> Dense:
    """As `surface_inverse`; where that may have lost digits, it is found a second time. Raises SingularOperator.

    Multiplied by a number that is no power of two, each stiffness is rounded otherwise, those that are alike alike: what changes
    in the compliance is not known.
    """
    found, reciprocal_condition = surface_inverse(matrix, places, surface, last, symmetric)
    if reciprocal_condition < DOUBTFUL:
        change = surface_inverse(OTHERWISE * matrix, places, surface, last, symmetric)[0]
        change *= OTHERWISE
        change -= found
        share = float(np.abs(change, out=change).max() / np.abs(found).max())
        if not share <= COARSEST:
            raise SingularOperator(
                f"the slab's stiffness leaves its compliance uncertain by {share:.0e} of the largest, {COARSEST:g} is needed: "
                "use a poisson further from 0.5, or an aspect_ratio nearer 1"
            )
    return found


def _add(total: Dense, compliance: Dense, place: NDArray[np.int64], weight: Dense) -> None:
    """Add what a family contributes, a few rows at a time: weight and place among its fields of every displacement."""
    for first in range(0, len(total), ROWS_AT_ONCE):
        some = slice(first, first + ROWS_AT_ONCE)
        rows = compliance.take(place[some], 0).take(place, 1)
        rows *= weight[some, None]
        rows *= weight
        total[some] += rows
