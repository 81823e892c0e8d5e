"""The event-driven method is exact: against an adaptive method with event location, closed forms and balances.

A contact that does not yield is the limit K → ∞ of one that does. The short way over small teeth is the long way to rounding, and
is taken only where that can be promised. Runge-Kutta steps converge to the exact motion as they should, and refuse to blow up.
"""

import math
from fractions import Fraction

import numpy as np
import pytest
from scipy.optimize import brentq

from nanoslip.solver.drive import Drive
from nanoslip.solver.dynamics import integrators
from nanoslip.solver.dynamics.friction_limit import FrictionLimit
from nanoslip.solver.dynamics.integrators import RK4, integrate
from nanoslip.solver.dynamics.kernels import motion as kernel, steps
from nanoslip.solver.dynamics.kernels.motion import Motion, PinState, ToothTable
from nanoslip.solver.dynamics.kernels.steps import integrate_exactly
from nanoslip.solver.dynamics.stick_slip import Oscillator
from nanoslip.solver.outcome import Ending, InvalidInput
from nanoslip.solver.parameter import MOST_WHOLE
from tests.conftest import for_python
from tests.solver.drives import PROBLEMS, SMALL_TEETH, K, Problem, reference
from tests.synthetic import constant_profile, profile_through

brief_responses, offset_from_level, root, segment_from, tooth_at, tooth_holding, monotone_end = map(
    for_python,
    (
        kernel.brief_responses,
        kernel.offset_from_level,
        kernel.root,
        kernel.make_segment,
        kernel.find_tooth,
        kernel.tooth_holding,
        steps.monotone_end,
    ),
)

PEAK_AND_REST = Problem(profile_through([0.0, 0.1, 1.1], [1.2, 0.5], [1.2, 0.5], periodic_from=1), 0.0, 0.2, 25.0)
FLUNG_BACK = PEAK_AND_REST._replace(profile=profile_through([0.0, 0.1, 1.1], [3.0, 0.5], [3.0, 0.5], 1), duration=40.0)
BACKWARDS = PROBLEMS["stick-slip with reversal onto the negative branch"]
ENDLESS = PROBLEMS["one tooth for ever"]
SMOOTH = Problem(profile_through([0.0, 100.0], [0.1], [600.0]), 0.1, 0.3, 10.0)
"""One endless rising tooth, steeper than the contact: F = K x throughout."""
RIGID = {**PROBLEMS, "rest after a peak": PEAK_AND_REST, "flung back by a peak": FLUNG_BACK}
ALL = {**RIGID, "small teeth": SMALL_TEETH}
COMPLIANT = pytest.mark.parametrize("compliant", [True, False], ids=["compliant", "rigid"])
FIRM = 1e30
"""A surface stiffness that leaves neither creep nor presliding length: the rigid pin slips where it leaves rest."""
PHASES = ("slip_time", "slip_position", "slip_force", "restick_time", "restick_position", "binned_force")


def every(problems):
    return pytest.mark.parametrize("problem", problems.values(), ids=problems)


def teeth_of(profile):
    return ToothTable(profile.edges, profile.force, profile.slope, profile.periodic_from)


@every(PROBLEMS)
def test_the_kernels_teeth_are_the_profiles_on_both_sides_of_zero(problem):
    """A pulled pin hardly ever gets behind its start, so the mirrored teeth are looked at directly."""
    teeth, beyond = teeth_of(problem.profile), 0.0
    for index in range(-12, 12):
        left, right, force, slope = tooth_at(teeth, index)
        assert index == -12 or left == pytest.approx(beyond, abs=1e-15)
        beyond = right
        inside = left + (right - left) * np.array([0.1, 0.5, 0.9])
        off = force + slope * (inside - left) - problem.profile.limit(inside)
        assert np.abs(off).max() < 1e-13  # slope × rounding of x
    assert tooth_at(teeth, 0)[0] == 0.0


@pytest.mark.everyday(6)
@every(PROBLEMS | {"small teeth": SMALL_TEETH})
@pytest.mark.parametrize("share", [0.3, 0.6, 1.0])
def test_the_state_is_that_of_a_method_of_order_eight(problem, share):
    end = share * problem.duration
    result = problem.driven(duration=end, samples=1)
    state = [result.position[-1], result.velocity[-1], result.friction_force[-1]]
    # The reference's relative tolerance of 1e-12 grows along some hundred events, 600 small teeth; 2e-11 seen.
    assert np.abs(state - reference(problem, end)).max() < 1e-9


