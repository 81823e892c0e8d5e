"""The short way over small teeth is the long way to rounding, and is taken only where that can be promised."""

import math
from fractions import Fraction

import numpy as np
import pytest

from nanoslip.solver.dynamics import integrators as exact
from nanoslip.solver.dynamics.integrators import integrate
from nanoslip.solver.dynamics.kernels.motion import (
    POSITION,
    VELOCITY,
    Motion,
    Pin,
    Slip,
    Tally,
    Teeth,
    brief_responses,
    driving_force,
    offset_from_level,
    root,
    segment_from,
    series,
)
from nanoslip.solver.dynamics.kernels.steps import cruise as cruise_over_teeth
from nanoslip.solver.dynamics.kernels.steps import empty_record, integrate_exactly, monotone_end
from nanoslip.solver.outcome import Ending
from nanoslip.solver.parameter import MOST_WHOLE
from tests.solver.dynamics.drives import SMALL_TEETH, K, reference
from tests.synthetic import profile_through

SPRING, STAGE = 1.0, 0.3


def motion(damping=0.2, contact=K, duration=100.0):
    stick_velocity = SPRING * STAGE / (SPRING + contact)
    return Motion(SPRING, damping, STAGE, contact, stick_velocity, 0.1, duration, 1e-8, MOST_WHOLE, duration)


def cruise(profile, motion, pin, climbing=False, limit=1000):
    """A cruise from the start of tooth 0."""
    teeth = Teeth(profile.edges, profile.force, profile.slope, profile.periodic_from)
    record = empty_record(motion, 1, 1)
    slip = Slip(True, climbing, 0.0, 0.0, 0.0, 0, 0.0)
    return cruise_over_teeth(teeth, motion, record, 0, pin, slip, Tally(0, 0.0, 0.0, 0, 0), limit, None)


@pytest.mark.parametrize(("damping_ratio", "stage"), [(0.0, 0.3), (0.3, 0.3), (0.02, 0.2), (0.05, 0.05)])
def test_the_short_way_is_the_long_way(monkeypatch, damping_ratio, stage):
    """Up to three slips over thousands of teeth, with re-sticks, micro-slips and reversals at the lower velocities."""
    problem = SMALL_TEETH._replace(damping_ratio=damping_ratio, stage_velocity=stage, duration=40.0)
    short = integrate(problem.profile, problem.drive(samples=2000), K)
    monkeypatch.setattr(exact, "integrate_exactly", lambda *all: integrate_exactly(*all[:-1], False))
    long = integrate(problem.profile, problem.drive(samples=2000), K)
    assert not np.array_equal(short.velocity, long.velocity)  # or the short way was not taken
    assert len(short.slip_time) >= 1
    for name in ("position", "velocity", "friction_force", "slip_force", "slip_time", "restick_time", "binned_force"):
        # Rounding of x up to 12, t of 40 and means from differences of sums: 1e-13 seen.
        assert np.allclose(getattr(short, name), getattr(long, name), rtol=0.0, atol=5e-13, equal_nan=True), name
    assert short.friction_work == pytest.approx(long.friction_work, rel=1e-13)
    assert short.micro_slips == long.micro_slips
    assert short.micro_travel == pytest.approx(long.micro_travel, abs=1e-13)


@pytest.mark.parametrize("share", [0.4, 1.0])
def test_small_teeth_leave_the_state_of_a_method_of_order_eight(share):
    end = share * SMALL_TEETH.duration
    result = integrate(SMALL_TEETH.profile, SMALL_TEETH.drive(duration=end, samples=1), K)
    state = [result.position[-1], result.velocity[-1], result.friction_force[-1]]
    assert np.abs(state - reference(SMALL_TEETH, end)).max() < 1e-9  # the reference's 1e-12 over some 600 teeth


