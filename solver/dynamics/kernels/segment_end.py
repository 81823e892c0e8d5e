"""Where a segment ends: at a distance, at a velocity of 0 or of stick, at an extremum of the velocity, or with the drive."""

import math

from nanoslip.solver.compiled import compiled
from nanoslip.solver.dynamics.kernels.oscillator import Segment, state_at
from nanoslip.solver.dynamics.kernels.roots import DRIVING_RATE, POSITION, VELOCITY, next_zero, offset_from_level, root
from nanoslip.solver.dynamics.kernels.slips import acceleration_rounding, driving_force
from nanoslip.solver.dynamics.kernels.state import Motion, Pin


@compiled(error_model="numpy")
def _quick_crossing(segment: Segment, distance: float) -> float:
    """When the pin reaches `distance`, if it surely keeps between half and 3/2 of its velocity until then; else NaN.

    Within the phases allowed here |q| and |p| grow by less than a fifth, which makes the bound on the velocity a proof.
    """
    speed = segment.pin.velocity
    late = 2.0 * distance / speed
    if segment.damping * late > 0.1 or abs(segment.stiffness) * late * late > 0.01:
        return math.nan
    if 2.4 * (abs(segment.q) + abs(segment.p) * late) * late > abs(speed):
        return math.nan
    tau = 0.5 * late
    for _ in range(50):
        y, v, _ = state_at(segment, tau)
        step = (y - distance) / v
        tau -= step
        if abs(step) <= 1e-9 * tau:  # Newton's next step would be the square of this
            break
    return tau


@compiled(error_model="numpy")
def monotone_end(segment: Segment, motion: Motion, watched: bool, horizon: float) -> float:
    """How far the velocity (and, if watched, the driving force's rate) is monotone, at most to the horizon.

    An extremum that the last segment ended at is not met again, although rounding leaves a little acceleration there.
    """
    c, stiffness, q, p = segment.damping, segment.stiffness, segment.q, segment.p
    doubt = acceleration_rounding(motion, segment.pin, segment.slope)
    end = min(horizon, next_zero(c, stiffness, q if abs(q) > doubt else 0.0, p, motion.instant))
    if watched:
        k = motion.spring
        g, rate = k * q + c * p, k * p - c * (c * p + stiffness * q)
        doubt = (k + c * c) * doubt + 4.4e-16 * c * (segment.ramp + abs(stiffness * segment.pin.velocity))
        end = min(end, next_zero(c, stiffness, g if abs(g) > doubt else 0.0, rate, motion.instant))
    if stiffness < 0.0:  # growth: stay far from overflow
        end = min(end, 20.0 / math.sqrt(-stiffness))
    return end


@compiled(error_model="numpy")
def _velocity_level(motion: Motion, v0: float, v1: float) -> float:
    """The first of the velocities 0 and that of stick that lies strictly between v0 and v1, or NaN."""
    stick_velocity = motion.stick_velocity
    if v1 < v0:
        if v0 > stick_velocity > v1:
            return stick_velocity
        return 0.0 if v0 > 0.0 > v1 else math.nan
    if v0 < 0.0 < v1:
        return 0.0
    return stick_velocity if v0 < stick_velocity < v1 else math.nan


@compiled(error_model="numpy")
def segment_end(
    segment: Segment, motion: Motion, watched: bool, distance: float, forward: bool
) -> tuple[float, bool, float, float, float]:
    """When the segment ends, whether by reaching `distance`, and y, y' and ∫y then."""
    v, horizon = segment.pin.velocity, motion.duration - segment.pin.time
    if v < 0.0 or (v > 2.0 * motion.stick_velocity and not watched):
        tau = _quick_crossing(segment, distance)
        if tau <= horizon:
            _, v1, area = state_at(segment, tau)
            return tau, True, distance, v1, area
    tau = monotone_end(segment, motion, watched, horizon)
    y, v1, area = state_at(segment, tau)
    level = _velocity_level(motion, v, v1)
    if not math.isnan(level):
        tau = root(segment, motion, VELOCITY, level, tau, v1 > v)
        y, _, area = state_at(segment, tau)
        v1 = level
    if y < distance if forward else y > distance:
        return tau, False, y, v1, area
    tau = root(segment, motion, POSITION, distance, tau, forward)
    _, v1, area = state_at(segment, tau)
    return tau, True, distance, max(v1, 0.0) if forward else min(v1, 0.0), area


@compiled(error_model="numpy")
def highest_driving_force(segment: Segment, motion: Motion, end: float, new: Pin) -> float:
    """Maximum over [0, end] of the driving force, whose rate is monotone there; `new` is the pin at the end."""
    at_start = driving_force(motion, segment.pin)
    highest = max(at_start, driving_force(motion, new))
    rate = motion.spring * (motion.stage - segment.pin.velocity) - motion.damping * segment.q
    if rate > 0.0 and offset_from_level(segment, motion, DRIVING_RATE, 0.0, end)[0] < 0.0:
        tau = root(segment, motion, DRIVING_RATE, 0.0, end, False)
        y, v, _ = state_at(segment, tau)
        change = motion.spring * (motion.stage * tau - y) - motion.damping * (v - segment.pin.velocity)
        highest = max(highest, at_start + change)
    return highest