def test_the_problems_take_every_branch():
    """Otherwise the comparisons here would hold less than they say."""
    results = {name: problem.driven(samples=2000) for name, problem in PROBLEMS.items()}
    assert all(result.outcome.ok for result in results.values())
    backwards = results["stick-slip with reversal onto the negative branch"]
    assert backwards.velocity.min() < -0.5
    assert backwards.friction_force.min() < -0.6  # the lowest tooth is at 0.45: -F̃ was followed up a tooth
    assert len(backwards.slip_time) > 1
    assert PROBLEMS["teeth steeper than the contact"].profile.slope.max() > K
    assert PROBLEMS["falling teeth"].profile.slope.min() < 0.0
    back, rest = (each.driven(surface_compliance=False, samples=2000) for each in (FLUNG_BACK, PEAK_AND_REST))
    assert back.velocity.min() < -0.5
    assert np.all(back.friction_force[back.velocity < 0.0] < -0.4)
    later = rest.time > rest.restick_time[0]
    assert 100 < (rest.velocity[later] == 0.0).sum() < later.sum() - 100
    assert len(rest.slip_time) >= 2  # undamped: the velocity touches 0 once a period later on


@COMPLIANT
@pytest.mark.parametrize("damping_ratio", [0.0, 0.1, 1.0, 3.0])
def test_sliding_against_constant_friction_is_the_closed_form(damping_ratio, compliant):
    """Eq. 16 until the driving force is the friction force (Eq. 19), Eq. 17 from then on: to rounding at x of 4, 2e-15 seen.

    A contact 10^8 times as stiff as the spring is off by F/K and kV/(k + K), the velocity by the contact's own vibration, of
    amplitude V·√(k/K), that rides on it at the onset.
    """
    stiff = 1e8 if compliant else FIRM
    drive = Drive(1.0, damping_ratio, 0.3, duration=25.0, samples=600, surface_compliance=compliant)
    result = integrate(constant_profile(4.0), drive, stiff)
    slide = Oscillator(1.0, damping_ratio, 0.3, 4.0, time=(4.0 - 2.0 * damping_ratio * 0.3) / 0.3)
    moving = result.time > slide.time
    position, velocity = slide.motion(result.time[moving])
    assert np.abs(result.position[moving] - position).max() < 40.0 / stiff + 1e-14
    assert np.abs(result.velocity[moving] - velocity).max() < 0.6 * math.sqrt(1.0 / stiff) + 1e-14
    assert np.abs(result.position[~moving]).max(initial=0.0) < 8.0 / stiff
    if not compliant:
        assert result.slip_time[0] == pytest.approx(slide.time, abs=1e-14)
        driving = result.spring_force + 2.0 * damping_ratio * (0.3 - result.velocity)
        assert np.abs(result.friction_force - np.where(moving, 4.0, driving)).max() < 1e-14
        # What a first slip takes more is inertia: V√(k·m) without a damper, less with one, which moves the pin along.
        beyond = result.slip_force[0] - 4.0
        assert 0.0 < beyond < 0.3 if damping_ratio else beyond == pytest.approx(0.3, rel=1e-12)


def test_equal_slopes_of_limit_and_contact_are_one_motion_whichever_branch_rounding_takes():
    """F̃ = K x from a relaxed start: on the limit and below it at once."""
    drive = Drive(1.0, 0.1, 0.3, duration=20.0, samples=200)
    profiles = [profile_through([0.0, 100.0], [0.0], [100.0 * K * (1.0 + tilt)]) for tilt in (-3e-16, 0.0, 3e-16)]
    results = [integrate(profile, drive, K) for profile in profiles]
    for result in results:
        assert result.outcome.ok
        assert np.abs(result.position - results[1].position).max() < 1e-13


@COMPLIANT
@every(ALL)
def test_output_decimation_changes_nothing(problem, compliant):
    """Bit for bit: samples are read off the closed form and never end a segment, in small teeth neither."""
    few, many = (problem.driven(samples=samples, surface_compliance=compliant) for samples in (7, 7 * 30))
    for name in ("position", "velocity", "friction_force"):
        assert np.array_equal(getattr(few, name), getattr(many, name)[::30])
    for name in (*PHASES, "steps", "micro_slips", "micro_travel", "friction_work"):
        assert np.array_equal(getattr(few, name), getattr(many, name), equal_nan=True)


