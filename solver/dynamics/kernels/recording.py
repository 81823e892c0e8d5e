"""Samples of the motion and time integrals of its forces, written as segments pass."""

import math

from solver.compiled import compiled
from solver.dynamics.kernels.oscillator import Segment, state_at
from solver.dynamics.kernels.slips import driving_force
from solver.dynamics.kernels.state import Motion, Pin, Record, Tally


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
    samples, impulse, duration = record
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
    record: Record, segment: Segment, tally: Tally, until: float, tau: float, y: float, area: float
) -> Tally:
    """Write and add up what falls into the segment, which ends at the time `until` and lasts τ; y and ∫y then."""
    steps, resisted, work, row, edge = tally
    friction_force, slope = segment.pin.friction_force, segment.slope
    row, edge = write_samples(record, row, edge, segment, resisted, until)
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
    samples, impulse, duration = record
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
    tau = until - pin.time
    return Tally(steps + 1, resisted + (driving + 0.5 * ramp * tau) * tau, work, row, edge)
