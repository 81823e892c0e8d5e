"""Read columns of numbers from an instrument's text file: names, units and numbers, whatever separates them. And CSV."""

import codecs
import csv
import io
import math
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.arrays import Floats
from nanoslip.solver.outcome import InvalidInput, quote_value
from nanoslip.study.measured.units import factor

_SEPARATORS: Final = (
    ("semicolons", re.compile(r"(?<!\s)\s*;\s*"), True),
    ("tabs", re.compile(r"(?<! ) *\t *"), True),
    ("commas", re.compile(r'"\s*,\s*"|,\s+'), True),
    ("commas", re.compile(r"(?<!\s)\s*,\s*"), False),
    ("spaces", re.compile(r"\s+"), True),
)
"""Separators of numbers, with True if a comma within a number is then its decimal point.

A separator begins where no space is before it: else a run of spaces would be passed again from each of them.
"""
_SPACES: Final = len(_SEPARATORS) - 1
_NUMBER: Final = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[ed][-+]?\d+)?", re.IGNORECASE)
"""A finite number; D begins the exponent of a double in Fortran."""
_HOLE: Final = re.compile(r"[^a-df-z]*+(?:nan|inf|n/?a|null|none)?[^a-z]*+", re.IGNORECASE)
"""Cell of a line of numbers that has none there: no word but these."""
_COMMENT: Final = ("#", "%")
_IN_HEADERS: Final = (
    re.compile(r"\s{2,}|\t"),
    re.compile(r"(?<=[\])])\s*+[,;]?\s*+(?=\S)"),
    re.compile(r"[,;]\s*"),
    re.compile(r"\s+(?![\[(])"),
)
"""Separators of names above numbers that are separated differently."""
_SECTION: Final = re.compile(r"^\[[^\]]*\]\s+(?=[^\[\s])")
_IN_BRACKETS: Final = re.compile(r"(.*?)\s?[\[(]\s?([^\])]*?)\s?[\])]\s?")
_UNIT_BEHIND: Final = re.compile(r"(.+?)(?:\sin\s|\s?/\s?|[_,\s]{1,3})([^\W\d]+)")
"""Both are for names in which no space follows another."""
_UNIT: Final = re.compile(r"[A-Za-zµμÅ]{1,15}")
_LOOKED_AT: Final = 10_000
"""Number of lines from which the separator of numbers is determined."""
DIMENSIONS: Final = ("s", "m", "N", "Pa")
"""Units of the dimensions by which columns are chosen."""


_FORMULA: Final = re.compile(r"[=@\t\r]|[-+](?!\.?\d[\d.]*([eE][-+]?\d+)?$|inf$)")
"""Beginning of a cell that spreadsheets compute: no number."""


def rows_as_csv(rows: Iterable[Iterable[object]]) -> str:
    """The rows as CSV, the header first; a text that a spreadsheet would take for a formula begins with an apostrophe."""
    lines: list[str] = []  # a writer that ends them by two letters quotes cells that have one of these
    writer = csv.writer(SimpleNamespace(write=lines.append), lineterminator="\r\n")
    writer.writerows(map(_inert, row) for row in rows)
    return "".join(f"{line[:-2]}\n" for line in lines)


def _inert(cell: object) -> object:
    return f"'{cell}" if isinstance(cell, str) and _FORMULA.match(cell) else cell


def file_text(path: Path) -> str:
    """The text of an instrument's file. Raises InvalidInput if it cannot be read."""
    if path.exists() and not path.is_file():
        raise InvalidInput("not a regular file")  # a device may never end
    try:
        raw = path.read_bytes()
    except OSError as error:
        raise InvalidInput(f"cannot be read: {error.strerror}") from None
    if kind := kind_of_binary(raw):
        raise InvalidInput(f"is {kind}: needs text with columns of numbers, as instruments export it")
    return decode_text(raw)


