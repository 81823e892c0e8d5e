"""Integrators of Eq. 12, and the rounding that a drive allows.

The spring force k(Vt - x) has a rounding error of 1e-16 k·V·t, on settled drives up to three times the share that
`rounding_outcome` computes (tests.hard_cases.test_dynamics). Narrower teeth cannot be followed one by one.
"""

import math
from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from nanoslip.solver.arrays import Floats
from nanoslip.solver.drive import (
    FEWER_RESTS,
    FEWER_STEPS,
    INTEGRATORS,
    Drive,
    Integrator,
    estimate_duration,
    settling_time,
)
from nanoslip.solver.dynamics.friction_limit import FrictionLimit
from nanoslip.solver.dynamics.kernels.motion import Course, Motion, PinState, ToothTable
from nanoslip.solver.dynamics.kernels.runge_kutta import integrate_by_steps
from nanoslip.solver.dynamics.kernels.steps import integrate_exactly, integrate_rigidly
from nanoslip.solver.dynamics.result import BINS, DynamicsResult
from nanoslip.solver.outcome import COMPLETED, Ending, InvalidInput, Outcome
from nanoslip.solver.parameter import MOST_WHOLE, parameter, require, validate

LARGEST_NOISE: Final = 1e-4
"""Largest rounding error, over the steady friction force and over the mean width of a tooth: the precision of a plateau."""
_DIGIT: Final = float(np.finfo(float).eps)


def rounding_outcome(friction_limit: FrictionLimit, motion: Motion) -> Outcome:
    """`COMPLETED`, or `ROUNDING` where spring force or teeth will drown in the rounding of the pin's position."""
    friction_force, way = friction_limit.steady_force, motion.stage * motion.duration
    if friction_force == 0.0 or motion.spring * way <= friction_force:  # nothing to be lost in, or it never gets away
        return COMPLETED
    # The spring force is k times a difference of two ways as long as this, each rounded; a mean tooth is
    # as wide as the period over their number.
    force_noise = _DIGIT * motion.spring * way / friction_force
    uneven = np.ptp(friction_limit.force) > 0.0 or bool(friction_limit.slope.any())
    teeth = len(friction_limit.force) - friction_limit.periodic_from
    position_noise = _DIGIT * way * teeth / friction_limit.period if uneven else 0.0
    if force_noise > max(LARGEST_NOISE, position_noise):
        return _rounding_refusal(
            "rounded_force",
            f"spring_stiffness × stage_velocity × duration rounds the spring force by {force_noise:.1e} of the friction force: "
            "soften the spring, slow the stage or shorten the drive",
            force_noise,
        )
    if position_noise > LARGEST_NOISE:
        mean = ', or take profile = "mean"' if force_noise <= LARGEST_NOISE else ""
        return _rounding_refusal(
            "rounded_position",
            f"stage_velocity × duration rounds the position by {position_noise:.1e} of the friction profile's mean tooth: "
            "slow the stage or shorten the drive",
            position_noise,
            mean,
        )
    return COMPLETED


def nothing(samples: int) -> Course:
    """Run of a refused drive: NaN at all times."""
    nan = math.nan
    return Course(
        0.0, 0, np.full((samples + 1, 3), nan), np.full(BINS + 1, nan), np.empty((0, 5)), 0, nan, nan, nan, nan
    )


def _rounding_refusal(cause: str, message: str, noise: float, other: str = "") -> Outcome:
    factor = f" (by a factor of {noise / LARGEST_NOISE:.2g} or more)"
    return Outcome(Ending.ROUNDING, f"{message}{factor}{other}", cause=cause)


# Proportion of a dimensionless drive to the contact that it pulls: one in N/m, m/s and s hardly ever fits.
#
# In units of G·L_y the springs of machines are softer than the contact, 1e-4 to 1; in N/m they are 1e3 and more. In units of
# L_x a stage moves as far as contact and spring stretch before the pin slides, and beyond; in m it moves a millionth of that.

STIFFEST: Final = 1e3
"""Stiffness of the spring over that of the contact. Beyond it the spring yields a thousandth of the contact's displacement."""
LEAST_TRAVEL: Final = 1e-2
"""Travel of the stage over the travel that stretches contact and spring until the pin slides. Below it the pin feels
1 % of friction."""


