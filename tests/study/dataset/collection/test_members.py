"""The dataset of an ensemble: means over members, their ±, how many have a value, and the values of each."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from nanoslip.solver.ensemble import mean_of
from nanoslip.solver.outcome import Ending, Outcome
from nanoslip.study.dataset.collect import collect
from nanoslip.study.dataset.file import groups_of
from nanoslip.study.dataset.variables import EXPLAINED, fewer, means_of, members_of
from nanoslip.study.plan.kinds import column
from nanoslip.study.plan.plan import Plan
from nanoslip.study.results.store import Store
from tests.conftest import SMALL
from tests.study.dataset.campaigns import Build

Four = tuple[Plan, Store, xr.Dataset]
FOUR = SMALL.replace("members = 1", "members = 4").replace("[50.0, 100.0]", "[50.0]")


@pytest.fixture(scope="module")
def four(build: Build) -> Four:
    plan, store = build(FOUR)
    return plan, store, collect(plan, store)


def prepared(folder: Path) -> Store:
    store = Store(folder)
    store.prepare()
    return store


def test_a_number_is_the_mean_over_members_with_its_error_and_count(four: Four) -> None:
    plan, store, found = four
    here, keys = found.isel(intrinsic_friction=0).squeeze(), plan.case_tasks[plan.cases[0].case_id]
    record, driven = store.read(keys.record or ""), store.read(keys.drives["fast"])
    for name, values, at in (
        ("plateau_mean", record.scalars["plateau_mean"], here),
        ("mean_step", record.scalars["mean_step"], here),
        ("static_friction", driven.scalars["static_friction"], here.sel(drive="fast")),
    ):
        mean = mean_of(np.array(values))
        assert at[name].item() == mean.mean
        assert at[f"{name}_uncertainty"].item() == mean.uncertainty > 0.0
        assert at[f"{name}_members"].item() == mean.members == 4
    assert here["events"].item() == 200.0
    in_meters = here["mean_step_uncertainty"].item() * plan.manifest.scales.slab_width
    assert here["mean_step_si_uncertainty"].item() == pytest.approx(in_meters, rel=1e-15)
    assert (here["members"].item(), set(here["drive_members"].values)) == (4, {4})
    assert "member" not in found.dims


def test_the_values_of_each_member_are_beside_and_runs_are_the_firsts(four: Four) -> None:
    plan, store, found = four
    ensemble, driven, records = (groups_of(found)[name] for name in ("ensemble", "drive_ensemble", "record"))
    assert ensemble["member_row_size"].values.tolist() == [4, 4]
    assert driven["drive_member_row_size"].values.tolist() == 4 * [4]
    assert records["row_size"].values.tolist() == [200, 200]
    for number, case in enumerate(plan.cases):
        result = store.read(plan.case_tasks[case.case_id].record or "")
        members, events = (slice(size * number, size * (number + 1)) for size in (4, 200))
        np.testing.assert_array_equal(ensemble["plateau_mean"].values[members], result.scalars["plateau_mean"])
        first = column(result, "displacement", "event")
        assert len(result.arrays["displacement"]) == 4 * len(first)
        np.testing.assert_array_equal(records["displacement"].values[events], first)


def test_one_member_has_no_error_and_no_group_of_its_own(build: Build) -> None:
    found = collect(*build(SMALL))
    assert np.isnan(found["plateau_mean_uncertainty"]).all()
    assert set(found["members"].values.ravel()) == {1.0}
    assert not {"ensemble", "drive_ensemble"} & set(groups_of(found))
    assert means_of(found) == ""


def test_members_without_a_value_and_words_are_counted(four: Four, tmp_path: Path) -> None:
    plan, store, _ = four
    part, keys = prepared(tmp_path), plan.case_tasks[plan.cases[0].case_id]
    record, driven = store.read(keys.record or ""), store.read(keys.drives["fast"])
    values = record.scalars["plateau_mean"]
    scalars = {**record.scalars, "plateau_mean": [math.nan, *values[1:]]}
    lost = Outcome(Ending.COMPLETED, "1 of 4 members no_plateau: raise it")
    part.write(replace(record, scalars=scalars, outcome=lost))
    part.write(replace(driven, scalars={**driven.scalars, "regime": [2, 0, math.nan, 2]}))
    here = collect(plan, part).isel(intrinsic_friction=0).squeeze()
    assert here["plateau_mean"].item() == pytest.approx(np.mean(values[1:]), rel=1e-15)
    assert (fewer(here, "plateau_mean"), fewer(here, "mean_step")) == (" (3 of 4)", "")
    assert members_of(here, "events") is None
    assert (here["outcome"].item(), here["message"].item()) == ("completed", lost.message)
    assert here["regime"].sel(drive="fast").item() == "2 slides; 1 sticks"
    assert means_of(here) == f"numbers are means over 4 members; (k of n) {EXPLAINED}"


def test_a_drive_that_no_member_yields_has_no_numbers(four: Four, tmp_path: Path) -> None:
    plan, store, _ = four
    part, keys = prepared(tmp_path), plan.case_tasks[plan.cases[0].case_id]
    part.write(store.read(keys.record or ""))
    none = replace(store.read(keys.drives["fast"]), outcome=Outcome(Ending.NO_PLATEAU, "why"), scalars={}, arrays={})
    part.write(none)
    found = collect(plan, part).isel(intrinsic_friction=0).squeeze()
    assert found["drive_outcome"].sel(drive="fast").item() == "no_plateau"
    assert np.isnan(found["static_friction"]).all()
    assert np.isfinite(found["plateau_mean"].item())


def test_a_target_is_reached_or_the_most_are_computed(build: Build) -> None:
    asked = 0.008
    text = FOUR.replace("ensemble.members = 4", f"target = {{within = {asked}, most = 24, of = ['plateau_mean']}}")
    found = collect(*build(text)).squeeze()
    shares = (2.0 * found["plateau_mean_uncertainty"] / found["plateau_mean"]).values.tolist()
    counts = found["members"].values.tolist()
    assert set(counts) <= {3.0, 6.0, 12.0, 24.0}
    assert all(share <= asked or count == 24 for share, count in zip(shares, counts, strict=True))
