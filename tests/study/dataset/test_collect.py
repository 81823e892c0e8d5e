"""The dataset says what the results say, with names, units and provenance, in bytes that depend on nothing else."""

import time
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from solver.outcome import Ending, Outcome
from study.dataset import file
from study.dataset.collect import collect
from study.dataset.ragged import record as record_of
from study.dataset.ragged import trajectory as trajectory_of
from study.dataset.store import Store, StoreError
from study.dataset.variables import all_series, scalars
from study.discretization.front import load_front
from study.manifest.reader import load_manifest
from study.origin import Origin, here
from study.plan.plan import Plan, make_plan
from study.plan.tasks import TaskResult, run_task
from tests.conftest import SMALL

Build = Callable[[str], tuple[Plan, Store]]
CASE_DIMS = ("intrinsic_friction", "radius", "aspect_ratio", "n_x")
TABLE = "intrinsic_friction, radius\n0.25, 50\n0.5, 50\n0.5, 100\n"


@pytest.fixture(scope="module")
def build(tmp_path_factory: pytest.TempPathFactory) -> Build:
    """Compute a campaign from its text, once for each text."""
    known: dict[str, tuple[Plan, Store]] = {}

    def computed(text: str) -> tuple[Plan, Store]:
        if text not in known:
            folder = tmp_path_factory.mktemp("campaign")
            (folder / "campaign.toml").write_text(text)
            (folder / "cases.csv").write_text(TABLE)
            plan, store = make_plan(load_manifest(folder / "campaign.toml")), Store(folder)
            store.prepare()
            compute(plan, store)
            known[text] = plan, store
        return known[text]

    return computed


def compute(plan: Plan, store: Store) -> None:
    for task in plan.remaining(store.finished()):
        store.write(run_task(task, {key: store.read(key) for key in task.needs}))


@pytest.fixture(scope="module")
def small(build: Build) -> tuple[Plan, Store, xr.Dataset]:
    plan, store = build(SMALL)
    path = store.folder.parent / file.FILE
    file.write(collect(plan, store), path)
    return plan, store, file.read(path)


def changed(**replacements: str) -> str:
    """The small campaign with some of its lines replaced, by the word they start with."""
    lines = [replacements.get(line.split(" ")[0], line) for line in SMALL.splitlines()]
    return "\n".join(lines) + "\n"


def test_a_full_product_has_the_four_standard_dimensions_and_the_drives(small):
    _, _, found = small
    assert found["plateau_mean"].dims == CASE_DIMS
    assert found["plateau_mean"].shape == (2, 2, 1, 1)
    assert found["static_friction"].dims == (*CASE_DIMS, "drive")
    assert found["drive"].values.tolist() == ["slow", "fast"]
    assert found["stage_velocity"].values.tolist() == [1e-3, 2e-3]
    assert found["n_x"].values.tolist() == [17]
    assert found["normal_load"].item() == 1e-3
    assert found["support"].item() == "bonded"


def test_each_scalar_is_its_tasks_in_the_units_it_names(small):
    plan, store, found = small
    stiffness, length = plan.manifest.scales.stiffness, plan.manifest.scales.slab_width
    for case in plan.cases:
        keys = plan.case_tasks[case.case_id]
        record = store.read(keys.record).scalars
        here = found.sel({name: case.parameters[name] for name in CASE_DIMS})
        assert here["case_id"].item() == case.case_id
        assert here["plateau_mean"].item() == record["plateau_mean"]
        assert here["events"].item() == 60
        assert here["initial_friction"].item() == record["initial_force"] * (1.0 / record["normal_load"])
        assert here["surface_stiffness_si"].item() == record["surface_stiffness"] * stiffness
        assert here["mean_step_si"].item() == record["mean_step"] * length
        for name, key in keys.drives.items():
            driven = store.read(key).scalars
            for scalar in ("static_friction", "macroscopic_slips"):  # NaN where the pin never slipped
                np.testing.assert_equal(here[scalar].sel(drive=name).item(), driven[scalar])
        assert here["outcome"].item() == "completed"


def test_the_variables_that_were_promised_are_there(small):
    promised = (
        "plateau_mean plateau_std plateau_uncertainty peak_friction surface_stiffness static_friction kinetic_friction "
        "static_friction_uncertainty kinetic_friction_uncertainty events slips releases touches mean_step outcome message"
    )
    assert set(promised.split()) <= set(small[2].data_vars)


