"""A drive: its friction coefficients, regime and reasons where they are missing; where it ends, and which drives are refused.

Counts are what an independent reading of the trajectory counts, and what Eq. 16-19 say of a pin with constant friction forces.
"""

import itertools
import math
import re
from dataclasses import replace

import numpy as np
import pytest

import nanoslip
from nanoslip.solver.case import Case
from nanoslip.solver.drive import Drive, Scales
from nanoslip.solver.dynamics import integrators
from nanoslip.solver.dynamics.coefficients import friction_coefficients
from nanoslip.solver.dynamics.duration import measure_motion
from nanoslip.solver.dynamics.friction_limit import sawtooth
from nanoslip.solver.dynamics.integrators import LEAST_TRAVEL, RK4, STIFFEST, Exact, disproportion, integrate
from nanoslip.solver.dynamics.regime import count_sticks
from nanoslip.solver.dynamics.stick_slip import stick_slip
from nanoslip.solver.outcome import Ending, Outcome
from nanoslip.solver.simulate import drive_result
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.plateau import plateau_of
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.shipped import campaign_files
from tests.solver.drives import PROBLEMS, SMALL_TEETH, K
from tests.synthetic import LOAD, STIFFNESS, constant_profile, noisy_record, profile_through

TIME_UNIT = math.sqrt(0.5 / 1e8)  # s: the paper's pin of 0.5 kg, G = 10 GPa, L_y = 1 cm
PAPER = Drive(2e-3, 0.1, 2.0 * TIME_UNIT, 0.2 / TIME_UNIT)
RECORD = noisy_record()
PLATEAU = plateau_of(RECORD)
LIMIT = sawtooth(RECORD, PLATEAU)
BACKWARD = PROBLEMS["stick-slip with reversal onto the negative branch"]


def pulled(**changes):
    """The paper's drive of the noisy record, changed; its motion and coefficients."""
    motion = integrate(LIMIT, replace(PAPER, **changes), STIFFNESS)
    return motion, friction_coefficients(motion, RECORD, PLATEAU)


def test_kinetic_friction_is_the_plateaus_mean_and_static_friction_one_of_its_peaks():
    """§3.3: the paper's explanation of the two coefficients."""
    result, found = pulled()
    assert found.outcome.ok
    # The record repeats its steady part: over many repetitions its mean is met to the part of one that is missing.
    assert found.kinetic_friction == pytest.approx(PLATEAU.mean, rel=2e-3)
    # The driving force overshoots the limit while the pin gathers speed, by less than k V²/(2a), a of 1 % of F.
    assert PLATEAU.mean < found.static_friction < 1.05 * PLATEAU.peak
    assert found.static_friction == result.slip_force[0] / LOAD
    few = pulled(samples=10)[1]  # how many samples are kept does not matter
    assert (few.static_friction, few.kinetic_friction) == (found.static_friction, found.kinetic_friction)


@pytest.mark.parametrize("spring_stiffness", [1e-5, 2e-3])
def test_a_pin_that_is_pulled_too_little_says_so_and_slips_once_pulled_as_said(spring_stiffness):
    """By a drive too short, or a spring too weak for its time: a harder pull by what is missing, and a tenth more, is enough."""
    duration = 0.15 * LOAD / (spring_stiffness * PAPER.stage_velocity)
    little = {"spring_stiffness": spring_stiffness, "duration": duration, "stage_velocity": PAPER.stage_velocity}
    found = pulled(**little)[1]
    assert found.outcome.ending is Ending.NO_SLIP
    assert np.isnan([found.static_friction, found.kinetic_friction]).all()
    told, advice = found.outcome.naming("duration").message.split(": raise ")
    reached, least, most = map(float, re.findall(r"0\.\d+", told))
    assert 0.1 < reached < least < most
    assert all(name in advice for name in little)
    for name, value in little.items():
        assert len(pulled(**little | {name: value * 1.1 * most / reached})[0].slip_time), name


def test_a_stage_at_rest_is_told_from_a_spring_too_weak():
    assert pulled(stage_velocity=0.0)[1].outcome.message.endswith("raise stage_velocity")


def test_a_pin_that_follows_in_slips_too_short_is_to_have_a_softer_spring_or_a_faster_stage():
    softer, faster = {"spring_stiffness": PAPER.spring_stiffness}, {"stage_velocity": PAPER.stage_velocity}
    stiff = {"spring_stiffness": 10.0, "stage_velocity": 0.02 * PAPER.stage_velocity, "duration": 50 * PAPER.duration}
    result, found = pulled(**stiff)
    assert found.outcome.ending is Ending.NO_SLIP
    assert result.micro_slips > 100
    assert "lower spring_stiffness" in found.outcome.message
    for change in (softer, faster | {"duration": PAPER.duration}):  # as far as before
        assert len(pulled(**stiff | change)[0].slip_time)


def test_a_pin_too_heavy_to_swing_twice_has_no_kinetic_friction():
    period = 2.0 * math.pi / math.sqrt(PAPER.spring_stiffness)
    result, found = pulled(stage_velocity=20.0 * PAPER.stage_velocity, duration=1.5 * period)
    assert len(result.slip_time)
    assert result.settling_time == pytest.approx(period)
    assert found.outcome.ending is Ending.NO_PLATEAU
    assert "periods" in found.outcome.message
    assert math.isnan(found.kinetic_friction)


