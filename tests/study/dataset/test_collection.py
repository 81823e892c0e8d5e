"""The dataset says what the results say, with names, units and provenance, in bytes that depend on nothing else."""

import math
import shutil
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from nanoslip.solver.ensemble import mean_of
from nanoslip.solver.outcome import Ending, Outcome
from nanoslip.solver.sliding.validity import KNOWN
from nanoslip.study import api
from nanoslip.study.dataset import file, runs
from nanoslip.study.dataset.access import Accessor
from nanoslip.study.dataset.collect import collect
from nanoslip.study.dataset.file import NOTE, dataset_hash, is_current_dataset, read_groups, write_state
from nanoslip.study.dataset.table import case_rows
from nanoslip.study.dataset.variables import (
    EXPLAINED,
    all_groups,
    explain_means,
    fewer,
    member_count_text,
    missing_error_reasons,
    scalars,
)
from nanoslip.study.origin import Origin, computing_origin, here
from nanoslip.study.plan.plan import Plan, make_plan
from nanoslip.study.results import attempts
from nanoslip.study.results.attempts import Attempt
from nanoslip.study.results.store import FOLDER, Store
from nanoslip.study.tasks.kind import member_column
from nanoslip.study.tasks.task import TaskResult
from tests.conftest import SMALL
from tests.study.dataset.campaigns import CASE_DIMS, Build, changed
from tests.study.results.results import NO_FILES


def prepared(folder: Path) -> Store:
    store = Store(folder)
    store.prepare()
    return store


def said(values: xr.DataArray) -> set[object]:
    return set(values.values.ravel().tolist())


# Numbers and units.


def test_each_scalar_is_its_tasks_in_the_units_it_names(small):
    plan, store, found = small
    scales = plan.manifest.scales
    for case in plan.cases:
        keys = plan.case_tasks[case.case_id]
        record = {name: value for name, (value,) in store.read(keys["record", ""]).scalars.items()}
        place = found.sel({name: case.parameters[name] for name in CASE_DIMS})
        expected = {
            "case_id": case.case_id,
            "outcome": "completed",
            "plateau_mean": record["plateau_mean"],
            "events": 200,
            "plateau_ratio": record["plateau_mean"] * (1.0 / case.parameters["intrinsic_friction"]),
            "initial_force": record["initial_force"] * (1.0 / record["normal_load"]),
            "surface_stiffness_si": record["surface_stiffness"] * scales.stiffness,
            "mean_step_si": record["mean_step"] * scales.slab_width,
        }
        assert {name: place[name].item() for name in expected} == expected
        for name, key in ((name, key) for (kind, name), key in keys.items() if kind == "drive"):
            driven = store.read(key).scalars
            for scalar in ("static_friction", "macroscopic_slips"):  # NaN where the pin never slipped
                np.testing.assert_equal(place[scalar].sel(drive=name).item(), driven[scalar][0])


def test_no_number_of_a_result_is_lost(small):
    plan, store, _ = small
    # Of parameters; zero at initial contact; spring_force_amplitude where it means something; for drives over the record.
    known_apart = {"normal_load", "spacing", "node_area", "presliding_length"}
    known_apart |= {"displacement", "spring_force_range", "forgotten_from"}
    known_apart |= {
        f"plateau_{name}" for name in ("first_event", "last_event", "peak", "drift", "event_drift", "stress_drift")
    }
    for task in plan.tasks:
        result = store.read(task.key)
        series = [each for group in all_groups().values() for each in group.series if each.kind == task.kind]
        stated = {key: each.shared for key, each in scalars(task.kind)}
        known = {*stated, *(f"{key}_shared_error" for key, shared in stated.items() if shared)}
        assert set(result.scalars) - known_apart <= known
        if task.kind in ("record", "drive"):
            kept = {name for each in series for name in each.columns}
            assert set(result.arrays) - {"binned_force"} <= kept  # what uncertainties are made of


# What is not there, and how cases ended.


