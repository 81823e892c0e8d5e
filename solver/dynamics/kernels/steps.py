"""Eq. 12-14 integrated, compiled: from crossing to crossing, on an elastic and on a rigid contact."""

import math
from typing import NamedTuple

import numpy as np

from nanoslip.solver.compiled import declare_kernel
from nanoslip.solver.dynamics.kernels.motion import (
    Course,
    Floats,
    Motion,
    Passing,
    PinState,
    Record,
    Segment,
    Slip,
    Tally,
    ToothTable,
    acceleration_rounding,
    brief_responses,
    driving_force,
    find_motion,
    find_repeated_tooth,
    find_tooth,
    follow_slip,
    make_segment,
    motion_state,
    next_zero,
    no_slips,
    offset_from_level,
    root,
    slip_table,
    stage_place,
    tooth_holding,
)


@declare_kernel(error_model="numpy", inline="always")
def _quick_crossing(segment: Segment, distance: float) -> float:
    """Time when the pin reaches `distance`, if it surely keeps between half and 3/2 of its velocity until then; else NaN.

    Within the phases allowed here |q| and |p| grow by less than a fifth, which makes the bound on the velocity a proof.
    """
    speed = segment.pin.velocity
    # At half of its velocity the pin is there by then, and the rest shows that it keeps more than that.
    late = 2.0 * distance / speed
    if segment.damping * late > 0.1 or abs(segment.stiffness) * late * late > 0.01:
        return math.nan
    # 1.2 for the growth by less than a fifth, 2 as half of the velocity may be lost.
    if 2.4 * (abs(segment.q) + abs(segment.p) * late) * late > abs(speed):
        return math.nan
    tau = 0.5 * late
    for _ in range(50):
        y, v, _ = motion_state(segment, tau)
        step = (y - distance) / v
        tau -= step
        if abs(step) <= 1e-9 * tau:  # Newton's next step would be the square of this
            break
    return tau


@declare_kernel(error_model="numpy", inline="always")
def monotone_end(segment: Segment, motion: Motion, watched: bool, horizon: float) -> float:
    """Time for which the velocity (and, if watched, the driving force's rate) stays monotone, at most to the horizon.

    An extremum that the last segment ended at is not met again, although rounding leaves a little acceleration there.
    """
    c, stiffness, q, p = segment.damping, segment.stiffness, segment.q, segment.p
    doubt = acceleration_rounding(motion, segment.pin, segment.slope)
    # y'' + c y' + κ y = load + ramp·τ, differentiated twice: the acceleration a obeys a'' + c a' + κ a = 0, with
    # a(0) = q and a'(0) = p. The velocity is monotone up to the first zero of a.
    end = min(horizon, next_zero(c, stiffness, q if abs(q) > doubt else 0.0, p, motion.instant))
    if watched:
        k = motion.spring
        # D' = k(V - v) - c a and D'' = -(k a + c a'). With a'' = -c a' - κ a, the rate of g = k a + c a' is
        # k p - c (c p + κ q) at the start.
        # -g is the second rate of the driving force; it obeys the same free oscillation as the acceleration.
        g, rate = k * q + c * p, k * p - c * (c * p + stiffness * q)
        # p = ramp - c q - κ v: the rounding of g is that of q, k + c² times, and that of p's other terms.
        doubt = (k + c * c) * doubt + 4.4e-16 * c * (segment.ramp + abs(stiffness * segment.pin.velocity))
        end = min(end, next_zero(c, stiffness, g if abs(g) > doubt else 0.0, rate, motion.instant))
    # The larger rate, -c/2 + √(c²/4 - κ), is √-κ at most: within this time the motion grows to e^20 = 5e8 of its start.
    if stiffness < 0.0:  # growth: stay far from overflow
        end = min(end, 20.0 / math.sqrt(-stiffness))
    return end