_BINARY: Final = {
    b"\x89PNG": "a PNG picture",
    b"\xff\xd8\xff": "a JPEG picture",
    b"II*\x00": "a TIFF picture",
    b"MM\x00*": "a TIFF picture",
    b"%PDF": "a PDF document",
    b"PK\x03\x04": "a zip archive, as spreadsheets (.xlsx, .ods) are",
    b"\xd0\xcf\x11\xe0": "an old spreadsheet (.xls)",
    b"\x89HDF": "an HDF5 or netCDF file",
    b"CDF": "a netCDF file",
    b"\x1f\x8b": "a gzip archive",
    b"GWY": "a file of Gwyddion (.gwy)",
}
"""First bytes of files that are no text -> kind of file."""


_NUMPY: Final = b"\x93NUMPY"
"""First bytes of a file of `numpy.save`."""


def _rows_of_array(raw: bytes) -> str:
    """Rows of a two-dimensional array of `numpy.save` as text, to the last digit."""
    try:
        values = np.load(io.BytesIO(raw), allow_pickle=False)
    except (ValueError, EOFError, OSError):  # whose message quotes the file's bytes
        raise InvalidInput("is no array of numbers that NumPy can read") from None
    if values.ndim != 2 or values.dtype.kind not in "fiu":
        raise InvalidInput(f"is an array of {values.dtype} of shape {values.shape}: needs numbers in rows and columns")
    lines = [" ".join(map(repr, row)) for row in values.tolist()]
    return "\n".join(lines)


