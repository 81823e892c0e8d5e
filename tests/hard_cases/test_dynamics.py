"""Drives from the lightest pin to the heaviest, the softest spring to the hardest, at rest and far too fast.

Each ends in a motion that obeys the laws below at every output time, or with a named outcome and advice, within
`STEPS` segments. Numbers are in SI, as in a manifest: the ranges are wide because campaigns are.
"""

import itertools
import math
import time
from collections import Counter
from typing import NamedTuple

import numpy as np
import pytest

from nanoslip.solver.drive import Drive, Scales
from nanoslip.solver.dynamics.friction_limit import FrictionLimit, make_friction_limit
from nanoslip.solver.dynamics.integrators import LARGEST_NOISE, RK4, integrate
from nanoslip.solver.dynamics.result import DynamicsResult
from nanoslip.solver.dynamics.stick_slip import Oscillator
from nanoslip.solver.outcome import Ending
from nanoslip.solver.sliding.plateau import plateau_of
from nanoslip.study.manifest.manifest import NamedDrive
from tests.synthetic import STIFFNESS, constant_profile, noisy_record, profile_through

RECORD = noisy_record()
PLATEAU = plateau_of(RECORD)
PROFILES = {shape: make_friction_limit(RECORD, PLATEAU, shape) for shape in ("sawtooth", "coarse", "linear", "mean")}
SCALES = Scales()
STEPS = 30_000
"""Segments allowed: some milliseconds."""

DAMPING = (0.0, 0.1, 1.0, 10.0)
SPRING = (1.0, 1e3, 2e5, 1e8, 1e12)
STAGE = (0.0, 1e-9, 1e-6, 2e-3, 0.1, 10.0)
MASS = (1e-12, 1e-6, 0.5, 1e3)
LIMITS = {"finite": 0.0, "energy": 1e-9, "friction": 1e-9, "order": 0.0}
"""Largest allowed `errors`. Energy: the spring's force is rounded to k·V·t·1e-16, up to 2e-7 of F̃ here, at random in every
segment (1e-10 seen there, 1e-12 elsewhere). Friction: a tooth's slope, over F̃'s mean, times the rounding of x."""


class Point(NamedTuple):
    """One drive of the table, in SI."""

    damping_ratio: float = 0.1
    spring_stiffness: float = 2e5
    stage_velocity: float = 2e-3
    pin_mass: float = 0.5

    def drive(self, **changed: object) -> Drive:
        return NamedDrive.of("hard", **{**self._asdict(), "duration": 0.2, "samples": 300, **changed}).dimensionless(
            SCALES
        )


def points() -> list[Point]:
    """The paper's with one value changed, and the corners."""
    one_changed = [
        Point()._replace(**{name: value})
        for name, values in zip(Point._fields, (DAMPING, SPRING, STAGE, MASS), strict=True)
        for value in values
    ]
    corners = itertools.product(*((values[0], values[-1]) for values in (DAMPING, SPRING, STAGE, MASS)))
    each = [*one_changed, *(Point(*values) for values in corners)]
    return list(dict.fromkeys(each))  # the paper's value is among all that one is changed to


def errors(result: DynamicsResult, drive: Drive, profile: FrictionLimit) -> dict[str, float]:
    """Distance of a motion from every law, as a share of what each is about; infinite where a law has no number.

    finite: every value up to where the run ended, which is where the outcome says so. energy: the stage's work is stored
    in the spring and as motion, or taken by friction; the rest is the damper's, which takes at least what it would
    at constant velocity, and nothing without damping. friction: |F| ≤ F̃. order: slips follow each other.
    """
    reached = np.isfinite(result.position)
    count = int(reached.sum())
    kept = [values[:count] for values in (result.position, result.velocity, result.spring_force, result.friction_force)]
    whole = not reached[count:].any() and (count == reached.size) == result.outcome.ok
    finite = all(np.isfinite(values).all() for values in kept) and math.isfinite(result.friction_work)
    if not (whole and finite and count):
        return dict.fromkeys(LIMITS, math.inf)
    x, _, _, friction = kept
    nearby = [profile.limit(x * (1.0 + off)) for off in (-1e-14, 0.0, 1e-14)]  # both sides of a jump
    beyond = np.abs(friction) - np.max(nearby, axis=0)
    scale = profile.steady_force or float(np.abs(friction).max()) or 1.0
    times = np.stack((result.slip_time, result.restick_time), axis=1).ravel()
    times = times[~np.isnan(times)]
    return {
        "finite": 0.0,
        "energy": _energy_error(result, drive) if result.outcome.ok else 0.0,
        "friction": max(0.0, float(beyond.max())) / scale,
        "order": float(np.sum(np.diff(times) < 0.0)),
    }


def _energy_error(result: DynamicsResult, drive: Drive) -> float:
    k, V, end = drive.spring_stiffness, drive.stage_velocity, drive.duration
    stretch = V * end - float(result.position[-1])
    work = V * (float(result.binned_force.sum()) * end / len(result.binned_force) + float(result.velocity[-1]))
    stored = 0.5 * float(result.velocity[-1]) ** 2 + 0.5 * k * stretch**2
    damped = work - stored - result.friction_work
    least = 2.0 * drive.damping_ratio * math.sqrt(k) * stretch**2 / end
    amount = max(abs(work), stored, abs(result.friction_work))
    wrong = abs(damped) if drive.damping_ratio == 0.0 else max(0.0, least - damped)
    return wrong / amount if amount else 0.0


