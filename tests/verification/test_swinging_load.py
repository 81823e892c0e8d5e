"""A pin that is moved on in small steps while its load swings: its friction follows the lowest load."""

import numpy as np
import pytest

from nanoslip.solver.case import Case, Effects, SlipRule
from nanoslip.solver.load_path import LoadPath
from nanoslip.solver.simulate import friction_path
from nanoslip.solver.slab import Slab
from tests.verification.seen import seen

FRICTION, LOAD, LOWEST = 0.3, 1e-3, 0.6
STEP = 0.2
"""Way of the pin in a cycle of the load, over μ_i·W/K: five cycles bring it to the limit of the lowest load."""


def friction_at_lowest_load(
    slab: Slab, residual_shear: float, cycles: int, radius: float = 200.0, stiffness: float = 1.8
) -> np.ndarray:
    """F/(μ_i·W_min) where the load is lowest, of each cycle: a step of the pin, the load down, the load up.

    stiffness: K, roughly, over G·L_y.
    """
    step = STEP * FRICTION * LOAD / stiffness
    legs = [point for k in range(1, cycles + 1) for point in ((k * step, 1.0), (k * step, LOWEST), (k * step, 1.0))]
    rule, uncoupled = SlipRule(residual_shear=residual_shear), Effects(coupling=False)
    path = LoadPath(legs=tuple(legs))
    case = Case(FRICTION, radius, LOAD, slab, start=0.3, slip_rule=rule, effects=uncoupled, path=path)
    found = friction_path(case)
    assert found.outcome.ok
    return np.array([leg.final_force for leg in found.legs[1::3]]) / (FRICTION * LOWEST * LOAD)


PLANE, BALL = Slab(33, scheme="half_plane"), Slab(17, scheme="half_space")


@pytest.mark.parametrize(
    ("slab", "radius", "stiffness"),
    [(PLANE, 200.0, 1.8), pytest.param(BALL, 50.0, 0.9, marks=pytest.mark.slow)],
    ids=["half_plane", "half_space"],
)
def test_coulomb_friction_is_that_of_the_lowest_load(slab: Slab, radius: float, stiffness: float) -> None:
    """F = μ_i·W_min: there all nodes slide, and what the pin wins under a higher load is lost on the way down."""
    found = friction_at_lowest_load(slab, 1.0, 8, radius, stiffness)
    line = seen("friction under a swinging load", "Popov, Popov and Popov 2016", f"F/(μ W_min) {np.round(found, 3)}")
    assert found[0] < 0.5, line
    np.testing.assert_allclose(found[-2:], 1.0, rtol=1e-9, err_msg=line)


@pytest.mark.slow
def test_with_full_drops_it_is_the_plateau_of_the_lowest_load() -> None:
    """0.53 of μ_i·W_min in place of all of it. A contact of 37 nodes scatters by 0.02 about its plateau."""
    found = friction_at_lowest_load(Slab(65, scheme="half_plane"), 0.0, 12)
    line = seen("the same with full drops", "plateau (1 + r)/2", f"F/(μ W_min) {np.round(found, 3)}")
    assert np.mean(found[4:]) == pytest.approx(0.53, abs=0.03), line
