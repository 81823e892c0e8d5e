"""Means over evenly spread starts are what they say, longer records know the plateau better, and only members know μ_s."""

import math

import numpy as np
import pytest

from solver.case import Case
from solver.slab import Slab
from study.accuracy.digits import KINETIC, PLATEAU
from study.accuracy.lengths import OBSERVABLES, STATIC, Bought, _sets, as_markdown, bought, cheapest, draw


@pytest.fixture(scope="module")
def found() -> list[Bought]:
    return list(bought(Case(slab=Slab(65)), (0.5, 2.0), (1, 4)))


def error_of(found: list[Bought], observable: str, spacings: float, members: int) -> float:
    (each,) = [row for row in found if (row.observable, row.spacings, row.members) == (observable, spacings, members)]
    return each.error


def test_a_set_is_evenly_spread_over_all_starts() -> None:
    values = np.arange(8.0)[:, None]
    assert _sets(values, 2)[:, 0].tolist() == [2.0, 3.0, 4.0, 5.0]  # starts 0 and 4, 1 and 5, …
    assert _sets(values, 8)[:, 0].tolist() == [3.5]
    assert _sets(values, 1)[:, 0].tolist() == values[:, 0].tolist()


def test_a_record_without_a_plateau_is_left_out_of_means_and_a_set_of_none_is_unknown() -> None:
    values = np.array([[1.0], [math.nan], [3.0], [math.nan]])
    assert _sets(values, 4)[:, 0].tolist() == [2.0]
    assert np.isnan(_sets(values, 2)[:, 0]).tolist() == [False, True]


def test_length_buys_the_plateau_and_members_static_friction(found: list[Bought]) -> None:
    """The first macroscopic slip is over before a record is half a spacing long: what follows says nothing of it."""
    for observable in (PLATEAU, KINETIC):
        assert error_of(found, observable, 2.0, 1) < error_of(found, observable, 0.5, 1)
    assert error_of(found, STATIC, 2.0, 1) == pytest.approx(error_of(found, STATIC, 0.5, 1), rel=0.02)
    assert error_of(found, STATIC, 0.5, 4) < 0.7 * error_of(
        found, STATIC, 0.5, 1
    )  # independent: a half; 0.3 to 0.4 seen


def test_the_cheapest_way_is_the_fastest_that_is_right_enough(found: list[Bought]) -> None:
    for observable in OBSERVABLES:
        best = cheapest(found, observable, 0.03)
        assert best is not None
        assert best.error <= 0.03
        assert all(row.seconds >= best.seconds for row in found if row.observable == observable and row.error <= 0.03)
    assert cheapest(found, PLATEAU, 0.0) is None
    unknown = Bought(PLATEAU, 0.1, 1, 1e-9, math.nan, 0.5)
    assert cheapest([unknown], PLATEAU, 0.03) is None


def test_tables_and_diagram_show_all_of_it(found: list[Bought]) -> None:
    text = as_markdown({"a case": found})
    assert "| records with a plateau | | 100% | 100% |" in text
    assert text.count("| 4 members |") == len(OBSERVABLES)
    assert draw({"a case": found}).startswith(b"\x89PNG")
