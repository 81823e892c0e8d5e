"""Slips of a measured force: where it falls, how it rises before, where the pull ends, and the strokes of both signs."""

import math
from collections.abc import Sequence
from itertools import compress, pairwise
from typing import Final, NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from nanoslip.solver.arrays import Floats
from nanoslip.solver.ensemble import FEWEST
from nanoslip.study.measured.recording import FEWEST_POINTS, LEAST_DROP, NOISE, Trace, find_gaps, noise_deviation


class TraceSlip(NamedTuple):
    """Samples of the force's peak before a slip and of its least value after it; and if it rises again."""

    peak: int
    trough: int
    ended: bool


class Averaged(NamedTuple):
    """Averages of neighbouring samples, their noise, the fall of force that counts as a slip, the slips, and gaps.

    gaps: True for each step between samples in which a part of a cycle is not recorded.
    """

    width: int
    trace: Trace
    noise: float
    drop: float
    slips: list[TraceSlip]
    gaps: NDArray[np.bool_]

    def has_gap(self, first: int, last: int) -> bool:
        """True if a gap lies between two samples."""
        return bool(self.gaps[first:last].any())

    def recorded_time(self) -> Floats:
        """Time since the first sample, or way, less that of gaps."""
        steps = np.diff(self.trace.at)
        kept = np.where(self.gaps, np.median(steps), steps)
        return np.concatenate(([0.0], np.cumsum(kept)))


def _averaging_width(trace: Trace, width: int) -> Averaged:
    noise = noise_deviation(trace.force, width)
    trace = trace.average(width)
    force = trace.force
    falls = np.maximum.accumulate(force) - force
    drop = LEAST_DROP * float(falls.max())
    all_slips = find_slips(force, max(NOISE * noise, drop))
    slips = [
        slip for slip in all_slips if slip.peak > 0
    ]  # a trace that begins with a fall begins in the middle of a slip
    gaps = find_gaps(trace.at, _usual_cycle(trace, slips))
    return Averaged(width, trace, noise, drop, slips, gaps)


def _usual_cycle(trace: Trace, slips: Sequence[TraceSlip]) -> float:
    """Usual time, or way, from slip to slip; of a single one that of its rise, without slips that of the whole trace."""
    if not slips:
        return float(np.ptp(trace.at))
    peaks = [slip.peak for slip in slips]
    if len(peaks) == 1:
        peaks = [begin_of_rise(trace.force, peaks[0]), *peaks]
    return float(np.median(np.diff(trace.at[peaks])))


