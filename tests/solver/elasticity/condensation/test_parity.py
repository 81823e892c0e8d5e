"""Even and odd fields: together all displacements that are not restrained, each family deaf to forces of the other."""

import numpy as np
import pytest
import scipy.sparse as sp

from nanoslip.solver.elasticity.condensation import Fields, families, projected
from nanoslip.solver.elasticity.grid_scheme import stiffness
from nanoslip.solver.slab import Slab, Support


def basis(fields: Fields) -> np.ndarray:
    """Displacements of every field, (2·nodes, count)."""
    found = np.zeros((len(fields.number), fields.count))
    member = fields.number >= 0
    found[member, fields.number[member]] = fields.weight[member]
    return found


@pytest.mark.parametrize(("support", "count"), [("bonded", 2), ("frictionless", 2), ("right_side", 1)])
def test_the_families_span_all_free_displacements(support: Support, count: int) -> None:
    k = stiffness(Slab(n_x=17, support=support))
    found = families(k)
    assert len(found) == count
    everything = np.hstack([basis(fields) for fields in found])
    np.testing.assert_allclose(everything.T @ everything, np.eye(everything.shape[1]), atol=1e-15)
    np.testing.assert_allclose(everything @ everything.T, np.diag((~k.fixed).astype(float)), atol=1e-15)


def test_the_stiffness_does_not_mix_them() -> None:
    k = stiffness(Slab(n_x=17, poisson=0.2))
    even, odd = (sp.csr_array(basis(fields)) for fields in families(k))
    largest = abs(k.matrix).max()
    for one, other in ((even, odd), (odd, even)):
        assert abs(one.T @ k.matrix @ other).max() <= 1e-14 * largest


def test_a_field_stands_where_its_left_node_does() -> None:
    k = stiffness(Slab(n_x=17))
    x = np.tile(k.grid.coordinates()[:, 0], 2)
    for fields in families(k):
        assert len(fields.first_entries) == fields.count
        np.testing.assert_array_equal(fields.number[fields.first_entries], np.arange(fields.count))
        assert x[fields.first_entries].max() <= 0.5


@pytest.mark.parametrize("scheme", ["galerkin", "biquadratic"])
def test_the_projected_stiffness_is_that_between_fields(scheme: str) -> None:
    k = stiffness(Slab(n_x=17, scheme=scheme))
    for fields in families(k):
        between = basis(fields)
        expected = between.T @ k.matrix.toarray() @ between
        # Sums of at most four entries, rounded.
        np.testing.assert_allclose(projected(k.matrix, fields).toarray(), expected, atol=1e-15 * np.abs(expected).max())
