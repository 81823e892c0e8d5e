"""Samples of the motion, time integrals of its forces and the range of the spring force, written as segments pass."""

import math

import numpy as np

from nanoslip.solver.compiled import compiled
from nanoslip.solver.dynamics.kernels.oscillator import Segment, state_at
from nanoslip.solver.dynamics.kernels.roots import VELOCITY, root
from nanoslip.solver.dynamics.kernels.slips import driving_force
from nanoslip.solver.dynamics.kernels.state import Floats, Motion, Pin, Record, Run, Slip, Tally


@compiled(allocates=True, error_model="numpy")
def empty_record(motion: Motion, sample_count: int, bin_count: int) -> Record:
    """A record of a run that has not begun."""
    return Record(
        np.full((sample_count + 1, 3), np.nan),
        np.full(bin_count + 1, np.nan),
        motion.recorded,
        np.array([np.inf, -np.inf]),
        0.5 * motion.recorded,
    )


@compiled(error_model="numpy")
def note_spring_force(record: Record, motion: Motion, time: float, position: float) -> None:
    """Widen the range of the spring force to what it is at an instant."""
    force = motion.spring * (motion.stage * time - position)
    record.spring_range[0] = min(record.spring_range[0], force)
    record.spring_range[1] = max(record.spring_range[1], force)


@compiled(error_model="numpy")
def note_brief(record: Record, motion: Motion, pin: Pin, tau: float, v_end: float) -> None:
    """`note_segment` of a stretch so brief that its acceleration is constant; its end is left to what follows."""
    rate = (v_end - pin.velocity) / tau
    late = max(record.half - pin.time, 0.0)
    if late > 0.0:
        note_spring_force(record, motion, pin.time + late, pin.position + late * (pin.velocity + 0.5 * late * rate))
    if (pin.velocity < motion.stage) != (v_end < motion.stage):
        turn = (motion.stage - pin.velocity) / rate
        if turn >= late:
            way = turn * 0.5 * (pin.velocity + motion.stage)
            note_spring_force(record, motion, pin.time + turn, pin.position + way)


@compiled(error_model="numpy")
def note_segment(record: Record, motion: Motion, segment: Segment, tau: float) -> None:
    """Widen the range of the spring force to a segment that ends after `half`, and whose velocity is monotone.

    The spring force is largest and least at its ends, and where the pin is as fast as the stage.
    """
    pin = segment.pin
    late = max(record.half - pin.time, 0.0)
    y, v, _ = state_at(segment, late)
    note_spring_force(record, motion, pin.time + late, pin.position + y)
    y, v_end, _ = state_at(segment, tau)
    note_spring_force(record, motion, pin.time + tau, pin.position + y)
    if (v < motion.stage) != (v_end < motion.stage):
        turn = root(segment, motion, VELOCITY, motion.stage, tau, v_end > v)
        y, _, _ = state_at(segment, turn)
        note_spring_force(record, motion, pin.time + turn, pin.position + y)


@compiled(error_model="numpy")
def next_due(record: Record, row: int, edge: int) -> float:
    """When the next row of `samples` or entry of `impulse` is to be written."""
    last, bins = record.samples.shape[0] - 1, record.impulse.size - 1
    sample = record.duration * (row / last) if row <= last else math.inf
    return min(sample, record.duration * (edge / bins)) if edge <= bins else sample


@compiled(error_model="numpy")
def write_samples(
    record: Record, row: int, edge: int, segment: Segment, resisted: float, until: float
) -> tuple[int, int]:
    """Write what falls into the segment; the first row and entry left. resisted: ∫F dt up to the segment's start."""
    samples, impulse, duration = record.samples, record.impulse, record.duration
    pin, last, bins = segment.pin, samples.shape[0] - 1, impulse.size - 1
    while row <= last and duration * (row / last) <= until:
        y, v, _ = state_at(segment, duration * (row / last) - pin.time)
        samples[row, 0] = pin.position + y
        samples[row, 1] = v
        samples[row, 2] = pin.friction_force + segment.slope * y
        row += 1
    while edge <= bins and duration * (edge / bins) <= until:
        tau = duration * (edge / bins) - pin.time
        _, v, area = state_at(segment, tau)
        impulse[edge] = v + resisted + (pin.friction_force * tau + segment.slope * area)  # balance: the momentum is v
        edge += 1
    return row, edge


@compiled(error_model="numpy")
def pass_segment(
    record: Record, motion: Motion, segment: Segment, tally: Tally, until: float, tau: float, y: float, area: float
) -> Tally:
    """Write and add up what falls into the segment, which ends at the time `until` and lasts τ; y and ∫y then."""
    steps, resisted, work, row, edge = tally
    friction_force, slope = segment.pin.friction_force, segment.slope
    row, edge = write_samples(record, row, edge, segment, resisted, until)
    if until >= record.half:
        note_segment(record, motion, segment, tau)
    return Tally(
        steps + 1,
        resisted + (friction_force * tau + slope * area),
        work + (friction_force + 0.5 * slope * y) * y,
        row,
        edge,
    )


@compiled(error_model="numpy")
def pass_rest(record: Record, motion: Motion, pin: Pin, tally: Tally, until: float) -> Tally:
    """Let time pass at rest: friction balances the driving force, which grows as the stage moves on."""
    samples, impulse, duration = record.samples, record.impulse, record.duration
    last, bins = samples.shape[0] - 1, impulse.size - 1
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


@compiled(allocates=True, error_model="numpy")
def finished_run(record: Record, tally: Tally, slip: Slip, slips: Floats, reached: float) -> Run:
    """What a run of segments came to."""
    return Run(
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