def test_no_number_of_a_result_is_lost(small):
    plan, store, _ = small
    for task in plan.tasks:
        result = store.read(task.key)
        columns = {name for series in all_series() if series.kind == task.kind for name in series.columns}
        known_apart = {
            "normal_load",
            "spacing",
            "residual_shear",
            "spread",
            "displacement",
        }  # of parameters; zero at initial contact
        assert set(result.scalars) - known_apart <= set(scalars(task.kind))
        if task.kind in ("record", "drive"):
            assert set(result.arrays) - {"binned_force"} <= columns  # what uncertainties are made of


def test_every_variable_says_what_it_is_in_which_unit(small):
    _, _, found = small
    for name, variable in found.variables.items():
        assert variable.attrs["long_name"], name
        assert variable.attrs["units"], name


def test_attributes_carry_the_campaign_and_the_software(small):
    plan, _, found = small
    assert found.attrs["Conventions"] == "CF-1.11"
    assert found.attrs["title"] == plan.manifest.title
    assert found.attrs["manifest"] == plan.manifest.text
    assert found.attrs["manifest_sha256"] == plan.manifest.sha256
    assert found.attrs["slab_width"] == plan.manifest.scales.slab_width
    assert {"nanoslip_version", "source_commit", "numpy_version"} <= set(found.attrs)


def test_records_are_contiguous_ragged_arrays(small):
    _, _, found = small
    assert found["row_size"].attrs["sample_dimension"] == "event"
    assert int(found["row_size"].sum()) == found.sizes["event"] == 240
    assert found["trajectory_row_size"].attrs["sample_dimension"] == "sample"
    assert int(found["trajectory_row_size"].sum()) == found.sizes["sample"] == 8 * 41
    assert found["event_kind"].attrs["flag_meanings"] == "slip release touch"


def test_one_cases_record_is_its_result_and_opens_lazily(small):
    plan, store, found = small
    case = plan.cases[2]
    record = record_of(found, **{name: case.parameters[name] for name in CASE_DIMS})
    assert all(not variable._in_memory for variable in record.data_vars.values())
    result = store.read(plan.case_tasks[case.case_id].record)
    for name, quantity in all_series()[0].columns.items():
        by = 1.0 / result.scalars["normal_load"] if quantity.per else 1
        np.testing.assert_array_equal(record[quantity.name], result.arrays[name] * by)


def test_one_drives_trajectory_is_its_result_in_si(small):
    plan, store, found = small
    case, drive = plan.cases[1], plan.manifest.drives[1]
    moved = trajectory_of(found, **{name: case.parameters[name] for name in CASE_DIMS}, drive="fast")
    result = store.read(plan.case_tasks[case.case_id].drives["fast"])
    assert moved["sample_time"][-1].item() == pytest.approx(
        drive.in_si.duration, rel=1e-14
    )  # there and back: two roundings
    scales = plan.manifest.scales
    np.testing.assert_array_equal(moved["sample_position"], result.arrays["position"] * scales.slab_width)
    assert moved.sizes["slip_phase"] == result.arrays["slip_time"].size


def test_a_selection_that_fits_several_cases_or_none_is_refused(small):
    _, _, found = small
    with pytest.raises(ValueError, match="radius has 2 values"):
        record_of(found, intrinsic_friction=0.5)
    with pytest.raises(KeyError):
        record_of(found, intrinsic_friction=0.3, radius=50.0)


def test_a_further_axis_is_a_further_dimension(build):
    text = changed(radius='support = ["bonded", "frictionless"]', stages='stages = ["contact", "slip"]').split(
        "[[drives]]"
    )[0]
    found = collect(*build(text))
    assert found["plateau_mean"].dims == (*CASE_DIMS, "support")
    assert found["support"].values.tolist() == ["bonded", "frictionless"]
    assert "static_friction" not in found
    assert not np.array_equal(found["surface_stiffness"][..., 0], found["surface_stiffness"][..., 1])


@pytest.mark.parametrize("design", ["zip", "table"])
def test_a_list_of_cases_lies_along_one_dimension(build, design):
    if design == "zip":
        text = 'design = "zip"\n' + SMALL
    else:
        text = 'table = "cases.csv"\n' + SMALL[: SMALL.index("[axes]")] + SMALL[SMALL.index("[numerics]") :]
    plan, store = build(text)
    found = collect(plan, store)
    assert found["plateau_mean"].dims == ("case",)
    assert found["intrinsic_friction"].dims == ("case",)
    assert found["n_x"].dims == ("case",)
    assert found["radius"].values.tolist() == ([50.0, 100.0] if design == "zip" else [50.0, 50.0, 100.0])
    one = record_of(found, intrinsic_friction=0.5, radius=100.0)
    last = store.read(plan.case_tasks[plan.cases[-1].case_id].record)
    np.testing.assert_array_equal(one["event_displacement"], last.arrays["displacement"])


