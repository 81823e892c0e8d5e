"""Diagrams as tables: on the terminal, and in Markdown."""

import math
from collections.abc import Iterable

from nanoslip.solver.view import with_error
from nanoslip.study.accuracy.diagram import Diagram
from nanoslip.study.manifest.parameters import Value, words_of
from nanoslip.study.report.console import Table

MARK = "*"


def as_table(diagram: Diagram) -> Table:
    """All rows of a diagram, a value and its uncertainty in one cell; the rows on the front are marked."""
    keys = words_of("numerics")  # stay as they are written
    header = [name if name in keys else name.replace("_", " ") for name in diagram.shown]
    cells = [tuple(_cell(row[name], row.get(f"{name}_uncertainty")) for name in diagram.shown) for row in diagram.rows]
    if not diagram.error:
        return Table(tuple(header), tuple(cells))
    rows = ((*row, MARK if marked else "") for row, marked in zip(cells, diagram.on_front, strict=True))
    return Table((*header, "front"), tuple(rows))


def as_markdown(diagrams: Iterable[Diagram], title: str) -> str:
    """All diagrams, each under its name with what its errors are held against; their columns where no front is marked."""
    parts = [f"# {title}\n"]
    for diagram in diagrams:
        table = as_table(diagram)
        lines = [table.header, ("---",) * len(table.header), *table.rows]
        front = f" {MARK}: no other row is as good in less time." if diagram.error else ""
        parts.append(f"## {diagram.title}\n\nReference: {diagram.reference}.{front}\n")
        if not diagram.error:
            columns = zip(table.header, (diagram.words[name] for name in diagram.shown), strict=True)
            parts.append("\n".join(f"- *{name}*: {meaning}" for name, meaning in columns) + "\n")
        parts.append("\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n")
    return "\n".join(parts)


def _cell(value: Value, uncertainty: Value | None) -> str:
    if not isinstance(value, float):
        return str(value)
    if math.isnan(value):
        return "–"
    if isinstance(uncertainty, float) and math.isfinite(uncertainty):
        return with_error(value, uncertainty)
    return f"{value:.3g}"