@declare_kernel(error_model="numpy", inline="always")
def _velocity_level(motion: Motion, v0: float, v1: float) -> float:
    """The first of the velocities 0 and that of stick that lies strictly between v0 and v1, or NaN."""
    stick_velocity = motion.stick_velocity
    # In the order in which a falling, or a rising, velocity meets the two.
    if v1 < v0:
        if v0 > stick_velocity > v1:
            return stick_velocity
        return 0.0 if v0 > 0.0 > v1 else math.nan
    if v0 < 0.0 < v1:
        return 0.0
    return stick_velocity if v0 < stick_velocity < v1 else math.nan


@declare_kernel(error_model="numpy")
def segment_end(
    segment: Segment, motion: Motion, watched: bool, distance: float, forward: bool
) -> tuple[float, bool, float, float, float]:
    """Time when the segment ends, True if by reaching `distance`, and y, y' and ∫y then."""
    v, horizon = segment.pin.velocity, motion.duration - segment.pin.time
    # A crossing at half of this velocity or more passes neither level of the velocity, 0 or that of stick.
    if v < 0.0 or (v > 2.0 * motion.stick_velocity and not watched):
        tau = _quick_crossing(segment, distance)
        # NaN, where nothing is sure, fails here too.
        if tau <= horizon:
            _, v1, area = motion_state(segment, tau)
            return tau, True, distance, v1, area
    tau = monotone_end(segment, motion, watched, horizon)
    y, v1, area = motion_state(segment, tau)
    level = _velocity_level(motion, v, v1)
    if not math.isnan(level):
        tau = root(segment, motion, Passing.VELOCITY, level, tau, v1 > v)
        y, _, area = motion_state(segment, tau)
        v1 = level
    if y < distance if forward else y > distance:
        return tau, False, y, v1, area
    # Up to here the velocity has one sign, so that the position passes `distance` once.
    tau = root(segment, motion, Passing.POSITION, distance, tau, forward)
    _, v1, area = motion_state(segment, tau)
    # By rounding alone a pin that just reaches the edge must not seem to head back.
    return tau, True, distance, max(v1, 0.0) if forward else min(v1, 0.0), area


@declare_kernel(error_model="numpy")
def highest_driving_force(segment: Segment, motion: Motion, end: float, new: PinState) -> float:
    """Maximum over [0, end] of the driving force, whose rate is monotone there; `new` is the pin at the end."""
    at_start = driving_force(motion, segment.pin)
    highest = max(at_start, driving_force(motion, new))
    rate = motion.spring * (motion.stage - segment.pin.velocity) - motion.damping * segment.q
    if rate > 0.0 and offset_from_level(segment, motion, Passing.DRIVING_RATE, 0.0, end)[0] < 0.0:
        tau = root(segment, motion, Passing.DRIVING_RATE, 0.0, end, rate < 0.0)  # a literal would compile it again
        y, v, _ = motion_state(segment, tau)
        # The change alone: in the whole force the ways of stage and pin, both long, would cancel.
        change = motion.spring * (motion.stage * tau - y) - motion.damping * (v - segment.pin.velocity)
        highest = max(highest, at_start + change)
    return highest


# The friction law of Eq. 13-14 on one tooth: direction of motion, stick or slip, how far stick lasts.


@declare_kernel(error_model="numpy", inline="always")
def limit_friction(x: float, relaxed: float, surface_stiffness: float, limit: float) -> float:
    """Eq. 13, for a given relaxation point."""
    # At the limit the relaxation point follows (Eq. 14); here F alone, between -F̃ and F̃.
    return max(-limit, min(surface_stiffness * (x - relaxed), limit))


