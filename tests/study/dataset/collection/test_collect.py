"""The dataset says what the results say, with names, units and provenance, in bytes that depend on nothing else."""

import time
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from nanoslip.solver.outcome import Ending, Outcome
from nanoslip.study.dataset import file
from nanoslip.study.dataset.access import Accessor
from nanoslip.study.dataset.collect import collect
from nanoslip.study.dataset.file import groups_of
from nanoslip.study.origin import Origin, computing
from nanoslip.study.plan.grids import load_front
from nanoslip.study.plan.plan import Plan
from nanoslip.study.plan.task import TaskResult
from nanoslip.study.results.store import Store, StoreError
from tests.conftest import SMALL
from tests.study.dataset.campaigns import CASE_DIMS, changed


def test_attributes_carry_the_campaign_and_the_software(small):
    plan, _, found = small
    assert found.attrs["Conventions"] == "CF-1.11"
    assert found.attrs["title"] == plan.manifest.title
    assert found.attrs["manifest"] == plan.manifest.text
    assert found.attrs["manifest_sha256"] == plan.manifest.sha256
    assert found.attrs["slab_width"] == plan.manifest.scales.slab_width
    assert {"nanoslip_version", "source_commit", "numpy_version"} <= set(found.attrs)


def test_a_result_that_is_lost_while_it_is_read_is_pending_in_all_cases_that_share_it(build, monkeypatch):
    plan, store = build(changed(intrinsic_friction='pin = ["flat_punch"]'))  # which has no radius
    assert len(plan.cases) == 2 * len({plan.case_tasks[case.case_id].record for case in plan.cases})
    monkeypatch.setattr(Store, "find", lambda *_: None)
    assert set(collect(plan, store)["outcome"].values.ravel()) == {"pending"}


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
    assert [bool(name) for name in found["record_id"].values.ravel()] == [True, False]
    with pytest.raises(ValueError, match="has no record"):
        Accessor(found).record(intrinsic_friction=0.5)


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
    assert found["record_id"].values.ravel().tolist() == groups_of(found)["record"]["record"].values.tolist()
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


OLD = replace(computing(), source_hash="0123456789abcdef", source_commit="c0ffee", numpy_version="1.0")


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
    assert found.attrs["source_hash"] == computing().source_hash
    assert groups_of(found)["software"]["software_results"].values.tolist() == [
        12
    ]  # four records and their eight drives
    assert (
        set(found["computed_by"].values.ravel()) == {computing().name} == set(found["drive_computed_by"].values.ravel())
    )
    found = collect(plan, copied(plan, store, tmp_path, lambda _: OLD))
    for item in fields(Origin):
        assert found.attrs[item.name] == getattr(OLD, item.name)
        assert groups_of(found)["software"][f"software_{item.name}"].values.tolist() == [getattr(OLD, item.name)]
    assert set(found["computed_by"].values.ravel()) == {OLD.name}
    assert file.MIXED not in found.attrs


def test_results_of_different_software_are_named_with_counts_and_case_by_case(small, tmp_path):
    plan, store, _ = small
    one = plan.case_tasks[plan.cases[0].case_id]
    kept = {one.record, *one.drives.values()}
    mixed = copied(plan, store, tmp_path, lambda result: computing() if result.key in kept else OLD)
    found = collect(plan, mixed)
    assert found.attrs["source_hash"] == f"{OLD.source_hash} (9 results), {computing().source_hash} (3 results)"
    assert found.attrs["python_version"] == computing().python_version
    assert f"9 of {OLD}; 3 of {computing()}" in found.attrs[file.MIXED]
    assert found["computed_by"].values.ravel().tolist() == [computing().name] + 3 * [OLD.name]
    counts = dict(
        zip(*(groups_of(found)["software"][name].values for name in ("software", "software_results")), strict=True)
    )
    assert counts == {computing().name: 3, OLD.name: 9}


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
        assert groups_of(again)["software"].sizes["software"] == 0
