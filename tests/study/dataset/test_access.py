"""`.nanoslip` of a dataset and of its selections: one case by its parameters, its runs ready to be drawn, and flat tables."""

import re
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
import xarray as xr

import nanoslip
from nanoslip.study.api import open as open_dataset, run
from nanoslip.study.dataset.access import Column, case_columns
from nanoslip.study.dataset.file import LostGroupsError, read_groups
from nanoslip.study.dataset.table import one_case, select_rows
from nanoslip.study.dataset.verify import NotVerifiableError, rebuilt
from tests.conftest import ROOT
from tests.study.dataset.campaigns import FULL

ONE = {"radius": 50.0, "intrinsic_friction": 0.5}
WORDS = {"intrinsic_friction": "0.5", "radius": "50"}


@pytest.mark.slow
def test_a_record_has_displacement_events_and_the_scalars_of_its_case(full):
    one = full.nanoslip.record(**ONE)
    assert one["event_force_after"].dims == one["displacement"].dims == ("event",)
    assert one["event"].values.tolist() == list(range(1, 201))
    assert one["plateau_mean"].item() == full["plateau_mean"].sel(ONE).item()
    assert one["radius"].item() == 50.0
    assert "static_friction" not in one  # it is of a drive
    assert float(one["event_drop"].mean()) == pytest.approx(one["mean_drop"].item(), rel=1e-12)
    assert one["displacement"][-1].item() / 200 == pytest.approx(one["mean_step"].item(), rel=1e-14)


@pytest.mark.slow
def test_a_selection_finds_what_the_whole_does(full, full_folder):
    whole = full.nanoslip.record(**ONE).load()
    xr.testing.assert_identical(full.sel(radius=[50.0]).nanoslip.record(**ONE).load(), whole)
    xr.testing.assert_identical(full.sel(ONE).squeeze().nanoslip.record().load(), whole)
    xr.testing.assert_identical(full.isel(radius=0).nanoslip.record(intrinsic_friction=0.5).load(), whole)
    with xr.open_dataset(full_folder / "results.nc") as plain:
        xr.testing.assert_identical(plain.nanoslip.record(**ONE).load(), whole)
    xr.testing.assert_identical(run(FULL, full_folder).nanoslip.record(**ONE).load(), whole)


def test_a_notebook_shows_what_a_dataset_is(full):
    odd = full.assign_attrs(title="<i>Odd</i>")
    html = odd.nanoslip._repr_html_()
    assert html.startswith("<table><tr><th>campaign</th><td>&lt;i&gt;Odd&lt;/i&gt;</td></tr>")
    for text in (repr(full.nanoslip), html):
        assert "4 (4 completed) along intrinsic_friction (2), radius (2)" in text
        assert f"{float(full['plateau_mean'].min()):.4g} to {float(full['plateau_mean'].max()):.4g}" in text
        assert full.attrs["source_commit"] in text
        assert "record, trajectory, contact, interior" in text
    assert "cases: 1 (1 completed)\n" in repr(full.sel(ONE).nanoslip)
    bare = xr.Dataset({"plateau_mean": full["plateau_mean"].variable})
    assert "groups: lost" in repr(bare.nanoslip)
    assert "no dataset" in repr(xr.Dataset().nanoslip)


def test_what_is_masked_has_no_record_and_no_events(full):
    masked = full.where(full["radius"] > 60.0)
    assert masked.nanoslip.events().sizes["event"] == 400
    with pytest.raises(ValueError, match="has no record"):
        masked.nanoslip.record(**ONE)


def test_the_teeth_are_both_sides_of_each_drop(full):
    line, one = full.nanoslip.teeth(**ONE), full.nanoslip.record(**ONE)
    assert line.sizes["point"] == 2 * 200 + 2
    for side, start in (("before", 1), ("after", 2)):
        np.testing.assert_array_equal(line["displacement"][start:-1:2], one["displacement"])
        np.testing.assert_array_equal(line["friction_force"][start:-1:2], one[f"event_force_{side}"])
    assert line["friction_force"][0] == one["initial_force"]
    assert line["friction_force"][-1] == one["final_force"]
    assert line["displacement"][-1] == one["final_displacement"]
    # Forces over the load, rounded each in its own way.
    largest = float(line["friction_force"].max())
    assert largest == pytest.approx(one["peak_friction"].item(), rel=4 * np.finfo(float).eps)


