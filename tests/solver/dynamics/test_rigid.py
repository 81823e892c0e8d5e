"""A contact that does not yield is the limit K → ∞ of one that does, and with a constant limit Eq. 16-19 themselves."""

import math
from dataclasses import replace

import numpy as np
import pytest

from nanoslip.solver.drive import Drive
from nanoslip.solver.dynamics.integrators import RK4, integrate
from nanoslip.solver.dynamics.stick_slip import Oscillator
from nanoslip.solver.outcome import Ending, InvalidInput
from tests.solver.dynamics.drives import PROBLEMS, SMALL_TEETH, K, Problem
from tests.synthetic import constant_profile, profile_through

PEAK_AND_REST = Problem(profile_through([0.0, 0.1, 1.1], [1.2, 0.5], [1.2, 0.5], periodic_from=1), 0.0, 0.2, 25.0)
FLUNG_BACK = PEAK_AND_REST._replace(profile=profile_through([0.0, 0.1, 1.1], [3.0, 0.5], [3.0, 0.5], 1), duration=40.0)
RIGID = {**PROBLEMS, "rest after a peak": PEAK_AND_REST, "flung back by a peak": FLUNG_BACK}
EVERY_PROBLEM = pytest.mark.parametrize("problem", RIGID.values(), ids=RIGID.keys())
OVER_A_PEAK = ("stick-slip with reversal onto the negative branch", "no damping", *list(RIGID)[-2:])
FIRM = 1e30
"""A surface stiffness that leaves neither creep nor presliding length: the rigid pin slips where it leaves rest."""


def rigid(problem, **changed):
    return integrate(problem.profile, problem.drive(surface_compliance=False, **changed), K)


@pytest.mark.parametrize("damping_ratio", [0.0, 0.1, 1.0, 3.0])
def test_sliding_against_constant_friction_is_the_closed_form(damping_ratio):
    """Eq. 16 until the driving force is the friction force (Eq. 19), Eq. 17 from then on."""
    drive = Drive(1.0, damping_ratio, 0.3, duration=25.0, samples=600, surface_compliance=False)
    result = integrate(constant_profile(4.0), drive, FIRM)
    slide = Oscillator(1.0, damping_ratio, 0.3, 4.0, time=(4.0 - 2.0 * damping_ratio * 0.3) / 0.3)
    moving = result.time > slide.time
    position, velocity = slide.motion(result.time[moving])
    assert np.abs(result.position[moving] - position).max() < 1e-14  # rounding at x of 4; 2e-15 seen
    assert np.abs(result.velocity[moving] - velocity).max() < 1e-14
    assert not result.position[~moving].any()
    assert result.slip_time[0] == pytest.approx(slide.time, abs=1e-14)
    driving = result.spring_force + 2.0 * damping_ratio * (0.3 - result.velocity)
    assert np.abs(result.friction_force - np.where(moving, 4.0, driving)).max() < 1e-14


def test_stick_slip_is_put_together_from_closed_forms():
    """A static peak of 1.2 over a width of 0.1, then 0.5: rest, two slides, rest at the first stop, slip again at 0.5."""
    drive = replace(PEAK_AND_REST.drive(surface_compliance=False), damping_ratio=0.1)
    result = integrate(PEAK_AND_REST.profile, drive, FIRM)
    over_peak = Oscillator(1.0, 0.1, 0.2, 1.2, time=(1.2 - 0.04) / 0.2)
    low, high = over_peak.time, over_peak.time + 2.0
    for _ in range(100):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if over_peak.motion(np.asarray(middle))[0] > 0.1 else (middle, high)
    position, velocity = over_peak.motion(np.asarray(high))
    slide = Oscillator(1.0, 0.1, 0.2, 0.5, high, float(position), float(velocity))
    stop = slide.first_stop(25.0)
    rest = float(slide.motion(np.asarray(stop))[0])
    again = (0.5 - 0.04 + rest) / 0.2
    assert result.slip_time == pytest.approx([over_peak.time, again], abs=1e-12)
    assert result.restick_time[0] == pytest.approx(stop, abs=1e-12)
    assert result.restick_position[0] == pytest.approx(rest, abs=1e-12)
    assert 1.2 < result.slip_force[0] < 1.2 + 0.2 * 2.0  # the stage gains until the pin is as fast, within time 2


@pytest.mark.parametrize("name", [*RIGID, "small teeth"])
def test_it_is_what_a_stiffening_contact_tends_to(name):
    """The stretch F̃/K falls as 1/K. A static peak is left early by the contact's vibration, V·√K: that falls as 1/√K.

    Positions differ by less than 8/K (5 seen), over a peak by less than 8/√K (1 seen).
    """
    problem = RIGID.get(name, SMALL_TEETH)
    over_peak = name in OVER_A_PEAK
    limit = rigid(problem)
    for stiffness in (1e4, 1e6, 1e8):
        full = integrate(problem.profile, problem.drive(), stiffness)
        off = np.abs(full.position - limit.position).max()
        assert off < 8.0 / (math.sqrt(stiffness) if over_peak else stiffness) + 1e-13, f"{off} off at K = {stiffness}"


def test_the_problems_stick_slide_and_slide_back():
    """Otherwise the laws here would hold less than they say."""
    back = rigid(FLUNG_BACK, samples=2000)
    assert back.velocity.min() < -0.5
    assert np.all(back.friction_force[back.velocity < 0.0] < -0.4)
    rest = rigid(PEAK_AND_REST, samples=2000)
    later = rest.time > rest.restick_time[0]
    assert 100 < (rest.velocity[later] == 0.0).sum() < later.sum() - 100
    assert len(rest.slip_time) >= 2  # undamped: the velocity touches 0 once a period later on


