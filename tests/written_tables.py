"""Tables that commands measure, as CSV files: the site shows them (docs/measured.md)."""

from collections.abc import Iterable
from pathlib import Path

from nanoslip.study.measured.columns import rows_as_csv


def show(rows: Iterable[Iterable[object]], path: Path | None = None) -> None:
    """Print the rows, the header first, and write them where a path is given."""
    text = rows_as_csv(rows)
    print(text)
    if path:
        path.write_text(text, "utf-8")
