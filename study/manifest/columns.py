"""Problems of a campaign, one line each, and its CSV files: the table of cases and the pin's roughness."""

import csv
import difflib
import io
import json
import math
import re
import unicodedata
from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from nanoslip.solver.case import FARTHEST_POINT, LEAST_APART, Heterogeneity, parameters_of_a_case
from nanoslip.solver.drive import parameters_of_a_drive
from nanoslip.solver.outcome import SHOWN, InvalidInput, quoted
from nanoslip.solver.slab import SCHEMES
from nanoslip.study.manifest.parameters import Value, axes, of_symbol, table_of

# Messages about a wrong campaign: one line per problem, with its place, the value and what is allowed.

LONGEST_PATH = 200
"""The most characters of a path that a message shows."""

MOST_LINES = 100
"""Problems that a message lists: an axis may have a hundred thousand wrong values."""

ONE_LINE = "needs to be one line without control characters"


class ManifestError(Exception):
    """A campaign file is wrong. `lines` has one printable line for each of its problems."""

    def __init__(self, lines: Iterable[str]) -> None:
        self.lines = tuple(map(printable, lines))
        super().__init__(self.lines)

    def __str__(self) -> str:
        more = len(self.lines) - MOST_LINES
        return "\n".join([*self.lines[:MOST_LINES], *([f"and {more} problems more"] if more > 0 else [])])


def shown(value: object) -> str:
    """A value in the notation of TOML or nearly so, at most SHOWN characters."""
    try:
        text = repr(value) if isinstance(value, float) else json.dumps(value, ensure_ascii=False, default=str)
    except (ValueError, RecursionError):  # Python writes no number of more than 4300 digits, and nothing nested deeply
        return quoted(value)
    return text if len(text) <= SHOWN else text[: SHOWN - 3] + "..."


def key_shown(key: str) -> str:
    """A key of a campaign file, at most SHOWN characters; in quotes where it is not a single word."""
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) and len(key) <= SHOWN else shown(key)


def printable(text: str) -> str:
    """A text on one line, with escapes for what a terminal obeys: control characters, changes of the direction of writing."""
    return "".join(letter if letter.isprintable() else repr(letter)[1:-1] for letter in text)


def path_shown(path: Path) -> str:
    """A path as one printable line of at most LONGEST_PATH characters."""
    text = printable(str(path))
    return text if len(text) <= LONGEST_PATH else text[: LONGEST_PATH - 3] + "..."


def one_line(text: str) -> bool:
    """Whether a text is without line breaks and other control characters: a terminal obeys them, and a dataset ends at a null."""
    return not any(unicodedata.category(letter) in ("Cc", "Zl", "Zp") for letter in text)


def need(make: Callable[..., object], *arguments: object) -> str:
    """Call `make`; return what is needed (`needs ...`) where it raises InvalidInput, an empty text where it does not."""
    try:
        make(*arguments)
    except InvalidInput as error:
        return "needs " + str(error).rpartition(": needs ")[2]
    return ""


def unknown(word: str, allowed: Collection[str]) -> str:
    """Advice on a word that is not allowed here: the table that takes it, what it is a symbol of or like, or all allowed ones."""
    return meant_by(word, allowed) or "unknown; needs one of " + ", ".join(allowed)


def meant_by(word: str, allowed: Collection[str]) -> str:
    """The same of a word that somebody may have meant; empty for any other text."""
    if table := table_of(word):
        return f"belongs in [{table}]" + (" or [axes]" if word in axes() else "")
    of_drives = parameters_of_a_drive()
    if word in of_drives:
        return "belongs in [[drives]] or [drive_axes]"
    meant = of_symbol(word, {**parameters_of_a_case(), **of_drives})
    if meant != word:
        return f"unknown; did you mean {meant}" + ("?" if meant in allowed else f", which {unknown(meant, allowed)}?")
    near = difflib.get_close_matches(word[:SHOWN], allowed, 1)
    return f"unknown; did you mean {near[0]}?" if near else ""


class Given(NamedTuple):
    """A value of a campaign, and the file and key (or line) where it stands."""

    where: str
    value: Any


Columns = dict[str, list[Given]]
"""Word of a parameter -> its values: those of an axis, of a column of the table, or the one of a constant."""


@dataclass(frozen=True, slots=True)
class Table:
    """A CSV file of cases: a header of parameters' words, then one case per line."""

    raw: bytes
    text: str
    columns: Columns


