"""What is shown on the terminal, and on whatever stands in for one."""

from dataclasses import dataclass

import rich.box
import rich.console
import rich.table

WIDE = 200
"""Columns of output that no terminal limits."""


@dataclass(frozen=True, slots=True)
class Table:
    """Rows of text under a header; the last column is prose."""

    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def console(stderr: bool = False) -> rich.console.Console:
    """Standard output or error as rich sees it: as wide as the terminal, or `WIDE` where there is none."""
    found = rich.console.Console(stderr=stderr, highlight=False, markup=False)
    return (
        found if found.is_terminal else rich.console.Console(stderr=stderr, width=WIDE, highlight=False, markup=False)
    )


def print_table(table: Table) -> None:
    """Print a table to standard output."""
    drawn = rich.table.Table(box=rich.box.SIMPLE)
    for name in table.header:
        drawn.add_column(name, justify="left" if name == table.header[-1] else "right", overflow="fold")
    for row in table.rows:
        drawn.add_row(*row)
    console().print(drawn)