@COMPLIANT
@every(RIGID)
def test_momentum_and_energy_balance(problem, compliant):
    """The stage's work, of friction's impulse and the momentum, is stored, damped or taken by F."""
    result = problem.driven(samples=40_000, surface_compliance=compliant)
    V, end, damping = problem.stage_velocity, problem.duration, 2.0 * problem.damping_ratio
    friction, step = result.binned_force.sum() * end / 256, problem.duration / 40_000
    # The trapezoidal rule misses by one sample's change at each jump or kink of F, of which there are fewer than 50.
    assert friction == pytest.approx(np.trapezoid(result.friction_force, result.time), abs=50 * step * 0.5)
    impulse = friction + result.velocity[-1]
    stored = 0.5 * result.velocity[-1] ** 2 + 0.5 * result.spring_force[-1] ** 2
    damped = damping * np.trapezoid((V - result.velocity) ** 2, result.time)
    # To rounding where there is no damper whose loss has to be sampled.
    assert impulse * V - damped - result.friction_work == pytest.approx(stored, abs=max(1e-12, damping * step))


def test_phases_are_where_the_velocity_passes_creep():
    result = BACKWARDS.driven()
    assert len(result.slip_time) == len(result.restick_time) == 2
    times = np.concatenate((result.slip_time, result.restick_time))
    places = np.concatenate((result.slip_position, result.restick_position))
    for time, position in zip(times, places, strict=True):
        at = BACKWARDS.driven(duration=time, samples=1)
        assert at.velocity[-1] == pytest.approx(result.stick_velocity, abs=1e-12)  # rounding of a root at t of 20
        assert at.position[-1] == pytest.approx(position, abs=1e-12)
    assert np.all(result.restick_position - result.slip_position > result.presliding_length)


@every(PROBLEMS)
def test_static_friction_is_the_highest_driving_force_before_the_pin_is_as_fast_as_the_stage(problem):
    result, damping = problem.driven(samples=100_000), 2.0 * problem.damping_ratio
    driving = result.spring_force + damping * (problem.stage_velocity - result.velocity)
    for start, stop, highest in zip(result.slip_time, result.restick_time, result.slip_force, strict=True):
        as_fast = result.time[(result.time > start) & (result.velocity > problem.stage_velocity)][0]
        sampled = driving[(result.time >= start) & (result.time <= np.fmin(as_fast, stop))]
        assert sampled.max() <= highest < sampled.max() + np.abs(np.diff(sampled)).max()  # one sample


def test_a_slip_that_never_stops_has_no_restick():
    result = ENDLESS.driven()
    assert len(result.slip_time) == 1
    assert np.isnan([result.restick_time[0], result.restick_position[0]]).all()


@pytest.mark.parametrize(
    ("stage", "friction", "compliant"), [(0.0, 0.4, True), (0.0, 0.4, False), (0.0, 0.0, False), (1e-300, 0.4, False)]
)
def test_a_stage_that_does_not_get_there_leaves_the_pin_at_rest(stage, friction, compliant):
    result = integrate(constant_profile(friction), Drive(1.0, 0.1, stage, 50.0, surface_compliance=compliant), K)
    assert (result.outcome.ok, result.friction_work, len(result.slip_time)) == (True, 0.0, 0)
    assert not np.any([result.position, result.velocity])


@COMPLIANT
def test_a_frictionless_pin_is_an_oscillator(compliant):
    drive = Drive(1.0, 0.1, 0.3, duration=30.0, samples=300, surface_compliance=compliant)
    result = integrate(constant_profile(0.0), drive, K)
    motion = Oscillator(1.0, 0.1, 0.3, 0.0).motion(result.time)
    assert np.abs(np.array([result.position, result.velocity]) - motion).max() < 1e-13  # rounding at x of 9


