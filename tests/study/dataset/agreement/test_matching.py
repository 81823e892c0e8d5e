"""Cases are matched by the parameters that vary in either dataset; what only one has, or nobody computed, is set apart."""

import numpy as np
import pytest
import xarray as xr

from nanoslip.study.dataset.verify import NotComparableError, matched


def made(radius: list[float], load: list[float] | float = 1e-3, outcome: str = "completed") -> xr.Dataset:
    """A dataset of cases over radius, and load where it is a list."""
    loads = np.atleast_1d(load)
    dims = ("radius", "normal_load")[: 1 + isinstance(load, list)]
    shape = (len(radius), len(loads))[: len(dims)]
    return xr.Dataset(
        {"outcome": (dims, np.full(shape, outcome, dtype=object))},
        {"radius": radius, "normal_load": loads if len(dims) == 2 else load, "case_id": (dims, np.full(shape, "x"))},
    )


def test_cases_of_the_same_axes_meet_whatever_their_order() -> None:
    found = matched((made([50.0, 100.0, 200.0]), made([200.0, 50.0])), "")
    assert found.axes == ("radius",)
    assert found.rows == ((0, 1), (2, 0))
    assert found.labels == ({"radius": 50.0}, {"radius": 200.0})
    assert found.only == (({"radius": 100.0},), ())


def test_an_axis_meets_a_constant_of_the_other() -> None:
    found = matched((made([50.0], [1e-3, 2e-3]), made([50.0], 2e-3)), "")
    assert found.axes == ("normal_load",)
    assert (found.rows, found.only) == (((1, 0),), (({"normal_load": 1e-3},), ()))


def test_a_constant_that_differs_is_no_axis() -> None:
    assert matched((made([50.0], 1e-3), made([50.0], 2e-3)), "").rows == ((0, 0),)


def test_lists_of_cases_meet_products() -> None:
    listed = xr.Dataset(
        {"outcome": ("case", np.array(["completed"] * 2, dtype=object))},
        {"case": [0, 1], "radius": ("case", [100.0, 50.0]), "normal_load": ("case", [2e-3, 1e-3])},
    )
    assert matched((made([50.0, 100.0], [1e-3, 2e-3]), listed), "").rows == ((0, 1), (3, 0))


@pytest.mark.parametrize("outcome", ["pending", "timed_out", "out_of_memory", "crashed", "needs_failed"])
def test_what_is_not_computed_in_either_is_counted_and_left_out(outcome: str) -> None:
    found = matched((made([50.0]), made([50.0], outcome=outcome)), "")
    assert (found.rows, found.pending, found.only) == ((), 1, ((), ()))


def test_cases_that_nothing_tells_apart_are_refused() -> None:
    twice = made([50.0, 60.0]).drop_vars("radius").rename(radius="case")
    with pytest.raises(NotComparableError, match="not told apart by any parameter"):
        matched((twice, twice), "")
