"""A selection names cases by their coordinates; what it does not single out, or does not find, is said."""

import numpy as np
import pytest

from nanoslip.study.dataset.access import Accessor, places


def test_values_and_lists_of_values_name_cases(full):
    found = places(full, "plateau_mean", {"radius": [50.0, 100.0], "intrinsic_friction": 0.5})
    np.testing.assert_array_equal(
        found.values("plateau_mean"), full["plateau_mean"].sel(intrinsic_friction=0.5).values.ravel()
    )
    np.testing.assert_array_equal(found.values("normal_load"), [1e-3, 1e-3])
    driven = places(full, "static_friction", {"drive": "fast"})
    np.testing.assert_array_equal(
        driven.values("static_friction"), full["static_friction"].sel(drive="fast").values.ravel()
    )
    first = full["case_id"].values.ravel()[2]
    assert places(full, "outcome", {"case_id": first}).positions.tolist() == [[1, 0, 0, 0]]


def test_a_case_has_its_scalars_and_no_other_dimension(full):
    (case,) = places(full, "record_id", {"radius": 50.0, "intrinsic_friction": 0.5})
    assert case["plateau_mean"].item() == full["plateau_mean"].sel(radius=50.0, intrinsic_friction=0.5).item()
    assert not case.dims
    assert "static_friction" not in case  # it is of a drive


@pytest.mark.parametrize(
    ("selection", "error", "said"),
    [
        ({"intrinsic_friction": 0.5}, ValueError, "radius has 2 values"),
        ({}, ValueError, "no selection: needs to single out one case"),
        (
            {"intrinsic_friction": 0.3, "radius": 50.0},
            KeyError,
            "intrinsic_friction = 0.3: no such case; there are 0.25, 0.5",
        ),
        ({"colour": 1.0}, KeyError, "colour: no coordinate of these cases; there are intrinsic_friction, radius"),
        ({"drive": "slow"}, KeyError, "drive: no coordinate"),
    ],
)
def test_a_selection_that_fits_several_cases_or_none_is_refused(full, selection, error, said):
    with pytest.raises(error, match=said):
        Accessor(full).record(**selection)