@COMPLIANT
@pytest.mark.parametrize(("problem", "most"), [(ENDLESS, 20), (SMALL_TEETH, 300)], ids=["segments", "within a cruise"])
def test_too_many_segments_are_an_outcome_with_advice(problem, most, compliant):
    result = problem.driven(step_limit=most, surface_compliance=compliant)
    assert result.outcome.ending is Ending.STEP_LIMIT
    told = result.outcome.message.partition(f"{most} segments reached ")[2].partition(" % of the duration")[0]
    reached = result.time[np.isfinite(result.position)][-1] / result.time[-1]
    # The last sample before the end lies up to a sample before it.
    assert 0.999 * reached <= float(told) / 100.0 <= 1.001 * (reached + 1.0 / (len(result.time) - 1))
    assert result.steps == most
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
    forces = rng.uniform(0.0, 1.0, teeth), rng.uniform(0.0, 1.5, teeth)
    profile = profile_through(edges, *forces, int(rng.integers(0, teeth)))
    problem = Problem(profile, float(rng.choice([0.0, 0.05, 0.5, 1.5])), float(rng.uniform(0.05, 0.5)), 12.0)
    # First order at jumps of up to 1.5 in F: a step's worth of momentum per crossing, some fifty of them.
    assert np.abs(problem.driven().position - problem.driven(integrator=RK4(1e-5)).position).max() < 50 * 1.5 * 1e-5


@pytest.mark.parametrize(
    ("stage", "cause", "advised"), [(1e-7, "rests", "pin_mass"), (1.0, "segments", "slow the stage")]
)
def test_a_light_pin_that_rests_on_every_tooth_is_not_advised_to_be_slower(stage, cause, advised):
    """A pin of 0.1 ng met the limit at half the velocity, too, and passed at a million times its mass."""
    profile = profile_through([0.0, 1e-3, 2e-3], [0.4, 0.4], [0.6, 0.6])
    outcome = integrate(profile, Drive(1e-2, 0.1, stage, 1e3 / stage, samples=2, step_limit=200), 1.0).outcome
    assert (outcome.cause, advised in outcome.message) == (cause, True)


@pytest.mark.everyday(1)
@pytest.mark.parametrize("compliant", [False, True])
def test_a_pin_that_creeps_up_a_far_tooth_takes_a_few_segments_for_each_oscillation(compliant):
    """A pin comes to rest against a rising tooth, and is dragged up it at the pace of the spring.

    The oscillation dies out to less than the rounding of a friction force that is read off a position far out. Some of a hundred
    such drives took millions of segments: at each, rounding put an extremum of the velocity a millionth of a period ahead.
    """
    random = np.random.default_rng(1)
    for _ in range(100):
        slope, spring = 10.0 ** random.uniform(-2.0, 1.0), 10.0 ** random.uniform(-4.0, -2.0)
        damping, stage = float(random.choice([0.02, 0.1, 0.5])), 10.0 ** random.uniform(-5.0, -3.0)
        left, level = random.uniform(0.05, 2.0), 10.0 ** random.uniform(-4.0, -2.0)
        edges = np.array([0.0, left, left + 1e-3 / slope])
        teeth = FrictionLimit(edges, np.array([level, 1.5 * level]), np.array([0.0, slope]), 0)
        duration = (left + (1.5 * level + 0.5e-3) / spring) / stage
        most = math.ceil(20.0 * duration * math.sqrt(spring + slope) / (2.0 * math.pi)) + 100
        drive = Drive(spring, damping, stage, duration, samples=2, surface_compliance=compliant, step_limit=most)
        assert integrate(teeth, drive, 2.0 * slope if compliant else 0.5).outcome.ok


def test_rigid_stick_slip_is_put_together_from_closed_forms():
    """A static peak of 1.2 over a width of 0.1, then 0.5: rest, two slides, rest at the first stop, slip again at 0.5."""
    result = PEAK_AND_REST._replace(damping_ratio=0.1).driven(FIRM, surface_compliance=False)
    over_peak = Oscillator(1.0, 0.1, 0.2, 1.2, time=(1.2 - 0.04) / 0.2)
    ends = over_peak.time, over_peak.time + 2.0
    over = brentq(lambda time: float(over_peak.motion(np.asarray(time))[0]) - 0.1, *ends, xtol=1e-15)
    slide = Oscillator(1.0, 0.1, 0.2, 0.5, over, *map(float, over_peak.motion(np.asarray(over))))
    stop = slide.first_stop(25.0)
    rest = float(slide.motion(np.asarray(stop))[0])
    assert result.slip_time == pytest.approx([over_peak.time, (0.5 - 0.04 + rest) / 0.2], abs=1e-12)
    assert (result.restick_time[0], result.restick_position[0]) == pytest.approx((stop, rest), abs=1e-12)
    assert 1.2 < result.slip_force[0] < 1.2 + 0.2 * 2.0  # the stage gains until the pin is as fast, within time 2


