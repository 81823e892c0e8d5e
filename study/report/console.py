"""Tables and sentences as text, on a terminal, a pipe or a file."""

import os
import re
import sys
import textwrap
import time
import unicodedata
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import rich.table
from rich.box import SIMPLE_HEAD
from rich.cells import cell_len
from rich.console import Console, ConsoleOptions, RenderResult
from rich.segment import Segment
from rich.text import Text

from nanoslip.study.toml_text import is_one_line

if TYPE_CHECKING:
    from rich.status import Status

GAP: Final = 2
"""Letters between two columns."""
INDENT: Final = "    "
"""Indentation of lines below their row."""
LEAST_ROOM: Final = 14
"""Letters that a sentence needs to stand in its column; where it has fewer it stands below its row."""
WIDE: Final = 200
"""Width in letters of tables for a pipe or a file, unless COLUMNS is set."""
PATIENCE: Final = 2.0
"""Seconds in which `counting` shows nothing."""
FAILED: Final = "red"
"""Style of failures."""
_NO_BREAK: Final = "\N{NO-BREAK SPACE}"
_TOGETHER: Final = re.compile(r" [=±<≤>≥+] |nanoslip (?=[a-z])|(?<=\d) (?=\w{1,3}\))")
"""Words that belong together: words joined by a sign, the name of a command, and a size with its unit in brackets."""
_NUMBER: Final = re.compile(r"(?!.*[^\W\d_]{4})[-+]?[\d.]|[–…-]?$|(nan|inf)\b")
"""The start of a number with its error and unit; four letters in a row are a word, as in `3 completed`, which counts members."""


def wrap_sentence(text: str, width: int, first: str = INDENT, later: str = INDENT) -> list[str]:
    """A sentence in lines of at most this width where its words allow it; what belongs together is one word.

    first, later: indents of the first line and of later lines.
    """
    plain = _escape_controls(text)
    joined = _TOGETHER.sub(lambda match: whole(match.group()), plain)
    # A path or a command that is broken, at a hyphen too, can no longer be copied.
    lines = textwrap.wrap(
        joined, width, initial_indent=first, subsequent_indent=later, break_long_words=False, break_on_hyphens=False
    )
    # Joined words get their spaces back after the lines are cut.
    return [line.replace(_NO_BREAK, " ") for line in lines]


def whole(text: object) -> str:
    """A path, or words to be typed, as one word of a sentence, which `wrap_sentence` never breaks."""
    return str(text).replace(" ", _NO_BREAK)