@declare_kernel(error_model="numpy", inline="always")
def moves_forward(motion: Motion, pin: PinState, slope: float) -> bool:
    """Direction of the motion; from rest the acceleration decides, or its rate where that is 0 to rounding. slope: of F̃."""
    if pin.velocity != 0.0:
        return pin.velocity > 0.0
    q = driving_force(motion, pin) - pin.friction_force
    # At rest κ v is 0 in p = ramp - c q - κ v.
    jerk = motion.spring * motion.stage - motion.damping * q
    doubt = max(abs(jerk) * motion.instant, acceleration_rounding(motion, pin, slope))
    return q > 0.0 if abs(q) > doubt else jerk >= 0.0


@declare_kernel(error_model="numpy", inline="always")
def limit_followed(friction_force: float, limit: float, slope: float, surface_stiffness: float, forward: bool) -> int:
    """1 or -1 where F follows F̃ or -F̃, because elastic contact would exceed it; 0 where the contact sticks."""
    # Elastic friction changes by K per distance: ahead it passes a limit that rises less, backward one that rises more.
    if friction_force >= limit and slope != surface_stiffness and (slope < surface_stiffness) == forward:
        return 1
    if friction_force <= -limit and slope != -surface_stiffness and (slope < -surface_stiffness) == forward:
        return -1
    return 0


@declare_kernel(error_model="numpy", inline="always")
def sticking_distance(
    friction_force: float, limit: float, slope: float, surface_stiffness: float, forward: bool
) -> float:
    """Signed distance in the direction of motion for which F = K(x - x_R) stays between -F̃ and F̃."""
    reach = math.inf if forward else -math.inf
    # F + K y meets the limit F̃ + slope·y, below -(F̃ + slope·y), at these distances y.
    if slope != surface_stiffness and (slope < surface_stiffness) == forward:
        reach = (limit - friction_force) / (surface_stiffness - slope)
    if slope != -surface_stiffness and (slope < -surface_stiffness) == forward:
        down = -(limit + friction_force) / (slope + surface_stiffness)
        reach = min(reach, down) if forward else max(reach, down)
    return reach


# Samples of the motion, time integrals of its forces and the range of the spring force, written as segments pass.


@declare_kernel(entry=True, allocates=True, error_model="numpy")
def empty_record(motion: Motion, sample_count: int, bin_count: int) -> Record:
    """A record of a run that has not begun."""
    return Record(
        np.full((sample_count + 1, 3), np.nan),
        np.full(bin_count + 1, np.nan),
        motion.recorded,
        np.array([np.inf, -np.inf]),
        0.5 * motion.recorded,
    )


@declare_kernel(error_model="numpy")
def note_spring_force(record: Record, motion: Motion, time: float, position: float) -> None:
    """Extend the range of the spring force by its present value."""
    force = motion.spring * (stage_place(motion, time) - position)
    record.spring_range[0] = min(record.spring_range[0], force)
    record.spring_range[1] = max(record.spring_range[1], force)


@declare_kernel(error_model="numpy", inline="always")
def note_brief(record: Record, motion: Motion, pin: PinState, tau: float, v_end: float) -> None:
    """`note_segment` of a stretch so brief that its acceleration is constant; its end is noted by the next
    stretch."""
    # Constant acceleration: v is linear, the way its integral. The spring force turns where v is that of
    # the stage.
    rate = (v_end - pin.velocity) / tau
    late = max(record.half - pin.time, 0.0)
    if late > 0.0:
        note_spring_force(record, motion, pin.time + late, pin.position + late * (pin.velocity + 0.5 * late * rate))
    if (pin.velocity < motion.stage) != (v_end < motion.stage):
        turn = (motion.stage - pin.velocity) / rate
        if turn >= late:
            way = turn * 0.5 * (pin.velocity + motion.stage)
            note_spring_force(record, motion, pin.time + turn, pin.position + way)


