"""Slips of a measured force: where it falls, how it rises before, where the pull ends, and the strokes of both signs."""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from nanoslip.solver.arrays import Floats
from nanoslip.solver.ensemble import FEWEST
from nanoslip.study.measured.recording import FEWEST_POINTS, LEAST_DROP, NOISE, Trace, noise_of


class TraceSlip(NamedTuple):
    """Samples of the force's peak before a slip and of its least value after it; and if it rises again."""

    peak: int
    trough: int
    ended: bool


class Averaged(NamedTuple):
    """Averages of neighbouring samples, their noise, the fall of force that counts as a slip, and the slips."""

    width: int
    trace: Trace
    noise: float
    drop: float
    slips: list[TraceSlip]


def _averaged_over(trace: Trace, width: int) -> Averaged:
    trace = trace.averaged(width)
    force = trace.force
    noise = noise_of(force)
    drop = LEAST_DROP * float((np.maximum.accumulate(force) - force).max())
    slips = [slip for slip in _slips(force, max(NOISE * noise, drop)) if slip.peak > 0]
    return Averaged(width, trace, noise, drop, slips)


def averaged(trace: Trace) -> Averaged:
    """The narrowest means that show all slips but one, as one at an end may be seen or not."""
    widths = [_averaged_over(trace, 2**power) for power in range((len(trace.at) // FEWEST_POINTS).bit_length() or 1)]
    most = max(len(averages.slips) for averages in widths)
    return next(averages for averages in widths if len(averages.slips) >= most - 1)


def end_of_pull(averages: Averaged) -> int:
    """Sample at which a pull ends: the force comes to a level from which it never rises again. 0 if the pin slides on.

    The level is that of rest, below a tenth of the force; or comes after regular slips; or after steady sliding.
    """
    at, force, slips = averages.trace.at, averages.trace.force, averages.slips
    if not slips or not slides_on(averages):
        return 0
    last, drops = slips[-1], [force[slip.peak] - force[slip.trough] for slip in slips]
    level = float(np.median(force[last.trough :]))
    regular = len(slips) > 2 and drops[-1 if last.ended else -2] > 0.5 * drops[0]
    if last.ended:
        return last.trough + int(np.argmax(force[last.trough :] >= level)) if regular else 0
    rests = len(at) - last.trough >= FEWEST_POINTS and abs(level) <= LEAST_DROP * force[last.peak]
    above = force >= force[last.peak] - 0.25 * drops[-1]
    end = last.peak + int(np.flatnonzero(above[last.peak : last.trough + 1])[-1]) + 1
    top = force[int(np.argmax(above)) : end]  # its median is an eighth of the fall below the peak if it rises and falls
    steady = len(top) >= FEWEST_POINTS and force[last.peak] - np.median(top) < drops[-1] / 16.0
    return end if rests or regular or steady else 0


def slides_on(averages: Averaged) -> bool:
    """True if no slip follows the last one for longer than between any two, and the force is level in half of that time."""
    at, force, slips = averages.trace.at, averages.trace.force, averages.slips
    if not slips:
        return True
    peaks = at[[slip.peak for slip in slips]]
    level = np.ptp(force[(slips[-1].peak + len(at)) // 2 :]) <= max(averages.drop, NOISE * averages.noise)
    return bool(level and at[-1] - peaks[-1] > (np.diff(peaks).max() if len(slips) > 1 else peaks[0] - at[0]))


def _slips(force: Floats, drop: float) -> list[TraceSlip]:
    """Peaks after which the force falls by at least `drop`, with the least value before it rises by as much again."""
    found: list[TraceSlip] = []
    high = low = 0
    falling = False
    for place, value in enumerate(force.tolist()):
        if falling:
            low = place if value < force[low] else low
            if value > force[low] + drop:
                found.append(TraceSlip(high, low, ended=True))
                falling, high = False, place
        else:
            high = place if value > force[high] else high
            if value < force[high] - drop:
                falling, low = True, place
    return [*found, TraceSlip(high, low, ended=False)] if falling else found


def turned(at: Floats, slips: Sequence[TraceSlip]) -> bool:
    """True if the force falls more slowly than it rises. In stick-slip the slip is the shorter part."""
    falls = sum(at[slip.trough] - at[slip.peak] for slip in slips[:-1])
    rises = sum(at[after.peak] - at[slip.trough] for slip, after in pairwise(slips))
    return bool(falls > 1.5 * rises)


def rate_of(at: Floats, force: Floats, low: int, high: int) -> float:
    """Rate of the force in the middle of its rise between two samples; at the beginning a stage may be at rest."""
    if low == 0:
        smooth = np.maximum.accumulate(force[:high])
        low = min(int(np.searchsorted(smooth, 0.9 * force[0] + 0.1 * force[high])), high - 1)
    middle = slice(low + (high - low) // 5, high - (high - low) // 5 + 1)
    return float(np.polyfit(at[middle] - at[low], force[middle], 1)[0])


def ramp(at: Floats, force: Floats) -> list[float]:
    """Rate of the force's rise before steady sliding; empty if the trace begins there."""
    most = float(np.median(force))
    top = int(np.argmax(force >= 0.9 * most))
    return [rate_of(at, force, 0, top)] if force[0] < 0.5 * most and top > FEWEST else []


class Stroke(NamedTuple):
    """Samples of a stroke, from the sign's change to the last one before it turns; and the sign of its force."""

    first: int
    last: int
    sign: float


def strokes_of(force: Floats, middle: float, swing: float) -> list[Stroke]:
    """Strokes of a force of both signs, cut where it passes the middle; `swing` is half its usual range."""
    sides = np.where(force > middle + swing / 2.0, 1, np.where(force < middle - swing / 2.0, -1, 0))
    held = np.flatnonzero(sides)  # so noise at the middle turns nothing
    turns = held[1:][np.diff(sides[held]) != 0]
    passed = [int(np.flatnonzero((force[:turn] - middle) * sides[turn] <= 0.0)[-1]) + 1 for turn in turns]
    found = []
    for first, turn in pairwise([0, *passed, len(force)]):
        sign = float(sides[held[(held >= first) & (held < turn)][0]])
        forces = sign * (force[first:turn] - middle)
        found.append(Stroke(first, first + int(np.flatnonzero(forces >= np.median(forces))[-1]) + 1, sign))
    return [stroke for stroke in found if stroke.last - stroke.first >= FEWEST_POINTS]