def disproportion(drive: Drive, surface_stiffness: float, friction_force: float) -> str:
    """Name the inputs of a drive that are out of proportion, and explain how a drive is given in SI; empty if none is.

    surface_stiffness: K in G·L_y; friction_force: of the plateau, in G·L_x·L_y. A stage at rest is in proportion.
    """
    spring, travel = drive.spring_stiffness, drive.stage_velocity * (drive.duration or 0.0)
    needed = friction_force * (1.0 / spring + 1.0 / surface_stiffness) if surface_stiffness > 0.0 else math.nan
    if spring > STIFFEST * surface_stiffness:
        wrong = f"spring_stiffness = {spring:g} is {spring / surface_stiffness:.2g} times the contact's stiffness"
    elif 0.0 < travel < LEAST_TRAVEL * needed:
        wrong = f"stage_velocity × duration = {travel:g} is {travel / needed:.2g} of what makes the pin slide"
    else:
        return ""
    return (
        f"{wrong}: a Drive is dimensionless, in units of G·L_y, L_x and √(m/(G·L_y)). For N/m, m/s, s and kg: Drive.from_si("
        f"Scales(slab_width, slab_depth, shear_modulus), pin_mass, spring_stiffness={spring:g}, "
        f"stage_velocity={drive.stage_velocity:g}, duration={drive.duration or 0.0:g})"
    )


# Shared by all integrators: from a friction limit and an equation of motion to a run and its outcome.


class Method(Integrator):
    """An integrator of this package."""

    @abstractmethod
    def run(self, teeth: ToothTable, motion: Motion, drive: Drive) -> tuple[Course, Outcome]:
        """Integrate to the drive's end or its last slip, to its `step_limit`, or to where F would follow -F̃ unless it may."""


def outcome_of_segments(run: Course, motion: Motion, step_limit: int, tooth: float = 0.0) -> Outcome:
    """Outcome of a run of segments: `COMPLETED`, `STEP_LIMIT` or `REVERSED`. tooth: mean width of a tooth.

    A light pin on a slow stage may come to rest after every period of its oscillation, many times on a tooth.
    """
    if run.reached >= motion.duration or has_slipped_enough(run, motion):
        return COMPLETED
    if run.steps < step_limit:
        return end_of_reversed_run(run, motion)
    periods = tooth * math.sqrt(motion.spring + motion.surface_stiffness) / (2.0 * math.pi)
    rests = math.isfinite(motion.surface_stiffness) and motion.stage < periods
    message = f"{step_limit} segments reached {part_reached(run, motion)}: {FEWER_RESTS if rests else FEWER_STEPS}"
    return Outcome(Ending.STEP_LIMIT, message, cause="rests" if rests else "segments")


def part_reached(run: Course, motion: Motion) -> str:
    """Part of the duration that a run reached, in words without a unit: the reader gave the duration in seconds."""
    return f"{100.0 * run.reached / motion.duration:.4g} % of the duration"


def has_slipped_enough(run: Course, motion: Motion) -> bool:
    """True if the number of macroscopic slips that ends the drive has been reached."""
    return int(np.count_nonzero(np.isfinite(run.slips[:, 3]))) >= motion.most_slips


def end_of_reversed_run(run: Course, motion: Motion) -> Outcome:
    """The end of a run whose pin was not to move back."""
    message = f"the pin slips back after {part_reached(run, motion)}: needs reverse_motion = true"
    return Outcome(Ending.REVERSED, message, cause="reversed")


# The event-driven method: Eq. 12 in closed form between crossings (model of Eq. 13-14 as a ratchet on straight teeth).
#
# No step size and no tolerance: a segment ends where closed forms say that the friction law, the tooth or the direction
# changes. Segments are short enough for velocity and position to be monotone, so the first crossing is the only one.
#
# Without surface compliance, in the limit K → ∞, Eq. 13-14 lose their relaxation point, x_R = x, and with it their hysteresis:
# F is F̃(x) against the motion, and the pin is at rest while |spring + damper| ≤ F̃(x). With a constant F̃ this is the motion of
# Eq. 16-19.


AT_REST: Final = PinState(0.0, 0.0, 0.0, 0.0)
ONE_WAY: Final = np.empty((0, 3))
"""Further pieces of the way of a stage that keeps its velocity: none."""


@INTEGRATORS.register
@dataclass(frozen=True, slots=True)
class Exact(Method):
    """Integrate from crossing to crossing in closed form; nothing to set."""

    name = "exact"

    def fit(self, drive: Drive) -> None:
        """Every drive fits."""

    def run(self, teeth: ToothTable, motion: Motion, drive: Drive) -> tuple[Course, Outcome]:
        one_way = None if drive.reverse_motion else True
        if drive.surface_compliance:
            counts = (drive.samples, BINS, drive.step_limit)
            run = integrate_exactly(teeth, motion, *counts, one_way, AT_REST, ONE_WAY, True)
        else:
            run = integrate_rigidly(teeth, motion, drive.samples, BINS, drive.step_limit, one_way)
        tooth = float(np.diff(teeth.edges[teeth.periodic_from :]).mean())
        return run, outcome_of_segments(run, motion, drive.step_limit, tooth)


