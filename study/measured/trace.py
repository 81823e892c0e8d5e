"""A force that a laboratory measured while a stage pulled a pin: friction, period and stiffness, by Eq. 16-19.

While the pin sticks, the force y rises by r = k·V a second; while it slides, y'' + 2ζω y' + ω² y = ω² F, with rate r at both
ends. So k, V and the mass need not be known. Each cycle is fitted alone; the ± is their scatter (`nanoslip.solver.ensemble`).
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np
import scipy

from nanoslip.solver.arrays import Floats
from nanoslip.solver.dynamics.coefficients import LARGEST_CHANGE, SIGNIFICANT_CHANGE
from nanoslip.solver.ensemble import FEWEST
from nanoslip.solver.outcome import InvalidInput
from nanoslip.study.measured.cycles import RESOLVED, Cycle, FittedCycles, fit_cycles, ring_down
from nanoslip.study.measured.loops import FEW_TIMES, MIDDLE, SLIDES_FROM, Loops, coverage_factor, measure_loops
from nanoslip.study.measured.means import (
    VALUE_BATCHES,
    Measured,
    has_correlation,
    mean_of_cycles,
    mean_with_error,
    steady_mean,
)
from nanoslip.study.measured.over_load import friction_over_load, has_changing_load
from nanoslip.study.measured.recording import FEWEST_POINTS, NOISE, Limits, Trace, is_two_way, limits
from nanoslip.study.measured.slips import (
    Averaged,
    Stroke,
    TraceSlip,
    begin_of_rise,
    breakaway,
    cut_at_middle,
    end_of_pull,
    is_turned,
    keeps_sliding,
    narrowest_means,
    ramp,
    ring_width,
    rise_rate,
)


class Amount(NamedTuple):
    """Number with its SI unit."""

    value: float
    unit: str


class TraceFlag(NamedTuple):
    """Fact that a reader of the numbers should know, by name, and the numbers that it concerns."""

    name: str
    facts: dict[str, float | Amount]


class StrokeSpan(NamedTuple):
    """Begin and end of a stroke (s or m), and the sign of its force."""

    start: float
    end: float
    sign: float


@dataclass(frozen=True, slots=True, eq=False)
class TraceNumbers:
    """Numbers of a trace by the name that they have in a dataset, the fitted cycles, and facts on the answer by name."""

    numbers: dict[str, Measured]
    cycles: tuple[Cycle, ...]
    flags: tuple[TraceFlag, ...]
    offset: float = 0.0
    """Force that was subtracted, at the first sample."""
    drift: float = 0.0
    """Rate of a force that was subtracted, too, from the first sample on."""
    spans: tuple[StrokeSpan, ...] = ()
    loops: Loops | None = None

    @property
    def flagged(self) -> tuple[str, ...]:
        """Names of the flags."""
        return tuple(flag.name for flag in self.flags)


OF_PLACES: Final = ("pull_ends", "slides", "no_stick_slip", "offset")
"""Flags of a single pull that are meaningless for several strokes."""


FRICTIONS: Final = {"static_friction", "kinetic_friction", "mean_force"}
SILENCING: Final = {"turned", "unsteady", "sensor_limit", "nothing_slides"}
"""Flags that say why there is no friction."""


class _Pull(NamedTuple):
    """Facts of a measurement beside its trace: unit of its forces, newtons per unit, load, velocity and damping."""

    unit: str
    newtons: float
    load: float
    velocity: float
    damping: float | None
    rig: float = math.inf


def measure_trace(
    trace: Trace,
    load: float = math.nan,
    velocity: float = math.nan,
    damping: float | None = None,
    rig: float = math.inf,
) -> TraceNumbers:
    """Friction, period, amplitude and stiffness of a trace; also loop numbers if the trace has positions of a stage
    that turns.

    load: in N, which makes coefficients of forces. velocity: of the stage, in m/s. damping: ζ of the machine; None to
        fit it.
    rig: stiffness of the machine between the stage and the contact, in N/m. Raises InvalidInput for a stress without
        its load.
    """
    if trace.unit == "Pa":
        need = "the column of the normal stress, whose ratio is the friction coefficient; or times the area of contact, as N"
        raise InvalidInput(f"force = a shear stress: needs {need}")
    # Under a load that rises, friction is the slope of force over load: an adhesive contact has an intercept, too.
    if trace.unit == "N" and math.isnan(load) and trace.load is not None and has_changing_load(trace.load):
        return _load_line_numbers(trace, trace.load)
    # With a known load all that follows is over it, as computed numbers are; else forces stay in their unit.
    has_load = math.isfinite(load)
    per = load if trace.unit == "N" and has_load else 1.0
    newtons = load if has_load else 1.0
    unit = "1" if has_load else trace.unit
    pull = _Pull(unit, newtons, load, velocity, damping, rig)
    trace = replace(trace, force=trace.force / per)
    if is_two_way(trace.force):
        return _stroke_numbers(trace, pull)
    return _pull_numbers(trace, pull)


def _load_line_numbers(trace: Trace, load: Floats) -> TraceNumbers:
    """Friction over a load that changes. Raises InvalidInput of strokes of both signs, which need a load of their own each."""
    loads = np.abs(load)
    low = float(loads.min())
    high = float(loads.max())
    if is_two_way(trace.force):
        raise InvalidInput(
            f"normal load = {low:.4g} to {high:.4g} N: needs one load for strokes of both signs; --from, --to"
        )
    flag = TraceFlag("load_changes", {"low": Amount(low, "N"), "high": Amount(high, "N")})
    return TraceNumbers(friction_over_load(load, trace.force), (), (flag,))


def _stroke_numbers(trace: Trace, pull: _Pull) -> TraceNumbers:
    """Numbers of strokes of both signs: friction is half their difference, the offset half their sum, ± over strokes.

    A drift of the force cell is subtracted if it is beyond three of its standard errors.
    """
    middle, strokes = cut_at_middle(trace)
    drift = common_drift(trace, strokes)
    flags = [TraceFlag("strokes", {"strokes": len(strokes)})]
    numbers: dict[str, Measured] = {}
    rate = 0.0
    if math.isfinite(drift.uncertainty) and abs(drift.value) > SIGNIFICANT_DRIFT * drift.uncertainty:
        rate = drift.value
        trace = trace.subtract(0.0, rate)
        middle, strokes = cut_at_middle(trace)
        unit = _rate_unit(trace, pull)
        numbers["force_drift"] = drift._replace(unit=unit)
        few = "few_" if len(strokes) == 2 else ""
        flags.append(TraceFlag(f"{few}strokes_drift", {"rate": Amount(rate, unit)}))
    parts = [trace.part(stroke.first, stroke.last, stroke.sign, middle) for stroke in strokes]
    numbers_of_parts = [_pull_numbers(part, pull) for part in parts]
    names: dict[str, str] = {}
    for part_numbers in numbers_of_parts:
        names |= {name: number.unit for name, number in part_numbers.numbers.items()}
    means = {}
    for name, unit in names.items():
        having = [part_numbers.numbers for part_numbers in numbers_of_parts if name in part_numbers.numbers]
        values = [of_stroke[name].value for of_stroke in having]
        means[name] = mean_with_error(values, unit)
    numbers = means | numbers
    level = "mean_force" if "mean_force" in names else "kinetic_friction"
    ways: dict[float, list[float]] = {1.0: [], -1.0: []}
    for part_numbers, stroke in zip(numbers_of_parts, strokes, strict=True):
        if level in part_numbers.numbers:
            ways[stroke.sign].append(part_numbers.numbers[level].value)
    # Neighbours there and back: over a whole record the offset may drift, from one stroke to the next it does not.
    pairs = zip(ways[1.0], ways[-1.0], strict=False)
    halves = [middle + (forth - back) / 2.0 for forth, back in pairs]
    offset = middle
    if halves:
        numbers["force_offset"] = mean_with_error(halves, pull.unit)
        offset = float(np.mean(halves))
    flags_of_parts = [flag for part_numbers in numbers_of_parts for flag in part_numbers.flags]
    unlike = {flag.name: flag for flag in flags_of_parts if flag.name not in OF_PLACES}
    loops = _measure_stage(trace, offset, pull)
    state = loops.state if loops else None
    elastic = not FRICTIONS & numbers.keys() and _is_triangle(trace.force - offset)
    if (elastic and state != "slides") or state in ("partial_slip", "sticks"):
        largest = float(np.abs(trace.force - offset).max())
        flags.append(TraceFlag("nothing_slides", {"force": Amount(largest, pull.unit)}))
        # Friction of what never slides would be that of the stage's turn.
        numbers = {name: numbers[name] for name in ("force_drift", "force_offset") if name in numbers}
        unlike = {}
    if loops:
        numbers |= loops.numbers
    flags += _loop_flags(trace, loops)
    flags += unlike.values()
    spans = tuple(StrokeSpan(trace.at[cut.first], trace.at[cut.last - 1], cut.sign) for cut in strokes)
    return TraceNumbers(numbers, (), tuple(flags), offset, rate, spans, loops)


def _measure_stage(trace: Trace, offset: float, pull: _Pull) -> Loops | None:
    """Loops of a trace with positions that turn; None without, or without a whole cycle."""
    if trace.position is None:
        return None
    newtons = trace.mean_load
    if math.isnan(newtons):
        newtons = 1.0 if trace.unit == "N" and math.isnan(pull.load) else pull.load
    return measure_loops(trace.position, trace.force - offset, pull.unit, newtons, pull.rig, trace.at)


def _loop_flags(trace: Trace, loops: Loops | None) -> Iterator[TraceFlag]:
    if loops is None:
        if trace.position is not None:
            yield TraceFlag("no_whole_cycle", {})
        return
    if loops.state:
        ratio = loops.numbers["energy_ratio"].value
        yield TraceFlag(f"loop_{loops.state}", {"ratio": ratio, "least": SLIDES_FROM})
    factor = coverage_factor(loops.freedom)
    if factor > FEW_TIMES:
        facts: dict[str, float | Amount] = {"strokes": len(loops.strokes), "freedom": loops.freedom, "factor": factor}
        yield TraceFlag("few_strokes", facts)
    if loops.stretching > MIDDLE[0]:
        yield TraceFlag("short_stroke", {"share": loops.stretching, "middle": MIDDLE[0]})
    if loops.rigid:
        yield TraceFlag("as_stiff_as_rig", {})
    if loops.begins_at_rest:
        yield TraceFlag("open_loop", {})


SIGNIFICANT_DRIFT: Final = 3.0
"""Standard errors beyond which a slope that strokes have in common is a drift."""


def common_drift(trace: Trace, strokes: Sequence[Stroke]) -> Measured:
    """Rate at which the forces of strokes of both signs grow together.

    It is fitted with friction and offset to means of the force from slip to slip, or over eighths of a stroke without slips. Of
    three strokes and more friction may also change along the way, by position or from turn to turn, which counts as no drift.
    """
    rows: list[tuple[float, float, float, float]] = []
    for stroke in strokes:
        samples = slice(stroke.first, stroke.last)
        at, force = trace.at[samples], trace.force[samples]
        # Without positions the stage is taken to go evenly.
        place = stroke.sign * (at - at.mean())
        if trace.position is not None:
            place = trace.position[samples]
        part = trace.part(stroke.first, stroke.last, stroke.sign)
        for low, high in pairwise(_edges_of_means(part)):
            centre = float(at[low:high].mean())
            along = stroke.sign * float(place[low:high].mean())
            mean = float(force[low:high].mean())
            rows.append((stroke.sign, centre, along, mean))
    signs, centres, along_way, means = np.array(rows).T
    # Friction has the stroke's sign, an offset has none, a drift grows with time.
    columns = [signs, np.ones(len(signs)), centres - trace.at[0]]
    if len(strokes) > 2:
        columns.append(along_way / np.abs(along_way).max())
    terms = np.column_stack(columns)
    free = len(means) - terms.shape[1]
    if free < 1 or len({stroke.sign for stroke in strokes}) < 2:
        return Measured(math.nan, math.nan, 0)
    solved, *_ = np.linalg.lstsq(terms, means)
    residuals = means - terms @ solved
    scatter = float(np.sum(residuals**2)) / free
    inverse = np.linalg.inv(terms.T @ terms)
    error = math.sqrt(scatter * float(inverse[2, 2]))
    return Measured(float(solved[2]), error, len(means))


def _edges_of_means(stroke: Trace) -> list[int]:
    """Samples between which a stroke's force is averaged: its slips, or eighths of the part that slides."""
    averages = narrowest_means(stroke)
    peaks = [slip.peak * averages.width for slip in averages.slips]
    if len(peaks) > FEWEST:
        return peaks
    median = np.median(stroke.force)
    first = int(np.argmax(stroke.force >= median))
    edges = np.linspace(first, len(stroke.force), 9)
    return [int(edge) for edge in edges]


