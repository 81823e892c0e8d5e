"""Nested dissection gives the block of the inverse that a dense inverse has, however the fields lie and couple."""

import numpy as np
import pytest
import scipy.sparse as sp

from nanoslip.solver.elasticity import condensation as dissection
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.elasticity.condensation import surface_inverse
from nanoslip.solver.elasticity.schemes.biquadratic import Biquadratic
from nanoslip.solver.elasticity.schemes.galerkin import Galerkin
from nanoslip.solver.slab import Slab
from tests.benchmarks.compliance import sparse_compliance


def grid_of_springs(across: int, down: int, seed: int) -> tuple[sp.csr_array, np.ndarray]:
    """A stiffness without symmetry, dominated by its diagonal, whose fields act on their nearest eight; and their places."""
    places = np.array([(column, -row) for row in range(down) for column in range(across)], dtype=float)
    near = np.abs(places[:, None] - places[None]).max(axis=2) <= 1.0
    values = np.random.default_rng(seed).uniform(-1.0, 1.0, near.shape) * near
    return sp.csr_array(values + np.diag(1.0 + np.abs(values).sum(axis=1))), places


@pytest.mark.parametrize("smallest", [1, 7, 10_000], ids=["many cuts", "some cuts", "no cut"])
@pytest.mark.parametrize(("across", "down"), [(12, 5), (4, 15), (60, 1), (1, 60)])
def test_the_surface_of_the_inverse_is_found(
    across: int, down: int, smallest: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dissection, "SMALLEST", smallest)
    matrix, places = grid_of_springs(across, down, seed=across)
    shuffled = np.random.default_rng(1).permutation(len(places))
    matrix, places = sp.csr_array(matrix[shuffled][:, shuffled]), places[shuffled]
    surface = np.flatnonzero(places[:, 1] == 0.0)
    surface = surface[np.argsort(places[surface, 0])]
    expected = np.linalg.inv(matrix.toarray())[np.ix_(surface, surface)]
    # Diagonally dominant: nothing grows beyond rounding.
    found, _ = surface_inverse(matrix, places, surface)
    np.testing.assert_allclose(found, expected, atol=1e-14)

    both_ways = sp.csr_array(matrix + matrix.T)  # as dominant, and so definite
    expected = np.linalg.inv(both_ways.toarray())[np.ix_(surface, surface)]
    found, _ = surface_inverse(both_ways, places, surface, symmetric=True)
    np.testing.assert_allclose(found, expected, atol=1e-14)
    assert np.array_equal(found, found.T)


@pytest.mark.parametrize(
    "slab",
    [
        Slab(65),
        Slab(65, 0.01),
        Slab(65, support="right_side"),
        Slab(65, support="frictionless", poisson=0.0),
        Slab(65, 3.0, scheme="biquadratic"),
        Slab(33, scheme=Biquadratic(first_spacing="doubling")),
        Slab(17, scheme=Galerkin(rows_per_level=64, coarsest_row=5)),
    ],
    ids=lambda slab: f"{slab.n_x}-{slab.aspect_ratio}-{slab.support}-{slab.scheme}",
)
def test_a_slab_has_the_compliance_that_its_whole_stiffness_has(slab: Slab) -> None:
    expected = sparse_compliance(slab)
    # 3e-13 seen, the rounding of either way.
    np.testing.assert_allclose(surface_compliance(slab).matrix, expected, atol=2e-12 * np.abs(expected).max())
