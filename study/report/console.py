"""Tables and sentences as text, on a terminal, a pipe or a file."""

import os
import re
import sys
import textwrap
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final, NamedTuple

import rich.console
import rich.text
from rich.cells import cell_len

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


# A table as lines of a given width: whole columns are left out where it is too wide, no cell is ever cut or folded.
#
# What was asked for is left out last: before that rows are numbered, and a table above says which row is which.

GAP: Final = "  "
INDENT: Final = "    "
"""In front of what stands below its row."""
LONGEST_WORD: Final = 30
"""Characters of an outcome: what is longer is a sentence, which may stand below its row as a whole."""
LEAST_ROOM: Final = 24
"""Characters that a sentence needs to stand in its column; where it has fewer it stands below its row."""
_NO_BREAK: Final = "\N{NO-BREAK SPACE}"
_TOGETHER: Final = re.compile(" [=±<≤>≥] |nanoslip (?=[a-z])")
"""Words that belong together: what a sign joins, and the name of a command."""
_NUMBER: Final = re.compile(r"(?!.*[^\W\d_]{4})[-+]?[\d.]|[–…-]?$|(nan|inf)\b")
"""The start of a number with its error and unit; four letters in a row are a word, as in `3 completed`, which counts members."""
_SENTENCE: Final = re.compile(r": |; | (?=\[)")
"""Where an outcome ends and its flags, its message or the next outcome of an ensemble begin."""


@dataclass(frozen=True, slots=True)
class Table:
    """A header and rows of text, columns in the order of their importance; the last one holds an outcome or a sentence."""

    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    labels: int = 1
    """The first so many columns say which row it is: they are never left out, nor is the last one."""
    failed: frozenset[int] = frozenset()
    """Numbers of the rows that a terminal shows in colour."""
    asked: int = 0
    """So many columns behind the labels are what was asked for."""
    prose: bool = False
    """Whether the last column holds sentences, not outcomes: they may be folded as any sentence."""


class Line(NamedTuple):
    """One line of a table as it is printed."""

    text: str
    sort: str = ""
    """`header`, `failed`, or empty for an ordinary one."""


def table_lines(table: Table, width: int) -> list[Line]:
    """A table in so many characters: columns before the last are left out from the right until it fits, and are named below.

    A sentence in the last column is wrapped there; the message of an outcome that does not fit stands below its row. Where the
    labels alone are too wide, every cell has a line.
    """
    found = _fitting(table, width)
    if found is None:
        return list(_cards(table, width))
    layout, kept = found
    if kept < table.labels + table.asked < len(table.header):
        names, numbered = _numbered(table)
        above, below = _fitting(names, width), _fitting(numbered, width)
        if above and below and below[1] - numbered.labels > kept - table.labels:
            return [*above[0].lines(), Line(""), *_shown(numbered, *below, width)]
    return list(_shown(table, layout, kept, width))


def _shown(table: Table, layout: "_Layout", kept: int, width: int) -> Iterator[Line]:
    yield from layout.lines()
    yield from _left_out(table.header[kept:-1], width)


def _fitting(table: Table, width: int) -> "tuple[_Layout, int] | None":
    """The layout with the most columns that fits, and how many these are without the last; None where the labels are too wide."""
    last = len(table.header) - 1
    for folded in (False, True):
        for kept in range(last, min(table.labels, last) - 1, -1):
            if not folded and kept < last:
                break  # a header on several lines is better than a column less
            layout = _Layout(table, (*range(kept), last), width, folded)
            if layout.fits:
                return layout, kept
    return None


def _numbered(table: Table) -> tuple[Table, Table]:
    """A table as two: the labels of its rows, and what is known of them, both behind the number of the row."""
    known = table.labels
    header, rows = ("case", *table.header), [(str(n), *row) for n, row in enumerate(table.rows, start=1)]
    names = Table(header[: known + 1], tuple(row[: known + 1] for row in rows), known)
    told = tuple((row[0], *row[known + 1 :]) for row in rows)
    return names, replace(table, header=("case", *header[known + 1 :]), rows=told, labels=1)


def wrapped(text: str, width: int, first: str = INDENT, later: str = INDENT) -> list[str]:
    """A sentence in lines of at most this width where its words allow it; what belongs together is one word.

    first, later: what the first line and the others begin with.
    """
    joined = _TOGETHER.sub(lambda found: whole(found.group()), text)
    lines = textwrap.wrap(
        joined, width, initial_indent=first, subsequent_indent=later, break_long_words=False, break_on_hyphens=False
    )
    return [line.replace(_NO_BREAK, " ") for line in lines]


