"""What pulling the pin costs, before it is computed: teeth or steps of the motion, and the fit of the closed form.

A pin that is pulled slowly stops on every tooth and rings on the contact that yields: it takes more segments to a tooth, and
longer to find the end of each, than one that runs over the teeth. What is slow is measured by the speed at which the contact
rings by one tooth, mean step times √K. A stiff spring takes up less of a slip than the contact yields by: few slips are
macroscopic then, and a drive that ends after so many of them goes on.
"""

import math

from solver.case import Case
from solver.drive import Drive
from solver.dynamics.friction_limit import COARSE
from solver.dynamics.stick_slip import MOST_SAMPLES, MOST_SLIPS
from study.plan.cost.sliding import (
    lateral_stiffness,
    mean_step,
    steady_friction,
)

# Rough seconds on one core of an ordinary machine, as in study.plan.cost.seconds.
_EXCESS = 0.02  # of static friction over kinetic one, for slips after the first
_PER_SAMPLE = 2e-7  # any integrator
_PER_SEGMENT = (3.5e-8, 0.9e-6)  # exact integrator: of a pin that runs, and more of one that is slow
_SLOW = 31.0  # times the speed of ringing by one tooth: half of that more
_SEGMENTS = (0.6, 1.7)  # to a tooth: of a pin that runs, and times that speed over the stage's
_STUCK_TOOTH = 1e-4  # of a pin that never gets over it
_RIGID_TOOTH = 9e-8  # of a contact that does not yield
_COARSE_TOOTH = (
    2e-8,
    1.4e-6,
)  # of teeth taken together, yielding or not: of a pin that runs, and more of one that stops on them
_COARSE_SLOW = 300.0  # times the speed of ringing by one of the record's teeth: half of that more
_PER_TIME_STEP = 6.5e-8  # rk4
_PER_LEAP = 5e-7  # more for a step over many teeth, which looks each of them up
_MANY_TEETH = 20.0
_FIT_TRIALS = 90.0  # of Eq. 16-19, from both starts together
_PER_TRIAL = (1e-4, 6e-8, 2e-4)  # once, for each time looked at, for each slip


def drive_seconds(drive: Drive, case: Case, fitted: bool = True) -> float:
    """Seconds of motion and fit; the pin sticks until the spring's force reaches the plateau's, or so the estimate goes.

    A drive that is to end after some slips is followed twice: up to there, and once more to spread its samples over that.
    """
    force = steady_friction(case) * case.normal_load
    way = drive.stage_velocity * drive.duration - force / drive.spring_stiffness
    if not way > 0.0:
        return _motion_seconds(drive, 0.0, 0.0) + _stuck_seconds(drive, case, force)
    slips, passes = _slips(drive, force, way, lateral_stiffness(case)), 1.0
    if drive.max_slips is not None and 1.0 < slips >= drive.max_slips:
        way, slips, passes = way * drive.max_slips / slips, float(drive.max_slips), 2.0
    tooth = _tooth(drive, case)
    teeth = way / tooth
    ringing = mean_step(case) * math.sqrt(lateral_stiffness(case))
    return passes * _motion_seconds(drive, teeth, ringing) + (_fit_seconds(drive, slips) if fitted else 0.0)


def _tooth(drive: Drive, case: Case) -> float:
    """Length of the teeth that a pin is pulled over, in L_x; infinite without."""
    if drive.profile == "mean":
        return math.inf
    return max(mean_step(case), case.slab.spacing / COARSE if drive.profile == "coarse" else 0.0)


def _stuck_seconds(drive: Drive, case: Case, force: float) -> float:
    """Seconds of a pin that only creeps up to the force that it would slip at: the teeth on the way that a contact yields by."""
    if drive.profile == "mean" or not drive.surface_compliance:
        return 0.0
    return _STUCK_TOOTH * force / lateral_stiffness(case) / _tooth(drive, case)


def _motion_seconds(drive: Drive, teeth: float, ringing: float) -> float:
    """Seconds of the motion over so many teeth. ringing: speed at which the contact rings by one tooth."""
    writing = _PER_SAMPLE * drive.samples
    step: float | None = getattr(drive.integrator, "time_step", None)
    if step is None:
        return writing + _exact_seconds(drive, teeth, ringing)
    steps = drive.duration / step
    if steps > drive.step_limit:  # refused
        return writing
    return writing + steps * (_PER_TIME_STEP + _PER_LEAP * min(1.0, teeth / steps / _MANY_TEETH))


def _exact_seconds(drive: Drive, teeth: float, ringing: float) -> float:
    if drive.profile == "coarse" and teeth:
        running, stopping = _COARSE_TOOTH
        each = running + stopping / (1.0 + (drive.stage_velocity / (_COARSE_SLOW * ringing)) ** 2)
        return each * min(teeth, drive.step_limit)
    if not (drive.surface_compliance and teeth):
        return _RIGID_TOOTH * min(teeth, drive.step_limit)
    least, more = _SEGMENTS
    segments = teeth * (least + more * ringing / drive.stage_velocity)
    running, slow = _PER_SEGMENT
    seconds = running + slow / (1.0 + (drive.stage_velocity / (_SLOW * ringing)) ** 2)
    return seconds * min(segments, drive.step_limit)


def _slips(drive: Drive, force: float, way: float, stiffness: float) -> float:
    """Macroscopic slips: those of the closed form that are longer than the contact yields by, F/K.

    One for each cycle, or a single one where damping takes what a slip gains from its excess.
    """
    pace, excess = math.sqrt(drive.spring_stiffness), _EXCESS * force
    swing = math.hypot(1.0, excess / (pace * drive.stage_velocity))
    if math.log(swing) <= 2.0 * math.pi * drive.damping_ratio:
        return 1.0
    cycle = 2.0 * excess / drive.spring_stiffness + 2.0 * math.pi * drive.stage_velocity / pace  # of the stage's way
    length = 2.0 * math.hypot(excess / drive.spring_stiffness, drive.stage_velocity / pace)
    longer = min(length * stiffness / force, 1.0) ** 3 if drive.surface_compliance else 1.0
    return max(1.0, longer * way / cycle)


def _fit_seconds(drive: Drive, slips: float) -> float:
    if slips >= MOST_SLIPS:  # not fitted
        return 0.0
    once, each_time, each_slip = _PER_TRIAL
    return _FIT_TRIALS * (once + each_time * min(drive.samples, MOST_SAMPLES) + each_slip * slips)