@dataclass(frozen=True, slots=True)
class Table:
    """A header and rows of text, most important columns first; the last one holds an outcome or a sentence, and alone is wrapped.

    Too wide: titles are folded, then columns left out from the right and named below, but none that identifies a row or was asked
    for, then cells are folded. Then each sentence stands below its row, or requested columns are in several tables; at last every
    cell has a line.
    """

    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    labels: int = 1
    """Number of leading columns that label the row."""
    failed: frozenset[int] = frozenset()
    """Numbers of the rows that a terminal shows in colour."""
    asked: int = 0
    """Number of columns after the labels that were requested."""
    names: tuple[str, ...] = ()
    """Variables of the columns between the labels and the last one; empty if these are none."""

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """The table in `options.max_width` letters."""
        width = options.max_width
        folded, tight = self._widths()
        beside = self._widths_beside_sentences(width)
        if beside:
            yield self._grid(beside, width - _width(beside))
            yield from _name_missing(self.header[len(beside) : -1], width)
            return
        for widths in (folded[: len(tight)], tight):
            if _width(widths) <= width:
                yield from self._above_sentences(widths, console, options)
                return
        parts = list(self._parts(width, folded))
        # A single row reads better as a list of cells than as several tables of a row each.
        if parts and len(self.rows) > 1:
            yield from parts
        else:
            yield from self._cards(width)

    def shown_names(self, width: int) -> tuple[str, ...]:
        """Variables of the columns that are shown in this many letters."""
        beside = self._widths_beside_sentences(width)
        # Too narrow for that, a table has its requested columns, or a line for each cell.
        shown = len(beside) - self.labels if beside else self.asked or len(self.names)
        return self.names[:shown]

    def _widths(self) -> tuple[list[int], list[int]]:
        """Widths of all columns except the last, with folded titles; in labels and requested columns cells are folded, too."""
        last = len(self.header) - 1
        least = min(self.labels + self.asked, last)
        columns = list(zip(self.header, *self.rows, strict=True))[:last]
        folded = [max(_longest_word(title), _widest(cells)) for title, *cells in columns]
        return folded, [max(map(_longest_word, cells)) for cells in columns[:least]]

    def _widths_beside_sentences(self, width: int) -> list[int]:
        """Widths of the columns that fit into a width with the last one beside them; empty if not all requested ones do."""
        folded, tight = self._widths()
        *columns, sentences = zip(self.header, *self.rows, strict=True)
        least_room = min(_widest(sentences), LEAST_ROOM)
        needed = max(least_room, *map(_longest_word, sentences))
        wide = [_widest(cells) for cells in columns]
        fewer = [folded[:count] for count in range(len(folded), len(tight) - 1, -1)]
        # The order is that of loss: first columns at full width, then fewer of them, at last broken cells.
        for widths in (wide, *fewer, tight):
            if width - _width(widths) >= needed:
                return widths
        return []

    def _parts(self, width: int, folded: Sequence[int]) -> "Iterator[Table]":
        """Tables with the labels and as many requested columns as fit, the last with the sentences; none if one does not fit."""
        last = len(self.header) - 1
        room = width - _width(folded[: self.labels])
        groups: list[list[int]] = []
        # No table is open yet: the first column opens one.
        free = -1
        for place in range(self.labels, min(self.labels + self.asked, last)):
            needed = folded[place] + GAP
            # A column that does not fit beside the labels alone fits into no table.
            if needed > room:
                return
            if needed > free:
                groups.append([])
                free = room
            groups[-1].append(place)
            free -= needed
        if len(groups) < 2:
            return
        columns = list(zip(self.header, *self.rows, strict=True))
        blank = ("",) * len(columns[last])
        for group in groups:
            sentences = columns[last] if group is groups[-1] else blank
            shown = [columns[place] for place in group]
            chosen = [*columns[: self.labels], *shown, sentences]
            header, *rows = zip(*chosen, strict=True)
            yield replace(self, header=header, rows=tuple(rows), asked=len(group))

    def _above_sentences(self, widths: Sequence[int], console: Console, options: ConsoleOptions) -> RenderResult:
        """The first columns side by side, and below each row its sentence."""
        # Rich prints a grid as a whole: its header is rendered once, and cut off from the grid of each row,
        # so that a sentence can stand between two rows.
        header = console.render_lines(self._grid(widths, of=()), options, pad=False)
        for line in header:
            yield from (*line, Segment.line())
        for number, row in enumerate(self.rows):
            grid = self._grid(widths, of=(number,))
            lines = console.render_lines(grid, options, pad=False)
            for line in lines[len(header) :]:
                yield from (*line, Segment.line())
            sentence = wrap_sentence(row[-1], options.max_width)
            if sentence:
                yield _lines(sentence, self._style(number))

    def _grid(self, widths: Sequence[int], room: int = 0, of: Iterable[int] | None = None) -> rich.table.Table:
        """Lay out the first columns side by side in these widths, and the last one in the remaining room, if there is any.

        of: numbers of the rows that are shown.
        """
        grid = rich.table.Table(
            box=SIMPLE_HEAD,
            show_edge=False,
            pad_edge=False,
            # The box has one letter between columns, too.
            padding=(0, GAP - 1, 0, 0),
            header_style="bold",
            border_style="bold",
        )
        places = list(enumerate(widths))
        if room:
            places.append((-1, room))
        for place, letters in places:
            numbers = all(_NUMBER.match(row[place]) for row in self.rows)
            width = None if place == -1 else letters
            title = Text(self.header[place])
            grid.add_column(title, width=width, justify="right" if numbers else "left")
        for number in range(len(self.rows)) if of is None else of:
            row = self.rows[number]
            wrapped = [wrap_sentence(row[place], letters, "", "") for place, letters in places]
            cells = map("\n".join, wrapped)
            grid.add_row(*map(Text, cells), style=self._style(number))
        return grid

    def _cards(self, width: int) -> Iterator[Text]:
        """Lay out every cell on a separate line, after its title: label columns and requested columns, or all columns
        if none is requested."""
        last = len(self.header) - 1
        kept = min(self.labels + self.asked, last) if self.asked else last
        for number, row in enumerate(self.rows):
            lines = [""]
            for place in (*range(kept), last):
                title, cell = self.header[place], row[place]
                indent = INDENT if len(lines) > 1 else ""
                text = f"{title}: {cell}" if title else cell
                if cell:
                    lines += wrap_sentence(text, width, indent, indent + INDENT)
            yield _lines(lines, self._style(number))
        yield from _name_missing(self.header[kept:last], width)

    def _style(self, number: int) -> str:
        return FAILED if number in self.failed else ""


