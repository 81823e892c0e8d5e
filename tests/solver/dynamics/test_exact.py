"""The event-driven method is exact: against an adaptive method with event location, closed forms and balances."""

import math

import numpy as np
import pytest

from nanoslip.solver.drive import Drive
from nanoslip.solver.dynamics.integrators import RK4, integrate
from nanoslip.solver.dynamics.kernels.motion import Teeth, tooth_at
from nanoslip.solver.dynamics.stick_slip import Oscillator
from nanoslip.solver.outcome import Ending, InvalidInput
from tests.solver.dynamics.drives import PROBLEMS, K, Problem, reference
from tests.synthetic import constant_profile, profile_through

EVERY_PROBLEM = pytest.mark.parametrize("problem", PROBLEMS.values(), ids=PROBLEMS.keys())


@EVERY_PROBLEM
def test_the_kernels_teeth_are_the_profiles_on_both_sides_of_zero(problem):
    """A pulled pin hardly ever gets behind its start, so the mirrored teeth are looked at directly."""
    profile = problem.profile
    teeth = Teeth(profile.edges, profile.force, profile.slope, profile.periodic_from)
    beyond = 0.0
    for index in range(-12, 12):
        left, right, force, slope = tooth_at(teeth, index)
        assert index == -12 or left == pytest.approx(beyond, abs=1e-15)
        beyond = right
        inside = left + (right - left) * np.array([0.1, 0.5, 0.9])
        assert np.abs(force + slope * (inside - left) - profile.limit(inside)).max() < 1e-13  # slope × rounding of x
    assert tooth_at(teeth, 0)[0] == 0.0


@EVERY_PROBLEM
@pytest.mark.parametrize("share", [0.3, 0.6, 1.0])
def test_the_state_is_that_of_a_method_of_order_eight(problem, share):
    end = share * problem.duration
    result = integrate(problem.profile, problem.drive(duration=end, samples=1), K)
    state = [result.position[-1], result.velocity[-1], result.friction_force[-1]]
    # The reference's relative tolerance of 1e-12 grows along some hundred events; 2e-11 seen.
    assert np.abs(state - reference(problem, end)).max() < 1e-9


def test_the_problems_take_every_branch():
    """Otherwise the comparison above would hold less than it says."""
    results = {name: integrate(problem.profile, problem.drive(samples=2000), K) for name, problem in PROBLEMS.items()}
    backwards = results["stick-slip with reversal onto the negative branch"]
    assert backwards.velocity.min() < -0.5
    assert (
        backwards.friction_force.min() < -0.6
    )  # the lowest tooth is at 0.45: the negative limit was followed up a tooth
    assert len(backwards.slip_time) > 1
    assert PROBLEMS["teeth steeper than the contact"].profile.slope.max() > K
    assert PROBLEMS["falling teeth"].profile.slope.min() < 0.0
    assert all(result.outcome.ok for result in results.values())


@pytest.mark.parametrize("damping_ratio", [0.0, 0.1, 1.0, 3.0])
def test_sliding_against_constant_friction_is_the_closed_form(damping_ratio):
    """A contact 10^8 times as stiff as the spring sticks nearly without creep: Eq. 16-17 but for F/K and kV/(k + K)."""
    friction, stiff = 4.0, 1e8
    drive = Drive(1.0, damping_ratio, 0.3, duration=25.0, samples=600)
    result = integrate(constant_profile(friction), drive, stiff)
    slide = Oscillator(1.0, damping_ratio, 0.3, friction, time=(friction - 2.0 * damping_ratio * 0.3) / 0.3)  # Eq. 19
    moving = result.time > slide.time
    position, velocity = slide.motion(result.time[moving])
    assert np.abs(result.position[moving] - position).max() < 10 * friction / stiff
    # The contact's own vibration, of amplitude V·√(k/K), rides on the velocity at the onset.
    assert np.abs(result.velocity[moving] - velocity).max() < 2 * 0.3 * math.sqrt(1.0 / stiff)
    assert np.abs(result.position[~moving]).max(initial=0.0) < 2 * friction / stiff