@pytest.mark.parametrize("name", ALL)
def test_a_rigid_contact_is_what_a_stiffening_one_tends_to(name):
    """The stretch F̃/K falls as 1/K. A static peak is left early by the contact's vibration, V·√K: that falls as 1/√K.

    Positions differ by less than 8/K (5 seen), over a peak by less than 8/√K (1 seen).
    """
    limit = ALL[name].driven(surface_compliance=False)
    over_peak = "peak" in name or name in ("stick-slip with reversal onto the negative branch", "no damping")
    for stiffness in (1e4, 1e6, 1e8):
        off = np.abs(ALL[name].driven(stiffness).position - limit.position).max()
        assert off < 8.0 / (math.sqrt(stiffness) if over_peak else stiffness) + 1e-13, f"{off} off at K = {stiffness}"


@every(RIGID)
def test_rigid_friction_is_the_limit_against_the_motion_and_the_driving_force_at_rest(problem):
    result = problem.driven(surface_compliance=False, samples=4000)
    limit, ahead, behind = (problem.profile.limit(result.position + shift) for shift in (0.0, 1e-9, -1e-9))
    driving = result.spring_force + 2.0 * problem.damping_ratio * (problem.stage_velocity - result.velocity)
    rest = (result.velocity == 0.0) & (np.append(result.velocity[1:], 1.0) == 0.0)  # no mere turn
    inside = np.abs(ahead - behind) <= 0.01
    assert np.abs(result.friction_force - driving)[rest].max(initial=0.0) < 1e-14
    assert np.all((np.abs(driving) <= limit + 1e-12)[rest & inside])
    off = result.friction_force - np.sign(result.velocity) * limit
    assert np.abs(off)[(result.velocity != 0.0) & inside].max() < 1e-12  # slope × rounding of x


def test_a_rigid_contact_costs_no_more_segments_than_teeth_and_turns():
    """No vibration of the contact is followed: over constant friction a drive of any length is a handful of segments."""
    problem = Problem(constant_profile(0.5), 0.1, 0.3, 12.0)  # 3 edges
    assert problem.driven(surface_compliance=False).steps < 15
    assert problem.driven(1e4).steps > 100


def test_slips_of_a_rigid_contact_are_told_by_the_velocity_of_a_compliant_one():
    """So that both limits count alike; a contact of K → ∞ has the velocity of a rigid pin that sticks, 0."""
    problem = Problem(constant_profile(4.0), 0.1, 0.3, 25.0)
    yielding, firm = (problem.driven(surface_compliance=on).stick_velocity for on in (True, False))
    assert firm == yielding == 0.3 / (1.0 + K)
    assert problem.driven(FIRM, step_limit=100).stick_velocity < 1e-29


SPRING, STAGE = 1.0, 0.3


def motion(damping=0.2):
    stick = SPRING * STAGE / (SPRING + K)
    return Motion(SPRING, damping, STAGE, K, stick, 0.1, 100.0, 1e-8, MOST_WHOLE, 100.0, 0.1, 0.0)


@pytest.mark.parametrize(("damping_ratio", "stage"), [(0.0, 0.3), (0.3, 0.3), (0.02, 0.2), (0.05, 0.05)])
def test_the_short_way_is_the_long_way(monkeypatch, damping_ratio, stage):
    """Up to three slips over thousands of teeth, with re-sticks, micro-slips and reversals at the lower velocities."""
    problem = SMALL_TEETH._replace(damping_ratio=damping_ratio, stage_velocity=stage, duration=40.0)
    short = problem.driven(samples=2000)
    monkeypatch.setattr(integrators, "integrate_exactly", lambda *all: integrate_exactly(*all[:-1], False))
    long = problem.driven(samples=2000)
    assert not np.array_equal(short.velocity, long.velocity)  # or the short way was not taken
    assert len(short.slip_time) >= 1
    for name in ("position", "velocity", "friction_force", "slip_force", "slip_time", "restick_time", "binned_force"):
        # Rounding of x up to 12, t of 40 and means from differences of sums: 1e-13 seen.
        assert np.allclose(getattr(short, name), getattr(long, name), rtol=0.0, atol=5e-13, equal_nan=True), name
    assert short.friction_work == pytest.approx(long.friction_work, rel=1e-13)
    assert short.micro_slips == long.micro_slips
    assert short.micro_travel == pytest.approx(long.micro_travel, abs=1e-13)