@declare_kernel(error_model="numpy", inline="always")
def note_segment(record: Record, motion: Motion, segment: Segment, tau: float) -> None:
    """Widen the range of the spring force to a segment that ends after `half`, and whose velocity is monotone.

    The spring force is largest and least at its ends, and where the pin is as fast as the stage.
    """
    pin = segment.pin
    late = max(record.half - pin.time, 0.0)
    y, v, _ = motion_state(segment, late)
    note_spring_force(record, motion, pin.time + late, pin.position + y)
    y, v_end, _ = motion_state(segment, tau)
    note_spring_force(record, motion, pin.time + tau, pin.position + y)
    if (v < motion.stage) != (v_end < motion.stage):
        turn = root(segment, motion, Passing.VELOCITY, motion.stage, tau, v_end > v)
        y, _, _ = motion_state(segment, turn)
        note_spring_force(record, motion, pin.time + turn, pin.position + y)


@declare_kernel(error_model="numpy", inline="always")
def next_due(record: Record, row: int, edge: int) -> float:
    """Time when the next row of `samples` or entry of `impulse` is to be written."""
    last, bins = record.samples.shape[0] - 1, record.impulse.size - 1
    # The share first: the last sample then falls exactly on the duration.
    sample = record.duration * (row / last) if row <= last else math.inf
    return min(sample, record.duration * (edge / bins)) if edge <= bins else sample


@declare_kernel(error_model="numpy")
def write_samples(
    record: Record, row: int, edge: int, segment: Segment, resisted: float, until: float
) -> tuple[int, int]:
    """Write samples within the segment; returns the next row and entry. resisted: ∫F dt up to the segment's start."""
    samples, impulse, duration = record.samples, record.impulse, record.duration
    pin, last, bins = segment.pin, samples.shape[0] - 1, impulse.size - 1
    while row <= last and duration * (row / last) <= until:
        y, v, _ = motion_state(segment, duration * (row / last) - pin.time)
        samples[row, 0] = pin.position + y
        samples[row, 1] = v
        samples[row, 2] = pin.friction_force + segment.slope * y
        row += 1
    while edge <= bins and duration * (edge / bins) <= until:
        tau = duration * (edge / bins) - pin.time
        _, _, area = motion_state(segment, tau)
        impulse[edge] = resisted + (pin.friction_force * tau + segment.slope * area)
        edge += 1
    return row, edge


@declare_kernel(error_model="numpy")
def pass_segment(
    record: Record, motion: Motion, segment: Segment, tally: Tally, until: float, tau: float, y: float, area: float
) -> Tally:
    """Write samples and sums of the segment, which ends at the time `until` and lasts τ; y and ∫y then."""
    steps, resisted, work, row, edge = tally
    friction_force, slope = segment.pin.friction_force, segment.slope
    row, edge = write_samples(record, row, edge, segment, resisted, until)
    if until >= record.half:
        note_segment(record, motion, segment, tau)
    impulse = friction_force * tau + slope * area
    # F = F_0 + slope·y is exact in a segment: ∫F dt = F_0 τ + slope ∫y dt, ∫F dx = F_0 y + slope y²/2.
    return Tally(
        steps + 1,
        resisted + impulse,
        work + (friction_force + 0.5 * slope * y) * y,
        row,
        edge,
    )


@declare_kernel(error_model="numpy")
def pass_rest(record: Record, motion: Motion, pin: PinState, tally: Tally, until: float) -> Tally:
    """Let time pass at rest: friction balances the driving force, which grows as the stage moves on."""
    samples, impulse, duration = record.samples, record.impulse, record.duration
    last, bins = samples.shape[0] - 1, impulse.size - 1
    # A pin at rest does no work, and its friction force is what spring and damper pull with: linear in
    # time.
    steps, resisted, work, row, edge = tally
    driving, ramp = driving_force(motion, pin), motion.spring * motion.stage
    while row <= last and duration * (row / last) <= until:
        samples[row, 0] = pin.position
        samples[row, 1] = 0.0
        samples[row, 2] = driving + ramp * (duration * (row / last) - pin.time)
        row += 1
    while edge <= bins and duration * (edge / bins) <= until:
        tau = duration * (edge / bins) - pin.time
        impulse[edge] = resisted + (driving + 0.5 * ramp * tau) * tau
        edge += 1
    if until >= record.half:
        note_spring_force(record, motion, max(pin.time, record.half), pin.position)
        note_spring_force(record, motion, until, pin.position)
    tau = until - pin.time
    return Tally(steps + 1, resisted + (driving + 0.5 * ramp * tau) * tau, work, row, edge)


