"""Command `trace` of one file, or of several in one table with friction over their loads."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from nanoslip.solver.view import with_error
from nanoslip.study.commands.plans import plural, print_json
from nanoslip.study.commands.trace import (
    TRACE_SYMBOLS,
    TraceReading,
    TraceSeries,
    as_mapping,
    json_of_trace,
    number_table,
    sentence,
    show_trace,
)
from nanoslip.study.commands.words import Refusal
from nanoslip.study.figures import shared
from nanoslip.study.manifest.parameters import as_written
from nanoslip.study.measured.means import Measured, mean_with_error
from nanoslip.study.measured.over_load import friction_of_files, has_different_loads
from nanoslip.study.measured.recording import Trace
from nanoslip.study.measured.trace import TraceNumbers
from nanoslip.study.report.console import Table, note, print_sentences, print_table, whole
from nanoslip.study.results.store import write_files

LEVELS: Final = {"": ("kinetic_friction", "mean_force"), "static_": ("static_friction",)}
"""Begin of a line's names -> the frictions that it goes through, the first that a file has."""
MARKS: Final = {"": "o", "static_": "^"}
"""Begin of a line's names -> its marks in a picture."""


@dataclass(frozen=True, slots=True, eq=False)
class FileNumbers:
    """Numbers of one file of a series, its trace, and its normal load in N, NaN if that is not known."""

    trace: Trace
    load: float
    found: TraceNumbers

    def force(self, names: Sequence[str]) -> Measured | None:
        """The first of these frictions in N; None if there is none, or if the load is not known."""
        number = next((self.found.numbers[name] for name in names if name in self.found.numbers), None)
        if number is None or not math.isfinite(self.load):
            return None
        newtons = self.load if number.unit == "1" else 1.0
        return Measured(newtons * number.value, newtons * number.uncertainty, number.of, "N")


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
    files = [Path(word) for word in words if "=" not in word or Path(word).exists()]
    parameters = tuple(word for word in words if Path(word) not in files)
    if not files:
        raise Refusal("needs a FILE, as nanoslip trace lab.csv")
    if len(loads) > 1 and len(loads) != len(files):
        raise Refusal(
            f"--load is given {plural(len(loads), 'time')}: needs one for all files, or one for each of {len(files)}"
        )
    of_files = loads if len(loads) == len(files) else (loads or (None,)) * len(files)
    readings = [TraceReading(load=load, **reading) for load in of_files]
    if len(files) == 1:
        show_trace(files[0], parameters, over, picture, events, as_json, readings[0])
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
            trace, load, found = reading.numbers(file)
        except Refusal as error:
            refused[name] = error.format_message()
            continue
        known = load if math.isfinite(load) else trace.mean_load
        measured[name] = FileNumbers(trace, known, found)
    numbers = numbers_of_series(list(measured.values()))
    series = None
    if events and measured:
        traces = {name: each.trace for name, each in measured.items()}
        weights = {name: each.load for name, each in measured.items()}
        series = TraceSeries.of(traces, weights, readings[0])
    if as_json:
        of_files = {
            name: {"load": each.load, **json_of_trace(each.trace, each.found)} for name, each in measured.items()
        }
        distributions = {"events": as_mapping(series.numbers)} if series else {}
        print_json({"files": of_files, "refused": refused, **as_mapping(numbers), **distributions})
    else:
        print_table(_series_table(names, measured, refused))
        if numbers:
            print_table(number_table(numbers))
        if series:
            print_table(number_table(series.numbers))
        flags = {flag.name: flag for each in measured.values() for flag in each.found.flags}
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


def _short_names(files: Sequence[Path]) -> list[str]:
    """Names of files without folders, or with them where two would be equal."""
    names = [file.name for file in files]
    return names if len(set(names)) == len(names) else [str(file) for file in files]


def numbers_of_series(files: Sequence[FileNumbers]) -> dict[str, Measured]:
    """Lines of friction over load if the loads differ; means over the files, with the ± of their scatter, if they do not."""
    found: dict[str, Measured] = {}
    for begin, names in LEVELS.items():
        known = [(each.load, force) for each in files if (force := each.force(names))]
        loads, forces = [load for load, _ in known], [force for _, force in known]
        if has_different_loads(loads):
            found |= {f"{begin}{name}": number for name, number in friction_of_files(loads, forces).items()}
    if found or len(files) < 2:
        return found
    units = {name: number.unit for each in files for name, number in each.found.numbers.items()}
    for name, unit in units.items():
        values = [each.found.numbers[name].value for each in files if name in each.found.numbers]
        if len(values) == len(files):
            found[name] = mean_with_error(values, unit)
    return found


def _series_table(names: Sequence[str], measured: Mapping[str, FileNumbers], refused: Mapping[str, str]) -> Table:
    """A row for each file: its load and its numbers, and flags by name, or why it is refused."""
    units = {name: number.unit for each in measured.values() for name, number in each.found.numbers.items()}
    titles = []
    for name, unit in units.items():
        symbol = TRACE_SYMBOLS.get(name, name)
        titles.append(symbol if unit == "1" else f"{symbol} ({as_written(unit)})")
    rows = []
    for file in names:
        each = measured.get(file)
        cells = [_cell(each, name) for name in units]
        load = f"{each.load:.4g}" if each and math.isfinite(each.load) else "–"
        remark = ", ".join(each.found.flagged) if each else refused[file]
        rows.append((file, load, *cells, remark))
    failed = frozenset(number for number, file in enumerate(names) if file in refused)
    return Table(("file", "W (N)", *titles, "flags"), tuple(rows), failed=failed)


def _cell(file: FileNumbers | None, name: str) -> str:
    number = file.found.numbers.get(name) if file else None
    return with_error(number.value, number.uncertainty) if number else "–"


def _draw_series(files: Mapping[str, FileNumbers], numbers: Mapping[str, Measured], form: str) -> bytes:
    """Friction of each file over its load, with the lines through them. Raises Refusal where no load is known."""
    with shared.column(2.8, shared.PAGE) as figure:
        axes = figure.subplots()
        drawn = False
        for place, (begin, names) in enumerate(LEVELS.items()):
            known = [(each.load, force) for each in files.values() if (force := each.force(names))]
            if not known:
                continue
            drawn = True
            look: dict[str, Any] = {"color": shared.COLORS[place], "linestyle": "none", "marker": MARKS[begin]}
            loads, values, errors = np.array([(load, *force[:2]) for load, force in known]).T
            axes.errorbar(loads, values, np.nan_to_num(errors), label=TRACE_SYMBOLS[names[0]], markersize=4.0, **look)
            if slope := numbers.get(f"{begin}friction_slope"):
                intercept = numbers[f"{begin}friction_intercept"].value
                ends = np.array([0.0, float(loads.max())])
                label = f"{intercept:.3g} N + {slope.value:.3g} W"
                axes.plot(ends, intercept + slope.value * ends, color=shared.COLORS[place], label=label)
        if not drawn:
            raise Refusal(
                '--picture: friction of several files is drawn over their loads; needs --load, as "2 N", for each'
            )
        axes.set(xlabel="normal load W (N)", ylabel="friction (N)")
        shared.legend(figure)
        return shared.image(figure, form)
