"""What pulling the pin costs, before it is computed: teeth or steps of the motion, and the fit of the closed form."""

import math

from solver.case import Case
from solver.drive import Drive
from solver.dynamics.stick_slip import MOST_SAMPLES, MOST_SLIPS
from study.plan.cost.sliding import mean_step

# Rough seconds on one core of an ordinary machine, as in study.plan.cost.seconds.
_PLATEAU = 0.53  # F/W over μ_i at residual_shear 0, whatever the grid (§3.2.1)
_EXCESS = 0.02  # of static friction over kinetic one, for slips after the first
_PER_SAMPLE = 2e-7  # any integrator
_PER_TOOTH = 3e-8  # exact integrator
_PER_TIME_STEP = 6.5e-8  # rk4
_PER_LEAP = 5e-7  # more for a step over many teeth, which looks each of them up
_MANY_TEETH = 20.0
_FIT_TRIALS = 90.0  # of Eq. 16-19, from both starts together
_PER_TRIAL = (4e-4, 1.2e-7, 1.2e-4)  # once, for each time looked at, for each slip


def drive_seconds(drive: Drive, case: Case, fitted: bool = True) -> float:
    """Seconds of motion and fit; the pin sticks until the spring's force reaches the plateau's, or so the estimate goes.

    A drive that is to end after some slips is followed twice: up to there, and once more to spread its samples over that.
    """
    residual_shear = case.slip_rule.residual_shear
    force = (1.0 - (1.0 - _PLATEAU) * (1.0 - residual_shear)) * case.intrinsic_friction * case.normal_load
    way = drive.stage_velocity * drive.duration - force / drive.spring_stiffness
    if not way > 0.0:
        return _motion_seconds(drive, 0.0)
    slips, passes = _slips(drive, force, way), 1.0
    if drive.max_slips is not None and 1.0 < slips >= drive.max_slips:
        way, slips, passes = way * drive.max_slips / slips, float(drive.max_slips), 2.0
    teeth = 0.0 if drive.profile == "mean" else way / mean_step(case)
    return passes * _motion_seconds(drive, teeth) + (_fit_seconds(drive, slips) if fitted else 0.0)


def _motion_seconds(drive: Drive, teeth: float) -> float:
    writing = _PER_SAMPLE * drive.samples
    step: float | None = getattr(drive.integrator, "time_step", None)
    if step is None:
        return writing + _PER_TOOTH * min(teeth, drive.step_limit)
    steps = drive.duration / step
    if steps > drive.step_limit:  # refused
        return writing
    return writing + steps * (_PER_TIME_STEP + _PER_LEAP * min(1.0, teeth / steps / _MANY_TEETH))


def _slips(drive: Drive, force: float, way: float) -> float:
    """Of the closed form: one for each cycle, or a single one where damping takes what a slip gains from its excess."""
    pace, excess = math.sqrt(drive.spring_stiffness), _EXCESS * force
    swing = math.hypot(1.0, excess / (pace * drive.stage_velocity))
    if math.log(swing) <= 2.0 * math.pi * drive.damping_ratio:
        return 1.0
    cycle = 2.0 * excess / drive.spring_stiffness + 2.0 * math.pi * drive.stage_velocity / pace  # of the stage's way
    return max(1.0, way / cycle)


def _fit_seconds(drive: Drive, slips: float) -> float:
    if slips >= MOST_SLIPS:  # not fitted
        return 0.0
    once, each_time, each_slip = _PER_TRIAL
    return _FIT_TRIALS * (once + each_time * min(drive.samples, MOST_SAMPLES) + each_slip * slips)
