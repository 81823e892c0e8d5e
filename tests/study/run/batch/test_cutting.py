"""Every case is in exactly one shard, with all that it needs; shards cost about the same, and neighbours stay together."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nanoslip.study.manifest.reader import load_manifest, parse_manifest
from nanoslip.study.plan.plan import Plan, make_plan
from nanoslip.study.results.shard import Shard
from nanoslip.study.run.batch import blocks_of, finished_with, part
from tests.conftest import SMALL

MANY = SMALL.replace("[50.0, 100.0]", str([50.0 + number for number in range(12)])).replace(
    "[axes]", "[axes]\nn_x = [17, 33]"
)


@pytest.fixture(scope="module")
def plan(tmp_path_factory: pytest.TempPathFactory) -> Plan:
    """Forty-eight cases on two slabs, each with two drives."""
    path = tmp_path_factory.mktemp("plan") / "many.toml"
    path.write_text(MANY.replace("n_x = 17\n", ""))
    return make_plan(load_manifest(path))


@pytest.mark.parametrize("of", [1, 2, 5, 48, 60])
def test_every_case_is_in_one_shard_with_all_that_it_needs(plan: Plan, of: int) -> None:
    parts = [part(plan, Shard(number, of)) for number in range(1, of + 1)]
    assert [case.case_id for each in parts for case in each.cases] == [case.case_id for case in plan.cases]
    assert {task.key for each in parts for task in each.tasks} == {task.key for task in plan.tasks}
    for each in parts:
        keys = {task.key for task in each.tasks}
        assert all(keys.issuperset(task.needs) for task in each.tasks)
        assert {key for tasks in each.case_tasks.values() for key in tasks.keys.values()} <= keys
        assert list(each.tasks) == [task for task in plan.tasks if task.key in keys]  # their order stays


def test_one_shard_is_the_whole_plan(plan: Plan) -> None:
    assert part(plan, Shard(1, 1)) == plan


def test_shards_cost_about_the_same(plan: Plan) -> None:
    costs = [sum(task.cost for task in part(plan, Shard(number, 4)).tasks) for number in range(1, 5)]
    compliances = sum(task.cost for task in plan.tasks if task.kind == "compliance")
    assert max(costs) - min(costs) <= compliances + max(task.cost for task in plan.tasks) + 0.1 * max(costs)


@given(weights=st.lists(st.floats(1e-3, 1e3), min_size=1, max_size=40), count=st.integers(1, 50))
def test_no_block_is_empty_that_need_not_be_and_none_is_heavier_than_the_mean_by_more_than_one_weight(
    weights: list[float], count: int
) -> None:
    blocks = blocks_of(weights, count)
    assert blocks == sorted(blocks)  # neighbours together
    assert set(blocks) == set(range(min(count, len(weights))))
    heaviest = max(sum(w for w, block in zip(weights, blocks, strict=True) if block == each) for each in set(blocks))
    # Besides it, rounding of sums of forty numbers.
    assert heaviest <= (sum(weights) / min(count, len(weights)) + max(weights)) * (1.0 + 1e-12)


def test_ensembles_of_which_one_costs_most_leave_no_shard_empty() -> None:
    """Of four ensembles two share one of three shards."""
    small = (
        SMALL.replace("[50.0, 100.0]", "[50.0]").replace("n_x = 17", "").replace("[axes]", "[axes]\nn_x = [17, 257]")
    )
    waiting = make_plan(
        parse_manifest(Path("mine.toml"), small.replace("ensemble.members = 1", "target.within = 0.02"), {})
    )
    sizes = sorted(len(part(waiting, Shard(number, 3)).cases) for number in (1, 2, 3))
    assert sizes == [1, 1, 2]


def test_neighbours_share_a_slab_in_most_shards(plan: Plan) -> None:
    slabs = [{case.case.slab for case in part(plan, Shard(number, 6)).cases if case.case} for number in range(1, 7)]
    assert sum(len(each) > 1 for each in slabs) <= 1


def test_of_what_was_merged_only_what_a_task_still_reads_is_computed_again(plan: Plan) -> None:
    everything = {task.key: 0 for task in plan.tasks}
    assert finished_with(plan, {}, everything) == everything
    drive = next(task for task in plan.tasks if task.kind == "drive")
    needed, waiting = set(), [drive.key]
    needs = {task.key: task.needs for task in plan.tasks}
    while waiting:
        needed.add(key := waiting.pop())
        waiting.extend(needs[key])
    without = {key: 0 for key in everything if key != drive.key}
    assert everything.keys() - finished_with(plan, {}, without).keys() == needed
    own = {key: 1 for key in needed if key != drive.key}
    assert finished_with(plan, own, without) == {**without, **own}