def _is_triangle(force: Floats) -> bool:
    """True if the force is near its extremes no longer than an elastic force that follows the stage. A triangle is
    near them for a fifth of the time, a sine for two fifths, and strokes that slide half of their time for three
    fifths.
    """
    size = np.abs(force)
    high = float(np.quantile(size, 0.99))  # a spike is no extreme
    near = size > 0.8 * high
    return bool(np.mean(near) < 0.5)


def _pull_numbers(trace: Trace, pull: _Pull) -> TraceNumbers:
    """Numbers of a single pull. The part after its end is left out."""
    averages = narrowest_means(trace)
    if width := ring_width(trace, averages):
        return _ringing_numbers(trace, width, pull)
    end = end_of_pull(averages)
    if end * averages.width < FEWEST_POINTS:
        return _numbers_of_means(trace, averages, pull)
    earlier = _pull_numbers(trace.part(0, end * averages.width), pull)
    last_trough = averages.slips[-1].trough
    level = float(np.median(averages.trace.force[last_trough:]))
    at = float(averages.trace.at[end])
    facts: dict[str, float | Amount] = {"at": Amount(at, _place_unit(trace)), "level": Amount(level, pull.unit)}
    ends = TraceFlag("pull_ends", facts)
    return replace(earlier, flags=(ends, *earlier.flags))


