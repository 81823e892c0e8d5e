"""`nanoslip trace`: friction, period and stiffness of a force that was measured."""

import math
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
import xarray as xr

from nanoslip.solver.outcome import InvalidInput, quoted
from nanoslip.solver.parameter import Parameter
from nanoslip.solver.view import with_error
from nanoslip.study.commands.datasets import assignments, dataset_of
from nanoslip.study.commands.plans import counted, print_json
from nanoslip.study.commands.words import Refusal
from nanoslip.study.dataset.access import Accessor, one_case
from nanoslip.study.figures.shared import COLORS, PAGE, column, format_of, image, legend
from nanoslip.study.inference.trace import Trace, TraceNumbers, measure, read_trace
from nanoslip.study.manifest.columns import text_of
from nanoslip.study.manifest.units import in_words, plain
from nanoslip.study.report.console import Table, print_sentences, print_table, say, whole
from nanoslip.study.results.store import write_files

SYMBOLS: Final = {
    "static_friction": "μ_s",
    "kinetic_friction": "μ_k",
    "mean_force": "F̄ ≥ μ_k",
    "natural_period": "2π/ω",
    "damping_ratio": "ζ",
    "rising_stiffness": "dF/dδ",
    "rising_rate": "dF/dt",
}
"""Symbols of the numbers of a trace."""


class Reading(NamedTuple):
    """Options of the command line that say how a trace is read; texts with units."""

    time: str | None
    displacement: str | None
    force: str
    load: str | None
    velocity: str | None
    columns: tuple[int, int]
    offset: str | None
    drift: str | None
    damping: float | None

    def trace(self, file: Path) -> tuple[Trace, float, float]:
        """The trace, its load and the velocity of its stage; NaN where they are not given. Raises Refusal, InvalidInput."""
        if self.time and self.displacement:
            raise Refusal("--time and --displacement exclude each other: the first column is one of the two")
        over, unit = ("displacement", self.displacement) if self.displacement else ("time", self.time or "s")
        columns = (self.columns[0] - 1, self.columns[1] - 1)
        trace = read_trace(file, text_of(file), over, unit, self.force, columns)
        load, velocity = _number("load", self.load, "N"), _number("velocity", self.velocity, "m s-1")
        offset = _number("offset", self.offset, trace.unit)
        drift = _number("drift", self.drift, "N s-1" if over == "time" else "N m-1")
        for name, given, value in (("load", self.load, load), ("velocity", self.velocity, velocity)):
            if value <= 0.0:
                raise Refusal(f"--{name} = {quoted(given)}: needs a value above 0")
        trace = trace.without(*(0.0 if math.isnan(value) else value for value in (offset, drift)))
        return (trace if math.isnan(velocity) else trace.at_velocity(velocity)), load, velocity

    def numbers(self, file: Path) -> tuple[Trace, float, TraceNumbers]:
        """The trace, its load and its numbers. Raises Refusal."""
        try:
            trace, load, velocity = self.trace(file)
            return trace, load, measure(trace, load, velocity, self.damping)
        except InvalidInput as error:
            raise Refusal(f"{file}: {error}") from None


def _number(name: str, text: str | None, unit: str) -> float:
    """An option's value in SI; NaN where it is not given. Raises Refusal."""
    try:
        value = math.nan if text is None else float(plain(text, Parameter(name, unit=unit)))
    except ValueError:
        value = math.inf
    if text is not None and not math.isfinite(value):
        raise Refusal(f'--{name} = {quoted(text)}: needs a number, or one with a unit as "1 {in_words(unit)}"')
    return value


def show_trace(
    file: Path,
    parameters: tuple[str, ...],
    over: Path | None,
    picture: Path | None,
    as_json: bool,
    **reading: Any,
) -> None:
    """Print the numbers of a trace, beside those of a computed drive, and draw it. reading: see `Reading`."""
    form = format_of(picture) if picture else ""
    trace, weight, found = Reading(**reading).numbers(file)
    if over and trace.unit == "N" and math.isnan(weight):
        raise Refusal('--over: needs --load, as "100 N": computed forces are shares of the load')
    if parameters and not over:
        raise Refusal(f"{parameters[0]}: needs --over CAMPAIGN, whose case it selects")
    computed = _computed(over, parameters) if over else None
    if as_json:
        print_json({name: number._asdict() for name, number in found.numbers.items()} | {"notes": list(found.notes)})
    else:
        say(_as_read(trace))
        print_table(_table(found, computed))
        print_sentences(found.notes)
        if "static_friction" in found.numbers and trace.unit == "N" and math.isnan(weight):
            say('forces are in N: --load "100 N" makes them friction coefficients')
    if picture:
        write_files({picture: draw(trace, found, weight, form, computed)})
        say(whole(f"written: {picture}"), stderr=as_json)