def whole(text: object) -> str:
    """A path, or words to be typed, as one word of a sentence, which `wrapped` never breaks."""
    return str(text).replace(" ", _NO_BREAK)


class _Layout:
    """Some columns of a table, side by side."""

    def __init__(self, table: Table, columns: tuple[int, ...], width: int, folded: bool) -> None:
        self._table, self._columns, self._width = table, columns, width
        *others, last = columns
        self._titles = {each: _title(table, each, folded) for each in columns}
        self._widths = {each: self._widest(each, [row[each] for row in table.rows]) for each in others}
        self._room = width - sum(each + len(GAP) for each in self._widths.values())
        self._left = {each for each in columns if not all(map(_NUMBER.match, (row[each] for row in table.rows)))}
        if last not in self._left:
            self._widths[last] = self._widest(last, [row[last] for row in table.rows])
        self.fits = self._room >= self._widest(last, [_least(table, row) for row in table.rows])

    def lines(self) -> Iterator[Line]:
        """Header, rule and rows."""
        height = max(map(len, self._titles.values()))
        for number in range(height):
            titles = {each: ([""] * (height - len(text)) + text)[number] for each, text in self._titles.items()}
            yield Line(self._line(titles), "header")
        bodies = [(self._body(row), "failed" * (i in self._table.failed)) for i, row in enumerate(self._table.rows)]
        widest = max((cell_len(line) for texts, _ in bodies for line in texts[:1]), default=0)
        titled = self._width - self._room + max(map(cell_len, self._titles[self._columns[-1]]))
        yield Line("─" * max(widest, titled), "header")
        for texts, sort in bodies:
            yield from (Line(text, sort) for text in texts)

    def _widest(self, column: int, cells: list[str]) -> int:
        return max(map(cell_len, (*self._titles[column], *cells)))

    def _body(self, row: tuple[str, ...]) -> list[str]:
        """A row on its line, and below it what of its last cell does not fit there."""
        *others, last = self._columns
        indent = " " * (self._width - self._room)
        beside = wrapped(row[last], self._width, indent, indent) or [""]
        if self._table.prose and self._room >= LEAST_ROOM and max(map(cell_len, beside)) <= self._width:
            here, *more = beside[0].strip(), *beside[1:]
        else:
            here, below = _split(row[last], self._room)
            more = wrapped(below, self._width)
        return [self._line({each: row[each] for each in others} | {last: here}), *more]

    def _line(self, cells: dict[int, str]) -> str:
        parts = []
        for each, text in cells.items():
            space = " " * (self._widths.get(each, 0) - cell_len(text))
            parts.append(text + space if each in self._left else space + text)
        return GAP.join(parts).rstrip()


def _title(table: Table, column: int, folded: bool) -> list[str]:
    """The title of a column; folded, in lines as wide as its numbers where its words allow it."""
    text = table.header[column]
    if not (folded and text):
        return [text]
    cells = (_least(table, row) if column == len(row) - 1 else row[column] for row in table.rows)
    width = max(cell_len(each) for each in (*cells, *text.split()))
    return textwrap.wrap(text, width, break_long_words=False, break_on_hyphens=False)


def _heads(cell: str) -> Iterator[str]:
    """What of a cell may stay in its row, the longest first: all of it, its outcome with flags, its outcome."""
    yield cell
    for found in reversed(list(_SENTENCE.finditer(cell))):
        if found.start() <= LONGEST_WORD or cell[: found.start()].endswith("]"):
            yield cell[: found.start()]


def _least(table: Table, row: tuple[str, ...]) -> str:
    """What of a row's last cell has to stay there: an outcome, nothing of a sentence."""
    if table.prose:
        return ""
    *_, shortest = _heads(row[-1])
    return shortest if cell_len(shortest) <= LONGEST_WORD else ""


def _split(cell: str, room: int) -> tuple[str, str]:
    """What of a cell stays in its row, and what stands below."""
    head = next((each for each in _heads(cell) if cell_len(each) <= room), "")
    return head, cell[len(head) :].lstrip(":;").strip()


def _cards(table: Table, width: int) -> Iterator[Line]:
    """Every cell on a line of its own, behind its title."""
    for number, row in enumerate(table.rows):
        sort = "failed" * (number in table.failed)
        yield Line("")
        for place, (title, cell) in enumerate(zip(table.header, row, strict=True)):
            text = f"{title}: {cell}" if title else cell
            indent = INDENT * bool(place)
            for part in wrapped(text, width, indent, indent + INDENT) if cell else ():
                yield Line(part, sort)


def _left_out(names: tuple[str, ...], width: int) -> Iterator[Line]:
    if names:
        yield from map(Line, wrapped(f"not shown, for lack of width: {', '.join(names)}", width, first=""))


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