def _ringing_numbers(trace: Trace, width: int, pull: _Pull) -> TraceNumbers:
    """Numbers of a pull whose force cell rings, from means over its period of `width` samples.

    Where in a period the pin breaks away is not known: ± of μ_s has what the force rises in one. Means over a period hide how far
    the force falls, and how fast: these have no ±.
    """
    averaged = _pull_numbers(trace.average(width), pull)
    period = width * float(np.median(np.diff(trace.at)))
    numbers = dict(averaged.numbers)
    if static := numbers.get("static_friction"):
        rates = ramp(trace.at, trace.force, float(np.median(trace.force)))
        uncertainty = math.hypot(static.uncertainty, rates[0] * period) if rates else math.nan
        numbers["static_friction"] = static._replace(uncertainty=uncertainty)
    for name in numbers.keys() & {"spring_force_amplitude", "natural_period", "damping_ratio"}:
        numbers[name] = numbers[name]._replace(uncertainty=math.nan)
    flag = TraceFlag("cell_rings", {"period": Amount(period, _place_unit(trace))})
    return replace(averaged, numbers=numbers, flags=(flag, *averaged.flags))


def _numbers_of_means(trace: Trace, averages: Averaged, pull: _Pull) -> TraceNumbers:
    at, force, slips = averages.trace.at, averages.trace.force, averages.slips
    cut, flags = limits(trace.force), list(_noise_flags(averages, pull))
    if backward := is_turned(at, slips):
        flags.append(TraceFlag("turned", {}))
        slips = []
    slides = keeps_sliding(averages._replace(slips=slips))
    lows = [0, *(slip.trough for slip in slips)]  # where the force begins to rise
    rates = [
        math.nan if averages.has_gap(low, slip.peak) else rise_rate(at, force, low, slip.peak)
        for low, slip in zip(lows, slips, strict=False)
    ]
    highs = [*(slip.peak for slip in slips[1:]), len(at) - 1]  # where it has risen again
    is_complete = [not averages.has_gap(low, high) for low, high in zip(lows, highs, strict=False)]
    whole_slips: list[int] = []
    if not slides:
        whole_slips = [number for number, slip in enumerate(slips) if slip.ended and is_complete[number]]
    fitted = fit_cycles(averages, whole_slips, rates, pull.damping)
    cycles = tuple(fitted.cycles)
    numbers: dict[str, Measured] = {}
    if cycles:
        numbers = _cycle_numbers(fitted, pull.unit, "s" if trace.over == "time" else "m")
        begins = [cycle.start for cycle in cycles]
        numbers |= mean_of_cycles(at, force, begins, pull.unit, fitted.together())
    elif whole_slips:
        numbers = _sample_numbers(at, force, {number: slips[number] for number in whole_slips}, pull.unit, trace.over)
    flags += _fit_flags(averages, fitted, pull)
    if slides and not backward:
        numbers |= _sliding(trace, averages._replace(slips=slips), pull, flags)
        rates = rates[:1] or ramp(at, force, float(np.median(force)))
        if len(slips) > FEWEST and _decays(force, slips):
            numbers.pop("static_friction", None)
            rates = []
            peaks = [slip.peak for slip in slips]
            level = float(np.median(force[peaks[-1] :]))
            ringing = ring_down(at, force, begin_of_rise(force, peaks[0]), peaks, level)
            peak = float(force[peaks[0]])
            # The first peak has the inertia of a pin that overshoots: it is shown, and is no friction.
            flags.append(TraceFlag("inertia", {"peak": Amount(peak, pull.unit)}))
            if ringing:
                numbers["static_friction"] = Measured(*ringing, 1, pull.unit)
                broken = min(ringing.force, peak)
                breaks = int(np.argmax(force >= broken))
                rates = [rise_rate(at, force, 0, breaks)] if breaks > FEWEST else []
    # The first rise is from rest, where a stage may still speed up: others are better, if there are any.
    slopes = pull.newtons * np.array(rates[1:] or rates)
    slopes = slopes[np.isfinite(slopes)]
    if len(slopes):
        numbers |= _stiffness(trace, slopes, pull.velocity, pull.load)
    if any(cut):
        peaks_of_slips = np.array(
            [force[slip.peak] for slip, is_known in zip(slips, is_complete, strict=False) if is_known]
        )
        numbers = _numbers_within_limits(numbers, cut, peaks_of_slips, pull.unit)
        # Of a force that is cut off, other facts are facts of the cut.
        flags = [TraceFlag("sensor_limit", {"low": cut.low, "high": cut.high})]
    names_of_flags = {flag.name for flag in flags}
    if not (FRICTIONS & numbers.keys() or SILENCING & names_of_flags):
        flags.append(TraceFlag("no_friction", {}))
    return TraceNumbers(numbers, () if any(cut) else cycles, tuple(flags))


