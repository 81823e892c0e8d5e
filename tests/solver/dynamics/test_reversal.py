"""A pin that is not to slip back moves as any other until it would, and there its run ends by name."""

import numpy as np
import pytest

from nanoslip.solver.dynamics.integrators import RK4, integrate
from nanoslip.solver.outcome import Ending
from tests.solver.dynamics.drives import PROBLEMS, SMALL_TEETH, K

METHODS = pytest.mark.parametrize(
    "method",
    [{}, {"surface_compliance": False}, {"integrator": RK4(1e-4)}],
    ids=["exact", "rigid", "rk4"],
)
ARRAYS = ("position", "velocity", "friction_force", "slip_time", "slip_force", "restick_time", "binned_force")
FORWARD = {name: problem for name, problem in PROBLEMS.items() if problem.damping_ratio >= 1.0} | {"small": SMALL_TEETH}
BACKWARD = PROBLEMS["stick-slip with reversal onto the negative branch"]


@METHODS
@pytest.mark.parametrize("problem", FORWARD.values(), ids=FORWARD.keys())
def test_where_the_pin_never_slips_back_nothing_changes(problem, method):
    """Bit for bit."""
    free, one_way = (
        integrate(problem.profile, problem.drive(**method, reverse_motion=allowed), K) for allowed in (True, False)
    )
    assert one_way.outcome.ok
    assert (free.steps, free.friction_work, free.micro_travel) == (
        one_way.steps,
        one_way.friction_work,
        one_way.micro_travel,
    )
    for name in ARRAYS:
        assert np.array_equal(getattr(free, name), getattr(one_way, name), equal_nan=True), name


@METHODS
def test_the_run_ends_where_the_pin_would_slip_back(method):
    """Up to there nothing differs, after it there is nothing; friction has reached the negative limit there."""
    free, one_way = (
        integrate(BACKWARD.profile, BACKWARD.drive(**method, reverse_motion=allowed, samples=4000), K)
        for allowed in (True, False)
    )
    assert one_way.outcome.ending is Ending.REVERSED
    assert "reverse_motion = true" in one_way.outcome.message
    told = float(one_way.outcome.message.partition("after ")[2].partition(" % of")[0])
    reached = np.isfinite(one_way.position)
    count = int(reached.sum())
    assert 1000 < count < 4000
    assert not reached[count:].any()
    assert np.array_equal(one_way.position[:count], free.position[:count])
    share = one_way.time / one_way.time[-1]
    assert share[count - 1] <= told / 100.0 * (1.0 + 1e-3) < share[count] * (1.0 + 2e-3)  # four digits are told
    after = free.friction_force[count : count + 3]
    limit = BACKWARD.profile.limit(free.position[count : count + 3])
    assert np.abs(after + limit).max() < 1e-3  # a few samples on, F follows -F̃


@METHODS
def test_elastic_stretch_may_be_given_back(method):
    """The pin swings back in its stretched contact after a drop of the limit, as far as the stretch goes; a rigid one rests."""
    drive = PROBLEMS["falling teeth"].drive(**method, reverse_motion=False)
    result = integrate(PROBLEMS["falling teeth"].profile, drive, K)
    assert result.outcome.ok
    assert (result.velocity.min() < -0.1) == drive.surface_compliance
