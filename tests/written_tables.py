"""Tables that commands measure, as CSV files: the site shows them (docs/measured.md)."""

import csv
import io
from collections.abc import Iterable
from pathlib import Path


def show(rows: Iterable[Iterable[object]], path: Path | None = None) -> None:
    """Print the rows, the header first, and write them where a path is given."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    print(text.getvalue())
    if path:
        path.write_text(text.getvalue(), "utf-8")