def _decays(force: Floats, slips: Sequence[TraceSlip]) -> bool:
    """True if each peak is below the peak before: a pin that slides on and rings, and does not stick again."""
    peaks = force[[slip.peak for slip in slips]]
    return bool((np.diff(peaks) < 0.0).all())


def _numbers_within_limits(numbers: dict[str, Measured], cut: Limits, peaks: Floats, unit: str) -> dict[str, Measured]:
    """The numbers that do not need the forces beyond a sensor's limit; μ_s is then the mean of the largest samples."""
    # Times of slips need no force: those of the peaks are known even if their heights are not.
    kept = {name: numbers[name] for name in ("stick_slip_period",) if name in numbers}
    if cut.high or not len(peaks):
        return kept
    return {"static_friction": mean_with_error(peaks, unit), **kept}


def _sample_numbers(
    at: Floats, force: Floats, slips: Mapping[int, TraceSlip], unit: str, over: str
) -> dict[str, Measured]:
    """Numbers of slips that Eq. 16-19 do not fit: their largest and least samples, and their periods.

    slips: by number in the trace; between those that do not follow each other is a gap.
    """
    peaks = [slip.peak for slip in slips.values()]
    troughs = [slip.trough for slip in slips.values()]
    together = np.diff(list(slips)) == 1
    from_rest = together[0] and 0 in slips if len(together) else False
    periods = np.diff(at[peaks])[together][int(from_rest) :]
    falls = force[peaks] - force[troughs]
    time_unit = "s" if over == "time" else "m"
    numbers = {
        "static_friction": mean_with_error(force[peaks], unit),
        "spring_force_amplitude": mean_with_error(falls, unit),
        "stick_slip_period": mean_with_error(periods, time_unit),
    }
    begins = at[peaks].tolist()
    numbers |= mean_of_cycles(at, force, begins, unit, together)
    return {name: number for name, number in numbers.items() if number.of}


