"""Regimes are what Eq. 16-19 say of a pin with constant friction forces, and are counted from slips alone."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from nanoslip.solver.drive import Drive
from nanoslip.solver.dynamics.integrators import integrate
from nanoslip.solver.dynamics.regime import StickSlipCount, count_sticks
from nanoslip.solver.dynamics.result import DynamicsResult
from nanoslip.solver.dynamics.stick_slip import stick_slip
from nanoslip.solver.outcome import Ending, Outcome
from tests.solver.dynamics.drives import PROBLEMS
from tests.synthetic import constant_profile, profile_through

DRIVE = Drive(1.0, 0.05, 0.1, duration=100.0, samples=10)


def driven(slips: list[float], ends: list[float], duration: float = 100.0) -> DynamicsResult:
    """The result of a drive with these slips."""
    plain = integrate(constant_profile(1e3), replace(DRIVE, duration=duration), 5.0)
    none = np.full(len(slips), math.nan)
    return replace(
        plain,
        slip_time=np.array(slips),
        restick_time=np.array(ends),
        slip_position=none,
        slip_force=none,
        restick_position=none,
    )


def counted(result: DynamicsResult, drive: Drive = DRIVE) -> StickSlipCount:
    return count_sticks(result, drive)


def of_closed_form(duration: float, static: float, later: float, velocity: float = 0.1) -> DynamicsResult:
    drive = replace(DRIVE, duration=duration, stage_velocity=velocity)
    motion = stick_slip(np.linspace(0.0, duration, 3), drive, kinetic=0.5, static=static, later_static=later)
    return driven(list(motion.slip_time), list(motion.restick_time), duration)


def test_without_a_slip_the_pin_sticks_all_the_time():
    found = counted(driven([], []))
    assert (found.resticks, found.time_stuck, found.regime) == (0, 1.0, "sticks")


def test_time_outside_slips_is_time_stuck():
    found = counted(driven([10.0, 40.0, 80.0], [15.0, 60.0, math.nan]))
    assert found.resticks == 2
    assert found.time_stuck == pytest.approx(1.0 - (5.0 + 20.0 + 20.0) / 100.0, rel=1e-15)


@pytest.mark.parametrize("duration", np.linspace(30.0, 300.0, 91))
def test_a_motion_that_repeats_itself_is_stick_slip_whenever_it_is_cut(duration):
    """Static 1.2 over kinetic 0.5 for ever. From the first re-stick on: whether the end falls into stick or slip."""
    motion = stick_slip(np.linspace(0.0, 400.0, 3), DRIVE, kinetic=0.5, static=1.2, later_static=1.2)
    assert len(motion.slip_time) > 20
    assert motion.restick_time[0] < 30.0
    found = counted(of_closed_form(duration, 1.2, 1.2))
    assert found.regime == "stick_slip"
    assert found.resticks == np.sum(motion.restick_time < duration)


def test_a_pin_that_sticks_again_before_it_slides_for_good_slides():
    """Static 2 once, then 0.52: the first slip's swing re-sticks it, the last ends in steady sliding (as in §3.3)."""
    motion = stick_slip(np.linspace(0.0, 300.0, 3), DRIVE, kinetic=0.5, static=2.0, later_static=0.52)
    assert len(motion.slip_time) >= 2
    assert math.isnan(motion.restick_time[-1])
    assert counted(of_closed_form(300.0, 2.0, 0.52)).regime == "slides"
    cycle = max(later - start for start, later in pairwise(motion.slip_time))
    soon = float(motion.slip_time[-1]) + 0.99 * cycle  # too early to tell
    assert counted(of_closed_form(soon, 2.0, 0.52)).regime == "stick_slip"


def test_a_pin_that_never_sticks_again_slides():
    found = counted(of_closed_form(100.0, 0.5, 0.5))
    assert (found.resticks, found.regime) == (0, "slides")
    assert found.time_stuck == pytest.approx((0.5 - 0.01) / 0.1 / 100.0, rel=1e-12)  # up to k V t + c V = 0.5


def test_a_pin_at_rest_in_the_end_has_not_begun_to_slide():
    assert counted(driven([10.0], [30.0])).regime == "stick_slip"


@pytest.mark.parametrize(("velocity", "regime"), [(0.02, "stick_slip"), (2.0, "slides")])
def test_the_integrator_sticks_and_slips_when_slow_and_slides_when_fast(velocity, regime):
    """Teeth from 0.5 up to 1 and down again at once, much shorter than a slow pin's slips: stick-slip dies with speed."""
    profile = profile_through([0.0, 0.1, 1.1], [0.0, 0.5], [1.0, 0.5], periodic_from=0)
    drive = Drive(1.0, 0.3, velocity, duration=300.0 if velocity < 1.0 else 60.0, samples=10)
    result = integrate(profile, drive, 20.0)
    found = counted(result, drive)
    assert found.regime == regime
    assert found.resticks == np.isfinite(result.restick_time).sum()
    assert (found.resticks > 3) == (regime == "stick_slip")


def test_a_drive_that_ended_early_has_no_regime():
    found = counted(replace(driven([10.0], [30.0]), outcome=Outcome(Ending.STEP_LIMIT, "raise it")))
    assert (found.resticks, found.regime) == (1, None)
    assert math.isnan(found.time_stuck)