def test_the_teeth_of_several_members_are_those_of_the_first_alone():
    """Not the mean of where all members end."""
    campaign = {"title": "T", "stages": ["contact", "slip"], "numerics": {"n_x": 17}, "ensemble": {"members": 3}}
    data = nanoslip.run(campaign | {"limits": {"events": 60}})
    line, one = data.nanoslip.teeth(), data.nanoslip.record()
    np.testing.assert_array_equal(line["displacement"], np.repeat(one["displacement"], 2))
    np.testing.assert_array_equal(line["friction_force"][1::2], one["event_force_after"])
    assert one["final_displacement"] != line["displacement"][-1]


def test_events_of_all_cases_are_one_table_with_their_parameters(full):
    table = full.nanoslip.events()
    assert table.sizes["event"] == 800
    each = table.groupby("case_id")
    assert set(each.groups) == set(full["case_id"].values.ravel())
    for case_id, rows in each:
        one = full.nanoslip.record(case_id=case_id)
        for name in ("intrinsic_friction", "radius"):
            assert set(rows[name].values) == {one[name].item()}
        np.testing.assert_array_equal(rows["event_slips"], one["event_slips"])
        np.testing.assert_array_equal(rows["event_number"], one["event"])
    frame = full.nanoslip.events(radius=50.0).to_dataframe()
    assert len(frame) == 400
    assert {"displacement", "radius", "intrinsic_friction", "event_kind"} <= set(frame.columns)
    assert full.sel(radius=50.0).nanoslip.events().sizes["event"] == 400
    assert full.nanoslip.events(radius=[50.0, 100.0], intrinsic_friction=0.5).sizes["event"] == 400


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
    shear = float(full.nanoslip.contact(event=3, **ONE)["shear"].sum()) / 16
    force = full.nanoslip.record(**ONE)["event_force_after"].sel(event=3).item()
    assert shear == pytest.approx(force, rel=1e-9)
    with pytest.raises(KeyError, match=r"event = 4: .* 0, 3, 5"):
        full.nanoslip.contact(event=4, **ONE)


def test_initial_contact_is_there_once_where_states_begin_with_it():
    small = {"title": "once", "stages": ["contact", "slip"], "numerics": {"n_x": 17}, "limits": {"events": 5}}
    found = run({**small, "outputs": {"tractions": True, "tractions_at": [0, 2]}})
    assert read_groups(found)["contact"]["event"].values.tolist() == 17 * [0] + 17 * [2]


def test_the_inside_of_the_slab_has_x_and_z(full):
    inside = full.nanoslip.interior(event=3, **ONE)
    assert inside["stress_zz"].dims == inside["x"].dims == inside["z"].dims == ("interior_node",)
    assert float(inside["z"].max()) == 0.0


@pytest.mark.slow
def test_datatree_reads_everything_and_all_of_a_dataset_can_be_kept_and_opened_again(full, full_folder, tmp_path):
    with xr.open_datatree(full_folder / "results.nc") as tree:
        assert set(tree.children) == {"record", "trajectory", "contact", "interior", "software", "texts"}
        assert tree["record"].sizes["event"] == 800
        for name, group in read_groups(full).items():
            xr.testing.assert_identical(tree[name].to_dataset(inherit=False).load(), group.load())
    full.nanoslip.tree.to_netcdf(tmp_path / "copy.nc")
    again = open_dataset(tmp_path / "copy.nc")
    xr.testing.assert_identical(again.load(), full.compute())
    xr.testing.assert_identical(again.nanoslip.events().load(), full.nanoslip.events().load())


def test_a_dataset_that_has_lost_its_groups_or_never_had_records_says_so(full):
    bare = xr.Dataset({"plateau_mean": full["plateau_mean"].variable})
    says = r"ask the dataset that nanoslip\.open, nanoslip\.run or nanoslip\.concat returned"
    with pytest.raises(LostGroupsError, match=says):
        bare.nanoslip.events()
    with pytest.raises(ValueError, match="has lost record_id"):
        full[["plateau_mean"]].nanoslip.record(**ONE)
    found = run({"title": "contact", "stages": ["contact"], "numerics": {"n_x": 17}})
    with pytest.raises(ValueError, match="no group record"):
        found.nanoslip.teeth()