@declare_kernel(allocates=True, entry=True, error_model="numpy")
def make_run_result(record: Record, tally: Tally, slip: Slip, slips: Floats, reached: float) -> Course:
    """Result of a run of segments."""
    return Course(
        reached,
        tally.steps,
        record.samples,
        record.impulse,
        slips,
        slip.micro_slips,
        slip.micro_travel,
        tally.work,
        record.spring_range[0],
        record.spring_range[1],
    )


# Cross whole teeth the short way while the pin slides fast: nearly all of a long drive is this.


@declare_kernel(error_model="numpy", inline="always")
def _may_turn(segment: Segment, motion: Motion, tau: float) -> bool:
    """True if the driving force might have an extremum within a short τ: its rate changes by less than the bound."""
    k, c, q, p = motion.spring, motion.damping, segment.q, segment.p
    # D' = k(V - v) - c a, and D'' = -(k a + c a') with |a| up to |q| + τ|p| and |a'| near |p|: the factor
    # 2 covers what these grow by in a phase as small as `_cross_tooth` allows.
    rate = k * (motion.stage - segment.pin.velocity) - c * q
    second_rate = k * (abs(q) + tau * abs(p)) + c * abs(p)
    return abs(rate) <= 2.0 * tau * second_rate


class Forecast(NamedTuple):
    """The start of a tooth as the tooth before foretold it, less than 1e-6 off."""

    time: float
    velocity: float
    inverse: float
    """1/velocity."""


@declare_kernel(error_model="numpy", forceinline=True)  # a call costs a fifth of the time
def _cross_tooth(
    c: float, stiffness: float, pull: float, ramp: float, width: float, t: float, v: float, old: Forecast
) -> tuple[bool, float, float, float, Forecast]:
    """Decide if the pin surely crosses `width` in a small phase at nearly constant v; if so return time, y', ∫y and a forecast.

    A second-order guess of the time and one Newton step are exact to rounding here. The forecast for the next tooth spares it
    the wait for the exact velocity.
    """
    # g is the time at constant velocity v, and y(gθ) = v gθ + q (gθ)²/2 + p (gθ)³/6 = w (θ + a θ² + b θ³) with
    # a = q g/(2v), b = p g²/(6v). It is w at θ = 1 - (a + b) + 2a(a + b), to the third order.
    g = width * old.inverse
    q = pull + ramp * old.time - c * old.velocity
    p = ramp - c * q - stiffness * old.velocity
    a, b = 0.5 * g * old.inverse * q, (1 / 3 * g) * (0.5 * g * old.inverse * p)
    tau = g - g * ((a + b) - 2.0 * (a * (a + b)))
    u = v + tau * (q + 0.5 * tau * p)
    new = Forecast(t + tau, u, 1.0 / u)

    load = pull + ramp * t
    rate, h, one, two, three = brief_responses(c, stiffness, tau)
    y = v * h + (load * one + ramp * two)
    v_end = v * rate + (load * h + ramp * one)
    area = v * one + (load * two + ramp * three)
    # Newton's step (w - y)/y' adds the last digits; Newton's iteration for 1/y' spares the division.
    late = (width - y) * new.inverse * (2.0 - v_end * new.inverse)  # over v_end, to the square of the forecast's error
    v_end += late * (load + ramp * tau - c * v_end - stiffness * width)
    # The bounds of the phase are those of `brief_responses`; the last is that of the forecast, squared in `late`.
    sure = abs(a) + abs(b) <= 0.005 and c * g <= 0.01 and abs(stiffness) * (g * g) <= 0.004 and abs(late) <= 1e-6 * g
    return sure, tau + late, v_end, area + width * late, new


