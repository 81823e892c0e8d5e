"""Drives with fewer teeth are those whose left-out effects name them, alone or with others, of all members or of some."""

import numpy as np
import xarray as xr

from study.dataset.access.fewer_teeth import with_fewer_teeth


def test_the_teeth_are_found_among_what_was_left_out() -> None:
    """And fine ones: at 1 mm/s coarse teeth change the regime of 4 of 8 starts of the paper's pin."""
    texts = np.array(
        [["", "teeth"], ["inertia, teeth", "3 teeth; 1 inertia"], ["fine_teeth", "no_teeth_at_all"]], dtype=object
    )
    found = with_fewer_teeth(xr.Dataset({"drive_left_out": (("case", "drive"), texts)}))
    assert found.dims == ("case", "drive")
    assert found.values.tolist() == [[False, True], [True, True], [True, False]]


def test_a_dataset_that_leaves_nothing_out_has_none() -> None:
    assert not with_fewer_teeth(xr.Dataset({"regime": ("case", ["slides"])})).any()