def test_sliding_with_the_slope_of_the_limit_is_an_oscillator_with_that_stiffness():
    """One long rising tooth from 0: F̃ = s·x from the start, so x'' + c x' + (k + s)x = kVt + cV."""
    slope, damping_ratio, V = 0.7, 0.2, 0.3
    result = integrate(profile_through([0.0, 100.0], [0.0], [70.0]), Drive(1.0, damping_ratio, V, 4.0, samples=50), K)
    total = 1.0 + slope
    equivalent = Oscillator(total, damping_ratio / math.sqrt(total), V / total, friction_force=0.0)
    # Stage velocity V·k/(k + s) gives the same spring term; the damper then lacks c(V - V k/(k + s)), a constant force.
    lacking = 2.0 * damping_ratio * (V - V / total)
    shifted = Oscillator(total, equivalent.damping_ratio, V / total, friction_force=-lacking)
    position, velocity = shifted.motion(result.time)
    assert np.all(np.diff(result.position) > 0.0)  # else the limit would have been left
    assert np.abs(result.position - position).max() < 1e-14
    assert np.abs(result.velocity - velocity).max() < 1e-14


def test_equal_slopes_of_limit_and_contact_are_one_motion_whichever_branch_rounding_takes():
    """F̃ = K x from a relaxed start: on the limit and below it at once."""
    drive = Drive(1.0, 0.1, 0.3, duration=20.0, samples=200)
    results = [
        integrate(profile_through([0.0, 100.0], [0.0], [100.0 * K * (1.0 + tilt)]), drive, K)
        for tilt in (-3e-16, 0.0, 3e-16)
    ]
    for result in results:
        assert result.outcome.ok
        assert np.abs(result.position - results[1].position).max() < 1e-13


@EVERY_PROBLEM
def test_output_decimation_changes_nothing(problem):
    """Bit for bit: samples are read off the closed form and never end a segment."""
    few = integrate(problem.profile, problem.drive(samples=7), K)
    many = integrate(problem.profile, problem.drive(samples=7 * 30), K)
    assert np.array_equal(few.position, many.position[::30])
    assert np.array_equal(few.friction_force, many.friction_force[::30])
    for name in ("slip_time", "slip_position", "slip_force", "restick_time", "restick_position", "binned_force"):
        assert np.array_equal(getattr(few, name), getattr(many, name), equal_nan=True)
    assert (few.steps, few.micro_slips, few.micro_travel) == (many.steps, many.micro_slips, many.micro_travel)
    assert few.friction_work == many.friction_work


@EVERY_PROBLEM
def test_momentum_and_energy_balance(problem):
    """Impulse of the driving force less friction's is the momentum; the stage's work is stored, damped or taken by F."""
    result = integrate(problem.profile, problem.drive(samples=40_000), K)
    V, end = problem.stage_velocity, problem.duration
    impulse = result.binned_force.sum() * end / 256
    work = impulse * V
    stored = 0.5 * result.velocity[-1] ** 2 + 0.5 * result.spring_force[-1] ** 2
    damping = 2.0 * problem.damping_ratio
    damped = damping * np.trapezoid((V - result.velocity) ** 2, result.time)
    friction_impulse = np.trapezoid(result.friction_force, result.time)
    # The trapezoidal rule misses by one sample's change at each jump or kink of F, of which there are fewer than 50.
    step = end / 40_000
    assert impulse - friction_impulse == pytest.approx(result.velocity[-1], abs=50 * step * 0.5)
    tolerance = 1e-12 if damping == 0.0 else damping * step
    assert work - damped - result.friction_work == pytest.approx(stored, abs=tolerance)


def test_phases_are_where_the_velocity_passes_creep():
    problem = PROBLEMS["stick-slip with reversal onto the negative branch"]
    result = integrate(problem.profile, problem.drive(), K)
    assert len(result.slip_time) == 2
    for start, where, stop, rest in zip(
        result.slip_time, result.slip_position, result.restick_time, result.restick_position, strict=True
    ):
        for time, position in ((start, where), (stop, rest)):
            at = integrate(problem.profile, problem.drive(duration=time, samples=1), K)
            assert at.velocity[-1] == pytest.approx(result.stick_velocity, abs=1e-12)  # rounding of a root at t of 20
            assert at.position[-1] == pytest.approx(position, abs=1e-12)
        assert rest - where > result.presliding_length


