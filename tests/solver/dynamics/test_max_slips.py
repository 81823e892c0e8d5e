"""A drive that ends after so many macroscopic slips is the longer drive, cut where the last of them ended."""

from dataclasses import replace

import numpy as np
import pytest

from nanoslip.solver.drive import Drive
from nanoslip.solver.dynamics.integrators import RK4, integrate
from nanoslip.solver.dynamics.regime import count_sticks
from nanoslip.solver.dynamics.result import DynamicsResult
from tests.solver.dynamics.drives import K
from tests.synthetic import constant_profile, profile_through

TEETH = profile_through([0.0, 0.1, 1.1], [0.0, 0.5], [1.0, 0.5], periodic_from=0)
DRIVE = Drive(1.0, 0.3, 0.02, duration=400.0, samples=40)
STEPS = {"exact": DRIVE, "rigid": replace(DRIVE, surface_compliance=False), "rk4": replace(DRIVE, integrator=RK4(0.01))}


def driven(drive: Drive) -> DynamicsResult:
    return integrate(TEETH, drive, 20.0)


@pytest.mark.parametrize("drive", STEPS.values(), ids=STEPS)
@pytest.mark.parametrize("count", [1, 3])
def test_the_motion_is_that_of_the_whole_drive_up_to_the_last_slip(drive: Drive, count: int) -> None:
    """To the bit, as it is the same path: only where it is looked at differs."""
    whole, cut = driven(drive), driven(replace(drive, max_slips=count))
    assert len(whole.slip_time) > 4
    assert cut.outcome.ok
    for name in ("slip_time", "slip_position", "slip_force", "restick_time", "restick_position"):
        np.testing.assert_array_equal(getattr(cut, name), getattr(whole, name)[:count])
    assert cut.end_time == cut.time[-1]
    assert (
        0.0 <= cut.end_time - cut.restick_time[-1] <= 0.01
    )  # the end of rk4's step; exact methods end at the crossing
    assert np.isfinite(cut.position).all()
    assert np.isfinite(cut.binned_force).all()
    assert count_sticks(cut, drive).resticks == count
    again = driven(replace(drive, duration=cut.end_time, samples=drive.samples))
    np.testing.assert_allclose(cut.position, again.position, rtol=0.0, atol=1e-10)


def test_a_drive_with_fewer_slips_lasts_as_long_as_without() -> None:
    plain, never = driven(DRIVE), driven(replace(DRIVE, max_slips=1000))
    assert never.end_time == plain.end_time == DRIVE.duration
    np.testing.assert_array_equal(plain.position, never.position)
    assert never.steps == plain.steps
    sliding = integrate(constant_profile(0.5), replace(DRIVE, max_slips=1), K)
    assert (count_sticks(sliding, DRIVE).regime, sliding.end_time) == ("slides", DRIVE.duration)
