"""The event-driven method with a rigid contact."""

import numpy as np

from nanoslip.solver.compiled import compiled
from nanoslip.solver.dynamics.kernels.cruise import cruise
from nanoslip.solver.dynamics.kernels.oscillator import Segment, segment_from
from nanoslip.solver.dynamics.kernels.recording import empty_record, finished_run, pass_rest, pass_segment
from nanoslip.solver.dynamics.kernels.segment_end import highest_driving_force, segment_end
from nanoslip.solver.dynamics.kernels.slips import driving_force, follow_slip, no_slips, slip_table
from nanoslip.solver.dynamics.kernels.state import Motion, Pin, Run, Slip, Tally, Teeth
from nanoslip.solver.dynamics.kernels.teeth import tooth_at


@compiled(error_model="numpy")
def _let_go(segment: Segment) -> Segment:
    """The segment of a pin at rest that is just let go: its acceleration is 0 without rounding."""
    pin, slope, c, total, _, ramp, _, _, pace = segment
    return Segment(pin, slope, c, total, 0.0, ramp, 0.0, ramp, pace)


@compiled(allocates=True, error_model="numpy")
def integrate_rigidly(
    teeth: Teeth, motion: Motion, sample_count: int, bin_count: int, step_limit: int, one_way: bool | None
) -> Run:
    """`integrate_exactly` with a contact that does not yield: at rest while spring and damper pull no harder than F̃,
    in motion against a force of F̃.
    """
    duration, record = motion.duration, empty_record(motion, sample_count, bin_count)
    slip, finished = Slip(False, False, 0.0, 0.0, 0.0, 0, 0.0), no_slips()
    pin, tally, heading = Pin(0.0, 0.0, 0.0, 0.0), Tally(0, 0.0, 0.0, 0, 0), 0
    index = int(np.int64(0))  # as in `integrate_exactly`
    while pin.time < duration and tally.steps < step_limit and len(finished) < motion.most_slips:
        left, right, base, slope = tooth_at(teeth, index)
        if (
            heading > 0
            and slip.sliding
            and pin.velocity > 2.0 * motion.stick_velocity
            and left >= max(pin.position, 0.0)
        ):
            index, pin, slip, tally = cruise(teeth, motion, record, index, pin, slip, tally, step_limit, True)
            if tally.steps == step_limit:
                break
            left, right, base, slope = tooth_at(teeth, index)
        limit = max(base + slope * (pin.position - left), 0.0)
        let_go = False
        if heading == 0:
            driving = driving_force(motion, pin)
            heading = 1 if driving > 0.0 else -1
            if abs(driving) <= limit:
                wait = (limit - driving) / (motion.spring * motion.stage)
                let_go, heading = wait < duration - pin.time, 1
                until = pin.time + wait if let_go else duration
                tally = pass_rest(record, motion, pin, tally, until)
                pin = Pin(until, pin.position, 0.0, limit)
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

        segment = segment_from(motion, Pin(pin.time, x, pin.velocity, heading * limit), heading * slope)
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
        pin = Pin(t, x, v, friction_force + segment.slope * y)
        peak = highest_driving_force(segment, motion, tau, pin) if watched else driving_force(motion, pin)
        slip = follow_slip(slip, finished, motion, segment.pin, pin, peak)
    table = slip_table(slip, finished, motion, pin)
    return finished_run(record, tally, slip, table, pin.time)