@EVERY_PROBLEM
def test_static_friction_is_the_highest_driving_force_before_the_pin_is_as_fast_as_the_stage(problem):
    result = integrate(problem.profile, problem.drive(samples=100_000), K)
    damping = 2.0 * problem.damping_ratio
    driving = result.spring_force + damping * (problem.stage_velocity - result.velocity)
    for start, stop, highest in zip(result.slip_time, result.restick_time, result.slip_force, strict=True):
        as_fast = result.time[(result.time > start) & (result.velocity > problem.stage_velocity)][0]
        sampled = driving[(result.time >= start) & (result.time <= np.fmin(as_fast, stop))]
        one_sample = np.abs(np.diff(sampled)).max()
        assert sampled.max() <= highest < sampled.max() + one_sample


def test_a_slip_that_never_stops_has_no_restick():
    problem = PROBLEMS["one tooth for ever"]
    result = integrate(problem.profile, problem.drive(), K)
    assert len(result.slip_time) == 1
    assert np.isnan(result.restick_time[0])
    assert np.isnan(result.restick_position[0])


def test_a_stage_at_rest_moves_nothing():
    result = integrate(constant_profile(0.4), Drive(1.0, 0.1, 0.0, duration=10.0, samples=10), K)
    assert result.outcome.ok
    assert not result.position.any()
    assert not result.velocity.any()
    assert result.friction_work == 0.0
    assert len(result.slip_time) == 0


def test_a_frictionless_pin_is_an_oscillator():
    drive = Drive(1.0, 0.1, 0.3, duration=30.0, samples=300)
    result = integrate(constant_profile(0.0), drive, K)
    position, velocity = Oscillator(1.0, 0.1, 0.3, 0.0).motion(result.time)
    assert np.abs(result.position - position).max() < 1e-13  # rounding at x of 9
    assert np.abs(result.velocity - velocity).max() < 1e-13


def test_too_many_segments_are_an_outcome_with_advice():
    problem = PROBLEMS["one tooth for ever"]
    result = integrate(problem.profile, problem.drive(step_limit=20), K)
    assert result.outcome.ending is Ending.STEP_LIMIT
    reached = result.time[np.isfinite(result.position)][-1] / result.time[-1]
    share = (
        float(result.outcome.message.partition("20 segments reached ")[2].partition(" % of the duration")[0]) / 100.0
    )
    # The last sample before the end lies up to a sample before it.
    assert 0.999 * reached <= share <= 1.001 * (reached + 1.0 / (len(result.time) - 1))
    assert result.steps == 20
    assert np.isfinite(result.position[0])
    assert np.isnan(result.position[-1])


@pytest.mark.parametrize("stiffness", [0.0, -1.0, math.nan, math.inf])
def test_a_contact_without_stiffness_is_refused(stiffness):
    with pytest.raises(InvalidInput, match="surface_stiffness"):
        integrate(constant_profile(0.4), Drive(1.0, 0.1, 0.3, duration=1.0), stiffness)


@pytest.mark.parametrize("seed", range(12))
def test_chance_profiles_agree_with_small_steps(seed):
    """Steep, falling and jumping teeth in any order; the RK4 of Eq. 13-14 as printed converges to the same motion."""
    rng = np.random.default_rng(seed)
    teeth = int(rng.integers(1, 9))
    edges = np.append(0.0, np.cumsum(rng.uniform(0.02, 0.3, teeth)))
    profile = profile_through(
        edges, rng.uniform(0.0, 1.0, teeth), rng.uniform(0.0, 1.5, teeth), int(rng.integers(0, teeth))
    )
    problem = Problem(profile, float(rng.choice([0.0, 0.05, 0.5, 1.5])), float(rng.uniform(0.05, 0.5)), 12.0)
    exact = integrate(profile, problem.drive(), K)
    stepped = integrate(profile, problem.drive(integrator=RK4(1e-5)), K)
    # First order at jumps of up to 1.5 in F: a step's worth of momentum per crossing, some fifty of them.
    assert np.abs(exact.position - stepped.position).max() < 50 * 1.5 * 1e-5