def _sliding(trace: Trace, averages: Averaged, pull: _Pull, flags: list[TraceFlag]) -> dict[str, Measured]:
    """Friction before and in steady sliding, with its flag, or the reason why there is none.

    Kinetic friction μ_k is the mean from the last slip on; static friction μ_s the force of the first.
    """
    slips, whole_trace = averages.slips, averages.trace
    first = slips[-1].peak if slips else 0
    at, force = whole_trace.at[first:], whole_trace.force[first:]
    time = averages.recorded_time()[first:]
    value, start, share = steady_mean(time, force, pull.unit)
    start = float(np.interp(start, time, at))
    # A force that is not steady has no mean: its middle serves to find the break before it.
    level = value.value if not math.isfinite(share) else float(np.median(force))
    static = _breakaway(trace, averages, level, pull.unit)
    if math.isfinite(share):
        flags.append(TraceFlag("unsteady", {"share": share}))
        return static
    period = samples_in_period(force[at >= start])
    if period < RESOLVED:
        flags.append(TraceFlag("undersampled", {"samples": period}))
        return {**static, "mean_force": value}
    name = "slides" if static else "no_stick_slip"
    flags.append(TraceFlag(name, {"from": Amount(start, _place_unit(trace))}))
    return {**static, "kinetic_friction": value}


