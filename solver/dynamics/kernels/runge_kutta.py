"""Eq. 12-14 integrated, compiled: classical Runge-Kutta steps of equal length."""

import math

import numpy as np

from nanoslip.solver.compiled import declare_kernel
from nanoslip.solver.dynamics.kernels.motion import (
    Course,
    Motion,
    PinState,
    Record,
    Slip,
    Tally,
    ToothTable,
    driving_force,
    find_tooth,
    follow_slip,
    no_slips,
    slip_table,
    tooth_holding,
)
from nanoslip.solver.dynamics.kernels.steps import (
    empty_record,
    limit_friction,
    make_run_result,
    note_brief,
    note_spring_force,
)


@declare_kernel(error_model="numpy")
def _cubic(s: float, old: float, new: float, old_rate: float, new_rate: float) -> float:
    """Cubic interpolation a fraction s into a step, from values and rates per step at both ends."""
    # Hermite's cubic: it has both values and both rates, at s = 0 and at s = 1.
    return old + s * s * (3.0 - 2.0 * s) * (new - old) + s * (1.0 - s) * ((1.0 - s) * old_rate - s * new_rate)


@declare_kernel(error_model="numpy", inline="always")
def _write_step(
    record: Record, motion: Motion, old: PinState, new: PinState, row: int, edge: int, pushed: float
) -> tuple[int, int]:
    """Write samples within a step; returns the next row and entry. pushed: ∫ of the driving force up to the step's start.

    The driving force has no jumps, so the impulse of friction is taken from it: less by the momentum, which is v.
    """
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
        s = (recorded * (edge / bins) - t) / dt
        v = _cubic(s, old.velocity, new.velocity, dt * a, dt * new_a)
        # With mass 1, v = ∫(D - F) dt from rest, so that ∫F dt = ∫D dt - v; D counts as linear within the
        # step.
        impulse[edge] = pushed + dt * s * (driving + 0.5 * (new_driving - driving) * s) - v
        edge += 1
    return row, edge


@declare_kernel(entry=True, allocates=True, error_model="numpy")
def integrate_by_steps(
    teeth: ToothTable, motion: Motion, steps: int, sample_count: int, bin_count: int, one_way: bool | None
) -> Course:
    """Classical Runge-Kutta steps of equal length; F at every stage with the relaxation point of the step's start,
    which Eq. 14 updates after the step. Samples by cubic interpolation, impulse by the trapezoidal rule.

    one_way: see `integrate_exactly`. A motion that runs away ends there, its `friction_work` NaN.
    """
    k, c, V, K = motion.spring, motion.damping, motion.stage, motion.surface_stiffness
    record = empty_record(motion, sample_count, bin_count)
    slip, finished = Slip(False, False, 0.0, 0.0, 0.0, 0, 0.0), no_slips()
    pin = PinState(0.0, 0.0, 0.0, 0.0)
    driving = driving_force(motion, pin)
    relaxed = pushed = work = 0.0
    index = row = edge = int(np.int64(0))  # as in `integrate_exactly`
    computed = 0
    left, right, base, slope = find_tooth(teeth, index)
    for step in range(steps):
        t, end = pin.time, motion.duration * ((step + 1) / steps)
        dt = end - t
        a = driving - pin.friction_force
        x, v, acceleration = pin.position, pin.velocity, a
        # (k_1 + 2 k_2 + 2 k_3 + k_4)/6 of the rates v and a at the four stages.
        dx, dv = v, a
        for stage in range(1, 4):
            part = dt if stage == 3 else 0.5 * dt
            x, v = pin.position + part * v, pin.velocity + part * acceleration
            if not left <= x < right:
                index, left, right, base, slope = tooth_holding(teeth, index, x)
            friction_force = limit_friction(x, relaxed, K, base + slope * (x - left))
            acceleration = k * (V * (t + part) - x) + c * (V - v) - friction_force
            weight = 1.0 if stage == 3 else 2.0
            dx += weight * v
            dv += weight * acceleration
        x, v = pin.position + dt / 6.0 * dx, pin.velocity + dt / 6.0 * dv
        if not left <= x < right:
            index, left, right, base, slope = tooth_holding(teeth, index, x)
        # No tooth can be told where the motion has run away to.
        if math.isnan(left):
            work = math.nan
            break
        if one_way is not None and K * (x - relaxed) < -(base + slope * (x - left)):
            break
        new = PinState(end, x, v, limit_friction(x, relaxed, K, base + slope * (x - left)))
        new_driving = driving_force(motion, new)

        row, edge = _write_step(record, motion, pin, new, row, edge, pushed)
        slip = follow_slip(slip, finished, motion, pin, new, max(driving, new_driving))
        pushed += 0.5 * dt * (driving + new_driving)
        work += 0.5 * (pin.friction_force + new.friction_force) * (x - pin.position)
        # Eq. 14, after the step: within one the relaxation point rests, as the paper words it.
        relaxed = x - new.friction_force / K
        if end >= record.half:
            # A step has no closed form to look into: its acceleration counts as constant.
            note_brief(record, motion, pin, dt, v)
            note_spring_force(record, motion, end, x)
        pin, driving, computed = new, new_driving, computed + 1
        if len(finished) >= motion.most_slips:
            break
    table = slip_table(slip, finished, motion, pin)
    return make_run_result(record, Tally(computed, pushed, work, 0, 0), slip, table, pin.time)
