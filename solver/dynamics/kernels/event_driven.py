"""The event-driven method with an elastic contact."""

import numpy as np

from nanoslip.solver.compiled import compiled
from nanoslip.solver.dynamics.kernels.cruise import cruise
from nanoslip.solver.dynamics.kernels.friction_law import limit_followed, moves_forward, stuck_reach
from nanoslip.solver.dynamics.kernels.oscillator import segment_from
from nanoslip.solver.dynamics.kernels.recording import empty_record, finished_run, pass_segment
from nanoslip.solver.dynamics.kernels.segment_end import highest_driving_force, segment_end
from nanoslip.solver.dynamics.kernels.slips import driving_force, follow_slip, no_slips, slip_table
from nanoslip.solver.dynamics.kernels.state import Motion, Pin, Run, Slip, Tally, Teeth
from nanoslip.solver.dynamics.kernels.teeth import tooth_at


@compiled(allocates=True, error_model="numpy")
def integrate_exactly(
    teeth: Teeth,
    motion: Motion,
    sample_count: int,
    bin_count: int,
    step_limit: int,
    one_way: bool | None,
    cruising: bool,
) -> Run:
    """Follow the pin from rest, segment by segment, each in closed form and ended by the first of: an edge of the
    tooth, F meeting ±F̃, a velocity of 0 or of stick, an extremum of the velocity, the end.

    one_way: unless None (which compiles a function without it), stop where F would follow -F̃. cruising: cross teeth
    the short way where that is exact.
    """
    K, duration = motion.surface_stiffness, motion.duration
    record = empty_record(motion, sample_count, bin_count)
    slip, finished = Slip(False, False, 0.0, 0.0, 0.0, 0, 0.0), no_slips()
    pin, tally = Pin(0.0, 0.0, 0.0, 0.0), Tally(0, 0.0, 0.0, 0, 0)
    index = int(np.int64(0))  # of a plain 0 numba would compile all that it is handed to once more, and then not use it
    while pin.time < duration and tally.steps < step_limit and len(finished) < motion.most_slips:
        left, right, base, slope = tooth_at(teeth, index)
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
            left, right, base, slope = tooth_at(teeth, index)
        t, x, v, friction_force = pin
        limit = max(base + slope * (x - left), 0.0)
        if one_way is not None and friction_force < -limit:
            break
        friction_force = min(max(friction_force, -limit), limit)
        pin = Pin(t, x, v, friction_force)
        forward = moves_forward(motion, pin, slope)
        way = right - x if forward else left - x
        if way <= 0.0 if forward else way >= 0.0:
            index += 1 if forward else -1
            tally = Tally(tally.steps + 1, tally.resisted, tally.work, tally.row, tally.edge)
            continue

        branch = limit_followed(friction_force, limit, slope, K, forward)
        if one_way is not None and branch < 0:
            break
        segment = segment_from(motion, pin, branch * slope if branch else K)
        reach = way if branch else stuck_reach(friction_force, limit, slope, K, forward)
        distance = min(way, reach) if forward else max(way, reach)
        watched = v >= motion.stick_velocity and (slip.climbing or not slip.sliding)
        tau, met, y, v, area = segment_end(segment, motion, watched, distance, forward)
        t = duration if tau >= duration - t else t + tau
        tally = pass_segment(record, motion, segment, tally, t, tau, y, area)

        x += y
        friction_force += segment.slope * y
        if met and distance == way:
            x = right if forward else left
            index += 1 if forward else -1
        elif met:
            branch = 1 if friction_force >= 0.0 else -1
        if branch:  # exactly on the limit, or the next segment would have to find it again
            friction_force = branch * (base + slope * (x - left))
        pin = Pin(t, x, v, friction_force)
        peak = highest_driving_force(segment, motion, tau, pin) if watched else driving_force(motion, pin)
        slip = follow_slip(slip, finished, motion, segment.pin, pin, peak)
    table = slip_table(slip, finished, motion, pin)
    return finished_run(record, tally, slip, table, pin.time)
