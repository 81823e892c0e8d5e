"""The half-space in closed form: the integral of Boussinesq's and Cerruti's point forces over a square, and an elastic body's."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import dblquad

from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.slab import Slab

OFFSETS = [(1, 0), (-1, 2), (3, -1), (0, -1), (4, 3)]


def point_force(x: float, y: float, poisson: float) -> np.ndarray:
    """[[u per f_x, u per f_z], [w per f_x, w per f_z]], z out of the body (Johnson, Contact Mechanics, §3.2 and §3.6)."""
    r, lean = np.hypot(x, y), (1 - 2 * poisson) / 2 * x / (x * x + y * y)
    return np.array([[(1 - poisson) / r + poisson * x * x / r**3, lean], [-lean, (1 - poisson) / r]]) / (2 * np.pi)


def spread(x: float, y: float, h: float, poisson: float, i: int, j: int) -> float:
    """Mean of one of them over a square with the side h."""
    ends = (-h / 2, h / 2, -h / 2, h / 2)
    return dblquad(lambda t, s: point_force(x - s, y - t, poisson)[i, j], *ends)[0] / h**2


@pytest.mark.parametrize("poisson", [-0.5, 0.3])
def test_a_node_moves_its_neighbours_as_point_forces_spread_over_its_square_do(poisson):
    slab = Slab(9, poisson=poisson, scheme="half_space")
    h, middle = slab.spacing, 4 * 9 + 4
    compliance, both = surface_compliance(slab), np.array([0, 81])
    for along, across in OFFSETS:
        there = middle + 9 * along + across
        found = compliance.entries(there + both, middle + both)
        expected = [[spread(h * along, h * across, h, poisson, i, j) for j in (0, 1)] for i in (0, 1)]
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12)  # the quadrature's own error
    # Under itself, in polar coordinates: ∫1/r over the square is 4 h ln(1 + √2), half of it each of x²/r³ and y²/r³.
    alone = 4 * np.log(1 + np.sqrt(2)) / (2 * np.pi * h) * np.array([[1 - poisson / 2, 0.0], [0.0, 1 - poisson]])
    np.testing.assert_allclose(compliance.entries(middle + both, middle + both), alone, rtol=1e-14, atol=1e-16)


@pytest.mark.parametrize("poisson", [-0.5, 0.0, 0.3, 0.5])
def test_it_is_an_elastic_body_and_its_matrix_entries_and_convolution_agree(poisson):
    slab = Slab(13, poisson=poisson, scheme="half_space")
    compliance, n = surface_compliance(slab), slab.nodes
    matrix = compliance.matrix
    np.testing.assert_array_equal(matrix, matrix.T)
    assert np.linalg.eigvalsh(matrix)[0] > 0.1 * compliance.own_displacement()[0]
    forces = np.random.default_rng(1).standard_normal((2, n))
    np.testing.assert_allclose(
        compliance.displacements(forces).ravel(), matrix @ forces.ravel(), atol=1e-13 * matrix.max() * n
    )
    some = np.array([3, 17, 18, 100])
    both = np.concatenate((some, some + n))
    np.testing.assert_array_equal(compliance.window(some), matrix[np.ix_(both, both)])
    np.testing.assert_allclose(
        compliance.convolution.w(forces[1]), matrix[n:, n:] @ forces[1], atol=1e-13 * matrix.max() * n
    )
    coupling = np.abs(matrix[:n, n:]).max()
    assert coupling == 0.0 if poisson == 0.5 else coupling > 0.0
    assert not compliance.decouple().matrix[:n, n:].any()


def test_places_and_areas_are_those_of_a_square_numbered_column_by_column():
    slab = Slab(5, scheme="half_space")
    compliance = surface_compliance(slab)
    assert (slab.rows, slab.nodes) == (5, 25)
    np.testing.assert_array_equal(compliance.x, np.repeat(np.linspace(-0.5, 0.5, 5), 5))
    np.testing.assert_array_equal(compliance.widths, np.full(25, 1 / 16))
    assert replace(slab, n_x=7).nodes == 49
