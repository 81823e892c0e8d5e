"""What is expected of ensembles before any is computed: more members where more is asked, none beyond what there are."""

import math
from dataclasses import replace
from pathlib import Path

import pytest

from solver.case import Case
from solver.slab import Slab
from study.manifest.cases import expand
from study.manifest.manifest import Ensemble
from study.manifest.reader import parse_manifest
from study.plan.cost.sliding import expected_uncertainty
from study.plan.ensemble.expected import expected_members, expected_of, likely
from study.plan.plan import make_plan

CASE = Case(slab=Slab(65), max_events=None, max_spacings=0.3)
HEAD = 'title = "x"\nnumerics.n_x = 65\nlimits.spacings = 0.3\n'


def test_more_is_expected_where_more_is_asked() -> None:
    own = expected_uncertainty(CASE)
    counts = [expected_members(CASE, Ensemble(64, own / asked)) for asked in (1.1, 2.0, 3.0, 4.0, 1000.0)]
    assert counts == sorted(counts)
    assert (counts[0], counts[-1]) == (4, 64)
    assert all(count.bit_count() == 1 for count in counts)


def test_members_that_each_know_enough_are_the_fewest() -> None:
    assert expected_members(replace(CASE, max_spacings=8.0), Ensemble(64, 0.5)) == 4


def test_tasks_of_batches_beyond_the_expected_are_not_likely() -> None:
    enough = expected_uncertainty(CASE) / 3.0
    text = f"{HEAD}[ensemble]\nmembers = 64\nuncertainty = {enough!r}\n"
    plan = make_plan(parse_manifest(Path("mine.toml"), text, {}))
    count = expected_members(CASE, plan.manifest.ensemble)
    assert 4 < count < 64
    records = [task for task in plan.tasks if task.kind == "record"]
    assert sum(likely(task, plan.manifest.ensemble) for task in records) == count
    found = expected_of(plan.cases, plan.manifest.ensemble)
    assert found is not None
    assert found == (count, count, 0, 1)


def test_what_members_have_in_common_is_out_of_reach() -> None:
    manifest = parse_manifest(Path("mine.toml"), f"{HEAD}[ensemble]\nuncertainty = 1e-6\n", {})
    found = expected_of(expand(manifest), manifest.ensemble)
    assert found is not None
    assert found == (16, 16, 1, 1)


@pytest.mark.parametrize("ensemble", ["", "[ensemble]\nmembers = 8\n"])
def test_nothing_is_expected_without_a_target(ensemble: str) -> None:
    manifest = parse_manifest(Path("mine.toml"), HEAD + ensemble, {})
    assert expected_of(expand(manifest), manifest.ensemble) is None
    assert math.isfinite(expected_uncertainty(CASE))