def narrowest_means(trace: Trace) -> Averaged:
    """The narrowest means that show all slips but one, as a slip at an end may be visible or not."""
    # Each doubling divides the noise by √2: finer steps would gain little.
    powers = (len(trace.at) // FEWEST_POINTS).bit_length() or 1
    widths = [_averaging_width(trace, 2**power) for power in range(powers)]
    most = max(len(averages.slips) for averages in widths)
    return next(averages for averages in widths if len(averages.slips) >= most - 1)


def end_of_pull(averages: Averaged) -> int:
    """Sample at which a pull ends: the force comes to a level from which it never rises again. 0 if the pin slides on.

    The level is that of rest, below a tenth of the force; or comes after regular slips; or after steady sliding.
    """
    force, slips = averages.trace.force, averages.slips
    if not slips:
        return 0
    last = slips[-1]
    drops = [force[slip.peak] - force[slip.trough] for slip in slips]
    regular = False
    if len(slips) > 2:
        # The fall at the end of a pull is longer than a slip, so it does not count.
        last_drop = drops[-1 if last.ended else -2]
        regular = last_drop > 0.5 * drops[0] and keeps_sliding(averages)
    if last.ended:
        if not regular:
            return 0
        behind = force[last.trough :]
        level = float(np.median(behind))
        return last.trough + int(np.argmax(behind >= level))
    above = force >= force[last.peak] - 0.25 * drops[-1]
    high = np.flatnonzero(above[last.peak : last.trough + 1])
    end = last.peak + int(high[-1]) + 1
    top = force[int(np.argmax(above)) : end]  # its median is an eighth of the fall below the peak if it rises and falls
    below_peak = force[last.peak] - np.median(top)
    steady = len(top) >= FEWEST_POINTS and below_peak < drops[-1] / 16.0
    return end if regular or steady or _rests(averages) else 0


def _rests(averages: Averaged) -> bool:
    """True if the force falls for the last time below a tenth of its peak, and a pull as before would have raised it again."""
    at, force, slips = averages.trace.at, averages.trace.force, averages.slips
    time = averages.recorded_time()
    last, before = slips[-1], slips[-2].trough if len(slips) > 1 else 0
    low = 0.75 * force[last.trough] + 0.25 * force[last.peak]
    is_low = force[last.peak :] <= low
    fell = last.peak + int(np.argmax(is_low))
    if len(at) - fell < FEWEST_POINTS:
        return False
    if abs(np.median(force[fell:])) > LEAST_DROP * force[last.peak]:
        return False
    raised = rise_rate(at, force, before, last.peak) * (time[-1] - time[fell])
    return bool(raised > 2.0 * max(averages.drop, NOISE * averages.noise))


def keeps_sliding(averages: Averaged) -> bool:
    """True if no slip follows the last slip for longer than between any two slips, and the force is level in the second
    half of the time since then.

    A single slip is compared with the time in which its force rose: how long the stage was at rest before tells
    nothing.
    """
    at, force, slips = averages.recorded_time(), averages.trace.force, averages.slips
    if not slips:
        return True
    peaks = at[[slip.peak for slip in slips]]
    middle = (slips[-1].peak + len(at)) // 2
    behind = force[middle:]
    level = np.ptp(behind) <= max(averages.drop, NOISE * averages.noise)
    begin = begin_of_rise(force, slips[0].peak)
    rise = peaks[0] - at[begin]
    longest = np.diff(peaks).max() if len(slips) > 1 else rise
    return bool(level and at[-1] - peaks[-1] > longest)


def find_slips(force: Floats, drop: float) -> list[TraceSlip]:
    """Peaks after which the force falls by at least `drop`, with the least value before it rises by as much again."""
    slips: list[TraceSlip] = []
    high = low = 0
    falling = False
    # With hysteresis: a peak counts once the force has fallen by `drop`, a trough once it has risen by as much.
    for place, value in enumerate(force.tolist()):
        if falling:
            low = place if value < force[low] else low
            if value > force[low] + drop:
                slips.append(TraceSlip(high, low, ended=True))
                falling, high = False, place
        else:
            high = place if value > force[high] else high
            if value < force[high] - drop:
                falling, low = True, place
    return [*slips, TraceSlip(high, low, ended=False)] if falling else slips


def is_turned(at: Floats, slips: Sequence[TraceSlip]) -> bool:
    """True if the force falls more slowly than it rises. In stick-slip the slip is the shorter part."""
    # The last slip may not have ended.
    falls = sum(at[slip.trough] - at[slip.peak] for slip in slips[:-1])
    neighbours = pairwise(slips)
    rises = sum(at[after.peak] - at[slip.trough] for slip, after in neighbours)
    return bool(falls > 1.5 * rises)


def begin_of_rise(force: Floats, high: int) -> int:
    """The sample from which the force rises to that of the first peak: before, a stage may be at rest."""
    smooth = np.maximum.accumulate(force[:high])
    tenth = 0.9 * force[0] + 0.1 * force[high]
    rises = int(np.searchsorted(smooth, tenth))
    return min(rises, high - 1)


def rise_rate(at: Floats, force: Floats, low: int, high: int) -> float:
    """Rate of the force in the middle of its rise between two samples."""
    if low == 0:
        low = begin_of_rise(force, high)
    # Without a fifth at each end: there the pin may creep before it slips, or ring after it.
    margin = (high - low) // 5
    middle = slice(low + margin, high - margin + 1)
    slope, _ = np.polyfit(at[middle] - at[low], force[middle], 1)
    return float(slope)


def top_of_ramp(force: Floats, level: float) -> int:
    """The sample at which the force first comes to 0.9 of the level on which it slides; 0 if the trace begins near it."""
    top = int(np.argmax(force >= 0.9 * level))
    return top if force[0] < 0.5 * level and top > FEWEST else 0


def ramp(at: Floats, force: Floats, level: float) -> list[float]:
    """Rate of the force's rise before steady sliding; empty if the trace begins there, or has a gap."""
    top = top_of_ramp(force, level)
    if not top or _has_gap_in_ramp(at, force, top):
        return []
    return [rise_rate(at, force, 0, top)]


def _has_gap_in_ramp(at: Floats, force: Floats, top: int) -> bool:
    low = begin_of_rise(force, top)
    gaps = find_gaps(at, float(at[top] - at[low]))
    return bool(gaps[low:top].any())


FASTER_THAN_PULL: Final = 1.5
"""Rate of a rise over that of the first pull from which on it is none of friction: both are k·V, to a few percent."""


def ring_width(trace: Trace, averages: Averaged) -> int:
    """Samples (before averaging) in a period of a force cell that rings; 0 if none does.

    While a pin sticks the force rises by k·V, while it slides by k·(V - v): what rises faster than the first pull does, time and
    again, is no friction.
    """
    at, force = averages.trace.at, averages.trace.force
    slips = averages.slips
    pulled = ramp(at, force, float(np.median(force)))
    if len(slips) <= FEWEST or not pulled or not pulled[0] > 0.0:
        return 0
    troughs = [slip.trough for slip in slips[:-1]]
    peaks = [slip.peak for slip in slips]
    raised = force[peaks[1:]] - force[troughs]
    rises = raised / (at[peaks[1:]] - at[troughs])
    if not np.median(rises) > FASTER_THAN_PULL * pulled[0]:
        return 0
    period = round(float(np.median(np.diff(peaks))))
    width = period * averages.width
    return width if len(trace.at) // width >= FEWEST_POINTS else 0


ONE_SIGMA: Final = float(scipy.special.ndtr(1.0))
"""Probability of less than one standard deviation above the mean."""
_ON_LINE: Final = 5
"""Fewest samples of a line whose scatter is to be known."""


class Breakaway(NamedTuple):
    """Force at which a pin breaks away from its first stick, its standard error, and the sample after it."""

    force: float
    error: float
    sample: int


def breakaway(at: Floats, force: Floats, level: float) -> Breakaway | None:
    """The force at the end of the ramp before steady sliding, where it is above the level of sliding; None where it is not,
    or where a gap may hide it.

    Single samples of it are lost in noise. So it is where two lines fit best, near where means fall most, and the line through
    the eighth of the ramp before, taken there. It is above the level if by five standard deviations of such means.
    """
    top = top_of_ramp(force, level)
    if not top:
        return None
    low = begin_of_rise(force, top)
    width = max(_ON_LINE, (top - low) // 16)
    sums = np.concatenate(([0.0], np.cumsum(force)))
    ramp_length = top - low
    last = min(top + ramp_length, len(force) - width)
    after = np.arange(top, last)
    if 2 * width > ramp_length or not len(after):
        return None
    if find_gaps(at, float(at[top] - at[low]))[low : top + ramp_length].any():
        return None
    # Sum of `width` samples before each place, less that of as many after it.
    falls = 2.0 * sums[after] - sums[after - width] - sums[after + width]
    steepest = int(after[np.argmax(falls)])
    sample = _sample_of_break(at, force, steepest, width)
    before = slice(sample - 2 * width, sample)
    # Times since the break: the constant of the line is then the force there, and its error that of the force.
    middle = at[sample - 1 : sample + 1].mean()
    time = at[before] - middle
    line, scatter = np.polyfit(time, force[before], 1, cov=True)
    slides = force[sample + width :]
    length = len(slides) // width * width
    means = slides[:length].reshape(-1, width).mean(axis=1)
    spread = math.inf
    if len(means) > FEWEST:
        spread = float(means.std(ddof=1))
    # A line through 2·width samples has two numbers of its own: Student's t with 2·width - 2 degrees of freedom.
    quantile = float(scipy.special.stdtrit(2 * width - 2, ONE_SIGMA))
    scattered = math.sqrt(scatter[1, 1]) * quantile
    step = line[0] * (at[sample] - at[sample - 1])
    error = math.hypot(scattered, step / math.sqrt(12.0))  # anywhere between samples
    least = NOISE / 2.0 * math.hypot(spread, error)
    above = line[1] - level > least
    return Breakaway(float(line[1]), error, sample) if above else None


def _sample_of_break(at: Floats, force: Floats, about: int, width: int) -> int:
    """The first sample of the second of two lines that fit the force best, within `width` samples of a given
    sample."""

    def misfit(sample: int) -> float:
        end = min(about + 2 * width, len(force))
        edges = (about - 2 * width, sample, end)
        misses = []
        for first, last in pairwise(edges):
            time = at[first:last] - at[about]
            forces = force[first:last]
            _, squares, *_ = np.polyfit(time, forces, 1, full=True)
            misses.append(float(squares.sum()))
        return sum(misses)

    # Three samples at least are behind the break: a line through two leaves no misfit.
    end = min(about + width, len(force) - 3)
    return min(range(about - width + 1, end), key=misfit)


class Stroke(NamedTuple):
    """Samples of a stroke, from the sign's change to the last one before it turns; and the sign of its force."""

    first: int
    last: int
    sign: float


def cut_strokes(trace: Trace, middle: float, swing: float) -> list[Stroke]:
    """Strokes of a force of both signs, cut where it passes the middle, and at gaps that hide a stroke; `swing` is half its
    usual range."""
    force = trace.force
    below = np.where(force < middle - swing / 2.0, -1, 0)
    sides = np.where(force > middle + swing / 2.0, 1, below)
    decided = np.flatnonzero(sides)  # so noise at the middle turns nothing
    turns = decided[1:][np.diff(sides[decided]) != 0]
    passed = []
    for turn in turns:
        on_other_side = (force[:turn] - middle) * sides[turn] <= 0.0
        before = np.flatnonzero(on_other_side)
        passed.append(int(before[-1]) + 1)
    cuts = sorted({0, *passed, *_behind_hidden_strokes(trace.at, [0, *passed, len(force)]), len(force)})
    strokes = []
    for first, turn in pairwise(cuts):
        within = decided[(decided >= first) & (decided < turn)]
        if not len(within):
            continue
        sign = float(sides[within[0]])
        forces = sign * (force[first:turn] - middle)
        # Behind the last force as large as the median the stage turns, and the spring is released.
        large = np.flatnonzero(forces >= np.median(forces))
        last = int(large[-1])
        strokes.append(Stroke(first, first + last + 1, sign))
    long = [stroke for stroke in strokes if stroke.last - stroke.first >= FEWEST_POINTS]
    # The rest of a stroke behind a gap may have one force alone, of which nothing is known.
    return [stroke for stroke in long if np.ptp(force[stroke.first : stroke.last]) > 0.0]


def _behind_hidden_strokes(at: Floats, cuts: Sequence[int]) -> list[int]:
    """First samples after gaps that last as long as the longest stroke without one: part of a stroke is shorter."""
    lasts = [float(at[last - 1] - at[first]) for first, last in pairwise(cuts)]
    gaps = find_gaps(at, float(np.median(lasts)))
    is_recorded = [not gaps[first : last - 1].any() for first, last in pairwise(cuts)]
    longest = max(compress(lasts, is_recorded), default=math.inf)
    hiding = gaps & (np.diff(at) >= longest)
    return [int(step) + 1 for step in np.flatnonzero(hiding)]


def cut_at_middle(trace: Trace) -> tuple[float, list[Stroke]]:
    """The middle of a force of both signs, and its strokes."""
    force = trace.force
    high = float(np.median(force[force > 0.0]))
    low = float(np.median(force[force < 0.0]))
    middle = (high + low) / 2.0
    return middle, cut_strokes(trace, middle, (high - low) / 2.0)