@pytest.mark.parametrize("damping_ratio", [50.0, 1000.0])
def test_a_pin_that_its_damper_drags_is_pulled_over_its_record_not_until_its_lag_has_relaxed(damping_ratio):
    """c·V is above all friction: it never sticks, and its friction is what it is while the spring still stretches, for c/k."""
    drive = replace(PAPER, damping_ratio=damping_ratio, duration=None)
    motion, found = measure_motion(RECORD, PLATEAU, drive)
    assert motion.end_time == pytest.approx(
        4.0 * (motion.settling_time + RECORD.final_displacement / drive.stage_velocity), rel=0.01
    )
    assert found.outcome.ok
    assert found.kinetic_friction == pytest.approx(PLATEAU.mean, rel=2e-3)  # to the part of a period that is missing
    assert count_sticks(motion, drive).regime == "slides"


def test_the_ramp_of_a_pin_that_its_damper_drags_is_no_amplitude():
    drive = Drive(1.0, 50.0, 0.1, duration=400.0)  # c/k = 100: e^-2 of the ramp is left in the second half, or e^-12
    short, long = (
        count_sticks(integrate(BACKWARD.profile, replace(drive, duration=time), 5.0), drive) for time in (400.0, 2400.0)
    )
    assert "the loading ramp" in short.unsettled
    assert math.isnan(short.spring_force_amplitude)
    assert not long.unsettled
    assert 0.0 < long.spring_force_amplitude < 0.02  # f/(cV) of a period of 1/2: 0.05·0.5/10, and the first tooth's


@pytest.mark.parametrize("damping_ratio", [0.01, 0.1, 1.0])
def test_kinetic_friction_is_that_of_the_record_while_the_pin_still_rings_from_its_start(damping_ratio):
    """Four periods at twenty times the paper's velocity: the mean driving force is 2 % off, by inertia."""
    period = 2.0 * math.pi / math.sqrt(PAPER.spring_stiffness)
    found = pulled(damping_ratio=damping_ratio, stage_velocity=20.0 * PAPER.stage_velocity, duration=4.0 * period)[1]
    assert found.kinetic_friction == pytest.approx(PLATEAU.mean, rel=1e-5)  # 2e-7 seen: teeth passed unevenly


def test_a_drive_without_duration_is_not_pulled_longer_than_its_segments_allow():
    """Its last motion and numbers stay, where twice as long would only meet the limit; what is missing names that."""
    drive = Drive(0.08913349, 0.1, 4.4306687e-6)  # its first slip is in the second half of its first time
    whole, first = (measure_motion(RECORD, PLATEAU, replace(drive, step_limit=limit)) for limit in (20_000_000, 10_000))
    assert whole[0].end_time == pytest.approx(2.0 * first[0].end_time)
    assert first[0].steps < 10_000 < 2 * first[0].steps
    assert first[1].outcome.ok
    assert count_sticks(first[0], replace(drive, step_limit=10_000)).unsettled.endswith("raise step_limit")


def test_what_is_said_of_a_drive_a_little_too_short_is_never_rounded_up():
    motion = integrate(LIMIT, Drive.from_si(Scales()), STIFFNESS)
    slides = float(motion.time[-1] - motion.slip_time[0])
    friction = friction_coefficients(replace(motion, settling_time=slides / 1.9996), RECORD, PLATEAU)
    assert friction.outcome.ending is Ending.NO_PLATEAU
    assert "1.99 oscillation periods" in friction.outcome.message


@pytest.mark.parametrize(("stage_velocity", "damping_ratio"), [(5e-3, 1.0), (1e-2, 0.5)])
@pytest.mark.parametrize("integrator", [Exact(), RK4(time_step=1e-3)])
def test_the_swing_of_a_pin_on_its_contact_is_no_slip_and_its_force_no_static_friction(
    stage_velocity, damping_ratio, integrator
):
    """The damper sets the pin in motion at once: it swings past where its contact slides, and sticks again.

    Spring and damper have reached half of what the contact holds then. That was called μ_s, and known to 8 %.
    """
    case = Case(intrinsic_friction=0.1, slab=Slab(33), max_events=2000)
    fast = Drive.from_si(samples=2, stage_velocity=stage_velocity, damping_ratio=damping_ratio, duration=0.02)
    found = drive_result(case, replace(fast, integrator=integrator))
    steady = slice(found.plateau.first_event, found.plateau.last_event + 1)
    assert found.coefficients.static_friction * case.normal_load >= found.record.force_after[steady].min()


def test_what_no_force_of_the_record_reaches_is_stated():
    """A pin a hundred times as heavy is pulled on by its own motion: contact holds half of what spring and damper reach."""
    case = Case(slab=Slab(33), max_events=2000)
    heavy = Drive.from_si(Scales(), pin_mass=50.0, stage_velocity=1e-2, damping_ratio=0.01, duration=0.3)
    for drive in (Drive.from_si(Scales(), samples=2), heavy):
        found = drive_result(case, drive)
        record, friction = found.record, found.coefficients
        held = max(record.force_before.max(), record.initial_force, record.final_force) / case.normal_load
        assert friction.static_friction_excess == max(friction.static_friction - held, 0.0)
    assert friction.static_friction_excess > 0.4 * friction.static_friction


