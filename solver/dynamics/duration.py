"""Motion and friction of a drive. Without a duration a drive continues until its numbers are determined, within
step_limit.

The first slip must lie in the first half of the time, and the mean friction force needs some cycles. A damper
stronger than all friction (c·V ≥ peak, ζ > π) drags the pin without stick: the duration then follows from the length
of the record.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial
from typing import Final

import numpy as np

from nanoslip.solver.drive import Drive, lag_time
from nanoslip.solver.dynamics.coefficients import FrictionCoefficients, friction_coefficients
from nanoslip.solver.dynamics.friction_limit import FrictionLimit, make_friction_limit
from nanoslip.solver.dynamics.integrators import Pull, integrate
from nanoslip.solver.dynamics.regime import RISING, count_sticks, ringing_time, start_forgotten_from
from nanoslip.solver.dynamics.result import DynamicsResult, ending_parameter
from nanoslip.solver.dynamics.stick_slip import Oscillator
from nanoslip.solver.parameter import declared
from nanoslip.solver.sliding.plateau import Plateau
from nanoslip.solver.sliding.record import FrictionRecord

DOUBLINGS: Final = 5
"""Number of times that a drive's duration is doubled before its numbers are given up."""
FORGETTING: Final = 500_000
"""Segments of a drive that goes on for its amplitude alone, or in a search for V_c: 20 ms, as the fit of Eq. 16-19."""
FEWEST_SLIPS: Final = 8
"""Fewest slips after the first whose strongest and weakest show how they scatter."""


def measure_motion(
    record: FrictionRecord, plateau: Plateau, drive: Drive, pull: Pull | None = None, patience: int | None = None
) -> tuple[DynamicsResult, FrictionCoefficients]:
    """The motion of a drive over `record`, and its friction. pull: pulls the pin over the contact itself instead.

    patience: segments that a drive without a duration may take for its regime; None for its step_limit. Raises NoPlateauError if
    the record has no steady part that could be continued.
    """
    limit = make_friction_limit(record, plateau, drive.profile)
    most = patience or drive.step_limit
    may_slide = cache(lambda: _may_slide(limit, drive, record.initial_stiffness, most))

    def lasting(duration: float | None) -> tuple[DynamicsResult, FrictionCoefficients]:
        motion = integrate(limit, replace(drive, duration=duration), record.initial_stiffness, pull)
        if pull is None and drive.duration is None and ending_parameter(motion, drive) != "max_slips":
            ends = partial(_slips_end, motion, drive, limit, may_slide)
            motion = replace(motion, forgotten_from=start_forgotten_from(motion, drive, limit.period, ends))
        return motion, friction_coefficients(motion, record, plateau, ending_parameter(motion, drive))

    last = lasting(drive.duration)
    longest = 2.0**DOUBLINGS * last[0].end_time
    while drive.duration is None and (longer := _sufficient_duration(*last, drive, most)) <= longest:
        measured = lasting(longer)
        if last[1].outcome.ok and not measured[1].outcome.ok:
            break  # what is known stays, where rounding or the step limit ends a longer one
        last = measured
    return last


def _slips_end(result: DynamicsResult, drive: Drive, limit: FrictionLimit, may_slide: Callable[[], bool]) -> bool:
    """True if slips end for good: a pin that slides sticks, too, or they are too strong for their scatter to matter."""
    return _end_by_far(result, drive, limit) or not may_slide()


def _end_by_far(result: DynamicsResult, drive: Drive, limit: FrictionLimit) -> bool:
    """True if Eq. 17 ends even a slip as far below the weakest as that is below the strongest, by ratios of excess force.

    Teeth may take a part of its energy, e²/(2k) of an excess e. Eq. 17 ends all slips without a damper, teeth do not.
    """
    k, excess = drive.spring_stiffness, result.slip_force[1:] - limit.steady_force
    if len(excess) < FEWEST_SLIPS or not excess.min() > 0.0 or not drive.damping_ratio:
        return False
    # As far below the weakest slip as that is below the strongest: min·min/max.
    far_below = float(excess.min() ** 2 / excess.max())
    # An excess e has the energy e²/(2k) beyond that of sliding, less what the teeth take.
    excess_squared = far_below**2 - 2.0 * k * limit.uneven_work
    damper = 2.0 * drive.damping_ratio * math.sqrt(k) * drive.stage_velocity
    excess_left = damper - math.sqrt(max(excess_squared, 0.0))
    pin = Oscillator(k, drive.damping_ratio, drive.stage_velocity, excess_left)
    return excess_squared > 0.0 and not math.isnan(pin.first_stop(math.inf))


