"""An ensemble that ends where it knows enough is the ensemble of so many members, and says how many they were."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from solver.outcome import Ending
from study.dataset import file
from study.dataset.collection.collect import collect
from study.dataset.collection.ensemble import NOT_NEEDED, ensemble_name, observables, over_members
from study.dataset.groups import groups_of
from study.manifest.cases import MEMBER
from study.manifest.reader import parse_manifest
from study.plan.plan import Plan, make_plan
from study.plan.tasks import run_task
from study.report.overview import accuracy, endings
from study.report.summary import failure_summary, scalar_table
from study.results.store import Store

UNTIL = 0.011
HEAD = """
title = "x"
axes.radius = [50.0, 100.0]
numerics.n_x = 33
limits.spacings = 0.4
"""
DRIVE = '[[drives]]\nname = "a"\nsamples = 5\n'


def planned(ensemble: str) -> Plan:
    return make_plan(parse_manifest(Path("mine.toml"), f"{HEAD}ensemble = {{{ensemble}}}\n{DRIVE}", {}))


def computed(plan: Plan, folder: Path, seed: int | None = None) -> Path:
    """The dataset's file. seed: of the order in which tasks are taken that are ready; None for the plan's own."""
    store, left = Store(folder), list(plan.tasks)
    store.prepare()
    random = np.random.default_rng(seed)
    done: set[str] = set()
    while left:
        ready = [number for number, task in enumerate(left) if done.issuperset(task.needs)]
        task = left.pop(ready[0] if seed is None else int(random.choice(ready)))
        store.write(run_task(task, {key: store.read(key) for key in task.needs}), task.shared)
        done.add(task.key)
    file.write(collect(plan, store), folder / file.FILE)
    return folder / file.FILE


@pytest.fixture(scope="module")
def until(tmp_path_factory: pytest.TempPathFactory) -> xr.Dataset:
    """Up to sixteen members of two cases, one of which needs more of them."""
    plan = planned(f"members = 16, uncertainty = {UNTIL}")
    return file.read(computed(plan, tmp_path_factory.mktemp("until")))


@pytest.fixture(scope="module")
def fixed(tmp_path_factory: pytest.TempPathFactory) -> dict[int, xr.Dataset]:
    """The same with a number of members that was given."""
    folder = tmp_path_factory.mktemp("fixed")
    return {
        count: file.read(computed(planned(f"members = {count}"), folder / str(count))).squeeze() for count in (4, 8, 16)
    }


def reached(found: xr.Dataset) -> np.ndarray:
    mean, error = (found[ensemble_name("plateau_mean", part)].values.squeeze() for part in ("mean", "uncertainty"))
    return np.asarray(error / mean <= UNTIL)


def test_it_ends_at_the_first_size_that_knows_enough_and_never_before(
    until: xr.Dataset, fixed: dict[int, xr.Dataset]
) -> None:
    used = until["members_used"].values.squeeze().tolist()
    expected = [
        next((count for count, found in fixed.items() if reached(found)[case]), 16) for case in range(len(used))
    ]
    assert used == expected
    assert len(set(used)) > 1, "needs cases that differ"


@pytest.mark.parametrize("part", ["mean", "uncertainty", "std"])
@pytest.mark.parametrize("name", [name for name, each in observables().items() if each.ensemble != "independent"])
def test_its_numbers_are_those_of_an_ensemble_of_that_size(
    until: xr.Dataset, fixed: dict[int, xr.Dataset], name: str, part: str
) -> None:
    """The same starts in another order: only sums differ, and starts by a rounding of none (halves are exact)."""
    for case, count in enumerate(until["members_used"].values.squeeze().tolist()):
        here, there = (found[ensemble_name(name, part)].squeeze().values[case] for found in (until, fixed[count]))
        np.testing.assert_allclose(here, there, rtol=1e-12)


def test_members_that_are_not_needed_have_an_ending_of_their_own_and_no_numbers(until: xr.Dataset) -> None:
    for case in range(2):
        one = until.isel(radius=case).squeeze()
        used = int(one["members_used"])
        for kind in ("outcome", "drive_outcome"):
            assert one[kind].values.tolist() == ["completed"] * used + [NOT_NEEDED] * (16 - used)
        for name in ("plateau_mean", "kinetic_friction", "approach", "events"):
            if name in one:
                assert np.isfinite(one[name].values[:used]).all()
                assert np.isnan(one[name].values[used:]).all()
    records = groups_of(until)["record"]
    assert records.sizes["record"] == int(until["members_used"].sum())


def test_what_a_reader_is_shown_is_of_the_members_used_and_no_failure(until: xr.Dataset) -> None:
    table = scalar_table(until)
    column = table.header.index("members")
    used = until["members_used"].values.squeeze().tolist()
    assert [int(row[column]) for row in table.rows] == used
    assert all(row[-1].startswith("completed") for row in table.rows)
    assert not table.failed
    assert not failure_summary(until)
    told = {ending.words: ending.failed for ending in endings(until)}
    assert told[f"{32 - sum(used)} members: not needed"] is False
    assert any(f"standard error of the mean of {min(used)} to {max(used)} members" in line for line in accuracy(until))


def test_words_are_counted_over_the_members_used(until: xr.Dataset, fixed: dict[int, xr.Dataset]) -> None:
    for case, count in enumerate(until["members_used"].values.squeeze().tolist()):
        here, there = (
            str(over_members(found)["regime"].values.squeeze()[case]).split("; ") for found in (until, fixed[count])
        )
        assert sorted(here) == sorted(there)


def test_the_order_in_which_tasks_are_done_changes_no_byte(until: xr.Dataset, tmp_path: Path) -> None:
    plan = planned(f"members = 16, uncertainty = {UNTIL}")
    files = [computed(plan, tmp_path / str(seed), seed) for seed in (1, 2)]
    own = computed(plan, tmp_path / "own")
    assert {each.read_bytes() for each in files} == {own.read_bytes()}


def test_what_is_not_computed_yet_is_not_used(tmp_path: Path) -> None:
    plan = planned(f"members = 16, uncertainty = {UNTIL}")
    store = Store(tmp_path)
    store.prepare()
    found = collect(plan, store)
    assert found["members_used"].values.ravel().tolist() == [0, 0]
    assert MEMBER in found["outcome"].dims
    assert NOT_NEEDED not in found["outcome"].values.ravel().tolist()
    assert Ending.NOT_NEEDED.value == NOT_NEEDED


def test_static_friction_can_be_what_is_asked_for(tmp_path: Path, fixed: dict[int, xr.Dataset]) -> None:
    """It ends at the second size in a row that knows enough: the scatter of few says little of itself."""
    name, enough = "static_friction", 0.02
    plan = planned(f'members = 16, uncertainty = {enough}, observable = "{name}"')
    found = file.read(computed(plan, tmp_path)).squeeze()
    known = {
        count: (each[ensemble_name(name, "uncertainty")] / each[ensemble_name(name, "mean")]).values <= enough
        for count, each in fixed.items()
    }
    expected = [8 if known[4][case] and known[8][case] else 16 for case in range(2)]
    assert found["members_used"].values.tolist() == expected
    assert len(set(expected)) > 1, "needs cases that differ"
