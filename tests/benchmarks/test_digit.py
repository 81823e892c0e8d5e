"""What a digit costs, by the committed table."""

import csv
from pathlib import Path


def test_the_committed_table_obeys_the_law():
    """Every exponent is -2 within 3 of its errors, as is every error of eight members what they state."""
    with Path(__file__).with_name("digit.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 9
    for cells in rows:
        power, its_error = map(float, cells["exponent"].split(" ± "))
        assert abs(1.0 / power + 0.5) < 3.0 * its_error / power**2, cells  # the slope is what scatters evenly
        error, its_error = map(float, cells["error"].split(" ± "))
        assert abs(error - float(cells["stated"])) < 3.0 * its_error, cells