def test_teeth_steeper_than_the_contact_are_crossed_the_short_way():
    """Those of a steady sawtooth: otherwise the two tests above might compare the long way with itself."""
    rng = np.random.default_rng(7)
    widths, starts = rng.uniform(0.0002, 0.002, 50), rng.uniform(0.498, 0.502, 50)
    teeth = profile_through([0.0, *np.cumsum(widths)], starts, starts + 1.2 * K * widths)
    index, pin, _, tally = cruise(teeth, motion(), Pin(0.5 / STAGE, 0.0, STAGE, 0.5))
    assert index == tally.steps == 1000
    assert pin.position == pytest.approx(20.0 * widths.sum(), rel=1e-14)


@pytest.mark.parametrize("damping", [0.0, 0.3])
@pytest.mark.parametrize("slope", [-4.0, -1.0, 2.0, 50.0])
def test_the_largest_phase_allowed_is_crossed_to_rounding_and_none_beyond(slope, damping):
    """Bisect for the widest tooth that is crossed the short way; the crossing satisfies the closed form there."""
    drive, start = motion(damping), Pin(2.0, 0.0, STAGE, 0.6)
    low, high = 1e-4, 0.1
    for _ in range(40):
        width = 0.5 * (low + high)
        _, _, _, tally = cruise(_tooth(slope, width), drive, start, limit=1)
        low, high = (width, high) if tally.steps else (low, width)
    _, end, _, tally = cruise(_tooth(slope, low), drive, start, limit=1)
    segment = segment_from(drive, start, min(slope, K))
    tau = end.time - start.time
    y, v, area = series(segment, tau)
    assert 0.02 < tau * math.sqrt(SPRING + K) < 0.2  # or the bounds would exclude what they need not
    assert y == pytest.approx(low, rel=1e-13)  # time is rounded at 2, τ at 0.01
    assert v == pytest.approx(end.velocity, rel=2e-14)
    assert tally.resisted == pytest.approx(0.6 * tau + min(slope, K) * area, rel=1e-13)
    assert tally.work == pytest.approx((0.6 + 0.5 * min(slope, K) * low) * low, rel=1e-15)


def _tooth(slope, width):
    return profile_through([0.0, width, 1.0], [0.6, 0.6], [0.6 + slope * width, 0.6])


def test_a_tooth_in_which_friction_meets_its_limit_is_left_to_the_long_way():
    """Elastic contact from 0.55 under a limit of 0.56 that rises less steeply: met within the tooth, or not."""
    start = Pin(2.0, 0.0, STAGE, 0.55)
    for width, crossed in ((0.0020, 1), (0.0030, 0)):
        profile = profile_through([0.0, width, 1.0], [0.56, 0.5], [0.56 + width, 0.5])
        assert cruise(profile, motion(), start, limit=1)[3].steps == crossed  # met at 0.01/(5 - 1) = 0.0025


def test_a_possible_extremum_of_the_driving_force_is_left_to_the_long_way():
    """While climbing the highest driving force counts; at the stage's own velocity its rate passes 0."""
    profile = _tooth(1.0, 1e-3)
    climbed = cruise(profile, motion(), Pin(2.0, 0.0, 0.5 * STAGE, 0.6), climbing=True, limit=1)
    assert climbed[3].steps == 1
    at_end = driving_force(motion(), climbed[1])
    assert climbed[2].peak == pytest.approx(at_end, rel=1e-14)
    assert climbed[2].climbing
    balanced = 0.6 / SPRING + STAGE * 2.0 - 2.0 * STAGE  # the time at which the forces balance at v = V
    level = cruise(profile, motion(), Pin(balanced / STAGE, 0.0, STAGE, 0.6), climbing=True, limit=1)
    assert level[3].steps == 0


def test_a_cruise_ends_before_its_slip_does():
    """Teeth so small that the pin hardly slows down over any one, although it does come to rest over many."""
    start = Pin(0.2 / STAGE, 0.0, STAGE, 0.6)  # the spring lacks 0.4
    tiny = profile_through([0.0, 1e-6], [0.6], [0.6 + 1.1e-6 * K])
    _, pin, _, tally = cruise(tiny, motion(), start, limit=1_000_000)
    assert 10_000 < tally.steps < 1_000_000
    assert pin.velocity == pytest.approx(2.0 * motion().stick_velocity, rel=1e-3)
    assert pin.velocity > 2.0 * motion().stick_velocity


