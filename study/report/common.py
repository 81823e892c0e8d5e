"""Values that are the same in all rows of a table: printed once above it, not in every row."""

from dataclasses import replace

from study.report.columns import Table

MOST: float = 1e12
"""Whole numbers below it are written as such."""
NOTHING = "–"
"""The cell of a number that is not known."""


def plain(value: float, digits: int) -> str:
    """A number in so many digits; a whole one that has more in all of them, in groups of three."""
    if 10**digits <= abs(value) < MOST and value == round(value):
        return f"{value:,.0f}".replace(",", "\N{NO-BREAK SPACE}")
    return f"{value:.{digits}g}"


def said_once(table: Table) -> tuple[Table, list[str]]:
    """A table without the columns whose cells are all the same, and sentences with their values.

    Labels and the last column stay, and a table of one row stays as it is.
    """
    if len(table.rows) < 2:
        return table, []
    last = len(table.header) - 1
    columns = list(zip(*table.rows, strict=True))
    alike = [place for place in range(table.labels, last) if len(set(columns[place])) == 1]
    known = [f"{table.header[place]} = {columns[place][0]}" for place in alike if columns[place][0] != NOTHING]
    unknown = [table.header[place] for place in alike if columns[place][0] == NOTHING]
    kept = [place for place in range(last + 1) if place not in alike]
    asked = sum(table.labels <= place < table.labels + table.asked for place in kept)
    rows = tuple(tuple(row[place] for place in kept) for row in table.rows)
    sentences = [f"In all rows: {', '.join(known)}."] if known else []
    if unknown:
        sentences.append(f"Not known in any row: {', '.join(unknown)}.")
    return replace(table, header=tuple(table.header[place] for place in kept), rows=rows, asked=asked), sentences
