"""Results of a version with fewer or more numbers are results; no right checksum is cut out, no finished case is lost."""

from collections.abc import Callable, Collection
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import Final

import numpy as np
import pytest

from nanoslip.solver.parameter import SHARED_ERROR
from nanoslip.study.api import run
from nanoslip.study.dataset import file
from nanoslip.study.dataset.collect import collect
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.plan.plan import make_plan
from nanoslip.study.results.entry import ENDING, pack_result, read_head, result_path, unpack_result
from nanoslip.study.results.store import Store
from nanoslip.study.tasks.kind import KINDS, result_quantities
from nanoslip.study.tasks.task import TaskResult
from tests.study.results.results import written

Change = Callable[[TaskResult], TaskResult]
ENSEMBLE = """\
title = "Every kind of number"
[axes]
intrinsic_friction = [0.3]
[numerics]
n_x = 17
[limits]
events = 400
[ensemble]
members = 3
[outputs]
statistics = true
[[drives]]
name = "slow"
duration = 0.2
samples = 40
"""
PATH = """\
title = "Every number of a path"
[axes]
radius = [50.0]
[numerics]
n_x = 17
[path]
amplitude = 1e-3
[ensemble]
members = 3
"""


def rewrite(out: Path, change: Change) -> None:
    """Write the results of a campaign as another version would have written them."""
    store = Store(out)
    found = [store.read(key) for key in sorted(store.finished())]
    for path in (out / "results").glob("*.log"):
        path.unlink()
    other = Store(out)
    for result in found:
        other.write(change(result), shared=result_path(other.folder, result.key).exists())
    other.close()


def without(*names: str) -> Change:
    """The change by a version that had none of these scalars."""
    return lambda result: replace(
        result, scalars={name: each for name, each in result.scalars.items() if name not in names}
    )


def with_more(result: TaskResult) -> TaskResult:
    """A result by a version that has another scalar."""
    if not result.scalars:
        return result
    members = len(next(iter(result.scalars.values())))
    return replace(result, scalars={**result.scalars, "largest_cascade": [3] * members})


def of_records(change: Change) -> Change:
    """The same change of friction records alone."""
    return lambda result: change(result) if result.kind == "record" else result


def logs(out: Path) -> dict[str, bytes]:
    """Name -> content of every file among the results that keeps some."""
    kept = {path for path in (out / "results").iterdir() if path.suffix in (".log", ENDING) or "aside" in path.name}
    return {path.name: path.read_bytes() for path in kept}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "lost"),
    [(of_records(without("mean_drop")), "mean_drop"), (of_records(with_more), "")],
    ids=["one number less", "one number more"],
)
def test_a_campaign_that_another_version_finished_is_finished(main, campaign, finished, change, lost):
    """Nothing is computed, nothing cut out, and all numbers that were there stay."""
    with file.open_dataset(finished / file.FILE) as before:
        expected = before.load()
    rewrite(finished, change)
    kept, count = logs(finished), written(finished)
    for _ in range(2):
        code, _, errors = main("run", campaign, "--out", finished, "--serial")
        assert code == 0, errors
        assert (logs(finished), written(finished)) == (kept, count)
    with file.open_dataset(finished / file.FILE) as found:
        for name in expected.data_vars:
            if lost and name == f"{lost}_members":
                assert not found[name].any()
            elif lost and name.startswith(lost):
                assert found[name].isnull().all()
            else:
                np.testing.assert_array_equal(found[name].values, expected[name].values, err_msg=name)


@pytest.fixture(scope="module", params=[ENSEMBLE, PATH], ids=["records and drives", "paths"])
def whole(request, tmp_path_factory):
    """A small campaign with all kinds of number, computed."""
    folder = tmp_path_factory.mktemp("whole")
    (folder / "campaign.toml").write_text(request.param)
    run(folder / "campaign.toml", folder / "out").close()
    return folder


class Older(Store):
    """Results as a version without some numbers wrote them, as this one reads them."""

    lacking: Collection[str] = ()

    def find(self, key: str) -> TaskResult | None:
        found = super().find(key)
        if found is None:
            return found
        lost = [name for name in self.lacking if name in result_quantities(KINDS[found.kind])]
        names = (*lost, *(f"{name}{SHARED_ERROR}" for name in lost))
        content = BytesIO(pack_result(without(*names)(found)))
        head = read_head(content)
        return unpack_result(head, content.read())


MADE_OF: Final = {
    "validity_flags": {"validity_flags", "contact_half_width"},
    "advice": {"validity_flags", "contact_half_width"},
    "spring_force_amplitude": {"regime"},
    "stick_slip_period": {"regime"},
}
"""Variable -> the numbers that it is made of beside its own."""


@pytest.mark.slow
@pytest.mark.parametrize("half", [0, 1])
def test_numbers_that_are_missing_cost_no_others(whole, half):
    """Every second of them, and the others."""
    plan, store = make_plan(load_manifest(whole / "campaign.toml")), Older(whole / "out")
    expected = collect(plan, store)
    results = [store.read(key) for key in store.finished()]
    declared = {name: each for result in results for name, each in result_quantities(KINDS[result.kind]).items()}
    held = sorted(declared.keys() & {name for result in results for name in result.scalars})
    assert len(held) > 10
    store.lacking = held[half::2]
    found = collect(plan, store)
    own: dict[str, str] = {}
    for key in store.lacking:
        for one in filter(None, (declared[key], declared[key].si)):
            own |= dict.fromkeys((one.name, *(each.name for each in one.beside)), key)
    for name in expected.data_vars:
        if name in own and expected[name].dtype.kind == "f" and not name.endswith("_members"):
            assert found[name].isnull().all(), name
        elif name not in own and MADE_OF.get(str(name), set()).isdisjoint(store.lacking):
            assert found[name].equals(expected[name]), name


# What no version of today can use: it stays, it is computed again, and no finished case of the dataset is lost meanwhile.


def without_arrays(*names: str) -> Change:
    """The change that loses these arrays, or all."""

    def lose(result: TaskResult) -> TaskResult:
        kept = {name: each for name, each in result.arrays.items() if names and name not in names}
        return replace(result, arrays=kept)

    return lose


@pytest.mark.slow
@pytest.mark.parametrize(
    "change", [without_arrays("force_before"), without("spacing")], ids=["an array", "a number that is no quantity"]
)
def test_a_record_without_what_drives_need_is_computed_again_and_nothing_is_lost(main, campaign, finished, change):
    """Its bytes and the dataset stay meanwhile."""
    before = (finished / file.FILE).read_bytes()
    rewrite(finished, of_records(change))
    kept = set(logs(finished).values())
    codes = []
    for _ in range(2):
        code, _, errors = main("run", campaign, "--out", finished, "--serial")
        codes.append(code)
        assert (finished / file.FILE).read_bytes() == before, errors
        assert kept <= set(logs(finished).values())
    assert codes[-1] == 0