def test_cases_that_share_a_result_share_its_record(build):
    plan, store = build(changed(radius="half_width = [0.1, 0.2]"))  # of a flat punch: the parabola ignores it
    found = collect(plan, store)
    assert found.sizes["record"] == 2
    assert found["record_index"].values.ravel().tolist() == [0, 0, 1, 1]


def test_what_is_not_computed_is_pending_and_what_is_refused_says_why(build, tmp_path):
    plan, store = build(changed(n_x="n_x = 17\nrows_per_level = 3", radius="poisson = [0.3]"))
    part = Store(tmp_path)
    part.prepare()
    first = plan.cases[0]
    part.write(store.read(plan.case_tasks[first.case_id].record))
    found = collect(plan, part)
    assert found["outcome"].values.ravel().tolist() == ["completed", "pending"]
    assert set(found["drive_outcome"].values.ravel()) == {"pending"}
    assert np.isnan(found["static_friction"]).all()
    assert found["record_index"].values.ravel().tolist() == [0, -1]
    with pytest.raises(ValueError, match="has no record"):
        record_of(found, intrinsic_friction=0.5)


def test_a_point_that_physics_refuses_is_a_row_with_the_reason(build):
    text = changed(radius="coarsest_row = [5, 17]", n_x="radius = 50.0", intrinsic_friction="n_x = [9, 17]")
    plan, store = build(text.replace("[numerics]", "[constants]"))
    found = collect(plan, store)
    refused = found.sel(n_x=9, coarsest_row=17)
    assert refused["outcome"].item() == "invalid"
    assert "coarsest_row = 17" in refused["message"].item()
    assert set(refused["drive_outcome"].values.ravel()) == {"invalid"}
    assert np.isnan(refused["plateau_mean"])
    assert found.sel(n_x=17, coarsest_row=17)["outcome"].item() == "completed"


def test_a_failed_stage_is_the_outcome_of_the_case(build, tmp_path):
    plan, store = build(SMALL)
    part = Store(tmp_path)
    part.prepare()
    keys = plan.case_tasks[plan.cases[0].case_id]
    good = store.read(keys.record)
    bad = type(good.outcome)(type(good.outcome.ending)("cascade_limit"), "raise it")
    part.write(TaskResult(good.key, good.kind, bad, good.scalars, good.arrays))
    found = collect(plan, part).isel(intrinsic_friction=0, radius=0)
    assert (found["outcome"].item(), found["message"].item()) == ("cascade_limit", "raise it")


def test_what_a_case_and_a_drive_lack_can_be_filtered(build):
    """Eight events are no plateau; over 60 the slow drive never slips, and what it does is a word."""
    plan, store = build(changed(events="events = 8", radius="radius = [50.0]"))
    found = collect(plan, store)
    assert set(found["outcome"].values.ravel()) == set(found["drive_outcome"].values.ravel()) == {"no_plateau"}
    assert set(found["regime"].values.ravel()) == {""}
    assert found["events"].values.ravel().tolist() == [8.0, 8.0]
    assert found["record_index"].values.ravel().tolist() == [0, 1]
    plan, store = build(SMALL.replace("stage_velocity = 1e-3", "stage_velocity = 1e-4"))
    found = collect(plan, store)
    assert set(found["outcome"].values.ravel()) == {"completed"}
    slow = found.sel(drive="slow")
    assert set(slow["drive_outcome"].values.ravel()) == {"no_slip"}
    assert set(slow["regime"].values.ravel()) == {"sticks"}
    assert np.all(slow["time_stuck"] == 1.0)
    assert found["resticks"].dims == found["regime"].dims == (*CASE_DIMS, "drive")


def test_a_failure_outweighs_a_missing_plateau_and_what_is_unfinished_is_pending(build, tmp_path):
    text = changed(events="events = 8", radius="radius = [50.0]") + "[outputs]\ntractions_at = [3]\n"
    plan, store = build(text)
    part = Store(tmp_path)
    part.prepare()
    first, second = (plan.case_tasks[case.case_id] for case in plan.cases)
    for keys in (first, second):
        part.write(store.read(keys.record))
    lost = Outcome(Ending.CONTACT_LOST, "press harder")
    part.write(replace(store.read(first.key("states")), outcome=lost))
    found = collect(plan, part)
    assert found["outcome"].values.ravel().tolist() == ["contact_lost", "pending"]
    assert found["message"].values.ravel()[0] == "press harder"


def test_bytes_depend_on_results_alone(small, tmp_path):
    plan, store, _ = small
    other = Store(tmp_path)
    other.prepare()
    for task in reversed(plan.tasks):
        other.write(store.read(task.key))
    time.sleep(1.1)  # HDF5 keeps times in whole seconds, if it is let
    file.write(collect(plan, other), tmp_path / file.FILE)
    assert (tmp_path / file.FILE).read_bytes() == (store.folder.parent / file.FILE).read_bytes()


