"""Eq. 16-19 with the velocity put right: solves Eq. 12, sticks and slips by its own rules, and fits what it made."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq, least_squares

from nanoslip.solver.case import Case
from nanoslip.solver.drive import Drive
from nanoslip.solver.dynamics import stick_slip as closed_form
from nanoslip.solver.dynamics.duration import measure_motion
from nanoslip.solver.dynamics.integrators import integrate
from nanoslip.solver.dynamics.stick_slip import MOST_FITTED_SAMPLES, MOST_SLIPS, Oscillator, fit_stick_slip, stick_slip
from nanoslip.solver.simulate import drive_result
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.plateau import plateau_of
from tests.synthetic import LOAD, constant_profile, noisy_record, profile_through

DRIVE = Drive(1.0, 0.1, 0.2, duration=60.0)
TIME = np.linspace(0.0, 60.0, 6001)
STIFF = 1e6
PEAK = profile_through([0.0, 2.0 / STIFF, 1.0], [0.0, 0.5], [2.0, 0.5], periodic_from=1)
"""A static peak of 2, then 0.5, on a contact 10^6 times as stiff as the spring."""
WORN = replace(DRIVE, damping_ratio=0.02)
"""With a static force of 2 it sticks and slips for ever: a cycle takes 18."""


@pytest.mark.parametrize("damping_ratio", [0.0, 0.1, 0.999999, 1.0, 1.000001, 4.0])
def test_the_oscillator_solves_equation_12(damping_ratio):
    """Central differences of the position and velocity; the state at the start is the one asked for."""
    pin = Oscillator(2.0, damping_ratio, 0.3, 0.7, time=1.5, position=0.2, velocity=-0.4)
    time, h = np.linspace(1.5, 9.0, 40), 1e-5
    x, v = pin.motion(time)
    assert (x[0], v[0]) == pytest.approx((0.2, -0.4), abs=1e-14)
    ahead, behind = pin.motion(time + h), pin.motion(time - h)
    damping = 2.0 * damping_ratio * math.sqrt(2.0)
    acceleration = 2.0 * (0.3 * time - x) + damping * (0.3 - v) - 0.7
    # Central differences: h² times a third derivative of up to 300 here, and rounding 1e-16/h (1e-10 near ζ = 1).
    assert np.abs((ahead[0] - behind[0]) / (2 * h) - v).max() < 1e-7
    assert np.abs((ahead[1] - behind[1]) / (2 * h) - acceleration).max() < 1e-7


def test_the_printed_position_of_equation_17_and_what_its_printed_velocity_lacks():
    """Written out as the paper prints it, at the paper's ζ = 0.1: position right, velocity off by V ζ ω_n/ω_d e^… sin."""
    V, zeta, kinetic, stuck, start = 0.2, 0.1, 0.5, 0.03, 2.6
    wn, wd = 1.0, math.sqrt(1.0 - zeta**2)
    time = np.linspace(start, start + 30.0, 2001)
    decay, sine, cosine = np.exp(-zeta * wn * (time - start)), np.sin(wd * (time - start)), np.cos(wd * (time - start))
    offset = kinetic + stuck - V * start
    printed = V * time - kinetic + decay * (offset * (cosine + zeta * wn / wd * sine) - V / wd * sine)
    printed_velocity = V + decay * (-V * cosine - offset * wd / (1 - zeta**2) * sine)
    position, velocity = Oscillator(1.0, zeta, V, kinetic, start, stuck).motion(time)
    assert np.abs(printed - position).max() < 1e-14
    lacking = V * zeta * wn / wd * decay * sine
    assert np.abs(printed_velocity + lacking - velocity).max() < 1e-14
    assert np.abs(lacking).max() == pytest.approx(0.086 * V, rel=0.01)


def test_slips_start_at_the_static_friction_force_and_stop_at_rest():
    motion = stick_slip(TIME, DRIVE, kinetic=0.5, static=2.0, later_static=1.2)
    assert len(motion.slip_time) >= 2
    for number, start in enumerate(motion.slip_time):
        stuck_at = np.interp(start, motion.time, motion.position)  # constant over a stick of many samples
        driving = 0.2 * start - stuck_at + 0.2 * 0.2  # k = 1, c V = 0.2·0.2
        assert driving == pytest.approx(2.0 if number == 0 else 1.2, abs=1e-4)  # Eq. 18; one sample of 0.01 blurs x
    for stop in motion.restick_time[~np.isnan(motion.restick_time)]:
        after = (motion.time > stop) & (motion.time < stop + 0.5)
        assert not motion.velocity[after].any()
    assert motion.velocity.min() >= 0.0
    assert np.array_equal(motion.spring_force, 0.2 * motion.time - motion.position)


