"""Columns of numbers in a text file of an instrument: a header or none, separators guessed, decimal points or commas. And CSV."""

import codecs
import csv
import io
import math
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Final, NamedTuple

from nanoslip.solver.outcome import InvalidInput
from nanoslip.solver.parameter import require

_SEPARATORS: Final = (
    ("semicolons", re.compile(";"), True),
    ("tabs", re.compile("\t"), True),
    ("commas", re.compile(r'"\s*,\s*"|,\s+'), True),
    ("commas", re.compile(","), False),
    ("spaces", re.compile(r"\s+"), True),
)
"""What may stand between numbers, and whether a comma within a number is its decimal point then."""
_NUMBER: Final = re.compile(r"[-+]?(?:(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?|nan|inf)", re.IGNORECASE)
_LOOKED_AT: Final = 10_000
"""Lines that tell what separates numbers."""


def rows_as_csv(rows: Iterable[Iterable[object]]) -> str:
    """The rows as CSV, the header first."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()


def text_of(path: Path) -> str:
    """The text of an instrument's file. Raises InvalidInput where it cannot be read."""
    if path.exists() and not path.is_file():
        raise InvalidInput("not a regular file")  # a device may never end
    try:
        return decoded(path.read_bytes())
    except OSError as error:
        raise InvalidInput(f"cannot be read: {error.strerror}") from None


def decoded(raw: bytes) -> str:
    """UTF-8, UTF-16 with its mark, or the one-byte letters of Windows, in which all bytes mean something."""
    if raw.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return raw.decode("utf-16", "replace")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        return raw.decode("cp1252", "replace")


class Columns(NamedTuple):
    """Rows of numbers of chosen columns, each with the number of its line; and how the file was read."""

    rows: list[tuple[int, tuple[float, ...]]]
    separator: str
    skipped: int
    """Lines before the numbers."""


def read_columns(path: Path, text: str, columns: tuple[int, ...] = (0, 1)) -> Columns:
    """Numbers of these columns. Raises InvalidInput with the line.

    Numbers are separated as most lines have it; lines before them are skipped, and those that begin with # or %.
    """
    lines = [(number, line) for number, line in enumerate(text.splitlines(), 1) if line.strip()]
    kinds = range(len(_SEPARATORS))
    best = max(kinds, key=lambda kind: sum(bool(_numbers(line, kind, columns)) for _, line in lines[:_LOOKED_AT]))
    parsed = [(number, _numbers(line, best, columns), line) for number, line in lines]
    skipped = next((place for place, (_, row, _) in enumerate(parsed) if row), len(parsed))
    rows = [(number, row) for number, row, line in parsed[skipped:] if row or not line.startswith(("#", "%"))]
    wanted = "two numbers" if columns == (0, 1) else f"{max(columns) + 1} columns of numbers"
    require("number of points", len(rows), len(rows) >= 2, f"at least 2 lines of {wanted} in {path}")
    for number, row in rows:
        if not row or not all(map(math.isfinite, row)):
            raise InvalidInput(f"line {number}: needs {'two' if len(columns) == 2 else len(columns)} finite numbers")
    return Columns(rows, _SEPARATORS[best][0], skipped)


def _numbers(line: str, kind: int, columns: tuple[int, ...]) -> tuple[float, ...]:
    """The numbers of these columns in a line; none where one of them is something else."""
    _, pattern, decimal_commas = _SEPARATORS[kind]
    cells = pattern.split(line.strip() if kind == len(_SEPARATORS) - 1 else line)
    if len(cells) <= max(columns):
        return ()
    found = [cells[column].strip(' \t"') for column in columns]
    words = [cell.replace(",", ".") for cell in found] if decimal_commas else found
    return tuple(map(float, words)) if all(map(_NUMBER.fullmatch, words)) else ()