def test_a_dataset_that_cannot_be_written_or_read_is_named(small, tmp_path):
    _, _, found = small
    (tmp_path / "file").touch()
    with pytest.raises(StoreError, match="cannot be written"):
        file.write(found, tmp_path / "file" / "results.nc")
    with pytest.raises(StoreError, match="run or collect"):
        file.read(Path(tmp_path) / "none.nc")


def test_every_case_has_the_error_that_its_grid_was_measured_with(build):
    """And NaN where it was not: a slab of another height."""
    plan, store = build(changed(radius="radius = [200.0]") + "[constants]\npoisson = 0.3333333333333333\n")
    found = collect(plan, store)
    expected = load_front().expected_error(plan.cases[0].case)
    assert np.all(found["discretization_error"] == expected)
    assert 0.0 < expected < 0.1
    assert found.attrs["discretization_front"].startswith("front.json, sha256 ")
    plan, store = build(changed(radius="radius = [200.0]") + "[constants]\naspect_ratio = 1.234\n")
    found = collect(plan, store)
    assert np.all(np.isnan(found["discretization_error"]))
    assert "NaN where" in found["discretization_error"].attrs["comment"]


def test_what_has_an_uncertainty_names_it_and_has_it(small):
    _, _, found = small
    named = {name: variable.attrs.get("ancillary_variables") for name, variable in found.data_vars.items()}
    named = {name: other for name, other in named.items() if other}
    assert {"plateau_mean", "mean_step", "mean_drop", "surface_stiffness", "static_friction"} <= set(named)
    for name, other in named.items():
        assert other in found
        assert set(found[other].dims) <= set(found[name].dims)


OLD = replace(here(), source_hash="0123456789abcdef", source_commit="c0ffee", numpy_version="1.0")


def copied(plan: Plan, store: Store, folder: Path, by: Callable[[TaskResult], Origin]) -> Store:
    """The same results, as if computed by other software."""
    other = Store(folder)
    other.prepare()
    for task in plan.tasks:
        result = store.read(task.key)
        other.write(replace(result, origins=(by(result),)))
    return other


def test_the_software_named_is_that_which_computed_not_that_which_collects(small, tmp_path):
    plan, store, found = small
    assert found.attrs["source_hash"] == here().source_hash
    assert found["software_results"].values.tolist() == [12]  # four records and their eight drives
    assert set(found["computed_by"].values.ravel()) == {here().name} == set(found["drive_computed_by"].values.ravel())
    found = collect(plan, copied(plan, store, tmp_path, lambda _: OLD))
    for item in fields(Origin):
        assert found.attrs[item.name] == getattr(OLD, item.name)
        assert found[f"software_{item.name}"].values.tolist() == [getattr(OLD, item.name)]
    assert set(found["computed_by"].values.ravel()) == {OLD.name}
    assert file.MIXED not in found.attrs


def test_results_of_different_software_are_named_with_counts_and_case_by_case(small, tmp_path):
    plan, store, _ = small
    one = plan.case_tasks[plan.cases[0].case_id]
    kept = {one.record, *one.drives.values()}
    mixed = copied(plan, store, tmp_path, lambda result: here() if result.key in kept else OLD)
    found = collect(plan, mixed)
    assert found.attrs["source_hash"] == f"{OLD.source_hash} (9 results), {here().source_hash} (3 results)"
    assert found.attrs["python_version"] == here().python_version
    assert f"9 of {OLD}; 3 of {here()}" in found.attrs[file.MIXED]
    assert found["computed_by"].values.ravel().tolist() == [here().name] + 3 * [OLD.name]
    counts = dict(zip(found["software"].values, found["software_results"].values, strict=True))
    assert counts == {here().name: 3, OLD.name: 9}


def test_a_result_that_does_not_say_is_of_unknown_software_and_no_result_of_none(small, tmp_path):
    plan, store, _ = small
    silent, empty = Store(tmp_path / "silent"), Store(tmp_path / "empty")
    for made in (silent, empty):
        made.prepare()
    for task in plan.tasks:
        silent.write(replace(store.read(task.key), origins=()))
    assert collect(plan, silent).attrs["source_hash"] == "unknown"
    found = collect(plan, empty)
    assert found.attrs["source_hash"] == "nothing is computed yet"
    assert set(found["computed_by"].values.ravel()) == {""}
    file.write(found, tmp_path / "empty.nc")
    with file.read(tmp_path / "empty.nc") as again:
        assert again.sizes["software"] == 0
