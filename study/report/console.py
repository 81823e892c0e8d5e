"""Print tables and sentences on a terminal, a pipe or a file."""

import os
from collections.abc import Iterable
from typing import Final

import rich.console
import rich.text

from study.report.columns import Line, Table, table_lines, wrapped

__all__ = ["WIDE", "Table", "console", "print_sentences", "print_table", "table_text"]

WIDE: Final = 200
"""Width in characters of output that goes to a pipe or a file, where COLUMNS does not say another one."""
_STYLES: Final = {"header": "bold", "failed": "red", "": ""}


def console(stderr: bool = False) -> rich.console.Console:
    """Standard output or error as a console of rich: as wide as the terminal, COLUMNS, or `WIDE` without either."""
    found = rich.console.Console(stderr=stderr, highlight=False, markup=False)
    if found.is_terminal or os.environ.get("COLUMNS", "").isdigit():  # which rich obeys
        return found
    return rich.console.Console(stderr=stderr, width=WIDE, highlight=False, markup=False)


def print_table(table: Table) -> None:
    """Print a table to standard output, between empty lines."""
    _print([Line(""), *table_lines(table, console().width), Line("")])


def print_sentences(sentences: Iterable[str], sort: str = "") -> None:
    """Print each sentence to standard output on lines of its own. sort: of `Line`."""
    _print(Line(line, sort) for each in sentences for line in wrapped(each, console().width, first=""))


def table_text(title: str, tables: Iterable[Table]) -> rich.text.Text:
    """A title and tables as one text in the colours of a terminal, as `print_table` prints each."""
    text = rich.text.Text(title)
    for table in tables:
        for line in [Line(""), *table_lines(table, console().width)]:
            text.append("\n").append(line.text, _STYLES[line.sort])
    return text


def _print(lines: Iterable[Line]) -> None:
    out = console()
    for line in lines:
        out.print(rich.text.Text(line.text, _STYLES[line.sort]), soft_wrap=True)