@pytest.mark.parametrize("stiffness", [-4.0, 0.0, 1e-3, 3.99])
@pytest.mark.parametrize("damping", [0.0, 1e-3, 0.3])
def test_brief_responses_are_their_series_in_exact_arithmetic(stiffness, damping):
    """At the largest phase allowed, κτ² = ±0.004 and cτ = 0.01; ∬h and ∭h count for less than 1e-3 of the others."""
    tau = min(math.sqrt(0.004 / max(abs(stiffness), 1e-9)), 0.01 / max(damping, 1e-9), 10.0)
    terms = [Fraction(0), Fraction(1)]  # derivatives of h at 0
    while len(terms) < 40:
        terms.append(-Fraction(damping) * terms[-1] - Fraction(stiffness) * terms[-2])
    # h', h, ∫h, ∬h, ∭h
    found = zip(
        range(-1, 4), brief_responses(damping, stiffness, tau), (2e-15, 2e-15, 2e-15, 2e-12, 5e-11), strict=True
    )
    for depth, value, off in found:
        powers = [(n + depth, term) for n, term in enumerate(terms) if n + depth >= 0]
        exact = sum(term * Fraction(tau) ** power / math.factorial(power) for power, term in powers)
        assert value == pytest.approx(float(exact), rel=off)


@pytest.mark.parametrize("quantity", [kernel.Passing.POSITION, kernel.Passing.VELOCITY])
@pytest.mark.parametrize("seed", range(10))
def test_a_root_leaves_nothing_but_rounding(quantity, seed):
    """Wherever the quantity is monotone, and however close the root is to either end, where a rate may vanish."""
    rng = np.random.default_rng(seed)
    drive = motion(damping=float(rng.choice([0.0, 0.2, 5.0])))
    segment = segment_from(
        drive, PinState(rng.uniform(0.0, 5.0), 0.0, rng.uniform(0.0, 0.5), rng.uniform(-1.0, 1.0)), K
    )
    end = monotone_end(segment, drive, False, 10.0)
    end = (
        min(end, 0.1) if quantity == kernel.Passing.POSITION else end
    )  # short enough for the velocity to keep its sign
    first, last = (offset_from_level(segment, drive, quantity, 0.0, tau)[0] for tau in (0.0, end))
    for share in (1e-9, 1e-4, 0.01, 0.1, 0.3, 0.5, 0.8, 0.99, 1.0 - 1e-9):
        level = first + share * (last - first)
        tau = root(segment, drive, quantity, level, end, last > first)
        assert 0.0 < tau <= end
        assert abs(offset_from_level(segment, drive, quantity, level, tau)[0]) < 2e-15  # of velocities of order 1


def errors(problem, steps):
    """Largest error of the velocity over 100 samples, for each time step."""
    exact = problem.driven().velocity
    return np.array([np.abs(problem.driven(integrator=RK4(step)).velocity - exact).max() for step in steps])


def test_rk4_has_order_four_where_the_force_is_smooth():
    steps = np.array([0.1, 0.05, 0.025])
    order = np.diff(np.log(errors(SMOOTH, steps))) / np.diff(np.log(steps))
    assert np.all((order > 3.8) & (order < 4.3)), f"orders {order}"  # 4 in the limit


@every(PROBLEMS)
def test_rk4_has_order_one_over_teeth(problem):
    """Every jump, of at most 2.5, is met up to a step late, and there are fewer than 50: error < 125 steps."""
    steps = np.array([2e-3, 2e-4, 2e-5])
    found = errors(problem, steps)
    assert np.all(found < 125.0 * steps), f"errors {found}"
    assert found[2] < found[0] / 5.0, f"errors {found}"  # erratic, as where a step falls is chance; 100 on average