@declare_kernel(error_model="numpy")
def cruise(
    teeth: ToothTable,
    motion: Motion,
    record: Record,
    index: int,
    pin: PinState,
    slip: Slip,
    tally: Tally,
    step_limit: int,
    rigid: bool | None,
) -> tuple[int, PinState, Slip, Tally]:
    """Slide on from the left edge of tooth `index` ≥ 0 over whole teeth, as long as `_cross_tooth` is sure of them, F
    does not meet its limit within one, and the velocity stays well above the stick velocity. Nearly all of a long drive is this.

    rigid: unless None (which compiles a function without it), F is F̃ from the start of every tooth on.
    """
    edges, force, slope = teeth.edges, teeth.force, teeth.slope  # in locals: whole tuples cost reference counts
    k, c, V, surface_stiffness, duration = (
        motion.spring,
        motion.damping,
        motion.stage,
        motion.surface_stiffness,
        motion.duration,
    )
    ramp, drag, slowest = k * V, c * V + k * motion.stage_start, 2.0 * motion.stick_velocity
    count, first = force.size, teeth.periodic_from
    j, shift = find_repeated_tooth(teeth, index)
    laps = (index - j) // (count - first)
    (t, x, v, friction_force), climbing, peak = pin, slip.climbing, slip.peak
    steps, resisted, work, row, edge = tally
    due, half = next_due(record, row, edge), record.half
    forecast = Forecast(t, v, 1.0 / v)
    # Tooth by tooth as in `integrate_exactly`, without all that cannot happen far above the stick
    # velocity: a turn, a re-stick, -F̃.
    while steps < step_limit:
        right, base, rise = edges[j + 1] + shift, force[j], slope[j]
        # A rigid contact is at its limit at once; an elastic one at most, where the limit has dropped.
        width, friction_force = right - x, min(friction_force, base) if rigid is None else base
        rate = rise if friction_force == base and rise < surface_stiffness else surface_stiffness
        after = friction_force + rate * width
        pull = drag - k * x - friction_force
        sure, tau, v_end, area, forecast = _cross_tooth(c, k + rate, pull, ramp, width, t, v, forecast)
        end = t + tau
        # F and F̃ are both straight within a tooth: F that is not above F̃ at either end is not above it between.
        if not (sure and after <= base + rise * width and v_end > slowest and end < duration):
            break
        if climbing:
            # The slip's largest driving force may lie within this tooth: only the long way finds it.
            if _may_turn(make_segment(motion, PinState(t, x, v, friction_force), rate), motion, tau):
                break
            peak = max(peak, k * (stage_place(motion, end) - right) + c * (V - v_end))
            climbing = v_end < V
        if end >= due:
            segment = make_segment(motion, PinState(t, x, v, friction_force), rate)
            row, edge = write_samples(record, row, edge, segment, resisted, end)
            due = next_due(record, row, edge)
        if end >= half and (t < half or (v < V) != (v_end < V)):
            note_brief(record, motion, PinState(t, x, v, friction_force), tau, v_end)
        resisted += friction_force * tau + rate * area
        work += 0.5 * width * (friction_force + after)
        t, x, v, friction_force = end, right, v_end, after
        steps += 1
        j += 1
        if j == count:
            j = first
            laps += 1
            # A product: a sum over laps would gather their rounding.
            shift = laps * (edges[count] - edges[first])
    slip = Slip(slip.sliding, climbing, slip.time, slip.position, peak, slip.micro_slips, slip.micro_travel)
    return index + steps - tally.steps, PinState(t, x, v, friction_force), slip, Tally(steps, resisted, work, row, edge)


# The event-driven method with an elastic contact.