# The paper's method (§2.2.3): classical fourth-order Runge-Kutta steps of a given length.
#
# The relaxation point of Eq. 14 is updated after each step, as the paper words it. Where a step meets a kink or a jump of the
# friction force the order falls to one; velocities during stick suffer first.


@INTEGRATORS.register
@dataclass(frozen=True, slots=True)
class RK4(Method):
    """Runge-Kutta steps of a given length."""

    name = "rk4"
    rests = False
    time_step: float | None = parameter(
        None, meaning="step of the integrator", unit="s", scale="time", need="0 < time_step ≤ duration"
    )

    def __post_init__(self) -> None:
        validate(self)

    def fit(self, drive: Drive) -> None:
        step = self.time_step
        allowed = step is not None and 0.0 < step <= (drive.duration or math.inf)
        require("time_step", step, allowed, "0 < time_step ≤ duration with rk4")

    def run(self, teeth: ToothTable, motion: Motion, drive: Drive) -> tuple[Course, Outcome]:
        """Integrate in equal steps of at most `time_step` that fill the duration; refused if more than `step_limit`.

        A step that makes free vibrations of the stuck pin grow is refused with the outcome `UNSTABLE_STEP`. Unless the pin
        may move back, the run ends where F would be -F̃.
        """
        assert self.time_step is not None  # a drive with rk4 has one
        if not is_stable(self.time_step, motion):
            shorter = self.time_step / longest(motion)
            message = (
                f"the stuck pin's vibrations would grow: needs a time_step shorter by a factor of {shorter:.4g} or more"
            )
            return nothing(drive.samples), Outcome(Ending.UNSTABLE_STEP, message, cause="vibrations")
        # A duration that is a multiple of the step, but for rounding, needs no step more.
        steps_needed = motion.duration / self.time_step * (1.0 - 1e-12)
        if steps_needed > drive.step_limit:
            message = f"{steps_needed:.6g} steps of time_step, step_limit = {drive.step_limit}: raise one of the two"
            return nothing(drive.samples), Outcome(Ending.STEP_LIMIT, message, cause="steps")
        steps = max(1, math.ceil(steps_needed))
        one_way = None if drive.reverse_motion else True
        run = integrate_by_steps(teeth, motion, steps, drive.samples, BINS, one_way)
        if math.isnan(run.friction_work):
            message = f"the motion ran away after {part_reached(run, motion)}: needs a shorter time_step"
            return run, Outcome(Ending.UNSTABLE_STEP, message, cause="runaway")
        return run, COMPLETED if run.steps == steps or has_slipped_enough(run, motion) else end_of_reversed_run(
            run, motion
        )


def is_stable(time_step: float, motion: Motion) -> bool:
    """True if a step damps, or at least does not amplify, free motion with the stuck contact's stiffness k + K."""
    stiffness = motion.spring + motion.surface_stiffness
    rates = np.roots([1.0, motion.damping, stiffness]).astype(complex)
    z = rates * time_step
    # exp(z) up to z⁴/4!: a step multiplies free motion by it.
    growth = np.abs(1.0 + z * (1.0 + z / 2.0 * (1.0 + z / 3.0 * (1.0 + z / 4.0))))
    return bool(np.all(growth <= 1.0 + 1e-14))  # rounding of tiny steps without damping


def longest(motion: Motion) -> float:
    """The longest stable step, a little below."""
    # No z beyond about 3 in size is stable: the upper end never is.
    low, high = 0.0, 4.0 / math.sqrt(motion.spring + motion.surface_stiffness)
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if is_stable(middle, motion) else (low, middle)
    return low


# Drive the pin by a spring over its friction limit (§2.2, Eq. 12-14): the one door to all integrators.
#
# The pin starts at rest at x = 0 with a relaxed contact: x_R = 0, so F = 0 (Eq. 13 leaves x = x_R open), whatever small force
# initial contact may have left in the record.


Pull = Callable[[Motion], tuple[Course, Outcome]]
"""A way to pull the pin: a run of its motion and how that ended."""


