"""One case is found by exact values of its parameters; what is left to choose is said with the values that there are."""

import re

import pytest
import xarray as xr

from study.dataset.access.single import one_case


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
    given = {"intrinsic_friction": "0.5", "radius": "50", "events": "60"}
    assert one_case(full, given).max_events.item() == 60
    with pytest.raises(KeyError, match="max_events = 61: no such case"):
        one_case(full, {**given, "events": "61"})


def test_members_of_an_ensemble_are_one_case_and_one_of_a_list_has_its_parameters() -> None:
    listed = xr.Dataset(
        {"outcome": (("case", "member"), [["completed"] * 2] * 3)},
        {
            "case": [0, 1, 2],
            "member": [0, 1],
            "radius": ("case", [50.0, 50.0, 60.0]),
            "half_width": ("case", [float("nan"), 0.1, 0.2]),
        },
    )
    assert one_case(listed, {"radius": "60"}).outcome.dims == ("member",)
    assert one_case(listed, {"case": "1", "member": "1"}).outcome.dims == ()
    with pytest.raises(ValueError, match=r"give also radius = 50\.0, 60\.0; half_width = 0\.1, 0\.2$"):
        one_case(listed, {})


def test_a_member_that_is_singled_out_has_no_number_of_its_ensemble() -> None:
    members = xr.Dataset(
        {
            "outcome": ("member", ["completed"] * 2),
            "plateau_mean": ("member", [0.1, 0.3]),
            "plateau_mean_ensemble_std": ((), 0.14),
            "plateau_mean_ensemble_members": ((), 2),
            "members_used": ((), 2),
        },
        {"member": [0, 1]},
    )
    assert set(one_case(members, {"member": "1"}).data_vars) == {"outcome", "plateau_mean"}
    assert "members_used" in one_case(members, {})
