"""Print tables and sentences on a terminal, a pipe or a file."""

import os
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Final

import rich.console
import rich.text

from study.report.columns import Line, Table, table_lines, whole, wrapped

if TYPE_CHECKING:
    from rich.status import Status

__all__ = [
    "WIDE",
    "Table",
    "console",
    "counting",
    "print_entries",
    "print_error",
    "print_sentences",
    "print_table",
    "say",
    "table_text",
    "whole",
]

WIDE: Final = 200
"""Width in characters of output that goes to a pipe or a file, where COLUMNS does not say another one."""
PATIENCE: Final = 2.0
"""Seconds in which `counting` shows nothing."""
_STYLES: Final = {"header": "bold", "failed": "red", "": ""}


def console(stderr: bool = False) -> rich.console.Console:
    """Standard output or error as a console of rich: as wide as the terminal, COLUMNS, or `WIDE` without either."""
    found = rich.console.Console(stderr=stderr, highlight=False, markup=False)
    if _limited(found):
        return found
    return rich.console.Console(stderr=stderr, width=WIDE, highlight=False, markup=False)


def print_table(*tables: Table) -> None:
    """Print tables to standard output, between empty lines."""
    for table in tables:
        _print([Line(""), *table_lines(table, console().width)])
    _print([Line("")])


def print_sentences(sentences: Iterable[str], sort: str = "", stderr: bool = False) -> None:
    """Print each sentence on lines of its own: as wide as the terminal or COLUMNS, else one, as programs read it.

    sort: of `Line`. Words that `whole` has joined stay together.
    """
    width = _room(stderr)
    _print([Line(line, sort) for each in sentences for line in wrapped(each, width, first="")], stderr)


def say(sentence: str, stderr: bool = False) -> None:
    """Print one sentence."""
    print_sentences([sentence], stderr=stderr)


def print_entries(entries: Mapping[str, str]) -> None:
    """Print what each name stands for, a name a line."""
    indent = " " * (max(map(len, entries)) + 2)
    for name, meaning in entries.items():
        first = f"{name:{len(indent)}}"
        _print([Line(line) for line in wrapped(meaning, _room(), first, later=indent)])


def print_error(message: str) -> None:
    """Print the lines of a message to standard error; those that go on are indented."""
    print_sentences(f"Error: {message}".splitlines(), stderr=True)


def table_text(title: str, tables: Iterable[Table]) -> rich.text.Text:
    """A title and tables as one text in the colours of a terminal, as `print_table` prints each."""
    text = rich.text.Text(title)
    for table in tables:
        for line in [Line(""), *table_lines(table, console().width)]:
            text.append("\n").append(line.text, _STYLES[line.sort])
    return text


@contextmanager
def counting(words: str) -> Iterator[Callable[[int], None]]:
    """A callback that takes the number done so far; a terminal shows it while it grows, if that takes long.

    words: `{} cases planned`.
    """
    out, begun = console(stderr=True), time.monotonic()
    shown: list[Status] = []
    with ExitStack() as stack:

        def heard(number: int) -> None:
            if time.monotonic() < begun + PATIENCE:
                return
            if not shown:
                shown.append(stack.enter_context(out.status("")))
            shown[0].update(words.format(number))

        yield heard if out.is_terminal else lambda _: None


def _room(stderr: bool = False) -> int:
    """The width of a sentence."""
    found = console(stderr)
    return found.width if _limited(found) else sys.maxsize


def _limited(found: rich.console.Console) -> bool:
    """Whether somebody says how wide lines may be; rich obeys COLUMNS itself."""
    return found.is_terminal or os.environ.get("COLUMNS", "").isdigit()


def _print(lines: Iterable[Line], stderr: bool = False) -> None:
    out = console(stderr)
    for line in lines:
        out.print(rich.text.Text(line.text, _STYLES[line.sort]), soft_wrap=True)
