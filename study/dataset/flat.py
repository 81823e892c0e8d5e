"""Flat tables as text for other programs: CSV and JSON."""

import json
import math
from collections.abc import Sequence
from typing import Any

from nanoslip.study.dataset.access import Column
from nanoslip.study.measured.columns import rows_as_csv


def as_csv(columns: Sequence[Column]) -> str:
    """A header of names with their units, as `time [s]`, then the rows; unknown numbers are empty.

    Numbers have all their digits; `true`, `false` and `inf` are words, as in a table of cases.
    """
    titles = [_title(column) for column in columns]
    cells = [map(_cell, column.values) for column in columns]
    return rows_as_csv([titles, *zip(*cells, strict=True)])


def as_json(columns: Sequence[Column], title: str) -> str:
    """An object with `title`, `variables` (name -> `units` and `long_name`) and `rows` (objects); unknown numbers are null.

    Infinite numbers are texts, `inf` and `-inf`, as JSON has none.
    """
    variables = {column.name: {"units": column.units, "long_name": column.meaning} for column in columns}
    values = [map(_json, column.values) for column in columns]
    table = zip(*values, strict=True)
    objects = (dict(zip(variables, row, strict=True)) for row in table)
    # A row a line, as a file of many cases is to be read by programs that go line by line, and by eye.
    lines = (json.dumps(entry, ensure_ascii=False) for entry in objects)
    rows = ",\n".join(lines)
    head = json.dumps({"title": title, "variables": variables}, ensure_ascii=False)
    return f'{head[:-1]},\n"rows": [\n{rows}\n]}}\n'


def _title(column: Column) -> str:
    """Name of a column with its unit, if it has one."""
    return column.name if column.units in ("", "1") else f"{column.name} [{column.units}]"


def _cell(value: Any) -> Any:
    if isinstance(value, bool):
        return "true" if value else "false"
    return "" if isinstance(value, float) and math.isnan(value) else value


def _json(value: Any) -> Any:
    if not isinstance(value, float) or math.isfinite(value):
        return value
    return None if math.isnan(value) else str(value)