@declare_kernel(entry=True, allocates=True, error_model="numpy")
def integrate_exactly(
    teeth: ToothTable,
    motion: Motion,
    sample_count: int,
    bin_count: int,
    step_limit: int,
    one_way: bool | None,
    pin: PinState,
    pieces: Floats,
    cruising: bool,
) -> Course:
    """Follow the pin in closed-form segments, each to a tooth's edge, F = ±F̃, velocity 0 or of stick, or an extremum.

    one_way: stop if F would follow -F̃; None compiles a function without it. pin: where it starts.
    pieces: (p, 3) of the stage's way after the first, which is that of the motion: end, velocity, place at time 0 (`Motion`).
    cruising: cross teeth the short way if exact.
    """
    K = motion.surface_stiffness
    record = empty_record(motion, sample_count, bin_count)
    slip, finished = Slip(False, False, 0.0, 0.0, 0.0, 0, 0.0), no_slips()
    tally = Tally(0, 0.0, 0.0, 0, 0)
    # From a plain 0 numba would compile all that it is handed to once more, and then not use it.
    index = tooth_holding(teeth, int(np.int64(0)), pin.position)[0]
    while pin.time < motion.duration and tally.steps < step_limit and len(finished) < motion.most_slips:
        left, right, base, slope = find_tooth(teeth, index)
        if (
            cruising
            and slip.sliding
            and pin.velocity > 2.0 * motion.stick_velocity
            and pin.friction_force >= 0.0
            and left >= max(pin.position, 0.0)
        ):
            index, pin, slip, tally = cruise(teeth, motion, record, index, pin, slip, tally, step_limit, None)
            if tally.steps == step_limit:
                break
            left, right, base, slope = find_tooth(teeth, index)
        t, x, v, friction_force = pin
        limit = max(base + slope * (x - left), 0.0)
        if one_way is not None and friction_force < -limit:
            break
        # Where F̃ drops at an edge, F drops to it, and with it the relaxation point (Eq. 14), which F stands for.
        friction_force = min(max(friction_force, -limit), limit)
        pin = PinState(t, x, v, friction_force)
        forward = moves_forward(motion, pin, slope)
        way = right - x if forward else left - x
        if way <= 0.0 if forward else way >= 0.0:
            index += 1 if forward else -1
            tally = Tally(tally.steps + 1, tally.resisted, tally.work, tally.row, tally.edge)
            continue

        branch = limit_followed(friction_force, limit, slope, K, forward)
        if one_way is not None and branch < 0:
            break
        # Stuck, F rises with K whatever the tooth: its slope bounds F, and is followed on the limit alone.
        segment = make_segment(motion, pin, branch * slope if branch else K)
        reach = way if branch else sticking_distance(friction_force, limit, slope, K, forward)
        distance = min(way, reach) if forward else max(way, reach)
        watched = v >= motion.stick_velocity and (slip.climbing or not slip.sliding)
        tau, met, y, v, area = segment_end(segment, motion, watched, distance, forward)
        # Exactly at the end, or a last segment as long as rounding would follow.
        t = motion.duration if tau >= motion.duration - t else t + tau
        tally = pass_segment(record, motion, segment, tally, t, tau, y, area)

        x += y
        friction_force += segment.slope * y
        # At an edge of the tooth, exactly: the next one begins there.
        if met and distance == way:
            x = right if forward else left
            index += 1 if forward else -1
        elif met:
            branch = 1 if friction_force >= 0.0 else -1
        if branch:  # exactly on the limit, or the next segment would have to find it again
            friction_force = branch * (base + slope * (x - left))
        pin = PinState(t, x, v, friction_force)
        peak = highest_driving_force(segment, motion, tau, pin) if watched else driving_force(motion, pin)
        slip = follow_slip(slip, finished, motion, segment.pin, pin, peak)
        motion = find_motion(motion, pieces, t)
    table = slip_table(slip, finished, motion, pin)
    return make_run_result(record, tally, slip, table, pin.time)


# The event-driven method with a rigid contact.


