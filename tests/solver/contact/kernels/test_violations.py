"""The search for the worst offender, bit for bit: the largest shear ratio, and of mirror twins the one further right."""

import numpy as np
import pytest
from numpy.typing import NDArray

from nanoslip.solver.contact.kernels.events import worst_violation

NODES = 45
TOLERANCE = 1e-15


def worst(shear: NDArray[np.float64], pressure: NDArray[np.float64], limits: NDArray[np.float64]) -> tuple[int, float]:
    node, tension = worst_violation(shear, -pressure, limits, np.isfinite(limits), TOLERANCE, -1.0)
    return int(node), float(tension)


def test_shear_against_the_drag_counts_only_where_both_ways_are_limited() -> None:
    shear, pressure, limits = np.array([-9.0, 1.0, 3.0, -2.0]), np.ones(4), np.full(4, 0.5)
    assert worst(shear, pressure, limits)[0] == 0
    assert worst_violation(shear, -pressure, limits, np.isfinite(limits), TOLERANCE, 0.0)[0] == 2
    assert worst_violation(-np.abs(shear), -pressure, limits, np.isfinite(limits), TOLERANCE, 0.0)[0] == -1


@pytest.mark.parametrize("seed", range(20))
def test_the_worst_offender_is_the_node_with_the_largest_ratio(seed: int) -> None:
    rng = np.random.default_rng(seed)
    shear, pressure, limits = rng.normal(size=NODES), rng.uniform(0.1, 1.0, NODES), rng.uniform(0.1, 1.0, NODES)
    limits[rng.random(NODES) < 0.3] = np.nan  # free or stuck for ever
    ratio = np.nan_to_num(np.abs(shear) / (limits * pressure))
    assert worst(shear, pressure, limits) == (int(np.argmax(ratio)), 0.0)
    assert worst(shear * 0.99 / ratio.max(), pressure, limits) == (-1, 0.0)
    pressure[np.flatnonzero(np.isfinite(limits))[3]] = -2.0
    assert worst(shear, pressure, limits)[1] == 2.0


@pytest.mark.parametrize("seed", range(20))
def test_rounding_does_not_decide_between_mirror_twins(seed: int) -> None:
    # Ratios over all magnitudes, so that some lie on the edge of a cut; a few ulps more or less on the left twin.
    rng = np.random.default_rng(seed)
    for ratio in (*(1.0 + 10.0 ** rng.uniform(-6, 2, 200)), *(1.0 + rng.integers(1, 2**20, 200) * 2.0**-37)):
        shear = np.full(NODES, 0.5)
        left, right = sorted(rng.choice(NODES, 2, replace=False))
        shear[right] = ratio
        shear[left] = -ratio * (1.0 + rng.integers(-4, 5) * np.finfo(float).eps)
        assert worst(shear, np.ones(NODES), np.ones(NODES))[0] == right
