"""`.nanoslip` of a dataset and of its selections: runs with their case's scalars, ready to be drawn."""

import re
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
import xarray as xr

from nanoslip.study.api import open_dataset, run
from nanoslip.study.dataset.file import LostGroupsError, groups_of
from tests.conftest import ROOT
from tests.study.dataset.campaigns import FULL

ONE = {"radius": 50.0, "intrinsic_friction": 0.5}


def test_a_record_has_displacement_events_and_the_scalars_of_its_case(full):
    one = full.nanoslip.record(**ONE)
    assert one["event_friction_after"].dims == ("event",)
    assert one["displacement"].dims == ("event",)
    assert one["event"].values.tolist() == list(range(1, 201))
    assert one["plateau_mean"].item() == full["plateau_mean"].sel(ONE).item()
    assert one["radius"].item() == 50.0
    assert float(one["event_drop"].mean()) == pytest.approx(one["mean_drop"].item(), rel=1e-12)
    assert one["displacement"][-1].item() / 200 == pytest.approx(one["mean_step"].item(), rel=1e-14)


def test_a_selection_finds_what_the_whole_does(full, full_folder):
    whole = full.nanoslip.record(**ONE).load()
    xr.testing.assert_identical(full.sel(radius=[50.0]).nanoslip.record(**ONE).load(), whole)
    xr.testing.assert_identical(full.sel(ONE).squeeze().nanoslip.record().load(), whole)
    xr.testing.assert_identical(full.isel(radius=0).nanoslip.record(intrinsic_friction=0.5).load(), whole)
    with xr.open_dataset(full_folder / "results.nc") as plain:
        xr.testing.assert_identical(plain.nanoslip.record(**ONE).load(), whole)
    xr.testing.assert_identical(run(FULL, full_folder).nanoslip.record(**ONE).load(), whole)


def test_what_is_masked_has_no_record_and_no_events(full):
    masked = full.where(full["radius"] > 60.0)
    assert masked.nanoslip.events().sizes["event"] == 400
    with pytest.raises(ValueError, match="has no record"):
        masked.nanoslip.record(**ONE)


def test_the_teeth_are_both_sides_of_each_drop(full):
    line, one = full.nanoslip.teeth(**ONE), full.nanoslip.record(**ONE)
    assert line.sizes["point"] == 2 * 200 + 2
    np.testing.assert_array_equal(line["displacement"][1:-1:2], one["displacement"])
    np.testing.assert_array_equal(line["displacement"][2:-1:2], one["displacement"])
    np.testing.assert_array_equal(line["friction_force"][1:-1:2], one["event_friction_before"])
    np.testing.assert_array_equal(line["friction_force"][2:-1:2], one["event_friction_after"])
    assert line["friction_force"][0] == one["initial_friction"]
    assert line["friction_force"][-1] == one["final_friction"]
    assert line["displacement"][-1] == one["final_displacement"]
    # Forces over the load, rounded each in its own way.
    assert float(line["friction_force"].max()) == pytest.approx(
        one["peak_friction"].item(), rel=4 * np.finfo(float).eps
    )


def test_events_of_all_cases_are_one_table_with_their_parameters(full):
    table = full.nanoslip.events()
    assert table.sizes["event"] == 800
    each = table.groupby("case_id")
    assert set(each.groups) == set(full["case_id"].values.ravel())
    for case_id, rows in each:
        (friction,), (radius,) = set(rows["intrinsic_friction"].values), set(rows["radius"].values)
        one = full.nanoslip.record(case_id=case_id)
        assert (friction, radius) == (one["intrinsic_friction"], one["radius"])
        np.testing.assert_array_equal(rows["event_slips"], one["event_slips"])
        np.testing.assert_array_equal(rows["event_number"], one["event"])
    frame = full.nanoslip.events(radius=50.0).to_dataframe()
    assert len(frame) == 400
    assert {"displacement", "radius", "intrinsic_friction", "event_kind"} <= set(frame.columns)
    assert full.sel(radius=50.0).nanoslip.events().sizes["event"] == 400


def test_a_trajectory_is_over_time_with_the_scalars_of_its_drive(full):
    moved = full.nanoslip.trajectory(**ONE, drive="fast")
    assert moved["sample_position"].dims == moved["time"].dims == ("sample",)
    assert moved["static_friction"].item() == full["static_friction"].sel(ONE).sel(drive="fast").item()
    assert moved.sizes["slip_phase"] == full["macroscopic_slips"].sel(ONE).sel(drive="fast").item()
    with pytest.raises(ValueError, match="drive has 2 values"):
        full.nanoslip.trajectory(**ONE)


