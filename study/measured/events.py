"""Events of a measured force: each fall, and the distributions of falls by the functions for computed records."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import compress, pairwise
from typing import Final, NamedTuple

import numpy as np

from nanoslip.solver.arrays import Floats
from nanoslip.solver.sliding.sizes import rank_correlation, size_distribution
from nanoslip.study.measured.columns import rows_as_csv
from nanoslip.study.measured.means import Measured, mean_with_error
from nanoslip.study.measured.recording import NOISE, Trace, is_two_way
from nanoslip.study.measured.slips import (
    FASTER_THAN_PULL,
    Averaged,
    TraceSlip,
    cut_at_middle,
    find_slips,
    narrowest_means,
    rise_rate,
)

BATCHES: Final = 8
"""Batches of successive events of a trace for the ± of an exponent: each is left out once. As many as an ensemble has members."""
ON_LINE: Final = 8
"""Most samples of the line that gives the force before and after a fall: single extremes are too far apart by noise."""


@dataclass(frozen=True, slots=True, eq=False)
class TraceEvents:
    """Events of a trace, arrays (e,). at: begin of the fall, in s or m. force: before it. drop: fall of the force.

    recurrence: s or m since the event before, NaN of the first one of a stroke. step: to the next event, NaN of the last one.
    rise: rate of the force's rise before the fall.
    """

    at: Floats
    force: Floats
    drop: Floats
    recurrence: Floats
    step: Floats
    rise: Floats

    def columns(self) -> tuple[Floats, ...]:
        """All columns, in their order."""
        return self.at, self.force, self.drop, self.recurrence, self.step, self.rise


def find_events(trace: Trace) -> TraceEvents:
    """All falls of a force that exceed its noise and end in a rise; strokes to and fro are searched one by one."""
    parts = [_events_of_pull(part) for part in _pulls(trace)]
    return TraceEvents(*np.concatenate(parts, axis=1))


def _pulls(trace: Trace) -> Iterator[Trace]:
    """The trace, or its strokes of both signs with a force above zero."""
    if not is_two_way(trace.force):
        yield trace
        return
    middle, strokes = cut_at_middle(trace)
    for stroke in strokes:
        yield trace.part(stroke.first, stroke.last, stroke.sign, middle)


def _events_of_pull(trace: Trace) -> Floats:
    """Numbers of the events of a pull (6, e), in the order of TraceEvents."""
    averages = narrowest_means(trace)
    at, force = averages.trace.at, averages.trace.force
    slips, rises = _drop_rings(averages)
    peaks = [slip.peak for slip in slips]
    troughs = [slip.trough for slip in slips]
    lows, highs = [0, *troughs], [*peaks, len(force) - 1]
    rising = zip(lows, peaks, strict=False)
    before = [_peak_force(at, force, low, peak) for low, peak in rising]
    rising_again = zip(troughs, highs[1:], strict=True)
    behind = [_trough_force(at, force, trough, high) for trough, high in rising_again]
    begins = at[peaks] if peaks else np.empty(0)
    apart = np.diff(begins)
    apart[[averages.has_gap(peak, following) for peak, following in pairwise(peaks)]] = math.nan
    drops = np.array(before) - np.array(behind)
    # Without an event there is no interval either: the lone NaN is cut off.
    recurrence = np.append(math.nan, apart)[: len(begins)]
    step = np.append(apart, math.nan)
    step = step[len(step) - len(begins) :]
    return np.array([begins, before, drops, recurrence, step, rises])


def _drop_rings(averages: Averaged) -> tuple[list[TraceSlip], list[float]]:
    """Falls beyond noise that end in a rise, and the rates at which the force rose before them.

    A fall across a gap is of unknown size, and none; the rate of a rise across one is NaN.
    Before a fall the force rises by k·V, or by less if the pin slides. What rises faster is the ringing of the fall before, and
    no event. k·V is the rate of most of the time.
    """
    at, force = averages.trace.at, averages.trace.force
    ended = [slip for slip in find_slips(force, NOISE * averages.noise) if slip.peak > 0 and slip.ended]
    lows = [0, *(slip.trough for slip in ended)]
    is_complete = [not averages.has_gap(slip.peak, slip.trough) for slip in ended]
    complete = list(compress(ended, is_complete))
    if not complete:
        return [], []
    lows = list(compress(lows, is_complete))
    rises = np.array([rise_rate(at, force, low, slip.peak) for low, slip in zip(lows, complete, strict=False)])
    lasts = np.array([at[slip.peak] - at[low] for low, slip in zip(lows, complete, strict=False)])
    gaps = np.array([averages.has_gap(low, slip.peak) for low, slip in zip(lows, complete, strict=False)])
    lasts[gaps & ~gaps.all()] = 0.0  # they tell nothing beside others
    order = np.argsort(rises)
    passed = np.cumsum(lasts[order])
    half = np.searchsorted(passed, lasts.sum() / 2.0)
    usual = float(rises[order][half])
    kept = np.flatnonzero((rises <= FASTER_THAN_PULL * usual) | gaps)
    rises[gaps] = math.nan
    return [complete[place] for place in kept], rises[kept].tolist()


def _peak_force(at: Floats, force: Floats, low: int, peak: int) -> float:
    """Force at a peak, on a line through samples up to it, of the later half of the rise."""
    first = max(low + (peak - low) // 2, peak - ON_LINE + 1)
    samples = slice(first, peak + 1)
    return _fit_force(at[samples], force[samples], float(at[peak]))


def _trough_force(at: Floats, force: Floats, trough: int, high: int) -> float:
    """Force at a trough, on a line through samples from it on, of the earlier half of the rise."""
    last = min(trough + (high - trough) // 2, trough + ON_LINE - 1)
    samples = slice(trough, last + 1)
    return _fit_force(at[samples], force[samples], float(at[trough]))


def _fit_force(at: Floats, force: Floats, place: float) -> float:
    if len(at) == 1:
        return float(force.mean())
    if len(at) < 3:
        return float(np.interp(place, at, force))
    # Times since the place: the constant of the line is then the force there.
    line = np.polyfit(at - place, force, 1)
    return float(line[1])


def event_numbers(events: Sequence[TraceEvents], unit: str, over: str) -> dict[str, Measured]:
    """Numbers of the distributions of drops, and of steps from drop to drop, by the names that a dataset has for them.

    events: of each trace; traces are the members of an ensemble, and a single trace is divided into batches. The ± of an
    exponent comes from leaving out one member at a time, the ± of a correlation is the standard error for independent events.
    """
    members = list(events) if len(events) > 1 else _batches(events[0])
    count = sum(len(of_trace.drop) for of_trace in events)
    numbers = {"sized_events": Measured(float(count), math.nan, 0)}
    place = "s" if over == "time" else "m"
    numbers |= _size_numbers("drop", [member.drop for member in members], unit)
    numbers |= _size_numbers("step", [member.step for member in members], place)
    steps = np.concatenate([of_trace.step for of_trace in events])
    finite = steps[np.isfinite(steps)]
    if len(finite) > 1:
        variation = float(finite.std() / finite.mean())
        numbers["step_variation"] = Measured(variation, math.nan, len(finite))
    # Pairs within each trace: the last event of one file is no neighbour of the first of the next.
    pairs = {
        "drop_correlation": [(of_trace.drop[:-1], of_trace.drop[1:]) for of_trace in events],
        "step_correlation": [(of_trace.step[:-1], of_trace.step[1:]) for of_trace in events],
        "drop_step_correlation": [(of_trace.drop, of_trace.step) for of_trace in events],
    }
    for name, columns in pairs.items():
        firsts, seconds = zip(*columns, strict=True)
        first, second = np.concatenate(firsts), np.concatenate(seconds)
        both = np.isfinite(first) & np.isfinite(second)
        count = int(both.sum())
        value = rank_correlation(first, second)
        if math.isfinite(value):
            # Of m independent pairs it is 0 with a standard error of 1/√(m - 1).
            error = 1.0 / math.sqrt(count - 1.0)
            numbers[name] = Measured(value, error, count)
    return numbers


def _batches(events: TraceEvents) -> list[TraceEvents]:
    columns = [np.array_split(column, BATCHES) for column in events.columns()]
    return [TraceEvents(*batch) for batch in zip(*columns, strict=True)]


def _size_numbers(name: str, members: Sequence[Floats], unit: str) -> dict[str, Measured]:
    """Mean, largest, and the power law of sizes, if there are enough."""
    sizes = size_distribution(*members, discrete=False)
    if not sizes.count:
        return {}
    largest = Measured(sizes.largest, math.nan, 0, unit)
    finite = _finite_part(np.concatenate(members))
    numbers = {f"{name}_mean": mean_with_error(finite, unit), f"{name}_largest": largest}
    if math.isfinite(sizes.exponent):
        numbers[f"{name}_exponent"] = Measured(sizes.exponent, sizes.exponent_uncertainty, sizes.tail)
        numbers[f"{name}_cutoff"] = Measured(sizes.cutoff, math.nan, 0, unit)
        numbers[f"{name}_goodness"] = Measured(sizes.goodness, math.nan, 0)
    return numbers


def _finite_part(values: Floats) -> Floats:
    return values[np.isfinite(values)]


class EventUnits(NamedTuple):
    """Units of the columns of events, and the factor from rates of rise to stiffness, which is over the way if it is known."""

    force: str
    place: str
    stiffness: str
    per_rate: float

    @classmethod
    def from_trace(cls, trace: Trace, load: float, velocity: float) -> "EventUnits":
        """Units of a trace whose force is over `load` (N) if that is known, of a stage with this velocity (m/s) if that is.

        A rise is in N if the load is known, so that it is a stiffness.
        """
        newtons = load if math.isfinite(load) else 1.0
        force = "N" if trace.unit == "N" or math.isfinite(load) else "1"
        if trace.over == "displacement":
            return cls(trace.unit, "m", f"{force}/m", newtons)
        if math.isfinite(velocity):
            return cls(trace.unit, "s", f"{force}/m", newtons / velocity)
        return cls(trace.unit, "s", f"{force}/s", newtons)


def events_as_csv(events: Mapping[str, TraceEvents], units: Mapping[str, EventUnits]) -> str:
    """Events of each file as CSV: a row for each, in units of the header. Files with other units have their own header."""
    rows: list[Sequence[object]] = []
    header: Sequence[object] = ()
    for file, file_events in events.items():
        unit = units[file]
        of_force = "" if unit.force == "1" else f" [{unit.force}]"
        begins = "time" if unit.place == "s" else "displacement"
        needed = (
            "file",
            f"{begins} [{unit.place}]",
            f"force before{of_force}",
            f"drop{of_force}",
            f"recurrence [{unit.place}]",
            f"stiffness [{unit.stiffness}]",
        )
        if needed != header:
            header = needed
            rows.append(header)
        stiffness = file_events.rise * unit.per_rate
        columns = (file_events.at, file_events.force, file_events.drop, file_events.recurrence, stiffness)
        for numbers in zip(*columns, strict=True):
            cells = ["" if math.isnan(number) else f"{number:.9g}" for number in numbers]
            rows.append([file, *cells])
    return rows_as_csv(rows)
