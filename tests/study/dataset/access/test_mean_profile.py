"""Drives without teeth are those whose left-out effects name them, alone or with others, of all members or of some."""

import numpy as np
import xarray as xr

from study.dataset.access.mean_profile import on_mean_profile


def test_the_teeth_are_found_among_what_was_left_out() -> None:
    """Not among fine ones: coarse teeth hold a pin as firmly."""
    texts = np.array([["", "teeth"], ["inertia, teeth", "3 teeth; 1 inertia"], ["fine_teeth", ""]], dtype=object)
    found = on_mean_profile(xr.Dataset({"drive_left_out": (("case", "drive"), texts)}))
    assert found.dims == ("case", "drive")
    assert found.values.tolist() == [[False, True], [True, True], [False, False]]


def test_a_dataset_that_leaves_nothing_out_has_none() -> None:
    assert not on_mean_profile(xr.Dataset({"regime": ("case", ["slides"])})).any()