def test_a_number_is_found_that_differs_in_its_last_digits(full):
    """As 0.1 + 0.2 from 0.3; of two values that near it is neither."""
    moved = full.assign_coords(intrinsic_friction=[0.25 * (1 + 1e-12), 0.5], radius=[50.0, 50.0 * (1 + 1e-12)])
    assert len(select_rows(moved, "case_id", {"intrinsic_friction": 0.25})) == 2
    assert len(select_rows(moved, "case_id", {"radius": 50.0})) == 2
    with pytest.raises(KeyError):
        select_rows(moved, "case_id", {"radius": 50.0 * (1 - 1e-10)})
    assert len(select_rows(full.assign_coords(radius=[-50.0, np.inf]), "case_id", {"radius": [-50.0, np.inf]})) == 4


@pytest.mark.slow
def test_what_xarray_saved_without_groups_is_refused_for_that_reason(full, tmp_path):
    full.to_netcdf(tmp_path / "copy.nc")
    full.isel(radius=[0]).nanoslip.tree.to_netcdf(tmp_path / "part.nc")
    with open_dataset(tmp_path / "copy.nc") as copy:
        with pytest.raises(ValueError, match="without groups"):
            copy.nanoslip.record(**ONE)
        with pytest.raises(NotVerifiableError, match="groups none"):
            rebuilt(copy, tmp_path / "copy.nc")
    with open_dataset(tmp_path / "part.nc") as part, pytest.raises(NotVerifiableError, match="2 of 4 cases"):
        rebuilt(part, tmp_path / "part.nc")


@pytest.mark.slow
def test_the_examples_of_the_page_run(tmp_path, monkeypatch):
    mpl.use("Agg")
    monkeypatch.chdir(tmp_path)
    axes = {"intrinsic_friction": [0.25, 0.5], "normal_load": [1e-3, 2e-3]}
    scales = {"slab_width": "1 mm", "slab_depth": "1 cm", "shear_modulus": "10 GPa"}
    mine = {"title": "mine", "stages": ["contact", "slip"], "scales": scales, "axes": axes, "numerics": {"n_x": 17}}
    run(mine, "results/mine").close()
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "dataset.md").read_text("utf-8"), re.DOTALL)
    names: dict[str, Any] = {}
    for block in blocks:
        exec(block, names)
    assert len(blocks) == 4
    assert len(names["table"]) == 4
    assert "poisson" not in names["table"]  # the same in all cases
    assert set(names["events"]["normal_load"]) == {1e-3, 2e-3}
    np.testing.assert_array_equal(names["words"].values, names["results"]["message"].values)


@pytest.mark.parametrize(
    ("selection", "error", "said"),
    [
        ({"intrinsic_friction": 0.5}, ValueError, "radius has 2 values"),
        ({}, ValueError, "no selection: needs to single out one case"),
        ({**ONE, "intrinsic_friction": 0.3}, KeyError, "intrinsic_friction = 0.3: no such case; there are 0.25, 0.5"),
        ({"colour": 1.0}, KeyError, "colour: no coordinate of these cases; there are intrinsic_friction, radius"),
        ({"drive": "slow"}, KeyError, "drive: no coordinate"),
    ],
)
def test_a_selection_that_fits_several_cases_or_none_is_refused(full, selection, error, said):
    with pytest.raises(error, match=said):
        full.nanoslip.record(**selection)


def test_one_case_keeps_its_drives_until_one_is_named_and_a_parameter_has_its_word_in_a_manifest_too(full):
    case = one_case(full, WORDS)
    assert case.outcome.dims == ()
    assert (case.intrinsic_friction.item(), case.radius.item()) == (0.5, 50.0)
    assert case.drive_outcome.dims == ("drive",)
    fast = one_case(full, {**WORDS, "drive": "fast"})
    assert fast.static_friction.item() == case.static_friction.sel(drive="fast").item()
    assert fast.nanoslip.trajectory().sizes["sample"] == 41
    assert one_case(full, {**WORDS, "events": "200"}).max_events.item() == 200
    in_si = {"intrinsic_friction": "0.5", "radius": "5 cm", "normal_load": "0.1 kN", "stage_velocity": "1 mm/s"}
    assert one_case(full, in_si).drive.item() == "slow"
    assert full.nanoslip.events(radius=["50 mm", "10 cm"]).sizes["event"] == 800