def _breakaway(trace: Trace, averages: Averaged, level: float, unit: str) -> dict[str, Measured]:
    """Static friction of the first slip before steady sliding: its largest sample if that is clear of noise."""
    slips = averages.slips
    # One slip may be the end of a slow rise, whose top the line through it gives better than a single sample.
    lone = len(slips) < 2 and breakaway(trace.at, trace.force, level)
    if lone and (averages.width > 1 or not slips):
        return {"static_friction": Measured(lone.force, lone.error, 1, unit)}
    if not slips or averages.has_gap(begin_of_rise(averages.trace.force, slips[0].peak), slips[0].trough):
        return {}
    peak = float(averages.trace.force[slips[0].peak])
    return {"static_friction": Measured(peak, averages.noise, 1, unit)}


CHANCE: Final = 1e-3
"""Probability at which white noise has so large a share of its power at one frequency."""


def samples_in_period(force: Floats) -> float:
    """Samples in a period of a force that is not white noise (Fisher, Proc. R. Soc. A 125, 54, 1929); infinite if it is."""
    # Without the mean, which is no oscillation.
    amplitudes = np.fft.rfft(force - force.mean())[1:]
    power = np.abs(amplitudes) ** 2
    if len(power) < 2 or not power.sum() > 0.0:
        return math.inf
    share = power.max() / power.sum()
    # The largest of n exponentially distributed powers exceeds this share of their sum with at most this probability.
    others = len(power) - 1
    by_chance = len(power) * (1.0 - share) ** others
    if not by_chance < CHANCE:
        return math.inf
    return len(force) / (int(power.argmax()) + 1.0)


def _place_unit(trace: Trace) -> str:
    return "s" if trace.over == "time" else "m"


def _rate_unit(trace: Trace, pull: _Pull) -> str:
    """Unit of a force, or coefficient, over time or displacement."""
    force_unit = "" if pull.unit == "1" else f"{pull.unit} "
    return f"{force_unit}{_place_unit(trace)}-1"


def _cycle_numbers(fitted: FittedCycles, unit: str, time: str) -> dict[str, Measured]:
    """Numbers of the chosen cycles. The period omits the time to the second slip, as the first slip starts from rest.

    `fitted.free` are the same cycles, each fitted with an individual damping. An error of the common damping shifts
    all cycles together; it shows in the scatter of the free cycles, so the ± of a mean is taken from them.
    """

    cycles, damping, shared = fitted.cycles, fitted.damping, fitted.estimate_shared_errors()

    def mean(of: Callable[[Cycle], float], unit: str, shared_error: float) -> Measured:
        values = [of(cycle) for cycle in fitted.free or cycles]
        measured_mean = mean_with_error(values, unit)
        value = np.mean([of(cycle) for cycle in cycles])
        # Scatter and the error that all slips share are independent.
        error = math.hypot(measured_mean.uncertainty, shared_error)
        return measured_mean._replace(value=float(value), uncertainty=error)

    together = fitted.together()
    starts = [cycle.start for cycle in cycles]
    # Slips between two chosen ones share the time between these.
    between = np.diff(starts) / np.diff(fitted.chosen)
    periods = between[together]
    if len(periods) > 1 and together[0]:
        periods = periods[1:]
    kinetic, natural = mean_with_error([], unit), mean_with_error([], time)
    if math.isfinite(damping.value):
        kinetic = mean(lambda cycle: cycle.kinetic, unit, shared.kinetic)
    if damping.of:
        shared_period = shared.period * cycles[0].period
        natural = mean(lambda cycle: cycle.period, time, shared_period)
        damping_error = math.hypot(damping.uncertainty, shared.damping)
        damping = damping._replace(uncertainty=damping_error)
    # A fall is 1 + exp(-πζ) times μ_s - μ_k, less than twice.
    of_fall = 2.0 * math.hypot(shared.static, shared.kinetic)
    numbers = {
        "static_friction": mean(lambda cycle: cycle.driving, unit, shared.static),
        "kinetic_friction": kinetic,
        "spring_force_amplitude": mean(lambda cycle: cycle.static - cycle.trough, unit, of_fall),
        "stick_slip_period": mean_with_error(periods, time),
        "natural_period": natural,
        "damping_ratio": damping,
    }
    if fitted.samples < RESOLVED:  # the largest force lies between samples
        numbers["static_friction"] = numbers["static_friction"]._replace(uncertainty=math.nan)
    return {name: number for name, number in numbers.items() if number.of}


