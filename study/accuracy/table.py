"""Sheets as tables: on the terminal, and in Markdown."""

import math
from collections.abc import Iterable

from study.accuracy.sheet import Sheet
from study.console import Table
from study.parameters import Value

MARK = "*"


def as_table(sheet: Sheet) -> Table:
    """All rows of a sheet, a value and its uncertainty in one cell; the rows on the front are marked."""
    header = [name.replace("_", " ") for name in sheet.shown]
    rows = [
        (*(_cell(row[name], row.get(f"{name}_uncertainty")) for name in sheet.shown), MARK if marked else "")
        for row, marked in zip(sheet.rows, sheet.on_front, strict=True)
    ]
    return Table((*header, "front"), tuple(rows))


def as_markdown(sheets: Iterable[Sheet], title: str) -> str:
    """All sheets, each under its name with what its errors are held against."""
    parts = [f"# {title}\n"]
    for sheet in sheets:
        table = as_table(sheet)
        lines = [table.header, ("---",) * len(table.header), *table.rows]
        parts.append(
            f"## {sheet.title}\n\nReference: {sheet.reference}. {MARK}: no other row is as good in less time.\n"
        )
        parts.append("\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n")
    return "\n".join(parts)


def _cell(value: Value, uncertainty: Value | None) -> str:
    if not isinstance(value, float):
        return str(value)
    if math.isnan(value):
        return "–"
    if isinstance(uncertainty, float) and math.isfinite(uncertainty):
        return f"{value:.4g} ± {uncertainty:.1g}"
    return f"{value:.3g}"
