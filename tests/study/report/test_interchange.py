"""Tables are read back by other programs as they were: all digits, nothing where nothing is known."""

import csv
import io
import json

import numpy as np
import pandas as pd
import pytest

from nanoslip.study.dataset.access import Column
from nanoslip.study.report.page import as_csv, as_json

NAN, INF = float("nan"), float("inf")
COLUMNS = [
    Column("radius", "1", "radius of the pin", [0.1 + 0.2, 1e-300, INF]),
    Column("events", "1", "events", [2**53 + 1, 0, -1]),
    Column("stage_velocity", "m s-1", "velocity", [NAN, 1.0, 2.0]),
    Column("friction", "", "switch", [True, False, True]),
    Column("message", "", "why", ["", 'raise "n_x", or\nlower it, #1', "μ_i"]),
]


def test_csv_has_a_header_a_line_of_units_and_the_rows():
    header, units, *rows = csv.reader(io.StringIO(as_csv(COLUMNS)))
    assert header == [each.name for each in COLUMNS]
    assert units == ["# 1", "1", "m s-1", "", ""]
    assert rows[0] == ["0.30000000000000004", "9007199254740993", "", "true", ""]
    assert rows[1][4] == 'raise "n_x", or\nlower it, #1'
    assert rows[2][0] == "inf"


def test_csv_is_read_by_pandas_which_skips_the_units():
    found = pd.read_csv(io.StringIO(as_csv(COLUMNS)), skiprows=[1])
    np.testing.assert_array_equal(found.radius, COLUMNS[0].values)
    assert found.events.tolist() == COLUMNS[1].values
    assert np.isnan(found.stage_velocity[0])
    assert found.friction.tolist() == [True, False, True]


def test_json_is_strict_and_says_units_and_meanings():
    found = json.loads(as_json(COLUMNS, 'A "title"'), parse_constant=pytest.fail)
    assert found["title"] == 'A "title"'
    assert found["variables"]["stage_velocity"] == {"units": "m s-1", "long_name": "velocity"}
    assert [row["radius"] for row in found["rows"]] == [0.1 + 0.2, 1e-300, "inf"]
    assert [row["stage_velocity"] for row in found["rows"]] == [None, 1.0, 2.0]
    assert found["rows"][1]["message"] == COLUMNS[4].values[1]


def test_a_table_without_rows_is_a_table():
    empty = [Column("radius", "1", "", [])]
    assert as_csv(empty) == "radius\n# 1\n"
    assert json.loads(as_json(empty, ""))["rows"] == []