def test_a_result_that_is_lost_while_it_is_read_is_pending_in_all_cases_that_share_it(build, monkeypatch):
    plan, store = build(changed(intrinsic_friction='pin = ["flat_punch"]'))  # which has no radius
    assert len(plan.cases) == 2 * len({plan.case_tasks[case.case_id]["record", ""] for case in plan.cases})
    monkeypatch.setattr(Store, "find", lambda *_: None)
    assert said(collect(plan, store)["outcome"]) == {"pending"}


def test_what_is_not_computed_is_pending(build, tmp_path):
    plan, store = build(changed(n_x="n_x = 17\nrows_per_level = 3", radius="poisson = [0.3]"))
    part = prepared(tmp_path)
    part.write(store.read(plan.case_tasks[plan.cases[0].case_id]["record", ""]))
    found = collect(plan, part)
    assert found["outcome"].values.ravel().tolist() == ["completed", "pending"]
    assert said(found["drive_outcome"]) == {"pending"}
    assert np.isnan(found["static_friction"]).all()
    assert [bool(name) for name in found["record_id"].values.ravel()] == [True, False]
    with pytest.raises(ValueError, match="has no record"):
        Accessor(found).record(intrinsic_friction=0.5)


def test_a_point_that_physics_refuses_is_a_row_with_the_reason(build):
    text = changed(radius="coarsest_row = [5, 17]", n_x="radius = 50.0", intrinsic_friction="n_x = [9, 17]")
    found = collect(*build(text.replace("[numerics]", "[constants]")))
    refused = found.sel(n_x=9, coarsest_row=17)
    assert refused["outcome"].item() == "invalid"
    assert "coarsest_row = 17" in refused["message"].item()
    assert said(refused["drive_outcome"]) == {"invalid"}
    assert np.isnan(refused["plateau_mean"])
    assert found.sel(n_x=17, coarsest_row=17)["outcome"].item() == "completed"


def test_what_a_case_and_a_drive_lack_can_be_filtered(build):
    """Eight events are no plateau; over 60 the slow drive never slips, and what it does is a word."""
    found = collect(*build(changed(events="events = 8", radius="radius = [50.0]")))
    assert said(found["outcome"]) == said(found["drive_outcome"]) == {"no_plateau"}
    assert said(found["regime"]) == {""}
    assert np.isnan(found["static_friction"]).all()
    assert found["events"].values.ravel().tolist() == [8.0, 8.0]
    assert found["record_id"].values.ravel().tolist() == read_groups(found)["record"]["record"].values.tolist()
    found = collect(*build(SMALL.replace("stage_velocity = 1e-3", "stage_velocity = 1e-4")))
    assert said(found["outcome"]) == {"completed"}
    slow = found.sel(drive="slow")
    assert (said(slow["drive_outcome"]), said(slow["regime"])) == ({"no_slip"}, {"sticks"})
    assert np.all(slow["time_stuck"] == 1.0)


def test_a_failure_outweighs_a_missing_plateau_and_what_is_unfinished_is_pending(build, tmp_path):
    plan, store = build(changed(events="events = 8", radius="radius = [50.0]") + "tractions_at = [3]\n")
    part = prepared(tmp_path)
    first, second = (plan.case_tasks[case.case_id] for case in plan.cases)
    for keys in (first, second):
        part.write(store.read(keys["record", ""]))
    part.write(replace(store.read(first["states", ""]), outcome=Outcome(Ending.CONTACT_LOST, "press harder")))
    found = collect(plan, part)
    assert found["outcome"].values.ravel().tolist() == ["contact_lost", "pending"]
    assert found["message"].values.ravel()[0] == "press harder"


# Bytes, software, and what a dataset is made of.


def test_bytes_depend_on_results_alone(small, tmp_path):
    plan, store, _ = small
    other = prepared(tmp_path)
    for task in reversed(plan.tasks):
        other.write(store.read(task.key))
    time.sleep(1.1)  # HDF5 keeps times in whole seconds, if it is let
    file.write_netcdf(collect(plan, other), tmp_path / file.FILE)
    assert (tmp_path / file.FILE).read_bytes() == (store.folder.parent / file.FILE).read_bytes()