def test_amplitude_and_period_are_those_of_the_motion_in_the_second_half():
    """Samples so dense that they miss a peak by a phase of 1e-3, and its height by the square of that, give the same range."""
    profile = profile_through([0.0, 0.1, 1.1], [0.0, 0.5], [1.0, 0.5], periodic_from=0)
    for compliance in (True, False):
        drive = Drive(1.0, 0.3, 0.02, duration=300.0, samples=300_000, surface_compliance=compliance)
        result = integrate(profile, drive, 20.0)
        found = counted(result, drive)
        force, late = result.spring_force[result.time >= 150.0], result.slip_time[result.slip_time >= 150.0]
        assert found.spring_force_amplitude == pytest.approx(np.ptp(force), rel=1e-5)
        assert found.spring_force_amplitude > 0.5
        assert found.stick_slip_period == pytest.approx((late[-1] - late[0]) / (len(late) - 1), rel=1e-12)


@pytest.mark.parametrize("damping_ratio", [0.02, 0.3])
def test_the_amplitude_of_a_sliding_pin_is_what_still_rings(damping_ratio):
    """After a first peak of 3: the ringing of the second half, e^(-ζ ω t) of what it was."""
    drive = Drive(1.0, damping_ratio, 0.5, duration=60.0, samples=60_000)
    result = integrate(PROBLEMS["stick-slip with reversal onto the negative branch"].profile, drive, 5.0)
    found = counted(result, drive)
    force = result.spring_force[result.time >= 30.0]
    assert found.regime == "slides"
    assert found.spring_force_amplitude == pytest.approx(np.ptp(force), abs=1e-5)
    assert math.isnan(found.stick_slip_period)


def test_what_repeats_is_not_told_without_a_whole_cycle_in_the_second_half():
    for slips, ends in (([], []), ([10.0], [30.0]), ([10.0, 60.0], [30.0, 70.0]), ([60.0], [math.nan])):
        found = counted(driven(slips, ends))
        assert math.isnan(found.spring_force_amplitude)
        assert math.isnan(found.stick_slip_period)
    found = counted(driven([10.0, 60.0, 80.0], [30.0, 70.0, 90.0]))
    assert found.stick_slip_period == 20.0
    assert math.isfinite(found.spring_force_amplitude)


def test_the_loading_ramp_is_no_amplitude():
    """The limit falls from 1 to 0.5 and jumps back up: all swings are as wide. `nanoslip try radius=50 stage_velocity=1e-3`
    showed 0.091 where 0.025 follows for ever: its first slip comes in the second half of 0.2 s."""
    profile = profile_through([0.0, 0.4], [1.0], [0.5], periodic_from=0)
    drives = [Drive(1.0, 0.3, 0.02, duration=duration, samples=10) for duration in (95.0, 300.0)]
    short, long = (counted(integrate(profile, drive, 20.0), drive) for drive in drives)
    assert short.macroscopic_slips > 1
    assert math.isnan(short.spring_force_amplitude)
    assert math.isnan(short.stick_slip_period)
    assert short.unsettled.startswith("the first slip is in the second half of the time")
    assert short.unsettled.endswith("raise duration")
    assert math.isfinite(long.spring_force_amplitude)
    assert long.unsettled == ""
    ended = replace(drives[1], max_slips=2)
    assert counted(integrate(profile, ended, 20.0), ended).unsettled.endswith("raise max_slips")


def test_a_single_late_slip_is_not_said_to_be_unsettled():
    """Nothing is lost: it has neither amplitude nor period."""
    assert counted(driven([60.0], [70.0])).unsettled == ""


def test_the_samples_do_not_decide_the_amplitude():
    profile = PROBLEMS["stick-slip with reversal onto the negative branch"].profile
    few, many = (integrate(profile, replace(DRIVE, samples=samples), 5.0) for samples in (1, 5000))
    assert few.spring_force_range == many.spring_force_range > 0.0


def test_a_stiff_spring_leads_the_pin_along_in_micro_slips():
    """Teeth of 0.02 of the presliding length, whose drops a spring as stiff as the contact relaxes at once: no slip is
    macroscopic, but the pin keeps up with the stage. Before the limit is reached it sticks."""
    edges = np.linspace(0.0, 0.2, 101)
    profile = profile_through(edges, np.full(100, 0.5), np.full(100, 0.5 + 0.002 * 5.0), periodic_from=0)
    slow = Drive(50.0, 1.0, 1e-3, duration=400.0, samples=200_000)
    result = integrate(profile, slow, 5.0)
    found = counted(result, slow)
    assert (found.macroscopic_slips, found.regime) == (0, "micro_slip")
    assert result.position[-1] - result.position[100_000] == pytest.approx(0.2, rel=0.05)
    assert found.spring_force_amplitude == pytest.approx(np.ptp(result.spring_force[100_000:]), rel=0.01)
    assert found.unsettled == ""
    early = replace(slow, duration=185.0)  # its ramp ends at 110
    still_rising = counted(integrate(profile, early, 5.0), early)
    assert still_rising.regime == "micro_slip"
    assert math.isnan(still_rising.spring_force_amplitude)
    assert still_rising.unsettled.startswith("the end of the loading ramp is in the second half")
    short = replace(slow, duration=50.0, stage_velocity=1e-5)
    assert counted(integrate(profile, short, 5.0), short).regime == "sticks"