def test_output_does_not_disturb_a_cruise():
    """Bit for bit, although samples fall into teeth that are crossed the short way."""
    few = integrate(SMALL_TEETH.profile, SMALL_TEETH.drive(samples=3), K)
    many = integrate(SMALL_TEETH.profile, SMALL_TEETH.drive(samples=3 * 500), K)
    assert np.array_equal(few.position, many.position[::500])
    assert np.array_equal(few.velocity, many.velocity[::500])
    assert np.array_equal(few.binned_force, many.binned_force)
    assert np.array_equal(few.slip_force, many.slip_force)
    assert (few.steps, few.friction_work) == (many.steps, many.friction_work)


def test_momentum_balance_over_small_teeth():
    result = integrate(SMALL_TEETH.profile, SMALL_TEETH.drive(samples=256 * 800), K)
    driving = result.spring_force + 0.2 * (STAGE - result.velocity)
    bins = driving[:-1] + 0.5 * np.diff(driving)
    # The driving force is continuous: the trapezoidal rule is right to (step·ω)² of it, and a step is 4e-5.
    assert np.allclose(result.binned_force, bins.reshape(256, 800).mean(axis=1), rtol=0.0, atol=1e-9)


def test_a_limit_on_the_segments_holds_within_a_cruise():
    result = integrate(SMALL_TEETH.profile, SMALL_TEETH.drive(step_limit=300), K)
    assert result.steps == 300
    assert result.outcome.ending is Ending.STEP_LIMIT
    assert np.isnan(result.position[-1])


@pytest.mark.parametrize("stiffness", [-4.0, 0.0, 1e-3, 3.99])
@pytest.mark.parametrize("damping", [0.0, 1e-3, 0.3])
def test_brief_responses_are_their_series_in_exact_arithmetic(stiffness, damping):
    """At the largest phase allowed, κτ² = ±0.004 and cτ = 0.01; ∬h and ∭h count for less than 1e-3 of the others."""
    tau = min(math.sqrt(0.004 / max(abs(stiffness), 1e-9)), 0.01 / max(damping, 1e-9), 10.0)
    terms = [Fraction(0), Fraction(1)]  # derivatives of h at 0
    while len(terms) < 40:
        terms.append(-Fraction(damping) * terms[-1] - Fraction(stiffness) * terms[-2])
    exact_tau = Fraction(tau)
    # h', h, ∫h, ∬h, ∭h
    for depth, value in zip(range(-1, 4), brief_responses(damping, stiffness, tau), strict=True):
        series = sum(
            term * exact_tau ** (n + depth) / math.factorial(n + depth)
            for n, term in enumerate(terms)
            if n + depth >= 0
        )
        assert value == pytest.approx(float(series), rel=(2e-15, 2e-15, 2e-15, 2e-12, 5e-11)[depth + 1])


@pytest.mark.parametrize("quantity", [POSITION, VELOCITY])
@pytest.mark.parametrize("seed", range(10))
def test_a_root_leaves_nothing_but_rounding(quantity, seed):
    """Wherever the quantity is monotone, and however close the root is to either end, where a rate may vanish."""
    rng = np.random.default_rng(seed)
    drive = motion(damping=float(rng.choice([0.0, 0.2, 5.0])))
    pin = Pin(rng.uniform(0.0, 5.0), 0.0, rng.uniform(0.0, 0.5), rng.uniform(-1.0, 1.0))
    segment = segment_from(drive, pin, K)
    end = monotone_end(segment, drive, False, 10.0)
    if quantity == POSITION:
        end = min(end, 0.1)  # short enough for the velocity to keep its sign
    first, last = (offset_from_level(segment, drive, quantity, 0.0, tau)[0] for tau in (0.0, end))
    for share in (1e-9, 1e-4, 0.01, 0.1, 0.3, 0.5, 0.8, 0.99, 1.0 - 1e-9):
        level = first + share * (last - first)
        tau = root(segment, drive, quantity, level, end, last > first)
        assert 0.0 < tau <= end
        assert abs(offset_from_level(segment, drive, quantity, level, tau)[0]) < 2e-15  # of velocities of order 1
