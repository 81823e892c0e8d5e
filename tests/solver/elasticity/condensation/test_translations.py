"""Rows of nodes as unknowns: the same stiffness, for which a row's translation is one number."""

import numpy as np
import pytest

from nanoslip.solver.elasticity.condensation import displace, families, projected, with_translations
from nanoslip.solver.elasticity.grid_scheme import stiffness
from nanoslip.solver.slab import Slab, Support


@pytest.mark.parametrize("support", ["bonded", "frictionless", "right_side"])
def test_forces_are_those_of_the_displacements_that_the_unknowns_stand_for(support: Support) -> None:
    k = stiffness(Slab(17, support=support, scheme="biquadratic"))
    random = np.random.default_rng(1)
    for fields in families(k):
        matrix, moving = with_translations(k, fields)
        unknowns = random.uniform(-1.0, 1.0, (fields.count, 1))
        displacements = unknowns.copy()
        displace(displacements, np.arange(fields.count), moving)
        expected = projected(k.matrix, fields) @ displacements
        np.testing.assert_allclose(matrix @ unknowns, expected, atol=1e-13 * np.abs(expected).max())


def test_every_row_that_nothing_holds_moves_as_a_whole() -> None:
    """Five rows above a bonded bottom: along x in the odd family, along z in the even one; a held side leaves z alone."""
    bonded, held = (stiffness(Slab(17, support=support, scheme="biquadratic")) for support in ("bonded", "right_side"))
    assert bonded.grid.rows == 5
    assert [len(with_translations(bonded, fields)[1]) for fields in families(bonded)] == [4, 4]
    # Its corner on the surface is free.
    assert [len(with_translations(held, fields)[1]) for fields in families(held)] == [1 + 4]


def test_finite_elements_keep_their_displacements() -> None:
    k = stiffness(Slab(17))
    for fields in families(k):
        matrix, moving = with_translations(k, fields)
        assert not moving
        assert (matrix != projected(k.matrix, fields)).nnz == 0
