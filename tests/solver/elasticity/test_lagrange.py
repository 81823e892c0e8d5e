"""Lagrange polynomials: one at their point, zero at the others, exact for polynomials of their degree."""

import numpy as np
import pytest

from nanoslip.solver.elasticity.grid import integral, lagrange, slope, value


@pytest.mark.parametrize("points", [(0.0, 1.0, 3.0), (-1.0, 1.0, 3.0), (0.5, 1.0, 1.5), (0.0, 2.0)])
def test_each_polynomial_is_one_at_its_point_only(points: tuple[float, ...]) -> None:
    basis = lagrange(points)
    np.testing.assert_allclose([value(basis, t) for t in points], np.eye(len(points)), atol=1e-15)


def test_values_slopes_and_integrals_of_a_parabola() -> None:
    points = (-0.3, 0.2, 1.1)
    nodal = np.array([2 - 3 * t + 5 * t * t for t in points])
    basis = lagrange(points)
    assert value(basis, 0.7) @ nodal == pytest.approx(2 - 3 * 0.7 + 5 * 0.49, rel=1e-14)
    assert slope(basis, 0.7) @ nodal == pytest.approx(-3 + 10 * 0.7, rel=1e-14)
    exact = 2 * 0.9 - 1.5 * (0.81 - 0.0) + 5 / 3 * 0.729
    assert integral(basis, 0.0, 0.9) @ nodal == pytest.approx(exact, rel=1e-14)


def test_the_typical_row_weights_of_eq_10() -> None:
    """γ at η = 0, 1, 3 where η is measured in the upper spacing: the printed forms at an arbitrary point."""
    eta = 0.37
    printed = [(eta - 1) * (eta - 3) / 3, -eta * (eta - 3) / 2, eta * (eta - 1) / 6]
    np.testing.assert_allclose(value(lagrange((0.0, 1.0, 3.0)), eta), printed, rtol=1e-14)