def survey(**effects: object) -> Counter[str]:
    """Endings of the drives of all points; each obeys every law."""
    endings: Counter[str] = Counter()
    for point in points():
        drive = point.drive(step_limit=STEPS, **effects)
        result = integrate(PROFILES[drive.profile], drive, STIFFNESS)
        endings[result.outcome.ending.value] += 1
        assert result.outcome.ok or result.outcome.message
        for law, error in errors(result, drive, PROFILES[drive.profile]).items():
            assert error <= LIMITS[law], f"{point}: {law} {error}, {result.outcome}"
    return endings


EFFECTS = [
    {"profile": profile, "surface_compliance": compliant}
    for profile, compliant in itertools.product(PROFILES, (True, False))
]


@pytest.mark.parametrize("effects", EFFECTS, ids=str)
def test_every_drive_obeys_the_laws_or_ends_by_name(effects):
    endings = survey(**effects)
    assert set(endings) <= {"completed", "step_limit"}
    assert endings["completed"] > 10


@pytest.mark.everyday(1)
@pytest.mark.parametrize("mass", [1e-3, 1e-5, 1e-6, 1e-7])
def test_rounding_does_not_hold_a_light_pin_at_an_extremum_of_its_velocity(mass):
    """Vibrations are at the rounding of the forces; met again and again, an extremum would take for ever.

    The stage drags it at the plateau, so it slips off tooth after tooth: the mean friction is the plateau's peaks'.
    """
    drive = Point(pin_mass=mass).drive(step_limit=6_000_000)
    result = integrate(PROFILES["sawtooth"], drive, STIFFNESS)
    assert result.outcome.ok
    assert all(error <= 10 * LIMITS[law] for law, error in errors(result, drive, PROFILES["sawtooth"]).items())
    assert PLATEAU.mean <= result.binned_force[-64:].mean() / RECORD.normal_load <= PLATEAU.peak


# --- Runge-Kutta: never garbage -------------------------------------------------------------------------------------


@pytest.mark.parametrize("point", points(), ids=str)
@pytest.mark.parametrize("step", [1e-3, 1e-5, 1e-9])
def test_steps_are_stable_or_refused_with_a_step_that_is(point, step):
    drive = point.drive(integrator="rk4", time_step=step, duration=0.02, step_limit=100_000)
    result = integrate(PROFILES["sawtooth"], drive, STIFFNESS)
    if result.outcome.ok:
        found = errors(result, drive, PROFILES["sawtooth"])
        assert found["finite"] == found["order"] == 0.0
        # Samples are interpolated between steps, over edges too.
        assert np.abs(result.friction_force).max() <= PLATEAU.peak * RECORD.normal_load * (1.0 + 1e-12)
        # The pin is never further ahead of the stage than a free one would swing, nor pulled back behind its start by more.
        far = drive.stage_velocity * drive.duration
        assert np.abs(result.position).max() <= 3.0 * far + 1e-300
    else:
        assert np.isnan(result.position).all()
        if result.outcome.ending is Ending.STEP_LIMIT:
            assert float(result.outcome.message.split()[0]) > drive.step_limit
            return
        assert result.outcome.ending is Ending.UNSTABLE_STEP
        factor = float(result.outcome.message.partition("by a factor of ")[2].split()[0])
        assert factor > 1.0
        shorter = point.drive(integrator="rk4", time_step=step / (1.001 * factor), duration=0.02, step_limit=100_000)
        assert integrate(PROFILES["sawtooth"], shorter, STIFFNESS).outcome.ending is not Ending.UNSTABLE_STEP


def leaping_error() -> float:
    """Relative error of a heavy pin's position after 1000 steps of 10 ms at 10 m/s: the teeth hardly hold it."""
    drive = Point(pin_mass=1e7, stage_velocity=10.0).drive(integrator="rk4", time_step=1e-2, duration=10.0)
    result = integrate(PROFILES["sawtooth"], drive, STIFFNESS)
    assert result.outcome.ok
    free, _ = Oscillator(drive.spring_stiffness, drive.damping_ratio, drive.stage_velocity, 0.0).motion(result.time)
    return float(np.abs(result.position - free).max() / free.max())


def test_a_step_over_a_hundred_million_teeth_takes_no_longer_than_one_over_a_few():
    """It took minutes. Friction, 2e-6 of the spring's force in the end, is all that tells the pin from a free one."""
    assert leaping_error() < 1e-5
    start = time.perf_counter()  # now that it is compiled
    leaping_error()
    assert time.perf_counter() - start < 5.0


