"""Cases of several datasets lie where their labels say."""

import numpy as np
import xarray as xr

from nanoslip.study.dataset.concatenation import axes_of, placed


def made(radius: list[float], load: float, first: int) -> xr.Dataset:
    """Cases along a radius, numbered from `first`."""
    numbers = np.arange(first, first + len(radius))
    coordinates = {"radius": radius, "normal_load": load, "case_id": ("radius", [str(each) for each in numbers])}
    return xr.Dataset({"number": ("radius", numbers.astype(float))}, coordinates)


def test_labels_in_order_stay_in_order_and_others_as_they_come():
    assert axes_of([made([1.0, 4.0], 1.0, 0), made([2.0], 1.0, 2)]).labels["radius"] == [1.0, 2.0, 4.0]
    assert axes_of([made([4.0, 1.0], 1.0, 0), made([2.0], 1.0, 2)]).labels["radius"] == [4.0, 1.0, 2.0]


def test_a_parameter_becomes_an_axis_only_where_cases_would_meet():
    apart = axes_of([made([1.0], 1.0, 0), made([2.0], 2.0, 1)])
    assert apart.added == ()
    meeting = axes_of([made([1.0, 2.0], 1.0, 0), made([1.0, 2.0], 2.0, 2)])
    assert meeting.added == ("normal_load",)


def test_values_lie_where_their_labels_are():
    roots = [made([1.0, 4.0], 2.0, 0), made([1.0, 4.0], 1.0, 2)]
    found = placed("number", axes_of(roots), roots, ["one", "other"])
    assert found.dims == ("normal_load", "radius")
    assert found.values.tolist() == [[2.0, 3.0], [0.0, 1.0]]
