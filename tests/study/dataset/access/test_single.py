"""One case is found by exact values of its parameters; what is left to choose is said with the values that there are."""

import re

import pytest
import xarray as xr

from nanoslip.study.dataset.access import one_case


def test_a_case_keeps_its_drives_until_one_is_named(full: xr.Dataset) -> None:
    case = one_case(full, {"intrinsic_friction": "0.5", "radius": "50"})
    assert case.outcome.dims == ()
    assert (case.intrinsic_friction.item(), case.radius.item()) == (0.5, 50.0)
    assert case.drive_outcome.dims == ("drive",)
    fast = one_case(full, {"intrinsic_friction": "0.5", "radius": "50.0", "drive": "fast"})
    assert fast.static_friction.item() == case.static_friction.sel(drive="fast").item()
    assert fast.nanoslip.trajectory().sizes["sample"] == 41


@pytest.mark.parametrize(
    ("given", "kind", "said"),
    [
        ({"radius": "50"}, ValueError, "needs to be one case: give also intrinsic_friction = 0.25, 0.5"),
        ({}, ValueError, "intrinsic_friction = 0.25, 0.5; radius = 50.0, 100.0"),
        ({"radius": "51"}, KeyError, "radius = 51: no such case; there are 50.0, 100.0"),
        ({"radius": "small"}, KeyError, "radius = 'small': no such case; there are 50.0, 100.0"),
        ({"raduis": "50"}, KeyError, "raduis: no coordinate of these cases; did you mean radius?"),
        ({"drive": "2"}, KeyError, "drive = '2': no such case; there are slow, fast"),
    ],
)
def test_what_is_no_single_case_is_said_with_what_there_is(full, given, kind, said) -> None:
    with pytest.raises(kind, match=re.escape(said)):
        one_case(full, given)


def test_a_parameter_has_its_word_in_a_manifest_too(full: xr.Dataset) -> None:
    given = {"intrinsic_friction": "0.5", "radius": "50", "events": "200"}
    assert one_case(full, given).max_events.item() == 200
    with pytest.raises(KeyError, match="max_events = 61: no such case"):
        one_case(full, {**given, "events": "61"})
