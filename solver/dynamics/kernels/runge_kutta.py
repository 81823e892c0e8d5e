"""Classical Runge-Kutta steps of equal length."""

import math

import numpy as np

from nanoslip.solver.compiled import compiled
from nanoslip.solver.dynamics.kernels.friction_law import limited_friction
from nanoslip.solver.dynamics.kernels.recording import empty_record, finished_run, note_brief, note_spring_force
from nanoslip.solver.dynamics.kernels.slips import driving_force, follow_slip, no_slips, slip_table
from nanoslip.solver.dynamics.kernels.state import Motion, Pin, Record, Run, Slip, Tally, Teeth
from nanoslip.solver.dynamics.kernels.teeth import tooth_at, tooth_holding


@compiled(error_model="numpy")
def _cubic(s: float, old: float, new: float, old_rate: float, new_rate: float) -> float:
    """Cubic interpolation a fraction s into a step, from values and rates per step at both ends."""
    return old + s * s * (3.0 - 2.0 * s) * (new - old) + s * (1.0 - s) * ((1.0 - s) * old_rate - s * new_rate)


@compiled(error_model="numpy")
def _write_step(
    record: Record, motion: Motion, old: Pin, new: Pin, row: int, edge: int, pushed: float
) -> tuple[int, int]:
    """Write what falls into a step; the first row and entry left. pushed: impulse up to the step's start."""
    samples, impulse, recorded = record.samples, record.impulse, record.duration
    last, bins = samples.shape[0] - 1, impulse.size - 1
    t, dt = old.time, new.time - old.time
    driving, new_driving = driving_force(motion, old), driving_force(motion, new)
    a, new_a = driving - old.friction_force, new_driving - new.friction_force
    while row <= last and recorded * (row / last) <= new.time:
        s = (recorded * (row / last) - t) / dt
        samples[row, 0] = _cubic(s, old.position, new.position, dt * old.velocity, dt * new.velocity)
        samples[row, 1] = _cubic(s, old.velocity, new.velocity, dt * a, dt * new_a)
        samples[row, 2] = old.friction_force + s * (new.friction_force - old.friction_force)
        row += 1
    while edge <= bins and recorded * (edge / bins) <= new.time:
        s = recorded * (edge / bins) - t
        impulse[edge] = pushed + s * (driving + 0.5 * (new_driving - driving) * s / dt)
        edge += 1
    return row, edge


@compiled(allocates=True, error_model="numpy")
def integrate_by_steps(
    teeth: Teeth, motion: Motion, steps: int, sample_count: int, bin_count: int, one_way: bool | None
) -> Run:
    """Classical Runge-Kutta steps of equal length; F at every stage with the relaxation point of the step's start,
    which Eq. 14 updates after the step. Samples by cubic interpolation, impulse by the trapezoidal rule.

    one_way: see `integrate_exactly`. A motion that runs away ends there, its `friction_work` NaN.
    """
    k, c, V, K = motion.spring, motion.damping, motion.stage, motion.surface_stiffness
    record = empty_record(motion, sample_count, bin_count)
    slip, finished = Slip(False, False, 0.0, 0.0, 0.0, 0, 0.0), no_slips()
    pin = Pin(0.0, 0.0, 0.0, 0.0)
    driving = driving_force(motion, pin)
    relaxed = pushed = work = 0.0
    index = row = edge = int(np.int64(0))  # as in `integrate_exactly`
    computed = 0
    left, right, base, slope = tooth_at(teeth, index)
    for step in range(steps):
        t, end = pin.time, motion.duration * ((step + 1) / steps)
        dt = end - t
        a = driving - pin.friction_force
        x, v, acceleration = pin.position, pin.velocity, a
        dx, dv = v, a
        for stage in range(1, 4):
            part = dt if stage == 3 else 0.5 * dt
            x, v = pin.position + part * v, pin.velocity + part * acceleration
            if not left <= x < right:
                index, left, right, base, slope = tooth_holding(teeth, index, x)
            friction_force = limited_friction(x, relaxed, K, base + slope * (x - left))
            acceleration = k * (V * (t + part) - x) + c * (V - v) - friction_force
            weight = 1.0 if stage == 3 else 2.0
            dx += weight * v
            dv += weight * acceleration
        x, v = pin.position + dt / 6.0 * dx, pin.velocity + dt / 6.0 * dv
        if not left <= x < right:
            index, left, right, base, slope = tooth_holding(teeth, index, x)
        if math.isnan(left):
            work = math.nan
            break
        if one_way is not None and K * (x - relaxed) < -(base + slope * (x - left)):
            break
        new = Pin(end, x, v, limited_friction(x, relaxed, K, base + slope * (x - left)))
        new_driving = driving_force(motion, new)

        row, edge = _write_step(record, motion, pin, new, row, edge, pushed)
        slip = follow_slip(slip, finished, motion, pin, new, max(driving, new_driving))
        pushed += 0.5 * dt * (driving + new_driving)
        work += 0.5 * (pin.friction_force + new.friction_force) * (x - pin.position)
        relaxed = x - new.friction_force / K
        if end >= record.half:
            note_brief(record, motion, pin, dt, v)
            note_spring_force(record, motion, end, x)
        pin, driving, computed = new, new_driving, computed + 1
        if len(finished) >= motion.most_slips:
            break
    table = slip_table(slip, finished, motion, pin)
    return finished_run(record, Tally(computed, pushed, work, 0, 0), slip, table, pin.time)
