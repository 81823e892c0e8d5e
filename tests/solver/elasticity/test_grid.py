"""Grids and the polynomials on their cells."""

import itertools
from typing import Any

import numpy as np
import pytest

from nanoslip.solver.elasticity.grid import FirstSpacing, integral, lagrange, restrained, slope, value
from nanoslip.solver.slab import Slab
from tests.synthetic import grid_of

# The paper's binary hierarchy of §2.1.2: row counts, depths, and control volumes that tile the slab.


def paper(**parameters: Any) -> Slab:
    return Slab.of({"scheme": "biquadratic", **parameters})


@pytest.mark.parametrize("levels", [2, 3, 5, 7])
def test_two_fine_rows_then_half_the_intervals_down_to_three_nodes(levels: int) -> None:
    grid = grid_of(paper(n_x=2**levels + 1))
    assert list(grid.counts) == [2**levels + 1] + [2**level + 1 for level in range(levels, 0, -1)]


@pytest.mark.parametrize("aspect_ratio", [0.25, 1.0, 4.0])
def test_equal_first_spacings_then_doubling(aspect_ratio: float) -> None:
    steps = -np.diff(grid_of(paper(n_x=65, aspect_ratio=aspect_ratio)).depths)
    assert steps[0] == pytest.approx(aspect_ratio / 2**5, rel=1e-14)  # L_z = Δz_2·2^(N-1)
    np.testing.assert_allclose(steps / steps[0], [1, 1, 2, 4, 8, 16], rtol=1e-13)


def test_doubling_from_the_first_row() -> None:
    steps = -np.diff(grid_of(paper(n_x=65, first_spacing="doubling")).depths)
    np.testing.assert_allclose(steps / steps[0], 2.0 ** np.arange(6), rtol=1e-13)


@pytest.mark.parametrize("first_spacing", ["equal", "doubling"])
@pytest.mark.parametrize("rows", [3, 4, 6])
def test_control_volumes_tile_the_slab(rows: int, first_spacing: FirstSpacing) -> None:
    grid = grid_of(paper(n_x=33, rows=rows, aspect_ratio=1.5, first_spacing=first_spacing))
    volumes = [grid.volume_z(row) for row in range(grid.rows)]
    assert volumes[0][1] == 0.0
    assert volumes[-1][0] == pytest.approx(-1.5, rel=1e-15)
    for upper, lower in itertools.pairwise(volumes):
        assert upper[0] == lower[1]


def test_a_typical_volume_reaches_one_spacing_down_as_eq_4_says() -> None:
    grid = grid_of(paper(n_x=65))
    lower, upper = grid.volume_z(3)
    spacing = grid.depths[2] - grid.depths[3]
    assert lower == pytest.approx(grid.depths[3] - spacing, rel=1e-14)
    assert upper == pytest.approx(grid.depths[3] + spacing / 2, rel=1e-14)


def test_coordinates_follow_the_numbering() -> None:
    grid = grid_of(paper(n_x=9))
    coordinates = grid.coordinates()
    assert coordinates.shape == (grid.nodes, 2)
    for row in range(grid.rows):
        np.testing.assert_array_equal(coordinates[grid.row_nodes(row), 0], grid.row_x(row))
        assert set(coordinates[grid.row_nodes(row), 1]) == {grid.depths[row]}


def test_supports_hold_what_they_name() -> None:
    grid = grid_of(paper(n_x=9))
    bottom = grid.row_nodes(grid.rows - 1)
    for support, held in (("bonded", 3), ("frictionless", 1), ("right_side", grid.rows - 1)):
        fixed_u, fixed_w = restrained(grid, support)  # type: ignore[arg-type]
        assert list(np.flatnonzero(fixed_w)) == list(bottom)
        assert fixed_u.sum() == held
    right = np.flatnonzero(restrained(grid, "right_side")[0])
    np.testing.assert_array_equal(grid.coordinates()[right, 0], 1.0)
    assert np.all(grid.coordinates()[right, 1] < 0.0)  # the surface corner stays free for the pin


# Lagrange polynomials: one at their point, zero at the others, exact for polynomials of their degree.


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