def _stiffness(trace: Trace, rates: Floats, velocity: float, load: float) -> dict[str, Measured]:
    """Slope of the force while the pin sticks: over displacement (given by time and velocity), else over time."""
    far = trace.over == "displacement" or math.isfinite(velocity)
    over, per = "s", 1.0
    if far:
        over, per = "m", velocity if trace.over == "time" else 1.0
    force = "N " if trace.unit == "N" or math.isfinite(load) else ""
    name = "rising_stiffness" if far else "rising_rate"
    return {name: mean_with_error(rates / per, f"{force}{over}-1")}


def _noise_flags(averages: Averaged, pull: _Pull) -> Iterator[TraceFlag]:
    """Flags of the samples."""
    force = averages.trace.force
    begins = float(force[0])
    if averages.width > 1:
        yield TraceFlag("averaged", {"width": averages.width})
    if count := int(averages.gaps.sum()):
        longest = float(np.diff(averages.trace.at)[averages.gaps].max())
        yield TraceFlag("gaps", {"count": count, "longest": Amount(longest, _place_unit(averages.trace))})
    if abs(begins) > max(NOISE * averages.noise, 0.02 * float(force.max())):
        yield TraceFlag("offset", {"begins": Amount(begins, pull.unit)})
    if NOISE * averages.noise > averages.drop:
        least = NOISE * averages.noise
        yield TraceFlag("noise", {"least": Amount(least, pull.unit)})


def _fit_flags(averages: Averaged, fitted: FittedCycles, pull: _Pull) -> Iterator[TraceFlag]:
    """Flags of the cycles."""
    cycles = fitted.cycles
    if fitted.unlike:
        name = "unlike_cycles" if cycles else "unlike_model"
        yield TraceFlag(name, {"count": len(fitted.unlike)})
    if not cycles:
        return
    if len(cycles) == 1:
        yield TraceFlag("one_cycle", {})
    if not fitted.damping.of and not fitted.given:
        yield TraceFlag("no_damping", {"samples": RESOLVED})
    if fitted.cell:
        period = Amount(2.0 * math.pi / fitted.cell.frequency, _place_unit(averages.trace))
        yield TraceFlag("cell_fitted", {"period": period, "damping": fitted.cell.damping})
    if misfit := fitted.estimate_shared_errors().static:
        yield TraceFlag("misfit", {"error": Amount(misfit, pull.unit)})
    if fitted.samples < RESOLVED:
        yield TraceFlag("few_samples", {"samples": fitted.samples})
    static = np.array([cycle.driving for cycle in cycles])
    if has_correlation(static):
        yield TraceFlag("correlated", {"batches": VALUE_BATCHES})
    least = LARGEST_CHANGE * abs(static.mean())
    if len(static) <= FEWEST:
        return
    later = static[1:]
    if static[0] - later.mean() > max(SIGNIFICANT_CHANGE * later.std(ddof=1), least):
        yield TraceFlag("first_slip", {"force": Amount(float(static[0]), pull.unit)})
    # Without the first slip, which would make a slope of its own rest.
    starts = [cycle.start for cycle in cycles]
    line = scipy.stats.linregress(starts[1:], later)
    least_slope = least / (starts[-1] - starts[0])
    if abs(line.slope) > max(SIGNIFICANT_CHANGE * line.stderr, least_slope):
        rate = Amount(float(line.slope), _rate_unit(averages.trace, pull))
        yield TraceFlag("drift", {"rate": rate})