def test_a_pin_stops_where_a_bracket_says_so_too():
    """Newton's steps against a search that knows no derivative; what is left is the rounding of the velocity."""
    chance, stops = np.random.default_rng(3), 0
    for _ in range(300):
        stiffness, stage_velocity, force = 10.0 ** chance.uniform((-3, -6, -3), (6, 1, 1))
        began = chance.choice([0.0, 10.0 ** chance.uniform(-3, 3)])
        behind = began * stage_velocity - force / stiffness * chance.uniform(1.01, 3.0)
        damping_ratio = chance.choice([0.0, 10.0 ** chance.uniform(-4, -0.01)])
        pin = Oscillator(stiffness, damping_ratio, stage_velocity, force, began, behind)
        times = began + np.linspace(0.0, 2.0 * math.pi / math.sqrt(stiffness * (1.0 - damping_ratio**2)), 2000)
        velocities = pin.motion(times)[1]
        fastest = int(velocities.argmax())
        if velocities[fastest:].min() >= 0.0:
            continue
        stops += 1
        stopped = fastest + int(np.argmax(velocities[fastest:] < 0.0))
        bracket = times[stopped - 1], times[stopped]
        bracketed = brentq(lambda time, pin=pin: float(pin.motion(np.asarray(time))[1]), *bracket, xtol=1e-300)
        rounding = 1e-13 * velocities[fastest] * (times[1] - began) / (velocities[stopped - 1] - velocities[stopped])
        assert pin.first_stop(math.inf) == pytest.approx(bracketed, rel=1e-14, abs=rounding)
    assert stops > 200


def test_a_later_slip_weaker_than_sliding_itself_goes_on_at_once():
    motion = stick_slip(TIME, DRIVE, kinetic=0.5, static=2.0, later_static=0.1)
    same = stick_slip(TIME, DRIVE, kinetic=0.5, static=2.0, later_static=0.5)
    assert np.array_equal(motion.position, same.position)


def test_equal_static_and_kinetic_friction_never_sticks_again():
    for damping_ratio in (0.0, 0.1, 1.0, 3.0):  # undamped: the velocity just touches zero once a period
        motion = stick_slip(TIME, replace(DRIVE, damping_ratio=damping_ratio), kinetic=0.5, static=0.5)
        assert len(motion.slip_time) == 1
        assert np.isnan(motion.restick_time).all()


def test_the_fit_finds_the_forces_behind_a_spring_force():
    """Made by the integrator, load 4."""
    drive = replace(DRIVE, samples=1000, duration=40.0)
    fit = fit_stick_slip(integrate(PEAK, drive, STIFF), drive, normal_load=4.0)
    assert fit.kinetic_friction == pytest.approx(0.5 / 4.0, abs=1e-3)
    swing = 0.04 * math.exp(-0.1 * 9.7)  # by which the contact lets go early, see above
    assert fit.static_friction == pytest.approx((2.0 - swing) / 4.0, abs=1e-3)
    assert fit.later_static_friction == pytest.approx(0.5 / 4.0, abs=2e-3)
    assert fit.residual < 1e-3


def test_without_a_slip_there_is_nothing_to_fit():
    drive = replace(DRIVE, duration=1.0)
    fit = fit_stick_slip(integrate(constant_profile(2.0), drive, 5.0), drive, normal_load=4.0)
    assert np.isnan([fit.kinetic_friction, fit.static_friction, fit.later_static_friction, fit.residual]).all()


@pytest.fixture
def trials(monkeypatch):
    """Every closed form that a fit computes."""
    found = []

    def noted(*arguments, **names):
        found.append(stick_slip(*arguments, **names))
        return found[-1]

    monkeypatch.setattr(closed_form, "stick_slip", noted)
    return found


@pytest.mark.parametrize("duration", [300.0, 3000.0, 30_000.0])
def test_a_fit_takes_no_longer_the_more_slips_there_are(trials, duration):
    """A duration of 30 000 holds 1700 slips of the closed form; slips times trials take the time."""
    drive = replace(WORN, duration=duration, samples=1000)
    plain = integrate(constant_profile(0.5), replace(drive, surface_compliance=False), STIFF)
    result = replace(plain, slip_force=np.array([2.0]))
    assert len(stick_slip(result.time, drive, 0.5, 2.0).slip_time) > 0.05 * duration
    fit_stick_slip(result, drive, normal_load=4.0)
    assert len(trials) <= 730
    assert max(len(model.slip_time) for model in trials) <= MOST_SLIPS


