"""The replay of a schedule keeps the bounds that any schedule has, and meets them where they are the limit."""

import pytest

from tests.benchmarks.replay import Cost, Timed, replay


def campaign(count: int, seconds: float) -> list[Timed]:
    """Equal tasks of known cost that all need a first one."""
    first = Timed("first", cost=seconds, seconds=seconds)
    return [first, *(Timed(str(number), ("first",), seconds, seconds=seconds) for number in range(count))]


def test_a_lone_rank_takes_the_sum() -> None:
    assert replay(campaign(10, 0.5), ranks=1, cost=Cost(0.0)).makespan == pytest.approx(5.5)


def test_ranks_share_what_follows_the_first_task() -> None:
    assert replay(campaign(40, 0.5), ranks=4, cost=Cost(0.0)).makespan == pytest.approx(0.5 + 40 * 0.5 / 4)


def test_more_ranks_than_the_coordinator_can_feed_take_its_time() -> None:
    seen = replay(campaign(2000, 0.01), ranks=1000, cost=Cost(1e-3))
    assert seen.coordinating == pytest.approx(2001 * 1e-3)
    assert seen.makespan == pytest.approx(seen.coordinating, rel=0.02)  # and the first and the last task


def test_without_enough_tasks_the_longest_is_the_limit() -> None:
    tasks = [Timed("long", cost=5.0, seconds=5.0), *(Timed(str(number), cost=0.1, seconds=0.1) for number in range(20))]
    assert replay(tasks, ranks=8, cost=Cost(0.0)).makespan == pytest.approx(5.0)