def integrate(
    friction_limit: FrictionLimit, drive: Drive, surface_stiffness: float, pull: Pull | None = None
) -> DynamicsResult:
    """Integrate Eq. 12 with the friction of Eq. 13-14 by the drive's integrator.

    surface_stiffness: K of Eq. 15, in G·L_y; without surface compliance it only separates slip from stick.
    pull: pulls the pin over something else than the limit, which then only gives the scales of force and length.
    Raises InvalidInput unless K > 0. All other failures are outcomes of the result.
    """
    if not 0.0 < surface_stiffness < math.inf:
        raise InvalidInput("surface_stiffness", surface_stiffness, "surface_stiffness > 0")
    peak, way = peak_force(friction_limit), float(friction_limit.edges[-1])
    duration = drive.duration or estimate_duration(drive, peak, friction_limit.steady_force, surface_stiffness, way)
    motion = make_motion(friction_limit, drive, surface_stiffness, duration)
    run, outcome = _run(friction_limit, motion, drive, pull)
    if outcome.ok and run.reached < motion.duration:  # by its slips: the same once more, spread over the time it took
        motion = motion._replace(recorded=run.reached)
        run, outcome = _run(friction_limit, motion, drive, pull)
    time = motion.recorded * (np.arange(drive.samples + 1) / drive.samples)
    return make_result(run, motion, time, drive.stage_velocity * time, settling_time(drive, peak), outcome)


def make_result(
    run: Course, motion: Motion, time: Floats, stage: Floats, settling: float, outcome: Outcome
) -> DynamicsResult:
    """The result of a run that ends at `motion.recorded`. time, stage: (n + 1,) of its samples; settling: time of the motion."""
    position, velocity, friction_force = run.samples.T.copy()
    slip_time, slip_position, slip_force, restick_time, restick_position = run.slips.T.copy()
    spring_range = run.largest_spring_force - run.least_spring_force
    # A stage that fails before its first turn has no time of which a mean could be taken.
    bins_in_time = BINS / motion.recorded if motion.recorded > 0.0 else math.nan
    return DynamicsResult(
        time=time,
        position=position,
        stage=stage,
        velocity=velocity,
        spring_force=motion.spring * (stage - position),
        friction_force=friction_force,
        slip_time=slip_time,
        slip_position=slip_position,
        slip_force=slip_force,
        restick_time=restick_time,
        restick_position=restick_position,
        micro_slips=run.micro_slips,
        micro_travel=run.micro_travel,
        binned_force=np.diff(run.impulse) * bins_in_time,
        friction_work=run.friction_work,
        stick_velocity=motion.stick_velocity,
        presliding_length=motion.presliding,
        settling_time=settling,
        steps=run.steps,
        end_time=motion.recorded,
        spring_force_range=spring_range if math.isfinite(spring_range) else math.nan,
        outcome=outcome,
    )


def peak_force(friction_limit: FrictionLimit) -> float:
    """The largest friction force of a limit, in G·L_x·L_y."""
    # A tooth that falls is highest at its left edge.
    rises = np.maximum(friction_limit.slope, 0.0) * np.diff(friction_limit.edges)
    return float((friction_limit.force + rises).max())


def make_motion(friction_limit: FrictionLimit, drive: Drive, surface_stiffness: float, duration: float) -> Motion:
    """The motion of a drive over a limit. surface_stiffness: K in G·L_y."""
    k, compliant = drive.spring_stiffness, drive.surface_compliance
    # ζ = c/(2√(m·k)) with mass 1.
    damping = 2.0 * drive.damping_ratio * math.sqrt(k)
    presliding = friction_limit.steady_force / surface_stiffness
    # Without surface compliance the steepest tooth is what sets the fastest motion.
    stiffest = surface_stiffness if compliant else float(np.abs(friction_limit.slope).max())
    return Motion(
        spring=k,
        damping=damping,
        stage=drive.stage_velocity,
        surface_stiffness=surface_stiffness if compliant else math.inf,
        stick_velocity=k * drive.stage_velocity / (k + surface_stiffness),
        presliding=presliding,
        duration=duration,
        instant=1e-8 / (math.sqrt(k + stiffest) + damping),
        most_slips=drive.max_slips or MOST_WHOLE,
        recorded=duration,
        stretched=presliding,
        stage_start=0.0,
    )


def _run(friction_limit: FrictionLimit, motion: Motion, drive: Drive, pull: Pull | None) -> tuple[Course, Outcome]:
    """The motion by the drive's method, and how it ended; nothing where rounding would drown it."""
    outcome = rounding_outcome(friction_limit, motion)
    if not outcome.ok:
        return nothing(drive.samples), outcome
    if pull is not None:
        return pull(motion)
    teeth = ToothTable(friction_limit.edges, friction_limit.force, friction_limit.slope, friction_limit.periodic_from)
    method: Method = drive.integrator
    return method.run(teeth, motion, drive)