@declare_kernel(error_model="numpy", inline="always")
def _let_go(segment: Segment) -> Segment:
    """The segment of a pin at rest that is just let go: its acceleration is 0 without rounding."""
    pin, slope, c, total, _, ramp, _, _, pace = segment
    return Segment(pin, slope, c, total, 0.0, ramp, 0.0, ramp, pace)


@declare_kernel(entry=True, allocates=True, error_model="numpy")
def integrate_rigidly(
    teeth: ToothTable, motion: Motion, sample_count: int, bin_count: int, step_limit: int, one_way: bool | None
) -> Course:
    """`integrate_exactly` with a contact that does not yield: at rest while spring and damper pull no harder than F̃,
    in motion against a force of F̃.
    """
    # K = ∞: F jumps between -F̃ and F̃ with the direction, and at rest is whatever balances the pull.
    duration, record = motion.duration, empty_record(motion, sample_count, bin_count)
    slip, finished = Slip(False, False, 0.0, 0.0, 0.0, 0, 0.0), no_slips()
    pin, tally, heading = PinState(0.0, 0.0, 0.0, 0.0), Tally(0, 0.0, 0.0, 0, 0), 0
    index = int(np.int64(0))  # as in `integrate_exactly`
    while pin.time < duration and tally.steps < step_limit and len(finished) < motion.most_slips:
        left, right, base, slope = find_tooth(teeth, index)
        if (
            heading > 0
            and slip.sliding
            and pin.velocity > 2.0 * motion.stick_velocity
            and left >= max(pin.position, 0.0)
        ):
            index, pin, slip, tally = cruise(teeth, motion, record, index, pin, slip, tally, step_limit, True)
            if tally.steps == step_limit:
                break
            left, right, base, slope = find_tooth(teeth, index)
        limit = max(base + slope * (pin.position - left), 0.0)
        let_go = False
        if heading == 0:
            driving = driving_force(motion, pin)
            # No pull at all is no motion: the limit is at least 0, so the pin then rests.
            heading = 1 if driving > 0.0 else -1
            if abs(driving) <= limit:
                # A stage at rest never pulls harder: infinite, or NaN at the limit, and then the pin rests to the end.
                wait = (limit - driving) / (motion.spring * motion.stage)
                let_go, heading = wait < duration - pin.time, 1
                until = pin.time + wait if let_go else duration
                tally = pass_rest(record, motion, pin, tally, until)
                pin = PinState(until, pin.position, 0.0, limit)
                if not let_go:
                    break
            if one_way is not None and heading < 0:
                break
        forward = heading > 0
        x, way = pin.position, right - pin.position if forward else left - pin.position
        if way <= 0.0 if forward else way >= 0.0:
            index += heading
            heading = heading if pin.velocity != 0.0 else 0
            tally = Tally(tally.steps + 1, tally.resisted, tally.work, tally.row, tally.edge)
            continue

        segment = make_segment(motion, PinState(pin.time, x, pin.velocity, heading * limit), heading * slope)
        segment = _let_go(segment) if let_go else segment
        friction_force = segment.pin.friction_force
        watched = pin.velocity >= motion.stick_velocity and (slip.climbing or not slip.sliding)
        tau, met, y, v, area = segment_end(segment, motion, watched, way, forward)
        t = duration if tau >= duration - pin.time else pin.time + tau
        tally = pass_segment(record, motion, segment, tally, t, tau, y, area)

        x += y
        if met:
            x = right if forward else left
            index += heading
        heading = heading if v != 0.0 else 0
        pin = PinState(t, x, v, friction_force + segment.slope * y)
        peak = highest_driving_force(segment, motion, tau, pin) if watched else driving_force(motion, pin)
        slip = follow_slip(slip, finished, motion, segment.pin, pin, peak)
    table = slip_table(slip, finished, motion, pin)
    return make_run_result(record, tally, slip, table, pin.time)