def test_teeth_smaller_than_a_step_act_by_their_mean():
    """300 000 teeth per unit length, some thousand per step: chance which force a step meets, between both bounds."""
    fine = profile_through([0.0, 3e-6], [0.4], [0.6])
    drive = Drive(1.0, 0.1, 0.3, 20.0, integrator=RK4(0.05), samples=100)
    stepped = integrate(fine, drive, 5.0)
    low, mean, high = (integrate(constant_profile(force), drive, 5.0) for force in (0.4, 0.5, 0.6))
    assert np.abs(stepped.friction_force).max() <= 0.6
    assert np.abs(stepped.position - mean.position).max() < np.abs(low.position - high.position).max()


# --- profiles -------------------------------------------------------------------------------------------------------


@pytest.mark.everyday(3)
@pytest.mark.parametrize("compliant", [True, False])
@pytest.mark.parametrize(
    "profile",
    [
        profile_through([0.0, 1e-9], [0.4], [0.4 + 1e-9]),
        profile_through([0.0, 1e-3], [0.0], [0.0]),
        profile_through([0.0, 0.5, 0.5 + 1e-15], [0.3, 0.0], [0.3, 1e6], 0),
        profile_through([0.0, 0.1, 0.2], [0.0, 1.0], [1.0, 0.0], 0),
        profile_through([0.0, 1e300], [0.5], [0.5]),
    ],
    ids=["one short tooth", "zero force", "a spike one ulp wide", "down to zero", "endless tooth"],
)
def test_odd_profiles_are_crossed(profile, compliant):
    drive = Drive(1.0, 0.1, 0.3, 5.0, samples=300, surface_compliance=compliant, step_limit=1_000_000)
    result = integrate(profile, drive, 5.0)
    found = errors(result, drive, profile)
    found.pop("friction")  # at a spike an ulp wide the limit itself has no digits
    assert not any(found.values()), (found, result.outcome)


# --- forces below the rounding of the spring's ----------------------------------------------------------------------


def settled() -> tuple[Counter[str], float]:
    """Endings of drives of every order of magnitude, and the worst error, over F, of a steady spring force.

    Those are left out that still swing, or whose stage hardly gets further than spring and contact stretch.
    """
    profile = PROFILES["mean"]
    endings: Counter[str] = Counter()
    worst = 0.0
    decades = [10.0 ** np.arange(*span, 4.0) for span in ((-6, 21), (-14, 7), (-2, 21))]
    for k, stage, duration in itertools.product(*decades):
        far = 3.0 * profile.steady_force * (1.0 / k + 1.0 / STIFFNESS)
        if math.sqrt(k) * duration < 1e3 or stage * duration < far:
            continue
        drive = Drive(k, 1.0, stage, duration, profile="mean", samples=100, step_limit=STEPS)
        result = integrate(profile, drive, STIFFNESS)
        endings[result.outcome.ending.value] += 1
        if result.outcome.ok:
            worst = max(worst, float(np.abs(result.spring_force[-20:] / profile.steady_force - 1.0).max()))
    return endings, worst


def test_steady_sliding_shows_the_friction_force_or_is_refused():
    """Where nothing is refused the spring force is off by up to 1e12 F here."""
    endings, worst = settled()
    assert set(endings) <= {"completed", "rounding", "step_limit"}
    assert min(endings["completed"], endings["rounding"]) > 10
    assert (
        worst < 3.0 * LARGEST_NOISE
    )  # three roundings: of the stage's position, of the pin's, of their product with time


# --- long drives ----------------------------------------------------------------------------------------------------


def longest_drift() -> float:
    """Share of a natural period by which 10 s (1000 periods) of undamped swinging is off its closed form."""
    drive = Point(damping_ratio=0.0).drive(profile="mean", surface_compliance=False, duration=10.0, samples=20_000)
    result = integrate(PROFILES["mean"], drive, 1e30)
    k, V, F = drive.spring_stiffness, drive.stage_velocity, PLATEAU.mean * RECORD.normal_load
    slide = Oscillator(k, 0.0, V, F, time=F / k / V)
    late = result.time > 0.9 * drive.duration
    position, _ = slide.motion(result.time[late])
    return float(np.abs(result.position[late] - position).max() / V * math.sqrt(k) / (2.0 * math.pi))


def test_ten_seconds_do_not_shift_the_phase():
    assert longest_drift() < 1e-10  # rounding of ω t of 6000 and of x of 20, over a swing of 3e-3


def test_ten_seconds_of_teeth_repeat_with_their_period():
    """Eleven million teeth: steady sliding repeats itself after each period of the profile, to the rounding of x."""
    profile = PROFILES["sawtooth"]
    drive = Point(damping_ratio=1.0).drive()
    lap = profile.period / drive.stage_velocity
    laps = math.floor(10.0 / SCALES.time(0.5) / lap)
    whole = Drive(
        drive.spring_stiffness, drive.damping_ratio, drive.stage_velocity, laps * lap, samples=laps
    )  # one sample per period
    result = integrate(profile, whole, STIFFNESS)
    assert result.outcome.ok
    steps = np.diff(result.position[laps // 2 :])
    assert np.abs(steps - profile.period).max() < 1e-12  # x is 20
    assert abs(result.position[-1] - result.position[laps // 2] - (laps - laps // 2) * profile.period) < 1e-12
    assert _energy_error(result, whole) < 1e-10