def _as_read(trace: Trace) -> str:
    what = "force" if trace.unit == "N" else "friction coefficient"
    end = f"{trace.at[-1]:.4g} {'s' if trace.over == 'time' else 'm'}"
    header = f", below {counted(trace.skipped, 'line')}" if trace.skipped else ""
    return (
        f"{len(trace.at)} points of {what} over {trace.over} to {end}; numbers are separated by {trace.separator}{header}; "
        f"{what} from {trace.force.min():.4g} to {trace.force.max():.4g}{'' if trace.unit == '1' else ' N'}"
    )


def _computed(source: Path, parameters: tuple[str, ...]) -> xr.Dataset:
    """The motion of one computed drive, with its numbers. Raises Refusal where it is not one."""
    with dataset_of(source) as dataset:
        try:
            return Accessor(one_case(dataset, assignments(parameters))).trajectory().load()
        except (KeyError, ValueError) as error:
            raise Refusal(f"--over {source}: {error.args[0]}") from None


def _beside(computed: xr.Dataset, name: str, periodic: bool) -> str:
    """A number of a computed drive, whose own kinetic friction is the mean force over time, also of a periodic one."""
    if periodic:
        name = {"mean_force": "kinetic_friction", "kinetic_friction": "fitted_kinetic_friction"}.get(name, name)
    if name not in computed or computed[name].isnull():
        return "–"
    value, error = float(computed[name]), f"{name}_uncertainty"
    return with_error(value, float(computed[error])) if error in computed else f"{value:.4g}"


def _table(found: TraceNumbers, computed: xr.Dataset | None) -> Table:
    rows = tuple(
        (
            name,
            SYMBOLS.get(name, ""),
            with_error(number.value, number.uncertainty) if number.of > 1 else f"{number.value:.4g}",
            "" if number.unit == "1" else in_words(number.unit),
            counted(number.of, "value") if number.of else "given",
            *([] if computed is None else [_beside(computed, name, "mean_force" in found.numbers)]),
        )
        for name, number in found.numbers.items()
    )
    return Table(
        ("number", "symbol", "value ±", "unit", "mean of", *([] if computed is None else ["computed ±"])), rows
    )


def draw(trace: Trace, found: TraceNumbers, load: float, form: str, computed: xr.Dataset | None = None) -> bytes:
    """The trace with the closed form that fits it, and a computed drive whose first slip is at the same time; below, a cycle."""
    per = load if trace.unit == "N" and math.isfinite(load) else 1.0
    label = "F/W" if trace.unit == "1" or math.isfinite(load) else "force (N)"
    middle = found.cycles[len(found.cycles) // 2] if found.cycles else None
    with column(4.4 if middle else 2.4, PAGE) as figure:
        panels = figure.subplots(2 if middle else 1, squeeze=False)[:, 0]
        if computed is not None:
            shift = _first_slip(found) - _first_drop(computed) if trace.over == "time" else 0.0
            force = computed["sample_spring_force"]
            panels[0].plot(
                computed["time"] + shift, force, color=COLORS[2], label=f"computed, {shift:+.3g} s", zorder=3
            )
        for axes, marker in zip(panels, (",", "."), strict=False):
            look: dict[str, Any] = {"marker": marker, "markersize": 2.0, "linewidth": 0.5, "color": COLORS[5]}
            axes.plot(trace.at, trace.force / per, label="measured", **look)
            for number, cycle in enumerate(found.cycles):
                name = "Eq. 16-19" if not number else None
                axes.plot(cycle.at, cycle.fit, color=COLORS[1], linewidth=1.0, label=name)
            for style, name in (("--", "static_friction"), (":", "kinetic_friction")):
                if name in found.numbers:
                    axes.axhline(found.numbers[name].value, color=COLORS[0], linestyle=style, label=SYMBOLS[name])
            axes.set_ylabel(label)
        if middle:
            shown = (trace.at >= middle.at[0]) & (trace.at <= middle.at[-1])
            force = trace.force[shown] / per
            room = 0.1 * (force.max() - force.min())
            panels[1].set(xlim=(middle.at[0], middle.at[-1]), ylim=(force.min() - room, force.max() + room))
        panels[-1].set_xlabel("time (s)" if trace.over == "time" else "displacement (m)")
        legend(figure)
        return image(figure, form)


def _first_slip(found: TraceNumbers) -> float:
    return found.cycles[0].start if found.cycles else 0.0


def _first_drop(computed: xr.Dataset) -> float:
    """When the first macroscopic slip of a computed drive begins; 0 where there is none, or where slips are not kept."""
    starts = computed["slip_phase_start"].values if "slip_phase_start" in computed else np.empty(0)
    return float(starts[0]) if len(starts) else 0.0
