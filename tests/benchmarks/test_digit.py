"""What a digit costs: errors, exponents and times of made-up members whose scatter is given, and the committed table."""

import csv
import math
from pathlib import Path

import numpy as np
import pytest

from tests.benchmarks.digit import GROUPS_OF, STARTS, errors_of, exponent

SCATTER = 0.05


def made_up(seed: int, scatter: float = SCATTER) -> np.ndarray:
    """Members with mean 2."""
    return 2.0 * (1.0 + scatter * np.random.default_rng([41, seed]).standard_normal(STARTS))


def test_the_error_of_means_is_the_scatter_over_the_root_of_the_members():
    values = made_up(1)
    for members in GROUPS_OF:
        found, right = errors_of(values, values, members), SCATTER / math.sqrt(members)
        # A root mean square over g groups scatters by 1/√(2g); 3.5 times that is no accident.
        assert found.error[0] == pytest.approx(right, rel=3.5 / math.sqrt(2.0 * len(found.squares)))
        assert found.stated == pytest.approx(right, rel=0.25)  # a median of three is a quarter off
    some = np.where(np.random.default_rng(5).random(STARTS) < 0.1, np.nan, values)
    assert errors_of(some, some, 8).error[0] == pytest.approx(SCATTER / math.sqrt(7.2), rel=0.3)
    for nothing in (np.full(STARTS, np.nan), np.zeros(STARTS), np.full(STARTS, 2.0)):
        assert math.isnan(errors_of(nothing, nothing, 8).error[0])


def test_the_exponent_is_minus_two_within_its_own_error():
    """Over 300 made-up cases: unbiased to a tenth of a standard error, whose size is right within a fifth."""
    found = []
    for values in map(made_up, range(300)):
        found.append(exponent({members: errors_of(values, values, members) for members in GROUPS_OF}))
    power, error = np.array(found).T
    assert abs(power.mean() + 2.0) < 0.03
    assert np.sqrt(np.mean(((power + 2.0) / error) ** 2)) == pytest.approx(1.0, rel=0.2)


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