def _may_slide(limit: FrictionLimit, drive: Drive, surface_stiffness: float, most: int) -> bool:
    """False if a pin that slides steadily sticks on the repeated part of the limit; True if it slides on, or that takes more than
    `most` segments.

    Before that part friction rises from 0 to its mean over so long a way that the pin is as fast as the stage, to 1 %. Then
    its teeth grow, pass by pass, while a ringing decays: teeth met at once swing the pin up to twice as far as they do later.
    """
    first, mean = limit.periodic_from, limit.steady_force
    # On a contact of this slope, RISING² k, a stuck pin follows the stage with kV/(k + slope) = V/(1 + RISING²).
    ramp = mean / (RISING**2 * drive.spring_stiffness)
    arrives = (ramp + mean / drive.spring_stiffness) / drive.stage_velocity
    rings = ringing_time(drive) if drive.damping_ratio else 0.0  # without a damper it may still stick later
    one_pass = limit.period / drive.stage_velocity
    teeth = len(limit.force) - first
    if not rings / one_pass <= most:
        return True  # each pass takes more than one segment; a damper may be too weak for its ringing to have a length
    growing = math.ceil(rings / one_pass)
    grown = arrives + growing * one_pass
    forgets = grown + one_pass + rings
    # Twice the stretch on grown teeth: in its second half the ringing and the start are forgotten.
    duration = 2.0 * forgets - grown
    if (duration - arrives) / one_pass * teeth > most:
        return True  # each tooth takes a segment
    begins = ramp + limit.period * np.arange(growing + 1)
    share = np.arange(1, growing + 2) / (growing + 1)
    from_first = limit.edges[first:-1] - limit.edges[first]
    passed = np.add.outer(begins, from_first)
    edges = np.concatenate(([0.0], passed.ravel(), [begins[-1] + limit.period]))
    if not np.all(np.diff(edges) > 0.0) or not declared(Drive)["duration"].holds(duration):
        return True  # a pin without friction meets no ramp; one that is too long drowns the teeth
    force = mean + np.outer(share, limit.force[first:] - mean)
    slope = np.outer(share, limit.slope[first:])
    rise = RISING**2 * drive.spring_stiffness
    forces = np.concatenate(([0.0], force.ravel()))
    slopes = np.concatenate(([rise], slope.ravel()))
    ramped = FrictionLimit(edges, forces, slopes, 1 + growing * teeth)
    trial = replace(drive, duration=duration, integrator="exact", samples=1, max_slips=None, step_limit=most)
    motion = integrate(ramped, trial, surface_stiffness)
    sticks = motion.restick_time[motion.restick_position > ramp]
    if not motion.outcome.ok or not len(sticks):
        return True
    return bool(sticks[-1] < forgets and np.isnan(motion.restick_time[-1]))


def _sufficient_duration(motion: DynamicsResult, friction: FrictionCoefficients, drive: Drive, patience: int) -> float:
    """Duration that a drive without one needs; infinite if a longer drive gives no more information about this
    motion.

    It is infinite if the motion has its numbers, was not to be extended, slips too little for any, or would meet the
    step limit. A pin that its damper drags has its friction long before its spring force has settled. The ringing of
    the start is awaited if that is cheap.
    """
    if not motion.outcome.ok or ending_parameter(motion, drive) == "max_slips" or drive.stage_velocity == 0.0:
        return math.inf
    count = count_sticks(motion, drive)
    settled = not count.unsettled or motion.settling_time < lag_time(drive)
    if settled and (friction.outcome.ok or count.regime == "micro_slip"):
        return math.inf
    needed, most = 2.0 * motion.end_time, drive.step_limit
    if motion.forgotten_from > motion.end_time:
        needed = max(needed, motion.forgotten_from)
        most = patience if friction.outcome.ok else drive.step_limit
    elif friction.outcome.ok:
        # Friction and regime are known: it goes on for the amplitude alone.
        needed, most = 2.0 * max(motion.end_time, count.ringing), FORGETTING
    return needed if motion.steps * needed <= most * motion.end_time else math.inf
