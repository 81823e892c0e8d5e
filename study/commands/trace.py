"""Command `trace`: friction, period and stiffness in a force that was measured; and its words."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
import xarray as xr

from nanoslip.solver.arrays import Floats
from nanoslip.solver.outcome import InvalidInput, quote_value
from nanoslip.solver.view import with_error
from nanoslip.study.commands.computed_loops import ComputedLoops, motion_of_drive, read_computed_loops
from nanoslip.study.commands.datasets import assignments, error_message, find_dataset
from nanoslip.study.commands.plans import plural, print_json
from nanoslip.study.commands.reading import lines_left_out, parse_option, separation
from nanoslip.study.commands.words import Refusal
from nanoslip.study.dataset.table import one_case
from nanoslip.study.dataset.units import prefix_factor
from nanoslip.study.figures import shared
from nanoslip.study.manifest.parameters import compact
from nanoslip.study.measured.columns import file_text
from nanoslip.study.measured.events import EventUnits, event_numbers, events_as_csv, find_events
from nanoslip.study.measured.means import Measured
from nanoslip.study.measured.over_load import has_changing_load
from nanoslip.study.measured.recording import Trace, TraceOptions, TraceSource, find_gaps, read_trace
from nanoslip.study.measured.trace import Amount, TraceFlag, TraceNumbers, measure_trace
from nanoslip.study.report.console import Table, note, print_sentences, print_table, whole
from nanoslip.study.results.store import write_files

TRACE_SYMBOLS: Final = {
    "static_friction": "μ_s",
    "kinetic_friction": "μ_k",
    "mean_force": "F̄ ≥ μ_k",
    "natural_period": "2π/ω",
    "damping_ratio": "ζ",
    "rising_stiffness": "dF/dδ",
    "rising_rate": "dF/dt",
    "cycle_energy": "∮F dx",
    "mid_stroke_friction": "μ",
    "turn_friction": "F at turns",
    "contact_stiffness": "K",
    "secant_stiffness": "F/δ at turns",
    "energy_ratio": "E/4Fδ",
    "friction_slope": "dF/dW",
    "friction_intercept": "F at W = 0",
    "load_correlation": "r",
    "static_friction_slope": "dF_s/dW",
    "static_friction_intercept": "F_s at W = 0",
    "static_load_correlation": "r",
    "drop_exponent": "τ",
    "step_exponent": "τ",
}
"""Symbols of the numbers of a trace."""
SENTENCES: Final = {
    "strokes": "forces of both signs are {strokes} strokes, cut where the sign changes: friction is half their difference, the "
    "offset half their sum, ± over strokes",
    "inertia": "after its largest force of {peak} the pin slides on and rings: that is inertia, V√(km), above "
    "friction; μ_s is from a fit of Eq. 16-19 to the pull, and missing where they do not fit",
    "load_changes": "the normal load changes from {low} to {high}, so friction is a line over it; parts at rest "
    "are left out, ± is over eighths of the trace",
    "strokes_drift": "the force of all strokes drifts by {rate}: subtracted",
    "few_strokes_drift": "the force of both strokes drifts by {rate}: subtracted; in two strokes "
    "friction that changes along the way looks the same, in three it does not",
    "nothing_slides": "nothing slides: the force follows the stage up to {force} and no stroke comes to a level: "
    "friction is at least that, and the contact sticks or slips in part",
    "as_stiff_as_rig": "after a turn the force rises as the stiffness of the rig alone makes it: that of the contact is not "
    "known from this loop",
    "loop_slides": "loops are those of a contact that slides: their energy ratio of {ratio:.2f} is above {least}",
    "loop_partial_slip": "loops are those of partial slip: they lose energy, and their energy ratio of {ratio:.2g} is "
    "below {least}",
    "loop_sticks": "loops lose no energy beyond its ±: the contact sticks, or slips by less than the noise",
    "few_strokes": "± of the loops is over {strokes} strokes less offset and drift, {freedom} degrees of freedom: 68 % "
    "lie within ±, 95 % within {factor:.2g} ±; more cycles bring that to 2 ±",
    "short_stroke": "after a turn {share:.0%} of a stroke only stretch rig and contact, more than {middle:.0%}: there is no "
    "friction at mid-stroke; a longer stroke shows it",
    "no_whole_cycle": "the stage turns, but no two strokes there and back are whole, from turn to turn: no loop; "
    "record a cycle more",
    "open_loop": "the only cycle begins without force, so its loop is wider than those after it: energy, slip and energy ratio "
    "are too large; a second cycle gives them",
    "pull_ends": "from {at} on the force stays at {level} and never rises again: taken for the end of the "
    "pull, and left out; --from and --to choose another part",
    "sensor_limit": "{low} samples are at the least force and {high} at the largest, reached by jumps: the sensor's limit; "
    "numbers that need the forces beyond it are missing, and μ_s is the mean of the largest samples",
    "gaps": "gaps in the record: {count}, up to {longest} long: no cycle, rise, fall or loop that spans one counts",
    "averaged": "slips are lost in the noise of single samples: numbers are of means over {width} each",
    "offset": "the trace begins at {begins}: if nothing pulls there, take it off by offset",
    "noise": "where the force falls by less than {least} it counts as noise, not as a slip",
    "cell_rings": "the force rises faster than in the first pull, every {period}, as no friction does: the force cell "
    "rings, and numbers are of means over that period",
    "turned": "no number: the force falls more slowly than it rises, which is no stick-slip: has it the other sign?",
    "slides": "steady from {from} on, after the last slip; μ_k is the mean, its ± from eight parts",
    "no_stick_slip": "steady from {from} on: no stick-slip, so no μ_s, period or amplitude; μ_k is the mean, its ± "
    "from eight parts",
    "undersampled": "the force repeats after {samples:.2g} samples, or means: too few to see slips, so there is the mean force, "
    "and no μ_k",
    "unsteady": "no μ_k: the force changes by {share:.1%} along the best steady part: needs a longer trace",
    "no_friction": "no friction: there are neither two slips nor a steady part; --from and --to choose a part of the file",
    "unlike_model": "Eq. 16-19 fit none of {count} slips within the measured forces: numbers are of largest and least samples; "
    "no μ_k, ζ or natural period",
    "unlike_cycles": "{count} slips are left out, as no fit of Eq. 16-19 lies within their measured forces",
    "one_cycle": "one cycle only: no ±",
    "no_damping": "slips of fewer than {samples} samples do not tell the damping: μ_k is below the mean force, and μ_s lacks the "
    "damper's force; --damping gives both",
    "cell_fitted": "after each slip the force cell rings, with a period of {period} and damping ratio {damping:.2g}: "
    "that is fitted together with Eq. 16-19, and is no part of the numbers",
    "misfit": "all slips differ from Eq. 16-19 in the same way, as with friction that changes while the pin slides: ± contains "
    "the most that this may hide, {error} of μ_s",
    "few_samples": "{samples:.3g} samples in a cycle: the largest force is between them, so μ_s has no ±",
    "correlated": "neighbouring cycles are correlated: ± is from {batches} batches of cycles, and rough; a longer trace is surer",
    "first_slip": "the first slip needs {force}, more than the others: μ_s is the mean of all",
    "drift": "the force before slips drifts by {rate}: take it off by drift",
}
"""Flag of a trace -> its sentence."""


def sentence(flag: TraceFlag) -> str:
    """A flag in words, its amounts in units with suitable prefixes."""
    facts: dict[str, float | str] = {}
    for name, fact in flag.facts.items():
        facts[name] = _amount_text(fact) if isinstance(fact, Amount) else fact
    return SENTENCES[flag.name].format(**facts)


DIGITS: Final = 4
"""Digits of numbers without ±."""


def _amount_text(amount: Amount) -> str:
    factor, unit = prefix_factor([amount.value], amount.unit)
    return f"{factor * amount.value:.{DIGITS}g} {unit}".rstrip()


class TraceReading(NamedTuple):
    """Options of the command line for reading a trace; texts with units."""

    time: str | None
    displacement: str | None
    force: str | None
    load: str | None
    velocity: str | None
    columns: tuple[str, str] | None
    start: str | None
    end: str | None
    offset: str | None
    drift: str | None
    damping: float | None
    rig: str | None = None

    def trace(self, file: Path) -> tuple[Trace, float, float]:
        """The trace, its load and the velocity of its stage; NaN where they are not given. Raises Refusal, InvalidInput."""
        if self.time and self.displacement:
            raise Refusal("--time and --displacement exclude each other: the force is measured over one of the two")
        time, displacement, force = self.time or "", self.displacement or "", self.force or ""
        options = TraceOptions(time, displacement, force, self.columns or ())
        trace = read_trace(file, file_text(file), options)
        load = parse_option("load", self.load, "N", positive=True)
        velocity = self.stage_velocity()
        unit = "s" if trace.over == "time" else "m"
        start = parse_option("from", self.start, unit)
        end = parse_option("to", self.end, unit)
        # Cut before offset and drift are taken off: a drift grows from the begin of the part that is looked at.
        trace = trace.select_span(start, end)
        offset = parse_option("offset", self.offset, trace.unit)
        drift = parse_option("drift", self.drift, f"N {unit}-1")
        trace = trace.subtract(_or_zero(offset), _or_zero(drift))
        # A given load takes the place of a column of it; a load that changes makes a line, and no coefficient.
        if math.isnan(load) and not _is_over_load(trace):
            trace = trace.divide_by_load()
        if not math.isnan(velocity):
            trace = trace.convert_to_time(velocity)
        return trace, load, velocity

    def stage_velocity(self) -> float:
        """Velocity of the stage in m/s; NaN where it is not given. Raises Refusal."""
        return parse_option("velocity", self.velocity, "m s-1", positive=True)

    def rig_stiffness(self) -> float:
        """Stiffness of the machine in N/m; infinite where it is not given. Raises Refusal."""
        rig = parse_option("rig", self.rig, "N m-1", positive=True)
        return math.inf if math.isnan(rig) else rig

    def numbers(self, file: Path) -> tuple[Trace, float, TraceNumbers]:
        """The trace, its load and its numbers. Raises Refusal."""
        try:
            trace, load, velocity = self.trace(file)
            measured = measure_trace(trace, load, velocity, self.damping, self.rig_stiffness())
            return trace, load, measured
        except InvalidInput as error:
            raise Refusal(f"{file}: {error}") from None


def _or_zero(value: float) -> float:
    return 0.0 if math.isnan(value) else value


def _is_over_load(trace: Trace) -> bool:
    """True if forces in N belong to loads that change, so that they show friction over load."""
    return trace.unit == "N" and trace.load is not None and has_changing_load(trace.load)


def show_trace(
    file: Path,
    parameters: tuple[str, ...],
    over: Path | None,
    picture: Path | None,
    events: Path | None,
    as_json: bool,
    reading: TraceReading,
) -> None:
    """Print the numbers of a trace, beside the numbers of a computed drive, draw it, and write its events."""
    form = shared.file_format(picture) if picture else ""
    trace, weight, measured = reading.numbers(file)
    if over and trace.unit == "N" and math.isnan(weight):
        raise Refusal('--over: needs --load, as "100 N": computed forces are shares of the load')
    if parameters and not over:
        raise Refusal(f"{parameters[0]}: needs --over CAMPAIGN, whose case it selects")
    computed, loops = None, None
    if over and measured.loops:
        weight_of_loop = _require_load(trace, weight)
        loops = _find_loops(over, parameters, weight_of_loop, reading.rig_stiffness())
    elif over:
        computed = _read_motion(over, parameters)
    series = TraceSeries.from_traces({file.name: trace}, {file.name: weight}, reading) if events else None
    if as_json:
        distributions = {"events": as_mapping(series.numbers)} if series else {}
        beside = {"computed": as_mapping(loops.numbers)} if loops else {}
        known_load = {"load": _find_load(trace, weight)}
        print_json({**known_load, **json_of_trace(trace, measured), **beside, **distributions})
    else:
        note(_as_read(trace))
        if loops:
            print_table(loop_table(measured.numbers, loops.numbers))
            print_sentences(_loop_sentences(loops, _require_load(trace, weight)))
        else:
            print_table(number_table(measured.numbers, computed))
        if series:
            print_table(number_table(series.numbers))
        print_sentences(map(sentence, measured.flags))
        if "static_friction" in measured.numbers and trace.unit == "N" and math.isnan(weight):
            note('forces are in N: --load "100 N" makes them friction coefficients')
    if picture:
        content = draw(trace, measured, weight, form, computed, loops)
        write_files({picture: content})
        note(whole(f"written: {picture}"), stderr=as_json)
    if events and series:
        write_files({events: series.text.encode()})
        note(whole(f"written: {events}"), stderr=as_json)


class TraceSeries(NamedTuple):
    """Events of traces by file: the text of their CSV file, and the numbers of their distributions."""

    text: str
    numbers: dict[str, Measured]

    @classmethod
    def from_traces(
        cls, traces: Mapping[str, Trace], loads: Mapping[str, float], reading: TraceReading
    ) -> "TraceSeries":
        """Find the events of each trace. loads: in N, NaN where they are not known."""
        velocity = reading.stage_velocity()
        events, units = {}, {}
        for file, trace in traces.items():
            load = loads[file]
            divides = trace.unit == "N" and math.isfinite(load)
            shown = replace(trace, force=trace.force / load, unit="1") if divides else trace
            events[file] = find_events(shown)
            units[file] = EventUnits.from_trace(shown, load, velocity)
        # Sizes of different dimensions have no common distribution.
        places = {(unit.force, unit.place) for unit in units.values()}
        if len(places) > 1:
            raise Refusal("--events: needs files of one kind: forces or coefficients, over time or over displacement")
        ((force, place),) = places
        over = "time" if place == "s" else "displacement"
        numbers = event_numbers(list(events.values()), force, over)
        return cls(events_as_csv(events, units), numbers)


def as_mapping(numbers: Mapping[str, Measured]) -> dict[str, dict[str, Any]]:
    """Numbers of a trace for JSON."""
    return {name: number._asdict() for name, number in numbers.items()}


def json_of_trace(trace: Trace, measured: TraceNumbers) -> dict[str, Any]:
    """Numbers, flags and notes of a trace for JSON."""
    notes = [] if trace.source is None else list(_describe_omissions(trace.source))
    notes += map(sentence, measured.flags)
    return {**as_mapping(measured.numbers), "flags": measured.flagged, "notes": notes}


def _as_read(trace: Trace) -> str:
    what = "force" if trace.unit == "N" else "friction coefficient"
    span = _range_text(trace.at, "s" if trace.over == "time" else "m")
    parts = [f"{len(trace.at)} points of {what} over {trace.over} {span}"]
    if trace.source is not None:
        parts += [separation(trace.source.columns), *_describe_omissions(trace.source)]
    parts.append(f"{what} {_range_text(trace.force, trace.unit)}")
    return "; ".join(parts)


def _range_text(values: Floats, unit: str) -> str:
    """The least and the largest of some numbers, in the unit with the prefix that suits the larger size."""
    factor, prefixed = prefix_factor(values, unit)
    least, most = factor * float(values.min()), factor * float(values.max())
    return f"from {least:.{DIGITS}g} to {most:.{DIGITS}g} {prefixed}".rstrip()


def _describe_omissions(source: TraceSource) -> Iterator[str]:
    """Lines and samples that were left out or mended, and the columns that were taken from more than two."""
    if len(source.columns.columns) > 2:
        yield f"columns {', '.join(map(quote_value, source.taken))}"
    yield from lines_left_out(source.columns, source.rows, source.holes)
    if source.spikes:
        yield f"{plural(source.spikes, 'sample')} far from the neighbours left out"
    if source.unloaded:
        yield f"{plural(source.unloaded, 'sample')} at less than half of the median normal load left out"


def _read_motion(source: Path, parameters: tuple[str, ...]) -> xr.Dataset:
    """The motion of a computed drive, with its numbers. Raises Refusal unless exactly one drive matches."""
    with find_dataset(source) as dataset:
        try:
            return motion_of_drive(one_case(dataset, assignments(parameters)))
        except (KeyError, ValueError) as error:
            raise Refusal(f"--over {source}: {error_message(error)}") from None


def _find_load(trace: Trace, load: float) -> float:
    return load if math.isfinite(load) else trace.mean_load


def _require_load(trace: Trace, load: float) -> float:
    """Normal load of a trace in N: given, or the mean of its column. Raises Refusal if neither is known."""
    stated = _find_load(trace, load)
    if math.isnan(stated):
        raise Refusal('--over: needs --load, as "100 N": the energy of a loop of coefficients is not known without')
    return stated


def _find_loops(source: Path, parameters: tuple[str, ...], load: float, rig: float) -> ComputedLoops:
    """Loops of a computed case. Raises Refusal unless exactly one case and drive matches, and has loops."""
    with find_dataset(source) as dataset:
        try:
            case = one_case(dataset, assignments(parameters))
            return read_computed_loops(case, dict(dataset.attrs), load, rig)
        except (KeyError, ValueError) as error:
            raise Refusal(f"--over {source}: {error_message(error)}") from None


def _loop_sentences(computed: ComputedLoops, load: float) -> Iterator[str]:
    """Sentences on the computed column, beside the measured one."""
    yield "computed ± are over starts, or over strokes of a single one; numbers without ± are of the start that is drawn"
    loads = [_amount_text(Amount(newtons, "N")) for newtons in (load, computed.load)]
    if loads[0] != loads[1]:
        yield f"measured at {loads[0]}, computed at {loads[1]}: energies, stiffness and lengths are those of different loads"
    if computed.of_path and not computed.machine:
        yield "the pin of a path is moved itself: without --rig the measured loop is that of contact and machine together"


def _format_computed(computed: xr.Dataset, name: str, periodic: bool) -> str:
    """A number of a computed drive. Kinetic friction of a periodic trace is compared with the drive's mean force over
    time."""
    if periodic:
        name = {"mean_force": "kinetic_friction", "kinetic_friction": "fitted_kinetic_friction"}.get(name, name)
    if name not in computed or computed[name].isnull():
        return "–"
    value, error = float(computed[name]), f"{name}_uncertainty"
    return with_error(value, float(computed[error])) if error in computed else f"{value:.4g}"


def loop_table(numbers: Mapping[str, Measured], computed: Mapping[str, Measured]) -> Table:
    """Table of measured numbers beside numbers of computed loops, first the numbers that both have."""
    names = [name for name in numbers if name in computed]
    names += [name for name in numbers if name not in computed]
    rows = []
    for name in names:
        both = [numbers[name], *filter(None, [computed.get(name)])]
        factor, unit = prefix_factor([number.value for number in both], both[0].unit)
        cells = [_format_measured(number, factor) for number in both]
        if name not in computed:
            cells.append("–")
        rows.append((name, *cells, unit))
    return Table(("number", "measured ±", "computed ±", "unit"), tuple(rows))


def _format_measured(number: Measured, factor: float) -> str:
    """A number and its ±, times the factor to its unit with a prefix."""
    value, error = factor * number.value, factor * number.uncertainty
    return with_error(value, error) if number.of > 1 or math.isfinite(error) else f"{value:.{DIGITS}g}"


def number_table(numbers: Mapping[str, Measured], computed: xr.Dataset | None = None) -> Table:
    """Table of the numbers of a trace, perhaps beside the numbers of a computed drive."""
    rows = []
    is_periodic = "mean_force" in numbers
    for name, number in numbers.items():
        values = plural(number.of, "value") if number.of else "–"
        factor, unit = prefix_factor([number.value], number.unit)
        symbol = TRACE_SYMBOLS.get(name, "")
        row = [name, symbol, _format_measured(number, factor), unit, values]
        if computed is not None:
            row.append(_format_computed(computed, name, is_periodic))
        rows.append(tuple(row))
    header = ["number", "symbol", "value ±", "unit", "mean of"]
    if computed is not None:
        header.append("computed ±")
    return Table(tuple(header), tuple(rows))


def draw(
    trace: Trace,
    measured: TraceNumbers,
    load: float,
    form: str,
    computed: xr.Dataset | None = None,
    computed_loops: ComputedLoops | None = None,
) -> bytes:
    """Draw the trace with its closed form, and a computed drive whose first slip is at the same time; below, a cycle or loops.

    Forces of both signs are drawn less offset and drift, with their strokes shaded and lines of both signs.
    """
    if "friction_slope" in measured.numbers and trace.load is not None:
        return _draw_over_load(trace, np.abs(trace.load), measured, form)
    per = load if trace.unit == "N" and math.isfinite(load) else 1.0
    quantity, unit = ("F/W", "1") if trace.unit == "1" or math.isfinite(load) else ("force", "N")
    drift = measured.drift * (trace.at - trace.at[0])
    force = trace.force / per - measured.offset - drift
    place, line_of_force = break_at_gaps(trace.at, trace.at, force)
    middle = measured.cycles[len(measured.cycles) // 2] if measured.cycles else None
    below = bool(middle) or measured.loops is not None
    with shared.column(4.4 if below else 2.4, shared.PAGE) as figure:
        grid = figure.subplots(2 if below else 1, squeeze=False)
        panels = grid[:, 0]
        if computed is not None:
            first = measured.cycles[0].start if measured.cycles else 0.0
            # Both stages start at times of their own: the first slips are laid over each other.
            shift = first - _first_drop(computed) if trace.over == "time" else 0.0
            look: dict[str, Any] = {"color": shared.COLORS[2], "label": f"computed, {shift:+.3g} s"}
            time = computed["time"] + shift
            panels[0].plot(time, computed["sample_spring_force"], zorder=3, **look)
        for axes, marker in zip(panels[: 2 if middle else 1], (",", "."), strict=False):
            look = {"marker": marker, "markersize": 2.0, "linewidth": 0.5}
            look["color"] = shared.COLORS[5]
            axes.plot(place, line_of_force, label="measured", **look)
            for number, cycle in enumerate(measured.cycles):
                name = "Eq. 16-19" if not number else None
                line: dict[str, Any] = {"color": shared.COLORS[1], "linewidth": 1.0}
                axes.plot(cycle.at, cycle.fit, label=name, **line)
            _draw_levels(axes, measured)
            label_axis(axes.yaxis, _less(quantity, measured), force, unit)
        for span in measured.spans:
            shade: dict[str, Any] = {"color": shared.COLORS[5], "alpha": 0.12, "linewidth": 0.0}
            panels[0].axvspan(span.start, span.end, **shade)
        if middle:
            begin, end = middle.at[0], middle.at[-1]
            shown = force[(trace.at >= begin) & (trace.at <= end)]
            least, most = shown.min(), shown.max()
            room = 0.1 * (most - least)
            panels[1].set(xlim=(begin, end), ylim=(least - room, most + room))
        elif measured.loops is not None:
            _draw_loops(panels[1], trace.at, measured, computed_loops)
            label_axis(panels[1].yaxis, _less(quantity, measured), force, unit)
        # Below loops, which have a position of their own, the axis of the trace is that of the upper panel.
        has_loops_below = measured.loops is not None and not middle
        along = panels[0 if has_loops_below else -1].xaxis
        label_axis(along, trace.over, trace.at, "s" if trace.over == "time" else "m")
        shared.legend(figure)
        return shared.image(figure, form)


def break_at_gaps(at: Floats, *columns: Floats) -> list[Floats]:
    """Columns with a NaN where nothing was recorded, so that no line is drawn there. at: time or way of each sample (n,)."""
    # Of a cycle of no length any part counts.
    gaps = np.flatnonzero(find_gaps(at, 0.0)) + 1
    return [np.insert(column, gaps, math.nan) for column in columns]


def _draw_loops(axes: Any, at: Floats, answer: TraceNumbers, computed: ComputedLoops | None) -> None:
    """Measured loops, and computed ones, each about the middle of its way; of a path both over the place of the contact.

    at: time or way of each measured sample.
    """
    assert answer.loops is not None
    machine = computed.machine if computed else 0.0
    # A rig between stage and contact shears the loop: its points are shifted by F/k.
    measured = answer.loops.position - machine * answer.loops.force
    way = measured - _middle(measured)
    if computed:
        place = computed.loops.position
        wide: dict[str, Any] = {"linewidth": 2.0, "color": shared.COLORS[2], "alpha": 0.6}
        label = f"computed, {_energy_text(computed.numbers)}"
        axes.plot(place - _middle(place), computed.loops.force, label=label, **wide)
    thin: dict[str, Any] = {"linewidth": 0.5, "color": shared.COLORS[5]}
    label = f"measured, {_energy_text(answer.numbers)}"
    axes.plot(*break_at_gaps(at, way, answer.loops.force), label=label, **thin)
    if computed:
        axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
    _draw_levels(axes, answer)
    label_axis(axes.xaxis, "position less F/rig" if machine else "position", way, "m")


def _energy_text(numbers: Mapping[str, Measured]) -> str:
    energy = numbers["cycle_energy"]
    factor, unit = prefix_factor([energy.value], energy.unit)
    return f"{_format_measured(energy, factor)} {unit} a cycle"


def _middle(place: Floats) -> float:
    extremes = float(place.max()) + float(place.min())
    return extremes / 2.0


def _draw_over_load(trace: Trace, load: Floats, measured: TraceNumbers, form: str) -> bytes:
    """Friction over normal load with its line."""
    slope = measured.numbers["friction_slope"].value
    intercept = measured.numbers["friction_intercept"].value
    ends = np.array([0.0, float(load.max())])
    points: dict[str, Any] = {"markersize": 2.0, "color": shared.COLORS[5], "label": "measured"}
    line: dict[str, Any] = {"color": shared.COLORS[1], "label": line_equation(slope, intercept)}
    with shared.column(2.8, shared.PAGE) as figure:
        axes = figure.subplots()
        axes.plot(load, trace.force, ".", **points)
        axes.plot(ends, intercept + slope * ends, **line)
        label_axis(axes.xaxis, "normal load W", load, "N")
        label_axis(axes.yaxis, "force", trace.force, "N")
        shared.legend(figure)
        return shared.image(figure, form)


def line_equation(slope: float, intercept: float) -> str:
    """Friction over load as an equation: `5 mN + 0.25 W`."""
    return f"{compact(intercept, 'N', digits=3)} + {slope:.3g} W"


def label_axis(axis: Any, quantity: str, values: Any, unit: str) -> None:
    """Label an axis of a figure, and its ticks in the unit with the prefix that suits these SI values."""
    factor, prefixed = prefix_factor(values, unit)
    # Powers of ten: ticks that are round in SI are round in the other unit.
    axis.set_major_formatter(lambda value, _: f"{factor * value:.6g}")
    axis.set_label_text(f"{quantity} ({prefixed})" if prefixed else quantity)


def _less(label: str, measured: TraceNumbers) -> str:
    """The label of forces, with the subtracted part."""
    parts = {"offset": measured.offset, "drift": measured.drift}
    subtracted = [name for name, value in parts.items() if value]
    return f"{label} less {' and '.join(subtracted)}" if subtracted else label


def _draw_levels(axes: Any, measured: TraceNumbers) -> None:
    """Lines at static and kinetic friction, of both signs for strokes to and fro."""
    for style, name in (("--", "static_friction"), (":", "kinetic_friction")):
        if number := measured.numbers.get(name):
            color = shared.COLORS[0]
            look: dict[str, Any] = {"color": color, "linestyle": style}
            axes.axhline(number.value, label=TRACE_SYMBOLS[name], **look)
            if measured.spans:
                axes.axhline(-number.value, **look)


def _first_drop(computed: xr.Dataset) -> float:
    """Time when the first macroscopic slip of a computed drive begins; 0 if there is none, or if slips are not kept."""
    starts = computed["slip_phase_start"].values if "slip_phase_start" in computed else np.empty(0)
    return float(starts[0]) if len(starts) else 0.0