OLD = replace(computing_origin(), source_hash="0123456789abcdef", source_commit="c0ffee", numpy_version="1.0")


def copied(plan: Plan, store: Store, folder: Path, by: Callable[[TaskResult], tuple[Origin, ...]]) -> Store:
    """The same results, as if computed by other software."""
    other = prepared(folder)
    for task in plan.tasks:
        result = store.read(task.key)
        other.write(replace(result, origins=by(result)))
    return other


def test_the_software_named_is_that_which_computed_not_that_which_collects(small, tmp_path):
    plan, store, found = small
    assert found.attrs["source_hash"] == computing_origin().source_hash
    # Four records and their eight drives.
    assert read_groups(found)["software"]["software_results"].values.tolist() == [12]
    assert said(found["computed_by"]) == {computing_origin().name} == said(found["drive_computed_by"])
    found = collect(plan, copied(plan, store, tmp_path, lambda _: (OLD,)))
    for item in fields(Origin):
        assert found.attrs[item.name] == getattr(OLD, item.name)
        assert read_groups(found)["software"][f"software_{item.name}"].values.tolist() == [getattr(OLD, item.name)]
    assert said(found["computed_by"]) == {OLD.name}
    assert file.MIXED not in found.attrs


@pytest.mark.parametrize("damage", [{"validity_flags": 2**31}, {"plateau_mean": 1e308, "static_friction": 1e308}])
def test_results_that_make_no_sense_are_collected_without_a_word(small, tmp_path, damage):
    """Flags that no version has, and numbers that overflow in another unit."""
    plan, store, _ = small
    other = Store(tmp_path)
    other.prepare()
    for task in plan.tasks:
        result = store.read(task.key)
        scalars = {name: [damage.get(name, value) for value in values] for name, values in result.scalars.items()}
        other.write(replace(result, scalars=scalars))
    found = collect(plan, other)
    assert (found["validity_flags"] & ~KNOWN == 0).all()


def test_results_of_different_software_are_named_with_counts_and_case_by_case(small, tmp_path):
    plan, store, _ = small
    one = plan.case_tasks[plan.cases[0].case_id]
    mine = {key for (kind, _), key in one.items() if kind in ("record", "drive")}
    found = collect(
        plan, copied(plan, store, tmp_path, lambda result: (computing_origin() if result.key in mine else OLD,))
    )
    assert found.attrs["source_hash"] == f"{OLD.source_hash} (9 results), {computing_origin().source_hash} (3 results)"
    assert found.attrs["python_version"] == computing_origin().python_version
    assert f"9 of {OLD}; 3 of {computing_origin()}" in found.attrs[file.MIXED]
    assert found["computed_by"].values.ravel().tolist() == [computing_origin().name] + 3 * [OLD.name]
    software = read_groups(found)["software"]
    counts = zip(software["software"].values, software["software_results"].values, strict=True)
    assert dict(counts) == {computing_origin().name: 3, OLD.name: 9}


def test_a_result_that_does_not_say_is_of_unknown_software_and_no_result_of_none(small, tmp_path):
    plan, store, _ = small
    silent = copied(plan, store, tmp_path / "silent", lambda _: ())
    assert collect(plan, silent).attrs["source_hash"] == "unknown"
    found = collect(plan, prepared(tmp_path / "empty"))
    assert " " in found.attrs["source_hash"]  # no hash
    assert said(found["computed_by"]) == {""}
    file.write_netcdf(found, tmp_path / "empty.nc")
    with file.open_dataset(tmp_path / "empty.nc") as again:
        assert read_groups(again)["software"].sizes["software"] == 0


Made = tuple[Plan, Store, Path]