def _width(widths: Sequence[int]) -> int:
    """Letters that columns of these widths take, each with the gap after it."""
    return sum(widths) + GAP * len(widths)


def _name_missing(titles: Sequence[str], width: int) -> Iterator[Text]:
    """Name the columns that a table has no room for, if there are any."""
    if titles:
        yield _lines(wrap_sentence(f"not shown, for lack of width: {', '.join(titles)}", width, first=""))


def _widest(cells: Iterable[str]) -> int:
    return max(map(cell_len, cells), default=0)


def _longest_word(text: str) -> int:
    return _widest(wrap_sentence(text, 1, "", ""))


def _lines(lines: Iterable[str], style: str = "") -> Text:
    return Text("\n".join(lines), style)


def _escape_controls(text: str) -> str:
    """A text in which letters that terminals obey, or that are half of a letter, are escaped, but line breaks."""
    letters = (letter if _is_plain(letter) else ascii(letter)[1:-1] for letter in text)
    return "".join(letters)


def _is_plain(letter: str) -> bool:
    """True if a terminal shows a letter and does not obey it, and for a line break."""
    if letter.isprintable() or letter == "\n":
        return True
    return is_one_line(letter) and unicodedata.category(letter) != "Cs"


def console(stderr: bool = False, unlimited: int = WIDE) -> Console:
    """Standard output or error as a console of rich: as wide as the terminal or COLUMNS, `unlimited` without either."""
    out = Console(stderr=stderr, highlight=False, markup=False)
    # Rich obeys COLUMNS by itself.
    has_columns = os.environ.get("COLUMNS", "").isdigit()
    if not (_has_width(out) or has_columns):
        out.width = unlimited
    return out


def _has_width(out: Console) -> bool:
    """True for a terminal of a known width. A launcher may give its ranks one of no size, behind which is a file."""
    if not out.is_terminal:
        return False
    with suppress(OSError, ValueError, AttributeError):
        return os.get_terminal_size(out.file.fileno()).columns > 0
    return True


def print_table(*tables: Table) -> None:
    """Print tables to standard output, between empty lines."""
    for table in tables:
        lines = (table.header, *table.rows)
        plain_rows = [tuple(map(_escape_controls, row)) for row in lines]
        header, *rows = plain_rows
        plain_table = replace(table, header=header, rows=tuple(rows))
        # The table has wrapped its lines: rich must not wrap them again at the width of a pipe.
        console().print("", plain_table, soft_wrap=True)
    console().print()


def print_sentences(sentences: Iterable[str], style: str = "", stderr: bool = False) -> None:
    """Print each sentence on separate lines, as wide as the terminal or COLUMNS; on a single line if a program reads
    the output.

    Words that `whole` has joined stay together.
    """
    out = console(stderr, sys.maxsize)
    for sentence in filter(None, sentences):
        lines = wrap_sentence(sentence, out.width, first="")
        out.print(_lines(lines, style), soft_wrap=True)


def note(sentence: str, stderr: bool = False) -> None:
    """Print one sentence."""
    print_sentences([sentence], stderr=stderr)


def print_entries(entries: Mapping[str, str]) -> None:
    """Print the meaning of each name, a name a line."""
    out = console(unlimited=sys.maxsize)
    indent = " " * (max(map(len, entries)) + GAP)
    for name, meaning in entries.items():
        title = name.ljust(len(indent))
        lines = wrap_sentence(meaning, out.width, title, indent)
        out.print(_lines(lines), soft_wrap=True)


def print_error(message: str) -> None:
    """Print the lines of a message to standard error; continuation lines are indented."""
    print_sentences(f"Error: {message}".splitlines(), stderr=True)


@contextmanager
def counting(words: str) -> Iterator[Callable[[int], None]]:
    """Callback for the number done so far; a terminal shows it if the work takes long.

    words: `{} cases planned`.
    """
    # Standard output belongs to the result, which may go to a file or another program.
    out, begun = console(stderr=True), time.monotonic()
    shown: list[Status] = []
    with ExitStack() as stack:

        def show(number: int) -> None:
            # A status that flashes up and vanishes disturbs more than it tells.
            if time.monotonic() < begun + PATIENCE:
                return
            if not shown:
                shown.append(stack.enter_context(out.status("")))
            shown[0].update(words.format(number))

        yield show if out.is_terminal else lambda _: None