@pytest.mark.parametrize(("reached", "known"), [(0.5, True), (1.99, True), (2.01, False)])
def test_the_first_slip_is_measured_from_the_highest_force_of_the_record_run_in_included(reached, known):
    """A tooth before the plateau holds three times the plateau: a pull of twice that is half inertia, and no friction beyond."""
    assert PLATEAU.first_event > 0
    held, motion = 3.0 * PLATEAU.peak, integrate(LIMIT, Drive.from_si(Scales()), STIFFNESS)
    high = replace(RECORD, force_before=np.append(held * LOAD, RECORD.force_before[1:]))
    pulls = np.full(len(motion.slip_force), reached * held * LOAD)
    friction = friction_coefficients(replace(motion, slip_force=pulls), high, PLATEAU)
    stated = (reached * held if known else np.nan, max(reached - 1.0, 0.0) * held)
    assert (friction.static_friction, friction.static_friction_excess) == pytest.approx(stated, nan_ok=True)
    assert ("inertia and damper" in friction.outcome.message) is not known


def test_a_driving_force_that_is_mostly_inertia_is_no_static_friction():
    """More than twice of all that the contact ever holds: the outcome says so, also of a drive that was given up amid it."""
    fast = {"stage_velocity": 150.0 * PAPER.stage_velocity, "duration": PAPER.duration / 8.0, "damping_ratio": 0.5}
    result, found = pulled(**fast)
    assert result.slip_force[0] > 2.0 * RECORD.force_before.max()
    assert math.isnan(found.static_friction)
    assert found.every_static_friction[0] == result.slip_force[0] / LOAD
    assert "inertia and damper" in found.outcome.message
    found = pulled(**fast, step_limit=result.steps // 2)[1]
    assert found.outcome.ending is Ending.STEP_LIMIT
    assert math.isnan(found.static_friction)
    assert "% of the duration" in found.outcome.message
    assert "inertia and damper" in found.outcome.message


def test_a_drive_given_up_after_its_first_slip_ran_off_has_its_static_friction():
    whole, known = pulled()
    given_up, found = pulled(step_limit=whole.steps - 1)
    assert given_up.outcome.ending is found.outcome.ending is Ending.STEP_LIMIT
    assert found.static_friction == known.static_friction
    assert math.isnan(found.kinetic_friction)


DRIVE = Drive(1.0, 0.05, 0.1, duration=100.0, samples=10)
WAVES = profile_through([0.0, 0.1, 1.1], [0.0, 0.5], [1.0, 0.5], periodic_from=0)
"""Teeth from 0.5 up to 1 and down again at once, much shorter than a slow pin's slips."""
SLOW = Drive(1.0, 0.3, 0.02, duration=400.0, samples=40)


def slipped(slips, ends, duration=100.0):
    """The result of a drive with these slips."""
    drive = replace(DRIVE, duration=duration)
    names = ("slip_position", "slip_force", "restick_position")
    told = {"slip_time": np.array(slips), "restick_time": np.array(ends)}
    plain = integrate(constant_profile(1e3), drive, 5.0)
    return replace(plain, **told, **dict.fromkeys(names, np.full(len(slips), math.nan)))


def counted(slips, ends, duration=100.0):
    return count_sticks(slipped(slips, ends, duration), DRIVE)


def closed_form(duration, static, later):
    """The same pin by Eq. 16-19, kinetic friction 0.5."""
    return stick_slip(np.linspace(0.0, duration, 3), DRIVE, kinetic=0.5, static=static, later_static=later)


def counted_of(motion, duration):
    return counted(list(motion.slip_time), list(motion.restick_time), duration)


@pytest.mark.parametrize(
    ("slips", "ends", "resticks", "stuck", "regime"),
    [
        ([], [], 0, 1.0, "sticks"),
        ([10.0, 40.0, 80.0], [15.0, 60.0, math.nan], 2, 1.0 - (5.0 + 20.0 + 20.0) / 100.0, "stick_slip"),
        ([10.0], [30.0], 1, 0.8, "stick_slip"),  # at rest in the end, it has not begun to slide
    ],
)
def test_time_outside_slips_is_time_stuck(slips, ends, resticks, stuck, regime):
    found = counted(slips, ends)
    assert (found.resticks, found.regime) == (resticks, regime)
    assert found.time_stuck == pytest.approx(stuck, rel=1e-15)


@pytest.mark.parametrize("duration", np.linspace(30.0, 300.0, 91))
def test_a_motion_that_repeats_itself_is_stick_slip_whenever_it_is_cut(duration):
    """Static 1.2 over kinetic 0.5 for ever. From the first re-stick on: whether the end falls into stick or slip."""
    motion = closed_form(400.0, 1.2, 1.2)
    assert len(motion.slip_time) > 20
    assert motion.restick_time[0] < 30.0
    found = counted_of(closed_form(duration, 1.2, 1.2), duration)
    assert (found.regime, found.resticks) == ("stick_slip", np.sum(motion.restick_time < duration))


def test_a_pin_that_sticks_again_before_it_slides_for_good_slides():
    """Static 2 once, then 0.52: the first slip's swing re-sticks it, the last ends in steady sliding (as in §3.3)."""
    motion = closed_form(300.0, 2.0, 0.52)
    assert len(motion.slip_time) >= 2
    assert math.isnan(motion.restick_time[-1])
    assert counted_of(motion, 300.0).regime == "slides"
    soon = float(motion.slip_time[-1]) + 0.99 * np.diff(motion.slip_time).max()  # of a cycle: too early to tell
    assert counted_of(closed_form(soon, 2.0, 0.52), soon).regime == "stick_slip"


@pytest.mark.parametrize(
    ("stage_velocity", "damping_ratio", "regime"),
    [(1e-4, 2e-3, "stick_slip"), (1e-3, 2e-3, "slides"), (3e-3, 5e-3, "slides"), (1e-2, 0.02, "slides")],
)
def test_a_drive_without_duration_goes_on_until_its_regime_is_known(stage_velocity, damping_ratio, regime):
    """Its ringing lasts for many passes over the record: up to 3 million segments. Thrice as long has the same regime."""
    drive = Drive.from_si(stage_velocity=stage_velocity, damping_ratio=damping_ratio, samples=1)
    motion = measure_motion(RECORD, PLATEAU, drive)[0]
    longer = replace(drive, duration=3.0 * motion.end_time)
    assert count_sticks(motion, drive).regime == regime
    assert count_sticks(measure_motion(RECORD, PLATEAU, longer)[0], longer).regime == regime


@pytest.mark.parametrize("damping_ratio", [1e-5, 1e-300, 5e-324])
def test_a_drive_whose_ringing_outlasts_its_step_limit_ends_at_once(damping_ratio):
    """Of its friction nothing is missing, and no length within the limit would show the regime."""
    drive = Drive.from_si(stage_velocity=3e-4, damping_ratio=damping_ratio, samples=1)
    motion, friction = measure_motion(RECORD, PLATEAU, drive)
    assert count_sticks(motion, drive).regime is None
    assert friction.outcome.ok
    assert motion.steps < 0.05 * drive.step_limit


@pytest.mark.parametrize(("velocity", "duration", "regime"), [(0.02, 300.0, "stick_slip"), (2.0, 60.0, "slides")])
def test_the_integrator_sticks_and_slips_when_slow_and_slides_when_fast(velocity, duration, regime):
    """Stick-slip dies with speed."""
    drive = replace(SLOW, stage_velocity=velocity, duration=duration)
    result = integrate(WAVES, drive, 20.0)
    found = count_sticks(result, drive)
    assert (found.regime, found.resticks) == (regime, np.isfinite(result.restick_time).sum())
    assert (found.resticks > 3) == (regime == "stick_slip")


def test_a_drive_that_ended_early_has_no_regime():
    found = count_sticks(replace(slipped([10.0], [30.0]), outcome=Outcome(Ending.STEP_LIMIT, "raise it")), DRIVE)
    assert (found.resticks, found.regime) == (1, None)
    assert math.isnan(found.time_stuck)


@pytest.mark.parametrize("compliant", [True, False])
def test_amplitude_and_period_are_those_of_the_motion_in_the_second_half(compliant):
    """Samples so dense that they miss a peak by a phase of 1e-3, and its height by the square of that, give the same range."""
    drive = replace(SLOW, duration=300.0, samples=300_000, surface_compliance=compliant)
    result = integrate(WAVES, drive, 20.0)
    found, late = count_sticks(result, drive), result.slip_time[result.slip_time >= 150.0]
    assert found.spring_force_amplitude == pytest.approx(np.ptp(result.spring_force[result.time >= 150.0]), rel=1e-5)
    assert found.spring_force_amplitude > 0.5
    assert found.stick_slip_period == pytest.approx((late[-1] - late[0]) / (len(late) - 1), rel=1e-12)


@pytest.mark.parametrize(("damping_ratio", "known"), [(0.0, False), (0.02, False), (0.3, True)])
def test_the_amplitude_of_a_sliding_pin_is_known_once_its_start_is_forgotten_and_samples_do_not_decide_it(
    damping_ratio, known
):
    """After a first peak of 3: in the second half a ringing of e^(-ζ ω t) of it is left, beside the teeth of a steady motion."""
    drive = Drive(1.0, damping_ratio, 0.5, duration=120.0, samples=60_000)
    result, few = (integrate(BACKWARD.profile, replace(drive, samples=count), 5.0) for count in (60_000, 1))
    found = count_sticks(result, drive)
    assert found.regime == "slides"
    seen = np.ptp(result.spring_force[result.time >= 60.0])
    assert found.spring_force_amplitude == pytest.approx(seen if known else math.nan, abs=1e-5, nan_ok=True)
    assert bool(found.unsettled) is not known
    assert math.isnan(found.stick_slip_period)
    assert few.spring_force_range == result.spring_force_range > 0.0


@pytest.mark.parametrize("count", [8, pytest.param(60, marks=pytest.mark.slow)])
def test_an_amplitude_without_a_duration_is_that_of_two_hundred_periods(count):
    """Random drives that slide: the ringing of four periods was 8 to 55,000 times as much. What is below rounding may differ."""
    chance, known = np.random.default_rng(4), 0
    for _ in range(count):
        drive = Drive.from_si(
            stage_velocity=10.0 ** chance.uniform(-3.0, -2.0),
            damping_ratio=chance.choice([0.02, 0.1, 0.3, 0.6]),
            samples=1,
        )
        motion, friction = measure_motion(RECORD, PLATEAU, drive)
        found = count_sticks(motion, drive)
        if found.regime == "slides" and not found.unsettled:
            known += 1
            longer = replace(drive, duration=200.0 * 2.0 * math.pi / math.sqrt(drive.spring_stiffness))
            later, kinetic = measure_motion(RECORD, PLATEAU, longer)
            amplitude = count_sticks(later, longer).spring_force_amplitude
            assert found.spring_force_amplitude == pytest.approx(amplitude, rel=0.2, abs=1e-9 * LOAD)
            assert friction.static_friction == kinetic.static_friction
            assert friction.kinetic_friction == pytest.approx(kinetic.kinetic_friction, rel=1e-3)
    assert known >= count / 8


BISTABLE = (9, 14, 20, 31, 35, 39)
"""Numbers of the drives below that were seen to stick and slip for a hundred periods or more, until one slip did not end.
When that is, the last digit decides."""


@pytest.mark.parametrize("numbers", [(20, 23, 27, 31), pytest.param(range(40), marks=pytest.mark.slow)])
def test_no_regime_near_the_border_of_stick_slip_changes_within_two_hundred_periods(numbers):
    """A pin that may slide for ever has no regime while it still sticks; the others have theirs from the start."""
    chance, found = np.random.default_rng(7), set()
    for number in range(max(numbers) + 1):
        spring = STIFFNESS * 10.0 ** chance.uniform(-3.5, -1.5)
        damping_ratio = float(chance.choice([0.02, 0.05, 0.1]))
        stage = 10.0 ** chance.uniform(-1.3, -0.3) * (PLATEAU.peak - PLATEAU.mean) * LOAD / math.sqrt(spring)
        if number in numbers:
            drive = Drive(spring, damping_ratio, stage, samples=1)
            ramp = 2.0 * PLATEAU.mean * LOAD / spring / stage
            longer = replace(drive, duration=ramp + 200.0 * 2.0 * math.pi / math.sqrt(spring))
            now, later = (count_sticks(measure_motion(RECORD, PLATEAU, each)[0], each) for each in (drive, longer))
            found.add(now.regime)
            assert now.regime in ((None, "slides") if number in BISTABLE else (later.regime,)), number
            assert (now.regime is None) <= np.isnan([now.spring_force_amplitude, now.stick_slip_period]).all()
    assert {"stick_slip", "slides"} <= found


def test_a_pin_over_a_limit_that_falls_to_zero_slides():
    """A node that drops all of its shear leaves no friction after any event, through which `linear` interpolates."""
    bare = replace(RECORD, force_after=np.zeros_like(RECORD.force_after))
    drive = Drive(25.0, 0.1, 8e-4, profile="linear")
    motion, found = measure_motion(bare, plateau_of(bare), drive)
    assert found.kinetic_friction == 0.0
    assert count_sticks(motion, drive).regime == "slides"


def test_what_repeats_is_not_told_without_a_whole_cycle_in_the_second_half():
    for slips, ends in (([], []), ([10.0], [30.0]), ([10.0, 60.0], [30.0, 70.0]), ([60.0], [math.nan])):
        found = counted(slips, ends)
        assert np.isnan([found.spring_force_amplitude, found.stick_slip_period]).all()
    found = counted([10.0, 60.0, 80.0], [30.0, 70.0, 90.0])
    assert found.stick_slip_period == 20.0
    assert math.isfinite(found.spring_force_amplitude)
    assert counted([60.0], [70.0]).unsettled == ""  # a single late slip: nothing is lost, it has neither


def test_the_loading_ramp_is_no_amplitude():
    """The limit falls from 1 to 0.5 and jumps back up: all swings are as wide. `nanoslip try radius=50 stage_velocity=1e-3`
    showed 0.091 where 0.025 follows for ever: its first slip comes in the second half of 0.2 s."""
    falling = profile_through([0.0, 0.4], [1.0], [0.5], periodic_from=0)
    drives = [replace(SLOW, **each) for each in ({"duration": 95.0}, {"duration": 300.0}, {"max_slips": 2})]
    short, long, ended = (count_sticks(integrate(falling, drive, 20.0), drive) for drive in drives)
    assert short.macroscopic_slips > 1
    assert np.isnan([short.spring_force_amplitude, short.stick_slip_period]).all()
    assert short.unsettled.startswith("the first slip")
    assert "raise" not in short.unsettled  # a longer drive helps, whatever its file calls that
    assert (math.isfinite(long.spring_force_amplitude), long.unsettled) == (True, "")
    assert ended.unsettled.endswith("raise max_slips")


def test_a_stiff_spring_leads_the_pin_along_in_micro_slips():
    """Teeth of 0.02 of the presliding length, whose drops a spring as stiff as the contact relaxes at once: no slip is
    macroscopic, but the pin keeps up with the stage. Before the limit is reached it sticks."""
    edges = np.linspace(0.0, 0.2, 101)
    profile = profile_through(edges, np.full(100, 0.5), np.full(100, 0.5 + 0.002 * 5.0), periodic_from=0)
    slow = Drive(50.0, 1.0, 1e-3, duration=400.0, samples=200_000)
    result = integrate(profile, slow, 5.0)
    found = count_sticks(result, slow)
    assert (found.macroscopic_slips, found.regime, found.unsettled) == (0, "micro_slip", "")
    assert result.position[-1] - result.position[100_000] == pytest.approx(0.2, rel=0.05)
    assert found.spring_force_amplitude == pytest.approx(np.ptp(result.spring_force[100_000:]), rel=0.01)
    early = replace(slow, duration=185.0)  # its ramp ends at 110
    still_rising = count_sticks(integrate(profile, early, 5.0), early)
    assert still_rising.regime == "micro_slip"
    assert math.isnan(still_rising.spring_force_amplitude)
    assert "the loading ramp" in still_rising.unsettled
    short = replace(slow, duration=50.0, stage_velocity=1e-5)
    assert count_sticks(integrate(profile, short, 5.0), short).regime == "sticks"


SAMPLES = 200_000
"""About 1e3 samples in a period: no slip is shorter than the contact's own period, a tenth of it at the most."""


def read(motion):
    """Macroscopic slips, re-sticks, seconds in such slips, and seconds right before them at the stick velocity itself, to
    rounding, as a well damped pin waits: as samples of position and velocity show them.

    Stretches of samples faster than a stuck pin is dragged along, of those that are longer than the presliding length, beyond
    the first stretch of the contact.
    """
    edges = np.diff(np.concatenate(([False], motion.velocity > motion.stick_velocity, [False])).astype(int))
    last, found = len(motion.time) - 1, np.zeros(4)
    moving = np.abs(motion.velocity / motion.stick_velocity - 1.0) > 1e-12
    for begin, end in zip(np.flatnonzero(edges == 1), np.minimum(np.flatnonzero(edges == -1), last), strict=True):
        from_here = max(motion.position[max(begin - 1, 0)], motion.presliding_length)
        if motion.position[end] - from_here > motion.presliding_length:
            before = np.append(0, np.flatnonzero(moving[:begin]))[-1]
            slipping, waiting = motion.time[[end, begin]] - motion.time[[begin, before]]
            found += (1, end < last, slipping, waiting)
    return found


def random_drive(number):
    """Soft to stiff, slow to fast, without damper to critically damped; long enough to slip and to repeat it."""
    rng = np.random.default_rng([2022, number])
    k, stage = 10.0 ** rng.uniform(-4.0, -1.8), 10.0 ** rng.uniform(-5.5, -3.5)
    duration = 2.0 * LIMIT.steady_force / (k * stage) + 30.0 * 2.0 * math.pi / math.sqrt(k)
    return Drive(k, float(rng.choice([0.0, 0.01, 0.1, 0.3, 1.0])), stage, duration, samples=SAMPLES)


@pytest.mark.parametrize("drives", [12, pytest.param(48, marks=pytest.mark.slow)])
def test_slips_and_resticks_are_those_that_the_trajectory_shows(drives):
    """Of random drives over many teeth, which stick, slip and slide. A stuck pin's micro slips are why a threshold of velocity
    counts too many."""
    regimes, more = [], 0
    for number in range(drives):
        motion = integrate(LIMIT, drive := random_drive(number), STIFFNESS)
        found, (slips, resticks, slipping, waiting) = count_sticks(motion, drive), read(motion)
        assert motion.outcome.ok
        assert (found.macroscopic_slips, found.resticks) == (slips, resticks), number
        # Samples know a slip to 1e-5 of the time; a velocity at which a pin waits is passed by rounding before the slip does.
        most = 1.0 - slipping / motion.end_time
        assert most - waiting / motion.end_time - 1e-3 < found.time_stuck < most + 1e-3, number
        if math.isfinite(found.spring_force_amplitude):
            seen = np.ptp(motion.spring_force[SAMPLES // 2 :])
            assert found.spring_force_amplitude == pytest.approx(seen, rel=1e-3), number  # of what samples miss
        regimes.append(found.regime)
        more += motion.micro_slips > found.resticks
    assert min(regimes.count("stick_slip"), regimes.count("slides")) >= drives / 5
    assert more > drives / 3


METHODS = pytest.mark.parametrize(
    "method", [{}, {"surface_compliance": False}, {"integrator": RK4(1e-4)}], ids=["exact", "rigid", "rk4"]
)
FORWARD = {name: problem for name, problem in PROBLEMS.items() if problem.damping_ratio >= 1.0} | {"small": SMALL_TEETH}


@METHODS
@pytest.mark.parametrize("problem", FORWARD.values(), ids=FORWARD)
def test_where_the_pin_never_slips_back_nothing_changes(problem, method):
    """Bit for bit."""
    free, one_way = (problem.driven(**method, reverse_motion=allowed) for allowed in (True, False))
    assert one_way.outcome.ok
    arrays = ("position", "velocity", "friction_force", "slip_time", "slip_force", "restick_time", "binned_force")
    for name in (*arrays, "steps", "friction_work", "micro_travel"):
        assert np.array_equal(getattr(free, name), getattr(one_way, name), equal_nan=True), name


@METHODS
def test_the_run_ends_where_the_pin_would_slip_back(method):
    """Up to there nothing differs, after it there is nothing; friction has reached the negative limit there."""
    free, one_way = (BACKWARD.driven(**method, reverse_motion=allowed, samples=4000) for allowed in (True, False))
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
    after = slice(count, count + 3)
    assert np.abs(free.friction_force + BACKWARD.profile.limit(free.position))[after].max() < 1e-3  # F follows -F̃


@METHODS
def test_elastic_stretch_may_be_given_back(method):
    """The pin swings back in its stretched contact after a drop of the limit, as far as the stretch goes; a rigid one rests."""
    result = PROBLEMS["falling teeth"].driven(**method, reverse_motion=False)
    assert result.outcome.ok
    assert (result.velocity.min() < -0.1) == method.get("surface_compliance", True)


@pytest.mark.parametrize(
    "method", [{}, {"surface_compliance": False}, {"integrator": RK4(0.01)}], ids=["exact", "rigid", "rk4"]
)
@pytest.mark.parametrize("count", [1, 3])
def test_a_drive_that_ends_after_so_many_slips_is_the_longer_one_cut_where_the_last_of_them_ended(method, count):
    """To the bit, as it is the same path: only where it is looked at differs."""
    drive = replace(SLOW, **method)
    whole, cut = (integrate(WAVES, each, 20.0) for each in (drive, replace(drive, max_slips=count)))
    assert len(whole.slip_time) > 4
    assert cut.outcome.ok
    for name in ("slip_time", "slip_position", "slip_force", "restick_time", "restick_position"):
        np.testing.assert_array_equal(getattr(cut, name), getattr(whole, name)[:count])
    assert cut.end_time == cut.time[-1]
    # The end of rk4's step; exact methods end at the crossing.
    assert 0.0 <= cut.end_time - cut.restick_time[-1] <= 0.01
    assert np.isfinite([cut.position.sum(), cut.binned_force.sum()]).all()
    assert count_sticks(cut, drive).resticks == count
    again = integrate(WAVES, replace(drive, duration=cut.end_time), 20.0)
    np.testing.assert_allclose(cut.position, again.position, rtol=0.0, atol=1e-10)


def test_a_drive_with_fewer_slips_lasts_as_long_as_without():
    plain, never = (integrate(WAVES, replace(SLOW, max_slips=most), 20.0) for most in (None, 1000))
    assert (never.end_time, never.steps) == (plain.end_time, plain.steps)
    assert plain.end_time == SLOW.duration
    np.testing.assert_array_equal(plain.position, never.position)
    sliding = integrate(constant_profile(0.5), replace(SLOW, max_slips=1), K)
    assert (count_sticks(sliding, SLOW).regime, sliding.end_time) == ("slides", SLOW.duration)


FORCE, CONTACT = 3e-4, 1e3
FINE = profile_through([0.0, 1e-6], [0.4], [0.6])
FAR = Drive(1e12, 1.0, 1.0, 1e4, samples=50)
"""k V t = 1e16: the spring force is rounded to 2.2, some 7000 times the friction force."""


def far(**changed):
    return integrate(profile_through([0.0, 1e6], [FORCE], [FORCE]), replace(FAR, **changed), CONTACT)


def test_a_spring_force_without_digits_is_refused_with_numbers_and_advice(monkeypatch):
    result = far()
    assert result.outcome.ending is Ending.ROUNDING
    for word in ("spring_stiffness × stage_velocity × duration", "7.4e+03 of the friction force", "7.4e+07 or more"):
        assert word in result.outcome.message
    assert np.isnan(result.position[1:]).all()
    assert (len(result.slip_time), result.steps) == (0, 0)
    monkeypatch.setattr(integrators, "LARGEST_NOISE", math.inf)  # what is refused would be noise
    noise = far()
    assert noise.outcome.ok
    assert np.abs(noise.spring_force[10:]).max() > 1e3 * FORCE


@pytest.mark.parametrize("name", ["spring_stiffness", "stage_velocity", "duration"])
def test_the_advice_is_enough(name):
    """Each of the three factors reduced as much as the message says, and a little: steady sliding shows the friction."""
    less = getattr(FAR, name) / (1.01 * float(far().outcome.message.split("by a factor of ")[-1].split()[0]))
    result = far(**{name: less})
    assert result.outcome.ok
    assert np.abs(result.spring_force[-5:] / FORCE - 1.0).max() < 3.0 * integrators.LARGEST_NOISE
    assert far(**{name: 1.1 * less}).outcome.ending is Ending.ROUNDING


def test_one_factor_is_enough_for_force_and_teeth_together():
    """The force alone asked for a factor of 7, then the teeth for 50,000."""
    drive = Drive(1e-9, 1.0, 1e3, 1e12, integrator=RK4(1e9), samples=10)
    both = replace(drive, spring_stiffness=0.1)
    refused = integrate(FINE, both, 1e-9).outcome
    factor = float(refused.message.split("by a factor of ")[-1].split()[0])
    assert integrate(constant_profile(0.5), both, 1e-9).outcome.cause == "rounded_force"
    assert (refused.cause, 'profile = "mean"' in refused.message) == ("rounded_position", False)
    assert integrate(FINE, drive, 1e-9).outcome.message.endswith('profile = "mean"')
    assert integrate(FINE, replace(both, stage_velocity=0.99e3 / factor), 1e-9).outcome.ending is not Ending.ROUNDING


def test_teeth_below_the_rounding_of_the_position_are_refused_and_an_even_profile_is_not():
    """Teeth of 1e-6 at x = 1e9, known to 1e-7: 0.2 of a tooth. What is the same everywhere has no teeth to be met."""
    drive = Drive(1e-9, 1.0, 1e3, 1e6, integrator=RK4(1e3), samples=10)
    refused = integrate(FINE, drive, 1e-9).outcome
    assert refused.ending is Ending.ROUNDING
    assert "mean tooth" in refused.message
    assert integrate(constant_profile(0.5), drive, 1e-9).outcome.ok


@pytest.mark.parametrize(
    ("profile", "drive"),
    [
        (constant_profile(0.0), Drive(1.0, 0.0, 1.0, 100.0, samples=10)),
        (FINE, Drive(1e-10, 0.0, 1e7, 100.0, samples=10)),
        (constant_profile(FORCE), Drive(1.0, 0.1, 0.0, 1e9, samples=10)),
    ],
    ids=["no friction to be lost", "a pin that never gets away", "a stage at rest"],
)
def test_what_rounding_cannot_hurt_is_not_refused(profile, drive):
    """The second is pulled by a fifth of its friction; a pin that got away would cross teeth as fine as its rounding."""
    assert integrate(profile, drive, CONTACT).outcome.ending is not Ending.ROUNDING


PAPERS = 0.4, 1.5e-4
"""Stiffness and friction force of the paper's contact."""


def test_drives_of_shipped_campaigns_are_in_proportion():
    """On contacts ten times as stiff or as soft as the paper's, and at its lightest and heaviest loads in the maps."""
    manifests = {path.stem: load_manifest(path) for path in campaign_files().values()}
    drives = [(name, each) for name, each in manifests.items() if "dynamics" in each.stages]
    pulls = [(name, pull.drive.dimensionless(each.scales)) for name, each in drives for pull in each.drives]
    assert len(pulls) > 100
    contacts = list(itertools.product(*((0.1 * value, value, 10.0 * value) for value in PAPERS)))
    assert [
        name for (name, drive), contact in itertools.product(pulls, contacts) if disproportion(drive, *contact)
    ] == []


def test_a_campaign_is_asked_nothing_as_its_drives_are_in_si():
    """Hard cases and random scenes pull pins by springs as stiff as can be written down."""
    drive = {"name": "rigid", "spring_stiffness": 1e12, "stage_velocity": 1e-6, "samples": 10}
    alone = {"limits": {"events": 60}, "ensemble": {"members": 1}}
    found = nanoslip.run({"title": "stiff", "numerics": {"n_x": 17}, "drives": [drive], **alone})
    assert found.spring_stiffness == 1e12  # and no warning, which would be an error here


def test_the_bounds_of_proportion_are_where_they_are_said_to_be():
    stiffness, force = PAPERS
    drive = Drive(STIFFEST * stiffness, 0.1, 1.0, 1.0)
    slow = Drive(stiffness, 0.1, LEAST_TRAVEL * (force * (1.0 / stiffness + 1.0 / stiffness)), 1.0)
    stiffer = replace(drive, spring_stiffness=1.1 * STIFFEST * stiffness)
    for lawful in (drive, slow, replace(slow, duration=0.9, stage_velocity=0.0)):  # a pin at rest is a question, too
        assert disproportion(lawful, *PAPERS) == ""
    assert "1.1e+03 times" in disproportion(stiffer, *PAPERS)
    assert "0.009 of" in disproportion(replace(slow, duration=0.9), *PAPERS)


def test_a_drive_in_si_is_warned_of_once_and_computed_all_the_same():
    case = Case(intrinsic_friction=0.5, radius=50.0, slab=Slab(n_x=17), max_events=200)
    record, said = (
        nanoslip.friction_record(case),
        r"^spring_stiffness = 200000 is .* times the contact's stiffness: .*from_si",
    )
    with pytest.warns(UserWarning, match=said) as seen:
        nanoslip.drive_result(case, Drive(2e5, 0.1, 2e-3, 0.2), record)
    assert [each.filename for each in seen] == [__file__]
    nanoslip.drive_result(case, Drive.from_si(Scales()), record)  # warnings are errors here