@pytest.fixture(scope="module")
def collected(small, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a dataset of all results but the first: not to be changed."""
    plan, known, _ = small
    store = prepared(tmp_path_factory.mktemp("collected"))
    for key in sorted(known.finished())[1:]:
        store.write(known.read(key))
    path = store.folder.with_name(file.FILE)
    file.write_netcdf(collect(plan, store), path)
    write_state(path, store, dataset_hash(plan.manifest, store))
    return path.parent


@pytest.fixture
def made(small, collected: Path, tmp_path: Path) -> Made:
    """A copy of it."""
    folder = shutil.copytree(collected, tmp_path / "made")
    plan, store, path = small[0], Store(folder), folder / file.FILE
    assert up_to_date(plan, store, path)
    return plan, store, path


def up_to_date(plan: Plan, store: Store, path: Path) -> bool:
    return is_current_dataset(path, store, dataset_hash(plan.manifest, store))


def test_a_result_or_a_failure_more_other_numbers_and_another_title_make_another_dataset(made, small):
    plan, store, path = made
    before = store.read(next(iter(store.finished())))
    store.write(replace(before, scalars={**before.scalars, "another": 1.0}))
    assert not up_to_date(*made)
    store.write(before)
    assert up_to_date(*made)
    manifest = replace(plan.manifest, text=plan.manifest.text.replace("small", "large"))
    assert not up_to_date(make_plan(manifest), store, path)
    failed = Attempt("a", "record", "crashed", "why", True, False, here().solver, "rank 0", "2026-01-01T00:00:00+00:00")
    attempts.add_attempt(path.parent, failed)
    assert not up_to_date(*made)
    (path.parent / attempts.FILE).unlink()
    assert up_to_date(*made)
    store.write(small[1].read(min(small[1].finished())))
    assert not up_to_date(*made)


def test_another_file_in_its_place_is_not_up_to_date(made):
    path = made[2]
    content = path.read_bytes()
    for other in (content[:-1], content[: len(content) // 2], b"", content + b"\n"):
        path.write_bytes(other)
        assert not up_to_date(*made)
    path.unlink()
    assert not up_to_date(*made)


@NO_FILES
@pytest.mark.parametrize("name", [f"{FOLDER}/{NOTE}", file.FILE])
def test_what_is_no_file_is_not_up_to_date_and_nobody_waits_for_it(made, no_file, name):
    (made[2].parent / name).unlink()
    no_file(made[2].parent / name)
    assert not up_to_date(*made)


# Layout: along the axes of a full product, or along one dimension of their own.


def test_a_full_product_has_the_four_standard_dimensions_and_the_drives(small):
    found = small[2]
    assert found["plateau_mean"].dims == CASE_DIMS
    assert found["plateau_mean"].shape == (2, 2, 1, 1)
    assert found["static_friction"].dims == found["regime"].dims == found["resticks"].dims == (*CASE_DIMS, "drive")
    assert found["drive"].values.tolist() == ["slow", "fast"]
    assert found["stage_velocity"].values.tolist() == [1e-3, 2e-3]
    assert found["n_x"].values.tolist() == [17]
    assert (found["normal_load"].item(), found["support"].item()) == (1e-3, "bonded")


LISTED = {
    "zip": ('design = "zip"\n' + SMALL, [50.0, 100.0]),
    "table": (
        'table = "cases.csv"\n' + SMALL[: SMALL.index("[axes]")] + SMALL[SMALL.index("[numerics]") :],
        [50.0, 50.0, 100.0],
    ),
}


@pytest.mark.parametrize(("text", "radii"), LISTED.values(), ids=LISTED)
def test_a_list_of_cases_lies_along_one_dimension(build, text, radii):
    plan, store = build(text)
    found = collect(plan, store)
    for name in ("plateau_mean", "intrinsic_friction", "n_x"):
        assert found[name].dims == ("case",)
    assert found["radius"].values.tolist() == radii
    one = Accessor(found).record(intrinsic_friction=0.5, radius=100.0)
    last = store.read(plan.case_tasks[plan.cases[-1].case_id]["record", ""])
    np.testing.assert_array_equal(one["displacement"], last.arrays["displacement"])


def test_parameters_that_do_not_matter_are_no_coordinates(build):
    text = SMALL.split("[[drives]]")[0].replace(', "dynamics"', "")
    smooth = collect(*build(text))
    assert not {"half_width", "distribution", "seed", "rows", "first_spacing"} & set(smooth.coords)
    assert {"spread", "max_events", "slip_order"} <= set(smooth.coords)
    contact = collect(*build(text.replace('"contact", "slip"', '"contact"')))
    assert not {"max_events", "pin_translation"} & set(contact.coords)
    two = 'design = "zip"\n' + text.replace("[50.0, 100.0]", '[50.0, 100.0]\npin = ["parabola", "flat_punch"]')
    mixed = collect(*build(two))
    np.testing.assert_array_equal(mixed["half_width"], [np.nan, 0.25])
    np.testing.assert_array_equal(mixed["radius"], [50.0, np.nan])


HEAD = SMALL[: SMALL.index("[[drives]]")].replace("[50.0, 100.0]", "[50.0]")
AXES = "[drive_axes]\nspring_stiffness = [1e5, 2e5]\npin_mass = [0.5, 0.2, 1.0]\n" + SMALL[SMALL.index("[[drives]]") :]


def test_axes_of_drives_are_dimensions_and_one_record_serves_all(build):
    """Beside `drive`, as there are several tables; every drive's value stands where its own task says."""
    plan, store = build(HEAD + AXES)
    found = collect(plan, store)
    assert Counter(task.kind for task in plan.tasks) == {"compliance": 1, "record": 2, "drive": 2 * 2 * 2 * 3}
    assert found["regime"].dims == (*CASE_DIMS, "drive", "spring_stiffness", "pin_mass")
    assert found["plateau_mean"].dims == CASE_DIMS
    assert found["spring_stiffness"].values.tolist() == [1e5, 2e5]
    assert found["stage_velocity"].dims == ("drive",)
    assert not [name for name in found.data_vars if str(name).startswith(("fitted_", "fit_"))]  # outputs.fit = false
    for case in plan.cases:
        for drive in plan.manifest.drives:
            place = {"intrinsic_friction": case.parameters["intrinsic_friction"], "drive": drive.name, **drive.point}
            result = store.read(plan.case_tasks[case.case_id]["drive", drive.label])
            assert found["steps"].sel(place).item() == result.scalars["steps"][0]
            assert found["drive_outcome"].sel(place).item() == result.outcome.ending


def test_what_follows_from_an_axis_varies_along_it_alone(build):
    axes = "[drive_axes]\nspring_stiffness = [1e5, 2e5]\npin_mass = [0.5, 0.05]\nprofile = ['mean']\n"
    found = collect(*build(HEAD + axes + '[[drives]]\nname = "one"\nsamples = 5\nduration_periods = 2\n'))
    assert found["duration"].dims == ("spring_stiffness", "pin_mass")
    two_periods = 4.0 * np.pi * np.sqrt(found["pin_mass"] / found["spring_stiffness"]).T
    np.testing.assert_allclose(found["duration"], two_periods, rtol=1e-15)
    assert (found["duration_periods"].item(), found["drive"].item(), found["profile"].item()) == (2.0, "one", "mean")
    assert found["steps"].dims == (*CASE_DIMS, "spring_stiffness", "pin_mass")


def test_a_point_that_excludes_itself_is_invalid_with_its_case_and_the_others_done(build):
    axes = "[drive_axes]\ntime_step = [1e-6, 1e-3]\nduration = [1e-4, 2e-3]\n"
    found = collect(*build(HEAD + axes + '[[drives]]\nname = "a"\nintegrator = "rk4"\n'))
    endings = found["drive_outcome"].isel(intrinsic_friction=0).squeeze()
    assert endings.dims == ("time_step", "duration")
    assert (endings == "invalid").values.tolist() == [[False, False], [True, False]]
    assert "needs 0 < time_step" in found["drive_message"].sel(time_step=1e-3, duration=1e-4)[0].item()
    assert said(found["outcome"]) == {"completed"}


def test_a_list_of_cases_lies_before_the_axes_of_drives_and_members_along_none(build):
    found = collect(*build(HEAD.replace("members = 1", "members = 3") + AXES))
    dims = ("drive", "spring_stiffness", "pin_mass")
    for name in ("static_friction", "static_friction_uncertainty", "static_friction_members"):
        assert found[name].dims == (*CASE_DIMS, *dims)
    assert np.isfinite(found["static_friction_uncertainty"]).any()
    zipped = collect(*build('design = "zip"\n' + HEAD.replace("[50.0]", "[50.0, 100.0]") + AXES))
    assert zipped["static_friction"].dims == ("case", *dims)


# Ensembles: means over members, their ±, how many have a value, and the values of each.

Four = tuple[Plan, Store, xr.Dataset]
FOUR = SMALL.replace("members = 1", "members = 4").replace("[50.0, 100.0]", "[50.0]")


@pytest.fixture(scope="module")
def four(build: Build) -> Four:
    plan, store = build(FOUR)
    return plan, store, collect(plan, store)


def test_a_number_is_the_mean_over_members_with_its_error_and_count(four: Four) -> None:
    plan, store, found = four
    case, keys = found.isel(intrinsic_friction=0).squeeze(), plan.case_tasks[plan.cases[0].case_id]
    record, (drive, pulled) = keys["record", ""], (keys["drive", "fast"], case.sel(drive="fast"))
    for name, key, at in (
        ("plateau_mean", record, case),
        ("surface_stiffness", record, case),
        ("contact_half_width", record, case),
        ("static_friction", drive, pulled),
        ("kinetic_friction", drive, pulled),
    ):
        of = store.read(key).scalars
        shared = of.get(f"{name}_shared_error", [0.0])[0]
        mean = mean_of(np.array(of[name]), shared)
        assert at[name].item() == mean.mean
        assert at[f"{name}_uncertainty"].item() == mean.uncertainty > 0.0
        assert at[f"{name}_members"].item() == mean.members == 4
        assert (f"{name}_shared_error" in at) == (f"{name}_shared_error" in of)
        assert at.get(f"{name}_shared_error", 0.0) == shared
    assert case["events"].item() == 200.0
    in_si = case["surface_stiffness_uncertainty"].item() * plan.manifest.scales.stiffness
    assert case["surface_stiffness_si_uncertainty"].item() == pytest.approx(in_si, rel=1e-15)
    assert np.isnan([case[f"mean_step{end}"].item() for end in ("_uncertainty", "_shared_error")]).all()  # 200 events
    assert (case["members"].item(), said(case["drive_members"])) == (4, {4})
    assert "member" not in found.dims


def test_the_values_of_each_member_are_beside_and_runs_are_the_firsts(four: Four) -> None:
    plan, store, found = four
    ensemble, driven, records = (read_groups(found)[name] for name in ("ensemble", "drive_ensemble", "record"))
    assert ensemble["member_row_size"].values.tolist() == [4, 4]
    assert driven["drive_member_row_size"].values.tolist() == 4 * [4]
    assert records["row_size"].values.tolist() == [200, 200]
    for number, case in enumerate(plan.cases):
        result = store.read(plan.case_tasks[case.case_id]["record", ""])
        members, events = (slice(size * number, size * (number + 1)) for size in (4, 200))
        np.testing.assert_array_equal(ensemble["plateau_mean"].values[members], result.scalars["plateau_mean"])
        first = member_column(result, "displacement", "event")
        assert len(result.arrays["displacement"]) == 4 * len(first)
        np.testing.assert_array_equal(records["displacement"].values[events], first)


def test_one_member_has_no_error_and_no_group_of_its_own(small) -> None:
    found = small[2]
    assert np.isnan(found["plateau_mean_uncertainty"]).all()
    assert said(found["members"]) == {1.0}
    assert not {"ensemble", "drive_ensemble"} & set(read_groups(found))
    assert explain_means(found, found) == missing_error_reasons(found, ["plateau_mean"]) == "± ?: a single start"


def test_members_without_a_value_and_words_are_counted(four: Four, tmp_path: Path) -> None:
    plan, store, _ = four
    part, keys = prepared(tmp_path), plan.case_tasks[plan.cases[0].case_id]
    record, driven = store.read(keys["record", ""]), store.read(keys["drive", "fast"])
    values = record.scalars["plateau_mean"]
    lost = Outcome(Ending.COMPLETED, "1 of 4 members no_plateau: raise it")
    part.write(replace(record, scalars={**record.scalars, "plateau_mean": [math.nan, *values[1:]]}, outcome=lost))
    part.write(replace(driven, scalars={**driven.scalars, "regime": [2, 0, math.nan, 2]}))
    case = collect(plan, part).isel(intrinsic_friction=0).squeeze()
    assert case["plateau_mean"].item() == pytest.approx(np.mean(values[1:]), rel=1e-15)
    assert (fewer(case, "plateau_mean"), fewer(case, "mean_step")) == (" (3 of 4 starts)", "")
    assert not member_count_text(case, "events")
    assert (case["outcome"].item(), case["message"].item()) == ("completed", lost.message)
    fast = case.sel(drive="fast")
    assert fast["regime"].item() == "slides"
    assert case_rows(fast, "regime").tallies("regime") == [{"slides": 2, "sticks": 1}]
    assert case_rows(fast, "outcome").tallies("outcome") == [{"completed": 1}]  # members are not counted
    assert explain_means(case, case).endswith(
        f"over 4 members, ± their 68 % interval; {missing_error_reasons(case, case)}; {EXPLAINED}"
    )
    assert missing_error_reasons(case, ["plateau_mean"]) == "± ?: starts without a value"
    assert missing_error_reasons(case, ["surface_stiffness", "events"]) == ""
    # What stands below a table explains the numbers that the table shows.
    assert explain_means(case, ["surface_stiffness"]).endswith("over 4 members, ± their 68 % interval")


@pytest.mark.parametrize(
    ("regimes", "amplitudes", "mean"),
    [
        ((1, 1, 1, 1), (1.0, 2.0, 3.0, 4.0), 2.5),
        ((1, 1, 1, 2), (1.0, 2.0, 3.0, 4.0), math.nan),
        ((2, 2, 2, 2), (1.0, 2.0, 3.0, math.nan), math.nan),
    ],
)
def test_an_amplitude_has_a_mean_where_all_members_have_it_in_one_regime(
    four: Four, tmp_path: Path, regimes: tuple[int, ...], amplitudes: tuple[float, ...], mean: float
) -> None:
    plan, store, _ = four
    part, keys = prepared(tmp_path), plan.case_tasks[plan.cases[0].case_id]
    part.write(store.read(keys["record", ""]))
    driven = store.read(keys["drive", "fast"])
    load = next(task.case.normal_load for task in plan.tasks if task.key == driven.key and task.case)
    new = {"regime": [float(each) for each in regimes], "spring_force_amplitude": [load * each for each in amplitudes]}
    new |= {"spring_force_amplitude_shared_error": [0.0] * 4}  # as of long records
    part.write(replace(driven, scalars={**driven.scalars, **new}))
    case = collect(plan, part).isel(intrinsic_friction=0).squeeze().sel(drive="fast")
    assert case["spring_force_amplitude"].item() == pytest.approx(mean, rel=1e-12, nan_ok=True)
    assert np.isnan(case["spring_force_amplitude_uncertainty"]) == math.isnan(mean)
    assert case["spring_force_amplitude_members"].item() == np.isfinite(amplitudes).sum()


def test_members_with_the_same_events_are_one_start_and_give_no_error(build: Build) -> None:
    """A pin as flat as a punch meets the nodes alike from every start; so do the pulls that follow. So does a single node, even
    where the grid has followed the pin."""
    alone = {
        "constants": {"intrinsic_friction": 9.46, "radius": 356.0, "normal_load": 1.75e-7, "poisson": -0.9},
        "numerics": {"n_x": 17, "scheme": "strip"},
    }
    one = api.run(
        {"title": "One node", "stages": ["contact", "slip"], "limits": {"presliding": 80.0}, **alone}
    ).squeeze()
    assert one["mean_slips"] == 1.0
    assert np.isnan(one["plateau_mean_uncertainty"])
    found = collect(*build(FOUR.replace("radius = [50.0]", "radius = [50.0, 1e9]"))).squeeze()
    for name in ("plateau_mean", "static_friction"):
        known = np.isfinite(found[f"{name}_uncertainty"]).any([dim for dim in found[name].dims if dim != "radius"])
        assert (name, known.values.tolist()) == (name, [True, False])
    assert np.isfinite(found["plateau_mean"]).all()


# Records and trajectories of different length are cut apart again as they were put together.


def test_runs_are_contiguous_ragged_arrays_with_the_labels_of_what_they_belong_to(small):
    found = small[2]
    record, trajectory = read_groups(found)["record"], read_groups(found)["trajectory"]
    assert record["row_size"].attrs["sample_dimension"] == "event"
    assert int(record["row_size"].sum()) == record.sizes["event"] == 4 * 200
    assert trajectory["trajectory_row_size"].attrs["sample_dimension"] == "sample"
    assert int(trajectory["trajectory_row_size"].sum()) == trajectory.sizes["sample"] == 8 * 41
    assert record["event_kind"].attrs["flag_meanings"] == "slip release touch"
    cases = found["case_id"].values.ravel()
    assert record["record"].values.tolist() == found["record_id"].values.ravel().tolist()
    assert record["case_id"].values.tolist() == cases.tolist()
    assert trajectory["trajectory"].values.tolist() == found["trajectory_id"].values.ravel().tolist()
    assert trajectory["case_id"].values.tolist() == np.repeat(cases, 2).tolist()
    assert trajectory["drive"].values.tolist() == 4 * ["slow", "fast"]


def test_one_cases_record_is_its_result_and_opens_lazily(small):
    plan, store, found = small
    case = plan.cases[2]
    record = Accessor(found).record(**{name: case.parameters[name] for name in CASE_DIMS})
    columns = [variable for variable in record.variables.values() if variable.dims == ("event",)]
    assert sum(not variable._in_memory for variable in columns) == len(columns) - 4  # number and drop, made of forces
    result = store.read(plan.case_tasks[case.case_id]["record", ""])
    for name, quantity in all_groups()["record"].series[0].columns.items():
        by = 1.0 / result.scalars["normal_load"][0] if quantity.per else 1
        np.testing.assert_array_equal(record[quantity.name], result.arrays[name] * by)


def test_one_drives_trajectory_is_its_result_in_si(small):
    plan, store, found = small
    case, drive = plan.cases[1], plan.manifest.drives[1]
    moved = Accessor(found).trajectory(**{name: case.parameters[name] for name in CASE_DIMS}, drive="fast")
    result = store.read(plan.case_tasks[case.case_id]["drive", "fast"])
    # There and back: two roundings.
    assert moved["time"][-1].item() == pytest.approx(drive.drive.in_si.duration, rel=1e-14)
    expected = result.arrays["position"] * plan.manifest.scales.slab_width
    np.testing.assert_array_equal(moved["sample_position"], expected)
    assert moved.sizes["slip_phase"] == result.arrays["slip_time"].size


def test_cases_that_share_a_result_share_its_record(build):
    found = collect(*build(changed(radius="half_width = [0.1, 0.2]")))  # of a flat punch: the parabola ignores it
    first, second = read_groups(found)["record"]["record"].values.tolist()
    assert found["record_id"].values.ravel().tolist() == [first, first, second, second]


def test_a_dataset_of_long_columns_is_the_same(small, monkeypatch, tmp_path):
    plan, store, _ = small
    monkeypatch.setattr(runs, "HELD", 0)
    file.write_netcdf(collect(plan, store), tmp_path / file.FILE)
    assert (tmp_path / file.FILE).read_bytes() == (store.folder.parent / file.FILE).read_bytes()
