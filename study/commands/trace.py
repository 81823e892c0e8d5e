"""`nanoslip trace`: friction, period and stiffness of a force that was measured."""

import math
from pathlib import Path
from typing import Any, Final

from nanoslip.solver.outcome import InvalidInput, quoted
from nanoslip.solver.parameter import Parameter
from nanoslip.solver.view import with_error
from nanoslip.study.commands.plans import counted, print_json
from nanoslip.study.commands.words import Refusal
from nanoslip.study.figures.shared import COLORS, PAGE, column, format_of, image, legend
from nanoslip.study.inference.trace import Trace, TraceNumbers, measure, read_trace
from nanoslip.study.manifest.checker import read_text
from nanoslip.study.manifest.units import in_words, plain
from nanoslip.study.report.console import Table, print_sentences, print_table, say, whole
from nanoslip.study.results.store import write_files

SYMBOLS: Final = {
    "static_friction": "μ_s",
    "kinetic_friction": "μ_k",
    "fitted_kinetic_friction": "μ_k",
    "natural_period": "2π/ω",
    "damping_ratio": "ζ",
    "rising_stiffness": "dF/dδ",
    "rising_rate": "dF/dt",
}
"""Symbols of the numbers of a trace."""


def trace_of(file: Path, given: dict[str, Any]) -> tuple[Trace, float, float, float | None]:
    """The trace that options of the command line name, with load, velocity and damping. Raises Refusal."""
    over = "displacement" if given["displacement"] else "time"
    if given["time"] and given["displacement"]:
        raise Refusal("--time and --displacement exclude each other: the first column is one of the two")
    columns = (given["columns"][0] - 1, given["columns"][1] - 1)
    try:
        text = read_text(file)[1]
        trace = read_trace(file, text, over, given[over] or "s", given["force"], columns)
    except InvalidInput as error:
        raise Refusal(f"{file}: {error}") from None
    per = "s" if over == "time" else "m"
    load, velocity = (_number(given, name, unit) for name, unit in (("load", "N"), ("velocity", "m s-1")))
    offset, drift = (_number(given, name, unit) for name, unit in (("offset", trace.unit), ("drift", f"N {per}-1")))
    for name, value in (("load", load), ("velocity", velocity)):
        if value <= 0.0:
            raise Refusal(f"--{name} = {quoted(given[name])}: needs a value above 0")
    trace = trace.without(*(0.0 if math.isnan(value) else value for value in (offset, drift)))
    return (trace if math.isnan(velocity) else trace.at_velocity(velocity)), load, velocity, given["damping"]


def _number(given: dict[str, Any], name: str, unit: str) -> float:
    """An option's value in SI; NaN where it is not given. Raises Refusal."""
    text = given[name]
    try:
        value = math.nan if text is None else float(plain(text, Parameter(name, unit=unit)))
    except ValueError:
        value = math.inf
    if math.isinf(value):
        raise Refusal(f'--{name} = {quoted(text)}: needs a number, or one with a unit as "1 {in_words(unit)}"')
    return value


def show_trace(file: Path, picture: Path | None, as_json: bool, **given: Any) -> None:
    """Print the numbers of a trace, and draw it."""
    form = format_of(picture) if picture else ""
    trace, load, velocity, damping = trace_of(file, given)
    found = measure(trace, load, velocity, damping)
    if as_json:
        print_json({name: number._asdict() for name, number in found.numbers.items()} | {"notes": list(found.notes)})
    else:
        say(_as_read(trace))
        print_table(_table(found))
        print_sentences(found.notes)
        if "static_friction" in found.numbers and trace.unit == "N" and math.isnan(load):
            say('forces are in N: --load "100 N" makes them friction coefficients')
    if picture:
        write_files({picture: draw(trace, found, load, form)})
        say(whole(f"written: {picture}"), stderr=as_json)


def _as_read(trace: Trace) -> str:
    what = "force" if trace.unit == "N" else "friction coefficient"
    end = f"{trace.at[-1]:.4g} {'s' if trace.over == 'time' else 'm'}"
    header = f", below {counted(trace.skipped, 'line')}" if trace.skipped else ""
    return (
        f"{len(trace.at)} points of {what} over {trace.over} to {end}; numbers are separated by {trace.separator}{header}; "
        f"{what} from {trace.force.min():.4g} to {trace.force.max():.4g}{'' if trace.unit == '1' else ' N'}"
    )


def _table(found: TraceNumbers) -> Table:
    rows = tuple(
        (
            name,
            SYMBOLS.get(name, ""),
            with_error(number.value, number.uncertainty) if number.of > 1 else f"{number.value:.4g}",
            "" if number.unit == "1" else in_words(number.unit),
            str(number.of) if number.of else "given",
        )
        for name, number in found.numbers.items()
    )
    return Table(("number", "symbol", "value ±", "unit", "of"), rows)


def draw(trace: Trace, found: TraceNumbers, load: float, form: str) -> bytes:
    """The trace with the closed form that fits it; below, its middle cycle."""
    per = load if trace.unit == "N" and math.isfinite(load) else 1.0
    label = "F/W" if trace.unit == "1" or math.isfinite(load) else "force (N)"
    middle = found.cycles[len(found.cycles) // 2] if found.cycles else None
    with column(4.4 if middle else 2.4, PAGE) as figure:
        panels = figure.subplots(2 if middle else 1, squeeze=False)[:, 0]
        for axes, marker in zip(panels, (",", "."), strict=False):
            look: dict[str, Any] = {"marker": marker, "markersize": 2.0, "linewidth": 0.5, "color": COLORS[5]}
            axes.plot(trace.at, trace.force / per, label="measured", **look)
            for number, cycle in enumerate(found.cycles):
                name = "Eq. 16-19" if not number else None
                axes.plot(cycle.at, cycle.fit, color=COLORS[1], linewidth=1.0, label=name)
            for style, name in (("--", "static_friction"), (":", "fitted_kinetic_friction"), (":", "kinetic_friction")):
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