def test_a_motion_of_too_many_slips_is_not_fitted():
    drive = replace(WORN, duration=6000.0, samples=1000)
    motion = stick_slip(np.linspace(0.0, 6000.0, 1001), drive, 0.5, 2.0)
    slips = len(motion.slip_time)
    assert slips > MOST_SLIPS
    plain = replace(integrate(constant_profile(1e3), drive, 5.0), spring_force=motion.spring_force)
    result = replace(plain, slip_force=np.full(slips, 2.0))
    assert math.isnan(fit_stick_slip(result, drive, normal_load=4.0).residual)


def test_two_samples_do_not_determine_three_coefficients():
    drive = replace(DRIVE, samples=1, duration=40.0)
    assert math.isnan(fit_stick_slip(integrate(PEAK, drive, STIFF), drive, normal_load=4.0).residual)


def test_the_fit_does_not_end_where_static_friction_is_below_kinetic_and_the_misfit_flat():
    """A search that keeps to a region of trust ends there with a residual 27 times as large."""
    case = Case(0.4, 30.0, 2e-5, Slab(33), max_events=400)
    drive = Drive.from_si(duration=0.1, samples=200)
    fit = fit_stick_slip(drive_result(case, drive).motion, drive, case.normal_load)
    assert fit.residual < 5e-4
    assert fit.static_friction == pytest.approx(0.392, abs=1e-3)


@pytest.mark.parametrize("count", [5, pytest.param(100, marks=pytest.mark.slow)])
def test_no_other_start_finds_a_smaller_residual(count):
    """Random drives that slide or stick and slip, and random starts; two of them find 3e-5 and 7e-5 of W less."""
    chance, record = np.random.default_rng(11), noisy_record()
    plateau = plateau_of(record)
    for _ in range(count):
        drive = Drive.from_si(
            stage_velocity=10.0 ** chance.uniform(-3.5, -1.7),
            damping_ratio=chance.choice([0.0, 0.02, 0.1, 0.3]),
            spring_stiffness=10.0 ** chance.uniform(4.5, 5.5),
            samples=200,
        )
        motion = measure_motion(record, plateau, drive)[0]
        fit = fit_stick_slip(motion, drive, LOAD)

        def misfit(coefficients, motion=motion, drive=drive):
            return (stick_slip(motion.time, drive, *coefficients * LOAD).spring_force - motion.spring_force) / LOAD

        for _ in range(4):
            start = plateau.mean * chance.uniform((0.9, 0.9, 0.9), (1.1, 2.0, 1.5))
            other = least_squares(misfit, start, method="lm", diff_step=1e-5 * np.ones(3), x_scale=1e-2, max_nfev=60)
            assert fit.residual < math.sqrt(np.mean(other.fun**2)) + 1e-4


def test_a_closed_form_cut_short_is_the_same_up_to_there():
    whole, cut = (stick_slip(TIME * 5.0, WORN, 0.5, 2.0, most_slips=most) for most in (10**6, 3))
    assert np.array_equal(cut.slip_time, whole.slip_time[:3])
    before = whole.time < whole.slip_time[3]
    assert np.array_equal(cut.position[before], whole.position[before])
    assert np.unique(cut.position[~before]).size == 1


def test_a_fit_looks_at_so_many_samples_and_finds_the_same(trials):
    """Ten or a hundred thousand samples of one motion: the latter at every tenth, which are the former."""
    drives = [replace(DRIVE, samples=samples, duration=40.0) for samples in (MOST_FITTED_SAMPLES, 100_000)]
    few, many = (fit_stick_slip(integrate(PEAK, drive, STIFF), drive, normal_load=4.0) for drive in drives)
    assert {len(model.time) for model in trials} == {MOST_FITTED_SAMPLES + 1}
    for name in ("kinetic_friction", "static_friction", "later_static_friction"):
        assert getattr(many, name) == pytest.approx(getattr(few, name), abs=1e-9)


@pytest.mark.parametrize("damping_ratio", [0.0, 1e-12, 0.1])
def test_a_pin_that_does_not_stop_in_its_first_swing_never_does_however_long_one_looks(damping_ratio):
    assert math.isnan(Oscillator(1.0, damping_ratio, 0.2, 0.5, 2.5, 0.0).first_stop(1e15))


def test_an_overdamped_pin_settles_however_long_it_is_watched():
    """After many decay times the position is the steady one: Vt - friction/k and the velocity the stage's."""
    pin = Oscillator(spring_stiffness=2.0, damping_ratio=2.0, stage_velocity=1e-4, friction_force=3e-4)
    time = np.array([0.0, 1e3, 1e6])
    position, velocity = pin.motion(time)
    assert position[0] == 0.0
    np.testing.assert_allclose(position[1:], 1e-4 * time[1:] - 3e-4 / 2.0, rtol=1e-12)
    np.testing.assert_allclose(velocity[1:], 1e-4, rtol=1e-12)
