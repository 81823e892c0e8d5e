"""Grids: the paper's binary hierarchy, its coordinates and what supports hold."""

from typing import Any

import numpy as np
import pytest

from nanoslip.solver.elasticity.grid import support_mask
from nanoslip.solver.slab import Slab
from tests.synthetic import grid_of

# The paper's binary hierarchy of §2.1.2: row counts, depths, and control volumes that tile the slab.


def paper(**parameters: Any) -> Slab:
    return Slab.of({"scheme": "biquadratic", **parameters})


@pytest.mark.parametrize("levels", [2, 3, 5, 7])
def test_two_fine_rows_then_half_the_intervals_down_to_three_nodes(levels: int) -> None:
    grid = grid_of(paper(n_x=2**levels + 1))
    assert list(grid.counts) == [2**levels + 1] + [2**level + 1 for level in range(levels, 0, -1)]


def test_doubling_from_the_first_row() -> None:
    steps = -np.diff(grid_of(paper(n_x=65, first_spacing="doubling")).depths)
    np.testing.assert_allclose(steps / steps[0], 2.0 ** np.arange(6), rtol=1e-13)


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
        fixed_u, fixed_w = support_mask(grid, support)  # type: ignore[arg-type]
        assert list(np.flatnonzero(fixed_w)) == list(bottom)
        assert fixed_u.sum() == held
    right = np.flatnonzero(support_mask(grid, "right_side")[0])
    np.testing.assert_array_equal(grid.coordinates()[right, 0], 1.0)
    assert np.all(grid.coordinates()[right, 1] < 0.0)  # the surface corner stays free for the pin