def kind_of_binary(raw: bytes) -> str:
    """Kind of a file that is no text; empty for text. UTF-16 has zeros, and a mark."""
    kinds = [name for first, name in _BINARY.items() if raw.startswith(first)]
    kind = kinds[0] if kinds else ""
    if kind or raw.startswith((_NUMPY, codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return kind
    return "a binary file" if b"\0" in raw[:4096] else ""


def decode_text(raw: bytes) -> str:
    """UTF-8, UTF-16 with its mark, or Windows-1252, in which every byte is a character; NumPy's arrays as rows.

    Raises InvalidInput for an array that is not numeric with two dimensions.
    """
    if raw.startswith(_NUMPY):
        return _rows_of_array(raw)
    if raw.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return raw.decode("utf-16", "replace")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        return raw.decode("cp1252", "replace")


def read_cells(text: str) -> list[tuple[int, list[str]]]:
    """Cells of each line of a CSV file that is not empty, with the line's number. Raises InvalidInput.

    Semicolons or tabs separate them if the first line has more of these than commas; then numbers may have decimal commas.
    """
    filled = (line for line in text.splitlines() if line.strip())
    first = next(filled, "")
    separator = max(",;\t", key=first.count)
    lines_of_text = io.StringIO(text, newline="")
    # Strict, as an open quotation mark would otherwise swallow the rest of the file without a word.
    reader = csv.reader(lines_of_text, delimiter=separator, skipinitialspace=True, strict=True)
    try:
        lines = []
        for row in reader:
            if any(map(str.strip, row)):
                lines.append((reader.line_num, row))
    except csv.Error as error:
        raise InvalidInput(f"line {reader.line_num}: not CSV: {error}") from None
    if separator == ",":
        return lines
    pointed = ((line, map(_with_point, row)) for line, row in lines)
    return [(line, list(row)) for line, row in pointed]


def _with_point(cell: str) -> str:
    """The cell, with a decimal point if it is a number with a decimal comma."""
    pointed = cell.strip().replace(",", ".")
    return pointed if _NUMBER.fullmatch(pointed) else cell


class FileColumn(NamedTuple):
    """A column of numbers, NaN where it has none; its name and unit as the header has them, or empty."""

    name: str
    unit: str
    values: Floats

    @property
    def dimension(self) -> str:
        """SI unit of time, length, force or stress if the unit is one of these, `1` of no unit, else empty."""
        is_pure = self.unit in ("", "1", "-")
        return "1" if is_pure else unit_dimension(self.unit)


class OmittedLines(NamedTuple):
    """Lines between the numbers that are left out: how many, and the number and text of the first."""

    number: int
    line: int
    text: str


@dataclass(frozen=True, slots=True, eq=False)
class FileColumns:
    """All columns of a file, each with a value for every row; and how they were read."""

    columns: tuple[FileColumn, ...]
    lines: NDArray[np.int64]
    """Number of the line of each row."""
    separator: str
    skipped: int
    """Lines above the numbers."""
    below: int
    """Lines below the numbers, less comments."""
    left_out: OmittedLines

    def __str__(self) -> str:
        """The columns in one line: number, name and unit of each."""
        titles = []
        for column in self.columns:
            unit = f" [{column.unit}]" if column.unit else ""
            titles.append(f"{column.name or 'no name'}{unit}")
        return ", ".join(f"{number} {title}" for number, title in enumerate(titles, 1))

    def rows(self, chosen: Sequence[int]) -> "Rows":
        """The chosen columns, less the rows in which one of them has no number. Raises InvalidInput of fewer than two rows."""
        values = np.array([self.columns[column].values for column in chosen])
        complete = np.isfinite(values).all(axis=0)
        # Most lines: else the columns are of different tables, and what both have is chance.
        if complete.sum() < max(2, len(complete) / 2):
            names = " and ".join(str(column + 1) for column in chosen)
            raise InvalidInput(
                f"columns {names}: numbers in {complete.sum()} of {len(complete)} lines: needs them in most"
            )
        places = np.flatnonzero(complete)
        holes = int((~complete).sum())
        return Rows(values[:, complete], self.lines[complete], places, holes)

    def find_column(self, wanted: str) -> int:
        """The place of a column by its number, counted from 1, or by its name or a part of it. Raises InvalidInput."""
        if wanted.isdecimal() and 0 < int(wanted) <= len(self.columns):
            return int(wanted) - 1
        names = [column.name.casefold() for column in self.columns]
        title, _ = _title(wanted)
        words = (wanted.casefold(), title.casefold())
        sure = [place for place, name in enumerate(names) if name in words]
        # A part of a name only if no name is the word: `F` is a column beside `F normal`.
        part = wanted.casefold()
        places = sure or [place for place, name in enumerate(names) if part in name]
        if len(places) != 1:
            raise InvalidInput("column", wanted, f"one of {self}")
        return places[0]


class Rows(NamedTuple):
    """Values (columns, n) of complete rows, their lines, their places among all rows, and how many rows have holes."""

    values: Floats
    lines: NDArray[np.int64]
    places: NDArray[np.int64]
    holes: int


def read_columns(path: Path, text: str, titled: bool = True) -> FileColumns:
    """All columns of numbers. Raises InvalidInput with the text that was met.

    Numbers are separated as most lines have it. A cell that is no number is a hole. titled: False of a matrix, without names
    of columns or a count of points above it: lines of numbers above its rows are lines left out.
    """
    numbered = enumerate(text.splitlines(), 1)
    lines = [(number, line) for number, line in numbered if line.strip()]
    looked_at = [line for _, line in lines[:_LOOKED_AT]]
    shares = [sum(_share(line, kind) for line in looked_at) for kind in range(len(_SEPARATORS))]
    kind = shares.index(max(shares))  # of equals the first
    cells = [_cells(line, kind) for _, line in lines]
    parsed = [_numbers(row, kind) for row in cells]
    full = [place for place, row in enumerate(parsed) if _count(row) >= 2]
    if len(full) < 2:
        met = ""
        if lines:
            number, line = lines[len(lines) // 2]
            met = f"; line {number} is {quote_value(line)}"
        raise InvalidInput(f"number of points = {len(full)}: needs at least 2 lines of two numbers in {path}{met}")
    widths = Counter(len(parsed[place]) for place in full)
    [(width, _)] = widths.most_common(1)
    rows = [place for place, row in enumerate(parsed) if len(row) == width and _count(row)]
    fitting = [place for place in full if len(parsed[place]) == width]
    # Rows of holes at the ends belong to the numbers, so that header and footer are what is neither.
    first, last = _with_holes(cells, parsed, fitting[0], fitting[-1])
    rows = [place for place in rows if first <= place <= last]
    values = np.array([parsed[place] for place in rows], float)
    if titled and _is_header(values):
        rows, values = rows[1:], values[1:]
    numbers = (place for place in range(rows[0]) if _has_numbers_alone(cells[place], parsed[place]))
    start = rows[0] if titled else next(numbers, rows[0])
    between = sorted({*range(start, rows[-1] + 1)} - {*rows})
    unread = [lines[place] for place in between if not _is_comment(lines[place][1])]
    # More lines left out than read: what was taken for the numbers is a part of something else.
    if len(unread) > len(rows):
        need = f"{width} columns of numbers, as line {lines[rows[0]][0]}"
        raise InvalidInput(f"line {unread[0][0]}: {quote_value(unread[0][1])}: needs {need}")
    has_numbers = np.isfinite(values).any(axis=0)
    wide = int(np.flatnonzero(has_numbers)[-1]) + 1  # a separator at the end of lines makes an empty column
    above = [line for _, line in lines[: first * titled]]
    titles = _titles(above, kind, wide, values)
    pairs = zip(titles, values.T[:wide], strict=True)
    columns = tuple(FileColumn(name, unit, column) for (name, unit), column in pairs)
    numbers_of_lines = np.array([lines[place][0] for place in rows])
    behind = [line for _, line in lines[rows[-1] + 1 :]]
    below = sum(not _is_comment(line) for line in behind)
    line_number, words = unread[0] if unread else (0, "")
    omitted = OmittedLines(len(unread), line_number, words)
    separator, *_ = _SEPARATORS[kind]
    return FileColumns(columns, numbers_of_lines, separator, rows[0], below, omitted)


def _numbers(row: Iterable[str], kind: int) -> list[float]:
    return [_number(cell, kind) for cell in row]


def _has_numbers_alone(cells: Iterable[str], numbers: Iterable[float]) -> bool:
    """True for a line of numbers and holes with one number at least."""
    has_number = any(map(math.isfinite, numbers))
    return has_number and all(map(_HOLE.fullmatch, cells))


def _with_holes(cells: Sequence[list[str]], parsed: Sequence[list[float]], first: int, last: int) -> tuple[int, int]:
    """First and last row, with rows of holes before and after: beside a number, no cell of these has a word."""

    def row(place: int) -> bool:
        if not 0 <= place < len(cells) or len(cells[place]) != len(cells[first]):
            return False
        return _has_numbers_alone(cells[place], parsed[place])

    while row(first - 1):
        first -= 1
    while row(last + 1):
        last += 1
    return first, last


def _cells(line: str, kind: int) -> list[str]:
    stripped = line.strip() if kind == _SPACES else line.strip("\r\n")
    _, separator, _ = _SEPARATORS[kind]
    return [cell.strip(' \t"') for cell in separator.split(stripped)]


def _is_comment(line: str) -> bool:
    return line.lstrip().startswith(_COMMENT)


def _number(cell: str, kind: int) -> float:
    """The number of a cell; NaN of anything else."""
    word = cell.replace("\N{MINUS SIGN}", "-")
    word = word.replace(",", ".") if _SEPARATORS[kind][2] else word
    if not _NUMBER.fullmatch(word):
        return math.nan
    return float(word.lower().replace("d", "e"))


def _count(row: Iterable[float]) -> int:
    return sum(map(math.isfinite, row))


def _share(line: str, kind: int) -> float:
    """Share of the cells of a line that are numbers; 0 of fewer than two numbers."""
    cells = [cell for cell in _cells(line, kind) if cell]
    count = _count(_number(cell, kind) for cell in cells)
    return count / len(cells) if count >= 2 else 0.0


def _is_header(values: Floats) -> bool:
    """True if the first row has the number of the rows below it, in no progression with these: a count of points."""
    if len(values) < 4:
        return False
    steps = np.abs(np.diff(values[:3], axis=0))
    counts = values[0] == len(values) - 1
    is_progression = np.isclose(steps[0], steps[1])
    return bool((counts & ~is_progression).any())


def _titles(above: Sequence[str], kind: int, width: int, values: Floats) -> list[tuple[str, str]]:
    """Name and unit of each column, from the last lines above the numbers: names, perhaps with units, or names over units."""
    titles: list[str] = []
    if above:
        titles = _labels(above[-1], kind, width, values)
    if not titles or any(map(_NUMBER.fullmatch, titles)):
        return [("", "")] * width
    bare = [_strip_brackets(label) for label in titles]
    names: list[str] = []
    if len(above) > 1:
        names = _labels(above[-2], kind, width, values)
    stated = [unit for unit in bare if unit not in ("", "1", "-")]
    # Units of other dimensions count only below names, and beside a unit that is needed: a word may be a name and a unit.
    dimensions = list(map(unit_dimension, stated))
    are_units = bool(names) and any(dimensions) and all(map(is_unit, stated))
    if any(bare) and (all(dimensions) or are_units):
        return list(zip(names or [""] * width, bare, strict=True))
    return [_title(label) for label in titles]


def _strip_brackets(label: str) -> str:
    """The unit of a label that is a unit in brackets, else the label."""
    match = _IN_BRACKETS.fullmatch(label)
    return match[2] if match and not match[1] else label


def _labels(line: str, kind: int, width: int, values: Floats) -> list[str]:
    """The labels of the columns in a line above the numbers; none if they do not fit."""
    # Many programs mark their header as a comment.
    marked = line.lstrip().startswith(("#", "%", "!", "*"))
    text = line.strip("\r\n").lstrip("#%!*\N{NO-BREAK SPACE} ") if marked else line
    ways = (_SEPARATORS[kind][1], *_IN_HEADERS)
    plain = _SECTION.sub("", text.strip("\r\n "), count=1)
    split = [_split_labels(way, plain) for way in ways]
    first_labels = split[0]
    if kind != _SPACES and len(first_labels) > width:
        return first_labels[:width]
    if fitting := [labels for labels in split if len(labels) == width]:
        return fitting[0]
    if not 2 <= len(first_labels) < width:
        return []
    # Commas without spaces: decimal commas would divide each number in two.
    if _SEPARATORS[kind] == _SEPARATORS[3]:
        raise InvalidInput(
            f"{quote_value(line)}: {len(first_labels)} names above {width} columns: are there decimal commas?"
        )
    # R's tables have no name above row names, which are numbers in a row.
    is_counted = (np.diff(values[:, 0]) == 1.0).all()
    if len(first_labels) == width - 1 and is_counted:
        return ["", *first_labels]
    unnamed = [""] * (width - len(first_labels))
    return [*first_labels, *unnamed]


def _split_labels(separator: re.Pattern[str], text: str) -> list[str]:
    """The labels in a text, up to the last one that is not empty."""
    labels = [label.strip(' \t"') for label in separator.split(text)]
    while labels and not labels[-1]:
        labels.pop()
    return labels


def _title(label: str) -> tuple[str, str]:
    """Name and unit of a label: `time [s]`, `F (mN)`, `t/ms`, `x_um`, `Weg in mm`. Square brackets always hold a unit."""
    short = " ".join(label.split())
    match = _IN_BRACKETS.fullmatch(short)
    if match and (match[2] in ("", "1", "-") or label.endswith("]") or is_unit(match[2])):
        return match[1], match[2]
    match = _UNIT_BEHIND.fullmatch(short)
    if match and unit_dimension(match[2]):
        return match[1], match[2]
    return label, ""


def is_unit(unit: str) -> bool:
    """True for a unit of any dimension."""
    return math.isfinite(unit_factor(unit, unit))


def unit_dimension(unit: str) -> str:
    """SI unit of time, length, force or stress if the unit is one of these, else empty."""
    if not _UNIT.fullmatch(unit):
        return ""
    dimensions = (dimension for dimension in DIMENSIONS if math.isfinite(unit_factor(unit, dimension)))
    return next(dimensions, "")


def unit_factor(unit: str, into: str) -> float:
    """Factor from a header's unit to another unit; NaN if it has another dimension. Names of units may begin with a capital."""
    scale = factor(unit, into)
    if math.isnan(scale) and len(unit) > 3:
        # Short ones stay as they are: `MM` is no mm, and `mS` no ms.
        return factor(unit.lower(), into)
    return scale


def column_unit(key: str, stated: str, column: FileColumn, usual: str) -> str:
    """The unit of a column: given, that of its header, or the usual one. Raises InvalidInput if the first two differ."""
    if column.unit in ("", "1", "-"):
        return stated or column.unit.replace("-", "1") or usual
    scale = unit_factor(stated, column.dimension) if stated else math.nan
    if not column.dimension or math.isnan(scale):
        return stated or column.unit
    if not math.isclose(scale, unit_factor(column.unit, column.dimension)):
        raise InvalidInput(f"{key} = {quote_value(stated)}: the header has {column.name} in {column.unit}")
    return column.unit


class OneWay(NamedTuple):
    """Increasing values of the first column (n,), the other columns (m, n), their lines, and the repairs.

    reversed: the first column falls in the file. restored: places whose rounded values were equal. merged: rows that
        were averaged with another row at the same place.
    """

    at: Floats
    others: Floats
    lines: NDArray[np.int64]
    reversed: bool
    restored: int
    merged: int


def one_way(rows: Rows, name: str, need: str, turns: bool = True) -> OneWay:
    """Rows in the order of their first column. Raises InvalidInput with the line at which it goes back.

    A first row that alone goes the other way is a header of numbers. Equal places are taken as evenly spaced if a
    line through them is nowhere further off than rounding; else rows of equal place are averaged. turns: the column
    may fall.
    """
    values, lines, places = rows.values, rows.lines, rows.places
    at = values[0]
    # By the second value, as the first may be that of a header.
    way = -1.0 if turns and at[-1] < at[min(1, len(at) - 2)] else 1.0
    if len(at) > 3:
        goes_back = (at[1] - at[0]) * way < 0.0
        others_go_on = (np.diff(at[1:]) * way).min() >= 0.0
        if goes_back and others_go_on:
            values, lines, places = values[:, 1:], lines[1:], places[1:]
            at = values[0]
    steps = np.diff(at) * way
    if (back := np.flatnonzero(steps < 0.0)).size:
        last, now = back[0], back[0] + 1
        raise InvalidInput(f"line {lines[now]}: {name} = {at[now]:g} after {at[last]:g}: needs {name} that {need}")
    equal = int((steps == 0.0).sum())
    if not equal:
        return OneWay(way * at, values[1:], lines, way < 0.0, restored=0, merged=0)
    if not steps.any():
        raise InvalidInput(f"{name} = {at[0]:g} in all lines: needs {name} that {need}")
    # Rounded places are those of even steps, each off by half of the smallest digit at most.
    even = np.polynomial.Polynomial.fit(places, at, 1)(places)
    if np.abs(even - at).max() <= steps[steps > 0.0].min():
        even += at[0] - even[0]
        return OneWay(way * even, values[1:], lines, way < 0.0, restored=equal, merged=0)
    is_first = np.concatenate(([True], steps > 0.0))
    firsts = np.flatnonzero(is_first)
    counts = np.diff(np.append(firsts, len(at)))
    means = np.add.reduceat(values, firsts, axis=1) / counts
    return OneWay(way * at[firsts], means[1:], lines[firsts], way < 0.0, restored=0, merged=equal)