@EVERY_PROBLEM
def test_friction_is_the_limit_against_the_motion_and_the_driving_force_at_rest(problem):
    result = rigid(problem, samples=4000)
    limit = problem.profile.limit(result.position)
    driving = result.spring_force + 2.0 * problem.damping_ratio * (problem.stage_velocity - result.velocity)
    rest = (result.velocity == 0.0) & (np.append(result.velocity[1:], 1.0) == 0.0)  # no mere turn
    at_edge = (
        np.abs(problem.profile.limit(result.position + 1e-9) - problem.profile.limit(result.position - 1e-9)) > 0.01
    )
    assert np.abs(result.friction_force - driving)[rest].max(initial=0.0) < 1e-14
    assert np.all((np.abs(driving) <= limit + 1e-12)[rest & ~at_edge])
    moving = (result.velocity != 0.0) & ~at_edge
    assert (
        np.abs(result.friction_force - np.sign(result.velocity) * limit)[moving].max() < 1e-12
    )  # slope × rounding of x


@EVERY_PROBLEM
def test_momentum_and_energy_balance(problem):
    """To rounding where there is no damper whose loss has to be sampled."""
    result = rigid(problem, samples=40_000)
    V, end = problem.stage_velocity, problem.duration
    work = result.binned_force.sum() * end / 256 * V
    stored = 0.5 * result.velocity[-1] ** 2 + 0.5 * result.spring_force[-1] ** 2
    damping = 2.0 * problem.damping_ratio
    damped = damping * np.trapezoid((V - result.velocity) ** 2, result.time)
    tolerance = 1e-12 if damping == 0.0 else damping * end / 40_000
    assert work - damped - result.friction_work == pytest.approx(stored, abs=tolerance)


def test_output_decimation_changes_nothing():
    few, many = rigid(SMALL_TEETH, samples=3), rigid(SMALL_TEETH, samples=1500)
    assert np.array_equal(few.position, many.position[::500])
    assert np.array_equal(few.friction_force, many.friction_force[::500])
    assert np.array_equal(few.binned_force, many.binned_force)
    assert (few.steps, few.friction_work) == (many.steps, many.friction_work)


def test_it_costs_no_more_segments_than_teeth_and_turns():
    """No vibration of the contact is followed: over constant friction a drive of any length is a handful of segments."""
    problem = Problem(constant_profile(0.5), 0.1, 0.3, 12.0)  # 3 edges
    yielding = integrate(problem.profile, problem.drive(), 1e4)
    assert rigid(problem).steps < 15
    assert yielding.steps > 100


@pytest.mark.parametrize(("stage", "friction"), [(0.0, 0.4), (0.0, 0.0), (1e-300, 0.4)])
def test_a_stage_that_does_not_get_there_leaves_the_pin_at_rest(stage, friction):
    result = integrate(constant_profile(friction), Drive(1.0, 0.1, stage, 50.0, surface_compliance=False), K)
    assert result.outcome.ok
    assert not result.position.any()
    assert not result.velocity.any()


def test_a_frictionless_pin_is_an_oscillator():
    drive = Drive(1.0, 0.1, 0.3, duration=30.0, samples=300, surface_compliance=False)
    result = integrate(constant_profile(0.0), drive, K)
    position, velocity = Oscillator(1.0, 0.1, 0.3, 0.0).motion(result.time)
    assert np.abs(result.position - position).max() < 1e-13  # rounding at x of 9
    assert np.abs(result.velocity - velocity).max() < 1e-13


def test_too_many_segments_are_an_outcome():
    problem = PROBLEMS["one tooth for ever"]
    result = integrate(problem.profile, problem.drive(surface_compliance=False, step_limit=20), K)
    assert result.outcome.ending is Ending.STEP_LIMIT
    assert result.steps == 20
    assert np.isnan(result.position[-1])


def test_steps_cannot_hold_a_rigid_contact_at_rest():
    with pytest.raises(InvalidInput, match='surface_compliance = false: needs integrator = "exact"'):
        Drive(1.0, 0.1, 0.3, 1.0, integrator=RK4(1e-3), surface_compliance=False)


@pytest.mark.parametrize("damping_ratio", [0.0, 0.1, 1.0])
def test_what_a_first_slip_over_constant_friction_takes_more_is_inertia(damping_ratio):
    """V√(k·m) without a damper, with which the pin reaches the stage's velocity; less with one, which moves it along."""
    drive = Drive(1.0, damping_ratio, 0.3, duration=25.0, samples=10, surface_compliance=False)
    beyond = integrate(constant_profile(4.0), drive, FIRM).slip_force[0] - 4.0
    if damping_ratio:
        assert 0.0 < beyond < 0.3
    else:
        assert beyond == pytest.approx(0.3, rel=1e-12)


def test_slips_of_a_rigid_contact_are_told_by_the_velocity_of_a_compliant_one():
    """So that both limits count alike; a contact of K → ∞ has the velocity of a rigid pin that sticks, 0."""
    drive = Drive(1.0, 0.1, 0.3, duration=25.0, samples=10)
    yielding, firm = (
        integrate(constant_profile(4.0), replace(drive, surface_compliance=on), K) for on in (True, False)
    )
    assert firm.stick_velocity == yielding.stick_velocity == 0.3 / (1.0 + K)
    assert integrate(constant_profile(4.0), replace(drive, step_limit=100), FIRM).stick_velocity < 1e-29
