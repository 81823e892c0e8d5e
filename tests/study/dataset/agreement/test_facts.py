"""Facts that differ are told once: parameters by their values, other keys of the campaigns, scales and software."""

import xarray as xr

from nanoslip.study.dataset.verify import differing


def made(radius: list[float], manifest: str, **attributes: object) -> xr.Dataset:
    return xr.Dataset(coords={"radius": radius}, attrs={"manifest": f'title = "{radius}"\n{manifest}', **attributes})


def test_the_same_campaign_has_no_facts_that_differ() -> None:
    assert differing((made([50.0], "stages = ['contact']"), made([50.0], "stages = ['contact']"))) == []


def test_parameters_keys_files_scales_and_software_are_told() -> None:
    one = made([50.0], "[outputs]\nrecords = true\n[axes]\nradius = [50]\n", slab_width=1e-3, source_hash="a")
    other = made(
        [50.0, 60.0], "[ensemble]\nmembers = 2\n", slab_width=2e-3, source_hash="b", manifest_table="radius\n50\n60\n"
    )
    found = {fact.name: fact.values for fact in differing((one, other))}
    assert found.pop("manifest_table")[0] == "–"
    assert found == {
        "radius": ("50.0", "50.0, 60.0"),
        "outputs.records": ("true", "–"),
        "ensemble.members": ("–", "2"),
        "slab_width": ("0.001", "0.002"),
        "source_hash": ("a", "b"),
    }


def test_switches_are_told_as_campaigns_have_them() -> None:
    one, other = (xr.Dataset(coords={"friction": values}) for values in ([True], [True, False]))
    assert [fact.values for fact in differing((one, other))] == [("true", "true, false")]


def test_a_difference_in_the_last_digit_is_told() -> None:
    assert differing((made([0.1 + 0.2], ""), made([0.3], "")))[0].values == ("0.30000000000000004", "0.3")
