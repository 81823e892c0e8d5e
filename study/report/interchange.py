"""Flat tables as text for other programs: CSV and JSON."""

import csv
import io
import json
import math
from collections.abc import Sequence
from typing import Any

from study.dataset.access.tidy import Column


def as_csv(columns: Sequence[Column]) -> str:
    """A header of names, a line of units whose first cell begins with `# `, then the rows; unknown numbers are empty.

    Numbers have all their digits; `true`, `false` and `inf` are words, as in a table of cases.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([each.name for each in columns])
    first, *others = (each.units for each in columns)
    writer.writerow([f"# {first}", *others])
    writer.writerows(zip(*([_cell(value) for value in each.values] for each in columns), strict=True))
    return text.getvalue()


def as_json(columns: Sequence[Column], title: str) -> str:
    """An object with `title`, `variables` (name -> `units` and `long_name`) and `rows` (objects); unknown numbers are null.

    Infinite numbers are texts, `inf` and `-inf`, as JSON has none.
    """
    variables = {each.name: {"units": each.units, "long_name": each.meaning} for each in columns}
    names = [each.name for each in columns]
    values = zip(*([_json(value) for value in each.values] for each in columns), strict=True)
    rows = ",\n".join(json.dumps(dict(zip(names, row, strict=True)), ensure_ascii=False) for row in values)
    head = (
        f'"title": {json.dumps(title, ensure_ascii=False)},\n"variables": {json.dumps(variables, ensure_ascii=False)}'
    )
    return f'{{{head},\n"rows": [\n{rows}\n]}}\n'


def _cell(value: Any) -> Any:
    if isinstance(value, bool):
        return "true" if value else "false"
    return "" if isinstance(value, float) and math.isnan(value) else value


def _json(value: Any) -> Any:
    if not isinstance(value, float) or math.isfinite(value):
        return value
    return None if math.isnan(value) else str(value)
