"""A campaign of interfaces: one contact is the record that it was, a sum has the same bytes whoever adds it, and is pulled."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import nanoslip

BASE: dict[str, Any] = {
    "title": "Interfaces",
    "numerics": {"n_x": 17, "scheme": "strip"},
    "limits": {"presliding": 4.0},
    "ensemble": {"members": 3},
}


def computed(**more: Any) -> xr.Dataset:
    """Without the dimensions of length one."""
    return nanoslip.run({**BASE, **more}).squeeze()


def test_one_contact_is_the_record_that_it_is_without_an_interface() -> None:
    whole = computed(axes={"contacts": [1, 3]})
    alone = computed()
    one = whole.sel(contacts=1)
    for name in alone.data_vars:
        if name not in ("computed_by", "record_id"):
            np.testing.assert_array_equal(one[name].values, alone[name].values, err_msg=str(name))
    there, here = whole.nanoslip.record(contacts=1), alone.nanoslip.record()
    for name in here.data_vars:
        np.testing.assert_array_equal(there[name].values, here[name].values, err_msg=str(name))
        assert there[name].dtype == here[name].dtype, name
    assert one.case_id.item() == alone.case_id.item()
    assert float(one.static_excess) == pytest.approx(float(alone.peak_friction / alone.plateau_mean - 1.0), rel=0.02)


@pytest.mark.slow
def test_a_sum_in_processes_has_the_bytes_of_one(tmp_path: Path, main: Any) -> None:
    """20 contacts are two batches. Batches are dropped, and nothing of them is computed twice."""
    text = 'title = "i"\naxes.contacts = [1, 20]\ninterface.loads = "exponential"\nnumerics = {n_x = 17, scheme = "strip"}\n'
    text += "limits = {presliding = 3.0}\nheterogeneity.spread = 0.1\nensemble.members = 2\n"
    found = []
    for name, options in {"one": (), "two": ("-j", "2")}.items():
        (tmp_path / name).mkdir()
        (tmp_path / name / "i.toml").write_text(text, "utf-8")
        code, _, said = main("run", str(tmp_path / name / "i.toml"), "--out", str(tmp_path / name), *options)
        assert code == 0, said
        found.append((tmp_path / name / "results.nc").read_bytes())
        assert not list((tmp_path / name / "results").glob("*.result"))
        assert "0 tasks left" in main("run", str(tmp_path / name / "i.toml"), "--out", str(tmp_path / name))[2]
    assert found[0] == found[1]


@pytest.mark.slow
def test_a_slider_of_several_contacts_is_pulled_over_their_sum() -> None:
    """Slowly: the spring's force is friction, inertia next to nothing."""
    drive = {"name": "a", "stage_velocity": 2e-4, "duration_periods": 300, "spring_stiffness": 8e7}
    found = computed(interface={"contacts": 4}, drives=[drive])
    assert float(found.static_friction) < float(found.peak_friction) * 1.01
    assert float(found.kinetic_friction) == pytest.approx(float(found.plateau_mean), rel=0.02)
    assert float(found.surface_stiffness) == pytest.approx(4.0 * float(computed().surface_stiffness), rel=0.05)


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"limits": {"events": 100}}, "contacts = 2: needs presliding, displacement or spacings"),
        (
            {"outputs": {"statistics": True}},
            "contacts = 2 with statistics = true: needs one contact",
        ),
    ],
)
def test_what_an_interface_cannot_do_is_the_outcome_of_its_case(more: dict[str, Any], message: str) -> None:
    found = computed(interface={"contacts": 2}, **more)
    assert found.outcome.item() == "invalid"
    assert message in found.message.item()


def test_a_wrong_number_or_sharing_is_a_problem_of_the_file() -> None:
    with pytest.raises(nanoslip.ManifestError) as caught:
        computed(interface={"contacts": 0, "loads": "gaussian"})
    assert "interface.contacts = 0: " in str(caught.value)
    assert 'interface.loads = "gaussian"' in str(caught.value)


@pytest.mark.slow
def test_a_look_at_a_slider_is_one_at_its_first_contact(tmp_path: Path) -> None:
    """Tractions, states after events and frames: the same as of the contact by itself, over the load that it carries."""
    outputs = {"tractions": True, "tractions_at": [0, 3]}
    one, many = computed(outputs=outputs), computed(outputs=outputs, interface={"contacts": 3})
    there, here = (found.nanoslip.contact() for found in (many, one))
    for name in ("pressure", "shear", "slip"):
        np.testing.assert_array_equal(there[name].values, here[name].values)
    assert float(many.mean_pressure) == float(one.mean_pressure)
    case = nanoslip.Case(slab=nanoslip.Slab(n_x=17, scheme="strip"), max_events=100, max_presliding=4.0)
    slider = replace(case, interface=nanoslip.Interface(3))
    looks = [nanoslip.frames(each, (0, 5), tmp_path / "strip.png") for each in (case, slider)]
    np.testing.assert_array_equal(np.asarray(looks[0].record.force_before), np.asarray(looks[1].record.force_before))


def test_effects_are_left_out_of_all_contacts(tmp_path: Path, main: Any) -> None:
    text = 'title = "i"\ninterface.contacts = 3\nnumerics = {n_x = 17, scheme = "strip"}\nlimits = {presliding = 3.0}\n'
    (tmp_path / "i.toml").write_text(text, "utf-8")
    code, shown, said = main("effects", str(tmp_path / "i.toml"))
    assert code == 0, said
    assert "pin_translation" in shown
