"""Sentences on files of columns: how they were read, and what was left out of them."""

from collections.abc import Iterator

from nanoslip.solver.outcome import quoted
from nanoslip.study.commands.plans import counted
from nanoslip.study.manifest.columns import FileColumns, OneWay


def separation(columns: FileColumns) -> str:
    """Separator of the numbers, and how many lines are above and below them."""
    above = f", below {counted(columns.skipped, 'line')}" if columns.skipped else ""
    below = f", above {counted(columns.below, 'line')}" if columns.below else ""
    return f"numbers are separated by {columns.separator}{above}{below}"


def lines_left_out(columns: FileColumns, rows: OneWay, holes: int) -> Iterator[str]:
    """Lines that were left out, and equal places."""
    number, line, text = columns.left_out
    if number:
        yield f"{counted(number, 'line')} of other text left out, the first is line {line}: {quoted(text)}"
    if holes:
        yield f"{counted(holes, 'line')} with a hole left out"
    if rows.restored:
        yield f"{counted(rows.restored, 'place')} equal to the one before by rounding: taken as evenly spaced"
    if rows.merged:
        yield f"{counted(rows.merged, 'line')} at the place of the one before: averaged with it"
