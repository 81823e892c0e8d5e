"""Values of parameters as they were written: columns of a campaign's axes or of its table of cases, not yet checked."""

import csv
import io
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from study.parameters import WORDS, Value
from study.problems import ManifestError, shown, unknown


class Given(NamedTuple):
    """A value and where it was written."""

    where: str
    value: Any


Columns = dict[str, list[Given]]
"""Word of a parameter -> its values."""


@dataclass(frozen=True, slots=True)
class Table:
    """A CSV file of cases: a header of parameters' words, then one case per line."""

    raw: bytes
    text: str
    columns: Columns


def read_text(path: Path) -> tuple[bytes, str]:
    """A file's bytes and its UTF-8 text. Raises ManifestError."""
    try:
        raw = path.read_bytes()
    except (OSError, ValueError) as error:
        raise ManifestError([f"{path}: cannot be read: {getattr(error, 'strerror', error)}"]) from None
    try:
        return raw, raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ManifestError([f"{path}: byte {error.start}: not UTF-8 text"]) from None


def read_table(path: Path) -> Table:
    """Read a table of cases. Raises ManifestError with one line per problem."""
    raw, text = read_text(path)
    reader = csv.reader(io.StringIO(text, newline=""), skipinitialspace=True, strict=True)
    try:
        lines = [(reader.line_num, row) for row in reader if any(cell.strip() for cell in row)]
    except csv.Error as error:
        raise ManifestError([f"{path}: line {reader.line_num}: not CSV: {error}"]) from None
    if len(lines) < 2:
        raise ManifestError([f"{path}: {len(lines)} lines: needs a header of parameters and at least one case"])
    header = [word.strip() for word in lines[0][1]]
    problems = [f"column {shown(word)}: {unknown(word, WORDS)}" for word in header if word not in WORDS]
    problems += [f"column {word}: needs to appear once" for word in WORDS if header.count(word) > 1]
    for line, row in lines[1:]:
        if len(row) != len(header):
            problems.append(f"line {line}: {len(row)} values: needs {len(header)}, one for each column")
    if problems:
        raise ManifestError(f"{path}: {problem}" for problem in problems)
    columns: Columns = {
        word: [Given(f"{path}: line {line}: {word}", _number_or_text(row[position].strip())) for line, row in lines[1:]]
        for position, word in enumerate(header)
    }
    return Table(raw, text, columns)


def _number_or_text(cell: str) -> Value:
    if cell in ("true", "false"):  # as in TOML
        return cell == "true"
    for kind in (int, float):
        try:
            return kind(cell)
        except ValueError:
            continue
    return cell
