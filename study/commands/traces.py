"""Command `trace` for a single file, or for several files in one table with friction over their loads."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from nanoslip.solver.view import with_error
from nanoslip.study.commands.plans import plural, print_json
from nanoslip.study.commands.trace import (
    DIGITS,
    TRACE_SYMBOLS,
    TraceReading,
    TraceSeries,
    as_mapping,
    json_of_trace,
    label_axis,
    line_equation,
    number_table,
    sentence,
    show_trace,
)
from nanoslip.study.commands.words import Refusal
from nanoslip.study.dataset.units import prefix_factor
from nanoslip.study.figures import shared
from nanoslip.study.measured.means import Measured, mean_with_error
from nanoslip.study.measured.over_load import friction_of_files, has_different_loads
from nanoslip.study.measured.recording import Trace
from nanoslip.study.measured.trace import TraceFlag, TraceNumbers
from nanoslip.study.report.console import Table, note, print_sentences, print_table, whole
from nanoslip.study.results.store import write_files

LEVELS: Final = {"": ("kinetic_friction", "mean_force"), "static_": ("static_friction",)}
"""Begin of a line's names -> the frictions that it goes through, the first that a file has."""
MARKS: Final = {"": "o", "static_": "^"}
"""Begin of a line's names -> its marks in a picture."""


@dataclass(frozen=True, slots=True, eq=False)
class FileNumbers:
    """Numbers of a file in a series, its trace, and its normal load in N, NaN if unknown."""

    trace: Trace
    load: float
    found: TraceNumbers

    def force(self, names: Sequence[str]) -> Measured | None:
        """The first of these frictions in N; None if there is none, or if the load is not known."""
        numbers = [self.found.numbers[name] for name in names if name in self.found.numbers]
        if not numbers or not math.isfinite(self.load):
            return None
        number = numbers[0]
        newtons = self.load if number.unit == "1" else 1.0
        value, error = newtons * number.value, newtons * number.uncertainty
        return Measured(value, error, number.of, "N")


def show_traces(
    words: tuple[str, ...],
    loads: tuple[str, ...],
    over: Path | None,
    picture: Path | None,
    events: Path | None,
    as_json: bool,
    **reading: Any,
) -> None:
    """Print the numbers of a file, or a table of several and friction over their loads. reading: see `TraceReading`."""
    # A file whose name has an equals sign is a file if it exists, else a parameter.
    files = [Path(word) for word in words if "=" not in word or Path(word).exists()]
    parameters = tuple(word for word in words if Path(word) not in files)
    if not files:
        raise Refusal("needs a FILE, as nanoslip trace lab.csv")
    if len(loads) > 1 and len(loads) != len(files):
        raise Refusal(
            f"--load is given {plural(len(loads), 'time')}: needs one for all files, or one for each of {len(files)}"
        )
    of_files: Sequence[str | None] = loads
    if len(loads) != len(files):
        of_files = (loads or (None,)) * len(files)
    readings = [TraceReading(load=load, **reading) for load in of_files]
    if len(files) == 1:
        outputs = (over, picture, events, as_json)
        show_trace(files[0], parameters, *outputs, readings[0])
        return
    if over or parameters:
        raise Refusal(f"{'--over' if over else parameters[0]}: needs one FILE, not {len(files)}")
    _show_series(files, readings, picture, events, as_json)


def _show_series(
    files: Sequence[Path], readings: Sequence[TraceReading], picture: Path | None, events: Path | None, as_json: bool
) -> None:
    form = shared.file_format(picture) if picture else ""
    names = _short_names(files)
    measured: dict[str, FileNumbers] = {}
    refused: dict[str, str] = {}
    for name, file, reading in zip(names, files, readings, strict=True):
        try:
            trace, load, file_numbers = reading.numbers(file)
        except Refusal as error:
            # A file that cannot be read does not cost the numbers of the others.
            refused[name] = error.format_message()
            continue
        mean_load = load if math.isfinite(load) else trace.mean_load
        measured[name] = FileNumbers(trace, mean_load, file_numbers)
    numbers = numbers_of_series(list(measured.values()))
    series = None
    if events and measured:
        traces = {name: numbers_of_file.trace for name, numbers_of_file in measured.items()}
        weights = {name: numbers_of_file.load for name, numbers_of_file in measured.items()}
        series = TraceSeries.from_traces(traces, weights, readings[0])
    if as_json:
        facts = {name: _file_data(of_file) for name, of_file in measured.items()}
        distributions = {"events": as_mapping(series.numbers)} if series else {}
        head = {"files": facts, "refused": refused}
        print_json({**head, **as_mapping(numbers), **distributions})
    else:
        print_table(_series_table(names, measured, refused))
        if numbers:
            print_table(number_table(numbers))
        if series:
            print_table(number_table(series.numbers))
        flags: dict[str, TraceFlag] = {}
        for of_file in measured.values():
            flags |= {flag.name: flag for flag in of_file.found.flags}
        print_sentences(f"{name}: {sentence(flag)}" for name, flag in flags.items())
    written = {}
    if picture:
        written[picture] = _draw_series(measured, numbers, form)
    if events and series:
        written[events] = series.text.encode()
    write_files(written)
    for path in written:
        note(whole(f"written: {path}"), stderr=as_json)
    if refused:
        raise Refusal(f"{len(refused)} of {plural(len(files), 'file')} cannot be read as a trace: {', '.join(refused)}")