def read_text(path: Path, given: str | None = None) -> tuple[bytes, str]:
    """The bytes of a file, and their UTF-8 text; or of `given`, the file's text. Raises ManifestError where it cannot be read."""
    if given is not None:
        return given.encode(), given
    if not one_line(str(path)):
        raise ManifestError([f"{path_shown(path)}: name of a file: {ONE_LINE}"])
    try:
        if path.exists() and not path.is_file():
            raise ValueError("not a regular file")  # a device may never end
        raw = path.read_bytes()
    except (OSError, ValueError) as error:
        raise ManifestError([f"{path_shown(path)}: cannot be read: {getattr(error, 'strerror', error)}"]) from None
    try:
        return raw, raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ManifestError([f"{path}: byte {error.start}: not UTF-8 text"]) from None


def read_table(path: Path, given: str | None = None) -> Table:
    """Read a table of cases from its file, or from `given`, the file's text. Raises ManifestError with one line per problem."""
    raw, text = read_text(path, given)
    lines = _lines(path, text)
    if len(lines) < 2:
        raise ManifestError([f"{path}: {len(lines)} lines: needs a header of parameters and at least one case"])
    header = [word.strip() for word in lines[0][1]]
    if not any(
        word in axes() or meant_by(word, axes()) for word in header
    ):  # another file: its text is nobody's business
        raise ManifestError([f"{path}: line {lines[0][0]}: needs a header of parameters, as intrinsic_friction,radius"])
    problems = [f"column {shown(word)}: {unknown(word, axes())}" for word in header if word not in axes()]
    problems += [f"column {word}: needs to appear once" for word in axes() if header.count(word) > 1]
    for line, row in lines[1:]:
        if len(row) != len(header):
            problems.append(f"line {line}: {len(row)} values: needs {len(header)}, one for each column")
    if problems:
        raise ManifestError(f"{path}: {problem}" for problem in problems)
    columns: Columns = {
        word: [Given(f"{path}: line {line}: {word}", _of_cell(word, row[position].strip())) for line, row in lines[1:]]
        for position, word in enumerate(header)
    }
    return Table(raw, text, columns)


@dataclass(frozen=True, slots=True)
class PinProfile:
    """A CSV file of a pin's roughness: the header `xi,height`, then one point of the profile per line, in L_x."""

    raw: bytes
    text: str
    points: tuple[tuple[float, float], ...]


def read_profile(path: Path, given: str | None = None) -> PinProfile:
    """Read a pin's roughness from its file, or from `given`, the file's text. Raises ManifestError with one line per problem."""
    raw, text = read_text(path, given)
    lines = _lines(path, text)
    if not lines or [word.strip() for word in lines[0][1]] != ["xi", "height"]:
        raise ManifestError([f"{path}: line {lines[0][0] if lines else 1}: needs the header xi,height"])
    problems: list[str] = []
    points: list[tuple[float, float]] = []
    for line, row in lines[1:]:
        point = _point(row)
        if wrong := _wrong_point(point, points[-1:]):
            problems.append(f"{path}: line {line}: {shown(','.join(row))}: {wrong}")
        elif point:
            points.append(point)
    if not problems and len(points) < 2:
        problems.append(f"{path}: number of points = {len(points)}: needs at least 2")
    if problems:
        raise ManifestError(problems)
    return PinProfile(raw, text, tuple(points))


def _point(row: list[str]) -> tuple[float, float] | None:
    """The point of a line; None where it is none."""
    try:
        xi, height = map(float, row)
    except ValueError:
        return None
    return (xi, height) if math.isfinite(xi) and math.isfinite(height) else None


def _wrong_point(point: tuple[float, float] | None, before: list[tuple[float, float]]) -> str:
    """What is needed instead of a point of a profile, behind the last good one; empty where all is well."""
    if point is None:
        return "needs two finite numbers, xi and height"
    if max(map(abs, point)) > FARTHEST_POINT:
        return f"needs |ξ| and |height| up to {FARTHEST_POINT:g}"
    if before and point[0] - before[0][0] < LEAST_APART:
        return need(partial(Heterogeneity, roughness=(*before, point)))
    return ""


def _lines(path: Path, text: str) -> list[tuple[int, list[str]]]:
    """The non-empty lines of a CSV file as lists of cells, each with its line number."""
    reader = csv.reader(io.StringIO(text, newline=""), skipinitialspace=True, strict=True)
    try:
        return [(reader.line_num, row) for row in reader if any(cell.strip() for cell in row)]
    except csv.Error as error:
        raise ManifestError([f"{path}: line {reader.line_num}: not CSV: {error}"]) from None


def _of_cell(word: str, cell: str) -> Value | None:
    """The value of a cell; None of an empty one where a setting of a scheme is not given."""
    return number_or_text(cell) if cell or word not in SCHEMES.settings() else None


def number_or_text(cell: str) -> Value:
    """A value from its text: `true`, `false`, a number, else the text itself."""
    if cell in ("true", "false"):  # as in TOML
        return cell == "true"
    for kind in (int, float):
        try:
            return kind(cell)
        except ValueError:
            continue
    return cell