def test_initial_contact_and_states_are_one_vocabulary_over_x(full):
    seen = full.nanoslip.contact(**ONE)
    assert seen["event"].values.tolist() == [0, 3, 5]
    assert seen["pressure"].dims == ("event", "contact_node")
    np.testing.assert_array_equal(seen["x"], np.linspace(-0.5, 0.5, 17))
    for event in (0, 3, 5):
        one = full.nanoslip.contact(event=event, **ONE)
        assert one["pressure"].dims == ("contact_node",)
        np.testing.assert_array_equal(one["pressure"], seen["pressure"].sel(event=event))
        assert float(one["pressure"].sum()) / 16 == pytest.approx(1.0, rel=1e-9)  # in W/(L_x·L_y): ΣN = W
    record = full.nanoslip.record(**ONE)
    shear = full.nanoslip.contact(event=3, **ONE)["shear"]
    assert float(shear.sum()) / 16 == pytest.approx(record["event_friction_after"].sel(event=3).item(), rel=1e-9)
    with pytest.raises(KeyError, match="event = 4: this case has its contact after events 0, 3, 5"):
        full.nanoslip.contact(event=4, **ONE)


def test_initial_contact_is_there_once_where_states_begin_with_it(tmp_path):
    outputs = {"tractions": True, "tractions_at": [0, 2]}
    campaign = {
        "title": "once",
        "stages": ["contact", "slip"],
        "numerics": {"n_x": 17},
        "limits": {"events": 5},
        "outputs": outputs,
    }
    found = run(campaign, tmp_path)
    assert groups_of(found)["contact"]["event"].values.tolist() == 17 * [0] + 17 * [2]


def test_the_inside_of_the_slab_has_x_and_z(full):
    inside = full.nanoslip.interior(event=3, **ONE)
    assert inside["stress_zz"].dims == inside["x"].dims == inside["z"].dims == ("interior_node",)
    assert float(inside["z"].max()) == 0.0


def test_what_is_returned_is_drawn_along_displacement_time_and_x(full):
    mpl.use("Agg")
    assert full.nanoslip.teeth(**ONE)["friction_force"].plot(x="displacement")[0].get_xdata().size == 402
    record = full.nanoslip.record(**ONE)["event_friction_after"].plot(x="displacement")[0]
    assert record.axes.get_xlabel().replace("\n", " ").startswith("pin displacement, in L_x")
    moved = full.nanoslip.trajectory(**ONE, drive="fast")["sample_spring_force"].plot(x="time")[0]
    assert moved.axes.get_xlabel().replace("\n", " ") == "time since the stage started [s]"
    assert len(full.nanoslip.contact(**ONE)["pressure"].plot(x="x", hue="event")) == 3


def test_a_table_of_the_scalars_is_small(full):
    assert full.to_dataframe().shape[0] == 8  # four cases, two drives


def test_datatree_reads_everything(full, full_folder):
    with xr.open_datatree(full_folder / "results.nc") as tree:
        assert set(tree.children) == {"record", "trajectory", "contact", "interior", "software"}
        assert tree["record"].sizes["event"] == 800
        xr.testing.assert_identical(tree.load(), full.nanoslip.tree.load())


def test_all_of_a_dataset_in_memory_can_be_kept_and_opened_again(full, tmp_path):
    full.nanoslip.tree.to_netcdf(tmp_path / "copy.nc")
    again = open_dataset(tmp_path / "copy.nc")
    xr.testing.assert_identical(again.load(), full.load())
    xr.testing.assert_identical(again.nanoslip.events().load(), full.nanoslip.events().load())


def test_a_dataset_that_has_lost_its_groups_says_what_to_ask(full):
    bare = xr.Dataset({"plateau_mean": full["plateau_mean"].variable})
    with pytest.raises(
        LostGroupsError, match=r"ask the dataset that nanoslip\.open, nanoslip\.run or nanoslip\.concat returned"
    ):
        bare.nanoslip.events()
    with pytest.raises(ValueError, match="has lost record_id"):
        full[["plateau_mean"]].nanoslip.record(**ONE)


def test_a_dataset_without_records_says_so():
    found = run({"title": "contact", "stages": ["contact"], "numerics": {"n_x": 17}})
    with pytest.raises(ValueError, match="no group record: its campaign leaves that out"):
        found.nanoslip.teeth()


def test_the_examples_of_the_readme_run(tmp_path, monkeypatch):
    mpl.use("Agg")
    monkeypatch.chdir(tmp_path)
    axes = {"intrinsic_friction": [0.25, 0.5], "normal_load": [1e-3, 2e-3]}
    run({"title": "mine", "stages": ["contact", "slip"], "axes": axes, "numerics": {"n_x": 17}}, "results/mine").close()
    text = (ROOT / "study" / "dataset" / "README.md").read_text("utf-8")
    blocks = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    names: dict[str, Any] = {}
    for block in blocks:
        exec(block, names)
    assert len(blocks) == 2
    assert len(names["table"]) == 4
    assert set(names["events"]["normal_load"]) == {1e-3, 2e-3}