def by_name(columns: list[Column]) -> dict[str, list]:
    found = {each.name: each.values for each in columns}
    assert len(found) == len(columns)
    assert len({len(values) for values in found.values()}) == 1
    return found


def test_a_flat_table_has_rows_of_cases_and_drives_that_say_what_the_dataset_says(full):
    columns = case_columns(full)
    assert [each.name for each in columns[:2]] == ["intrinsic_friction", "radius"]
    found = by_name(columns)
    assert len(found["outcome"]) == full.drive_outcome.size == 8
    for row in range(8):
        here = full.sel({name: found[name][row] for name in ("intrinsic_friction", "radius", "drive")}).squeeze()
        for name in ("plateau_mean", "static_friction", "case_id", "stage_velocity", "outcome"):
            assert found[name][row] == here[name].item() or np.isnan(here[name].item())
    assert set(full.variables) - {name for name in full.data_vars if name.endswith("_id")} == set(found)
    units = {each.name: each.units for each in columns}
    assert (units["stage_velocity"], units["plateau_mean"], units["outcome"]) == ("m s-1", "1", "")


FAST = {**ONE, "drive": "fast"}


@pytest.mark.parametrize(
    ("table", "draw", "where", "same"),
    [
        ("records", "record", ONE, {"event_number": "event", "event_drop": "event_drop"}),
        ("trajectories", "trajectory", FAST, {"time": "time", "sample_spring_force": "sample_spring_force"}),
    ],
)
def test_events_and_samples_are_rows_of_their_runs(full, table, draw, where, same):
    found = by_name(case_columns(full, table))
    assert next(iter(found)) == "intrinsic_friction"
    keys = zip(*(found[name] for name in where), strict=True)
    mine = [row for row, key in enumerate(keys) if key == tuple(where.values())]
    one = getattr(full.nanoslip, draw)(**where)
    for column, name in same.items():
        assert [found[column][row] for row in mine] == one[name].values.tolist()


IN_NEWTONS = {
    "title": "Three loads",
    "stages": ["contact"],
    "scales": {"slab_width": "2 mm", "shear_modulus": "1 MPa"},
    "axes": {"normal_load": ["0.1 N", "0.2 N", "0.4 N"], "radius": ["3 mm", "6 mm"]},
    "numerics": {"n_x": 33, "scheme": "half_plane"},
}


@pytest.fixture(scope="module")
def in_newtons(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """The folder of a campaign in N and mm."""
    folder = tmp_path_factory.mktemp("newtons")
    run(IN_NEWTONS, out=folder, progress=False)
    return folder


def test_a_number_in_si_selects_the_case_of_that_size(in_newtons):
    """By a text with its unit, or along coordinates in SI; a size that no case has selects none."""
    with open_dataset(in_newtons) as data, open_dataset(in_newtons, si=True) as along_si:
        for newtons in (0.1, 0.2, 0.4):
            found = data.nanoslip.sel(normal_load=f"{newtons} N")
            assert found["normal_load_si"].item() == pytest.approx(newtons, rel=1e-12)
            assert found["contact_half_width"].dims == data["contact_half_width"].isel(normal_load=0).dims
            alike = along_si.sel(normal_load_si=newtons, method="nearest", tolerance=1e-9)
            np.testing.assert_array_equal(found["contact_half_width"], alike["contact_half_width"])
        several = data.nanoslip.sel(normal_load=["0.1 N", "0.4 N"], radius="3 mm")
        assert several.sizes["normal_load"] == 2
        assert "radius" not in several.sizes
        assert read_groups(several).keys() == read_groups(data).keys()
        with pytest.raises(KeyError, match=r"no such case; .*\(0\.1 N\), .*\(0\.2 N\), .*\(0\.4 N\)"):
            data.nanoslip.sel(normal_load="0.3 N")
        with pytest.raises(KeyError, match="did you mean normal_load"):
            data.nanoslip.sel(normal_lod="0.3 N")
        with pytest.raises(KeyError):
            along_si.sel(normal_load_si=0.3, method="nearest", tolerance=1e-9)
        scaled = along_si.nanoslip.sel(normal_load="0.2 N")
        assert scaled["normal_load_si"].item() == pytest.approx(0.2, rel=1e-12)


def test_coordinates_in_si_need_scales(full_folder):
    with pytest.raises(ValueError, match="scales"):
        open_dataset(full_folder, si=True)
