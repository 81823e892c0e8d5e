"""Print tables and progress on a terminal, a pipe or a file."""

from dataclasses import dataclass

import rich.box
import rich.console
import rich.table

WIDE = 200
"""Width in characters of output that goes to a pipe or a file."""


@dataclass(frozen=True, slots=True)
class Table:
    """A header and rows of text; the last column holds sentences."""

    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def console(stderr: bool = False) -> rich.console.Console:
    """Standard output or error as a console of rich: as wide as the terminal, or `WIDE` without one."""
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
