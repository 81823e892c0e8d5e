"""Even and odd fields: together all displacements that are not restrained, each family deaf to forces of the other."""

import numpy as np
import pytest
import scipy.sparse as sp

from solver.elasticity.grid_scheme import stiffness
from solver.elasticity.parity import row_bases
from solver.slab import Slab, Support


@pytest.mark.parametrize(("support", "families"), [("bonded", 2), ("frictionless", 2), ("right_side", 1)])
def test_the_families_span_all_free_displacements(support: Support, families: int) -> None:
    k = stiffness(Slab(n_x=17, support=support))
    bases = row_bases(k)
    assert len(bases) == families
    assert all(len(rows) == k.grid.rows for rows in bases)
    everything = sp.hstack([basis for rows in bases for basis in rows]).toarray()
    np.testing.assert_allclose(everything.T @ everything, np.eye(everything.shape[1]), atol=1e-15)
    np.testing.assert_allclose(everything @ everything.T, np.diag((~k.fixed).astype(float)), atol=1e-15)


def test_the_stiffness_does_not_mix_them() -> None:
    k = stiffness(Slab(n_x=17, poisson=0.2))
    even, odd = (sp.hstack(rows) for rows in row_bases(k))
    largest = abs(k.matrix).max()
    for one, other in ((even, odd), (odd, even)):
        assert abs(one.T @ k.matrix @ other).max() <= 1e-14 * largest
