"""The graded hierarchy: valid on any slab, fine where fields vary fast, the paper's rows as one corner."""

import itertools

import numpy as np
import pytest

from nanoslip.solver.elasticity.schemes import Galerkin
from nanoslip.solver.slab import Slab
from tests.synthetic import grid_of


@pytest.mark.parametrize("aspect_ratio", [0.01, 0.1, 0.3, 1.0, 3.0, 10.0, 100.0])
@pytest.mark.parametrize("n_x", [5, 9, 33, 129, 1025, 4097])
def test_every_slab_has_a_hierarchy(n_x: int, aspect_ratio: float) -> None:
    top = n_x.bit_length() - 1
    for per_level, coarsest in itertools.product((1, 2, 3, 5), {1, top // 2, top}):
        for bottom in {max(1, coarsest), top}:
            if coarsest < 1:
                continue
            slab = Slab(
                n_x,
                aspect_ratio,
                scheme=Galerkin(rows_per_level=per_level, coarsest_row=2**coarsest + 1, bottom_row=2**bottom + 1),
            )
            grid = grid_of(slab)
            assert grid.rows >= 3
            assert grid.rows % 2 == 1
            assert grid.counts[0] == n_x
            assert grid.counts.min() >= 2**coarsest + 1
            assert grid.counts[-1] >= 2**bottom + 1 or grid.counts[-1] == grid.counts.min()
            assert grid.depths[0] == 0.0
            assert grid.depths[-1] == -aspect_ratio
            steps = -np.diff(grid.depths)
            assert steps.min() > 0.0
            # Neighbours are nested, and no row is much thinner than the next: strips of three stay well-shaped.
            assert set(np.diff(np.log2(grid.counts - 1)).round(12)) <= {-1.0, 0.0, 1.0}
            assert np.abs(np.diff(np.log2(steps))).max() <= 2.0


def test_head_middle_and_tail() -> None:
    grid = grid_of(Slab(129, scheme=Galerkin(coarsest_row=17, bottom_row=65, rows_per_level=2)))
    levels = list(np.log2(128 / (grid.counts - 1)).astype(int))
    middle = len(levels) - 10
    assert levels == [0, 0, 1, 1, 2, 2, *[3] * middle, 2, 2, 1, 1]
    steps = -np.diff(grid.depths) * 128
    np.testing.assert_allclose(steps[:6], [1.5, 1.5, 3.0, 3.0, 6.0, 6.0], rtol=1e-12)
    np.testing.assert_allclose(steps[-4:], [6.0, 6.0, 3.0, 3.0], rtol=1e-12)
    np.testing.assert_allclose(steps[6:-4], steps[6], rtol=1e-12)
    assert steps[6] <= 2 * 8


def test_the_papers_hierarchy_is_a_corner_of_the_family() -> None:
    grid = grid_of(Slab(129, scheme=Galerkin(rows_per_level=1, coarsest_row=3, bottom_row=3)))
    assert list(grid.counts[:7]) == [129, 65, 33, 17, 9, 5, 3]
    assert set(grid.counts[7:]) == {3}


@pytest.mark.parametrize("nodes", [5, 17])
def test_rows_thicken_in_proportion_to_the_distance_from_both_ends(nodes: int) -> None:
    """From L_x, or sixteen coarse spacings, to eight times that."""
    grid = grid_of(Slab(nodes, aspect_ratio=30.0, scheme=Galerkin(coarsest_row=nodes, bottom_row=nodes)))
    middle, steps = (grid.depths[1:] + grid.depths[:-1]) / -2, -np.diff(grid.depths)
    distance = np.clip(np.minimum(middle, 30.0 - middle) * min(1.0, (nodes - 1) / 16), 1.0, 8.0)
    # Their number is rounded to an even one.
    np.testing.assert_allclose(steps / (2 / (nodes - 1) * distance), 1.0, atol=0.06)