def _file_data(file: FileNumbers) -> dict[str, Any]:
    """Load, numbers and flags of a file for JSON."""
    return {"load": file.load, **json_of_trace(file.trace, file.found)}


def _short_names(files: Sequence[Path]) -> list[str]:
    """Names of files without folders, or with them where two would be equal."""
    names = [file.name for file in files]
    if len(set(names)) == len(names):
        return names
    return [str(file) for file in files]


def numbers_of_series(files: Sequence[FileNumbers]) -> dict[str, Measured]:
    """Lines of friction over load if the loads differ; means over the files, with the ± of their scatter, if they do not."""
    series_numbers: dict[str, Measured] = {}
    for begin, names in LEVELS.items():
        of_files = [(file.load, file.force(names)) for file in files]
        pairs = [(load, force) for load, force in of_files if force]
        loads = [load for load, _ in pairs]
        forces = [force for _, force in pairs]
        if has_different_loads(loads):
            line = friction_of_files(loads, forces)
            series_numbers |= {f"{begin}{name}": number for name, number in line.items()}
    if series_numbers or len(files) < 2:
        return series_numbers
    units = _units(files)
    for name, unit in units.items():
        having = [file.found.numbers for file in files if name in file.found.numbers]
        values = [numbers[name].value for numbers in having]
        # A number that some files lack would be the mean of a choice.
        if len(values) == len(files):
            series_numbers[name] = mean_with_error(values, unit)
    return series_numbers


def _series_table(names: Sequence[str], measured: Mapping[str, FileNumbers], refused: Mapping[str, str]) -> Table:
    """A row for each file: its load and its numbers, and flags by name, or why it is refused."""
    units = _units(measured.values())
    loads = [of_file.load for of_file in measured.values()]
    per_load, unit_of_load = prefix_factor(loads, "N")
    titles, factors = [f"W ({unit_of_load})"], {}
    for name, unit in units.items():
        having = [of_file.found.numbers for of_file in measured.values() if name in of_file.found.numbers]
        values = [numbers[name].value for numbers in having]
        factors[name], prefixed = prefix_factor(values, unit)
        symbol = TRACE_SYMBOLS.get(name, name)
        titles.append(f"{symbol} ({prefixed})" if prefixed else symbol)
    rows = []
    for file in names:
        of_file = measured.get(file)
        cells = [_cell(of_file, name, factor) for name, factor in factors.items()]
        load = f"{per_load * of_file.load:.{DIGITS}g}" if of_file and math.isfinite(of_file.load) else "–"
        remark = ", ".join(of_file.found.flagged) if of_file else refused[file]
        rows.append((file, load, *cells, remark))
    failed = frozenset(number for number, file in enumerate(names) if file in refused)
    header = ("file", *titles, "flags")
    return Table(header, tuple(rows), failed=failed)


def _units(files: Iterable[FileNumbers]) -> dict[str, str]:
    """Unit of each number that any of these files has."""
    units: dict[str, str] = {}
    for file in files:
        units |= {name: number.unit for name, number in file.found.numbers.items()}
    return units


def _cell(file: FileNumbers | None, name: str, factor: float) -> str:
    number = file.found.numbers.get(name) if file else None
    return with_error(factor * number.value, factor * number.uncertainty) if number else "–"


def _draw_series(files: Mapping[str, FileNumbers], numbers: Mapping[str, Measured], form: str) -> bytes:
    """Friction of each file over its load, with the lines through them. Raises Refusal where no load is known."""
    with shared.column(2.8, shared.PAGE) as figure:
        axes = figure.subplots()
        drawn_loads: list[float] = []
        drawn_forces: list[float] = []
        for place, (begin, names) in enumerate(LEVELS.items()):
            of_files = [(file.load, file.force(names)) for file in files.values()]
            pairs = [(load, force) for load, force in of_files if force]
            if not pairs:
                continue
            drawn_loads += [load for load, _ in pairs]
            drawn_forces += [force.value for _, force in pairs]
            color = shared.COLORS[place]
            look: dict[str, Any] = {"color": color, "linestyle": "none", "marker": MARKS[begin]}
            look |= {"label": TRACE_SYMBOLS[names[0]], "markersize": 4.0}
            points = [(load, *force[:2]) for load, force in pairs]
            loads, values, errors = np.array(points).T
            axes.errorbar(loads, values, np.nan_to_num(errors), **look)
            if slope := numbers.get(f"{begin}friction_slope"):
                intercept = numbers[f"{begin}friction_intercept"].value
                ends = np.array([0.0, float(loads.max())])
                label = line_equation(slope.value, intercept)
                axes.plot(ends, intercept + slope.value * ends, color=color, label=label)
        if not drawn_loads:
            raise Refusal(
                '--picture: friction of several files is drawn over their loads; needs --load, as "2 N", for each'
            )
        label_axis(axes.xaxis, "normal load W", drawn_loads, "N")
        label_axis(axes.yaxis, "friction", drawn_forces, "N")
        shared.legend(figure)
        return shared.image(figure, form)