def test_phases_and_mean_forces_of_rk4_converge_too():
    exact, stepped = BACKWARDS.driven(), BACKWARDS.driven(integrator=RK4(1e-5))
    for name in PHASES:
        assert np.abs(getattr(stepped, name) - getattr(exact, name)).max() < 1e-3, name  # first order: 100 steps
    assert stepped.friction_work == pytest.approx(exact.friction_work, rel=1e-4)
    assert stepped.steps == 2_500_000


# Without damping the limit is √8/ω with ω² = k + K, the classical one; with strong damping 2.785/fastest rate.
FASTEST = float(np.abs(np.roots([1.0, 40.0, 1.0 + K]).real).max())


@pytest.mark.parametrize(
    ("damping_ratio", "edge"),
    [(0.0, math.sqrt(8.0 / (1.0 + K))), (1.0, 2.0 / math.sqrt(1.0 + K)), (20.0, 0.99 * 2.785 / FASTEST)],
)
def test_a_step_beyond_stability_is_refused_and_one_below_is_not(damping_ratio, edge):
    problem = SMOOTH._replace(damping_ratio=damping_ratio, duration=50.0)
    good, bad = (problem.driven(integrator=RK4(share * edge)) for share in (0.99, 2.0))
    assert good.outcome.ok
    assert np.abs(good.position).max() < 2.0 * 0.3 * 50.0
    assert bad.outcome.ending is Ending.UNSTABLE_STEP
    needed = float(bad.outcome.message.partition("by a factor of ")[2].split()[0])
    again = RK4(2.0 * edge / needed * (1.0 - 1e-3))  # the factor is told to four digits
    assert problem.driven(integrator=again).outcome.ok
    assert np.isnan(bad.position).all()
    assert len(bad.slip_time) == 0


def test_samples_between_steps_are_interpolated_to_the_methods_order():
    """Decimation of a smooth motion: samples off the steps are as good as those on them."""
    exact, stepped = SMOOTH.driven(samples=997), SMOOTH.driven(samples=997, integrator=RK4(0.01))
    assert np.abs(stepped.position - exact.position).max() < 1e-8  # h⁴/384 of the fourth derivative, ω⁴·0.1 or so
    assert np.abs(stepped.velocity - exact.velocity).max() < 1e-7


@every(PROBLEMS)
def test_a_tooth_far_away_is_the_one_that_a_walk_from_tooth_to_tooth_finds(problem):
    """Both ways from the start, over laps, from any tooth on; edges themselves belong to the tooth on their right."""
    teeth = teeth_of(problem.profile)
    edges = [tooth_at(teeth, index)[0] for index in (-70, -3, 0, 1, 40, 333)]
    for x in (*np.random.default_rng(3).uniform(-60.0, 60.0, 100), *edges):
        there = 0
        while not tooth_at(teeth, there)[0] <= x < tooth_at(teeth, there)[1]:
            there += 1 if x >= tooth_at(teeth, there)[1] else -1
        for start in (there - 5000, there - 9, there + 1, there + 777):
            assert tooth_holding(teeth, start, x) == (there, *tooth_at(teeth, there))


def test_a_tooth_beyond_a_billion_laps_is_found_at_once():
    teeth = teeth_of(PROBLEMS["falling teeth"].profile)
    for x in (3.3e9, -3.3e9):
        _, left, right, _, _ = tooth_holding(teeth, 0, x)
        assert left <= x < right
    assert np.isnan([tooth_holding(teeth, 0, x)[1] for x in (1e300, -math.inf, math.nan)]).all()


def test_a_motion_that_runs_away_ends_by_name(monkeypatch):
    """Were an unstable step ever let through: the position grows by orders of magnitude each step, to infinity."""
    monkeypatch.setattr(integrators, "is_stable", lambda time_step, motion: True)
    result = PROBLEMS["falling teeth"].driven(integrator=RK4(20.0), duration=20000.0)
    assert result.outcome.ending is Ending.UNSTABLE_STEP
    assert "ran away after " in result.outcome.message
    assert 0 < result.steps < 1000
    assert np.isnan(result.position[-1])


@pytest.mark.parametrize("step", [1e-300, 5e-324])
def test_a_step_of_which_no_drive_has_room_is_refused_in_few_words(step):
    outcome = SMOOTH.driven(integrator=RK4(step)).outcome
    assert outcome.ending is Ending.STEP_LIMIT
    assert len(outcome.message) < 80
