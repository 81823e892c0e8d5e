"""Files of columns: options with units, and sentences on how a file was read and which parts were left out."""

import math
from collections.abc import Iterator

from nanoslip.solver.outcome import quote_value
from nanoslip.solver.parameter import Parameter
from nanoslip.study.commands.plans import plural
from nanoslip.study.commands.words import Refusal
from nanoslip.study.manifest.parameters import as_written, plain
from nanoslip.study.measured.columns import FileColumns, OneWay


def parse_option(name: str, text: str | None, unit: str, positive: bool = False) -> float:
    """An option's value in an SI unit; NaN where it is not given. Raises Refusal."""
    if text is None:
        return math.nan
    try:
        value = float(plain(f"--{name}", text, Parameter(name, unit=unit)))
    except ValueError:
        value = math.inf
    if math.isfinite(value) and (value > 0.0 or not positive):
        return value
    need = f"a number{' above 0' * positive}"
    raise Refusal(f'--{name} = {quote_value(text)}: needs {need}, or one with a unit as "1 {as_written(unit)}"')


def separation(columns: FileColumns) -> str:
    """Separator of the numbers, and how many lines are above and below them."""
    above = f", below {plural(columns.skipped, 'line')}" if columns.skipped else ""
    below = f", above {plural(columns.below, 'line')}" if columns.below else ""
    return f"numbers are separated by {columns.separator}{above}{below}"


def lines_left_out(columns: FileColumns, rows: OneWay, holes: int) -> Iterator[str]:
    """Lines that were left out, and equal places."""
    number, line, text = columns.left_out
    if number:
        yield f"{plural(number, 'line')} of other text left out, the first is line {line}: {quote_value(text)}"
    if holes:
        yield f"{plural(holes, 'line')} with a hole left out"
    if rows.restored:
        yield f"{plural(rows.restored, 'place')} equal to the one before by rounding: taken as evenly spaced"
    if rows.merged:
        yield f"{plural(rows.merged, 'line')} at the place of the one before: averaged with it"
