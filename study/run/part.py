"""The cases of a shard, and which of their tasks it skips.

Blocks of neighbours cost about the same. Neighbours mostly share slabs; what several shards need, each computes for itself.
"""

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from itertools import accumulate
from typing import Final, TypeVar

from nanoslip.study.plan.plan import Plan
from nanoslip.study.results.shard import Shard

LEAST: Final = 1e-3
"""Seconds that any case counts: those that are refused are spread, too."""

Result = TypeVar("Result")


def part(plan: Plan, shard: Shard) -> Plan:
    """The cases of a shard, and all tasks that they need. Every case is in one of the shards."""
    needed = {key: plan.with_needs(tasks.values()) for key, tasks in plan.case_tasks.items()}
    costs = {task.key: task.cost for task in plan.tasks}
    users = Counter(key for keys in needed.values() for key in keys)
    weights = [LEAST + sum(costs[key] / users[key] for key in sorted(needed[case.case_id])) for case in plan.cases]
    blocks = blocks_of(weights, shard.of)
    cases = tuple(case for case, block in zip(plan.cases, blocks, strict=True) if block == shard.number - 1)
    keys = {key for case in cases for key in needed[case.case_id]}
    case_tasks = {case.case_id: plan.case_tasks[case.case_id] for case in cases}
    distinct = tuple(task for task in plan.distinct if task.key in keys)
    return replace(plan, cases=cases, distinct=distinct, case_tasks=case_tasks)


def blocks_of(weights: Sequence[float], count: int) -> list[int]:
    """The block of each weight, from 0: neighbours together, each block about as heavy as any other.

    None is empty while there is another with two, and none is heavier than their mean by more than one weight.
    """
    ends, blocks = list(accumulate(weights)), list[int]()
    count = min(count, len(ends))
    for number, (end, weight) in enumerate(zip(ends, weights, strict=True)):
        middle = int(count * (end - weight / 2.0) / ends[-1])
        enough_for_the_others = count - (len(ends) - number)
        after_the_last = blocks[-1] + 1 if blocks else 0
        blocks.append(min(max(middle, enough_for_the_others), after_the_last))
    return blocks


def finished_with(
    plan: Plan, own: Mapping[str, Result], merged: Mapping[str, Result], given_up: Collection[str] = ()
) -> dict[str, Result]:
    """Tasks that a shard skips: finished or merged ones, unless a remaining task reads them.

    given_up: keys of tasks that it does not try.
    """
    found = {**merged, **own}
    while lacking := _read(plan, found, given_up) - own.keys():
        found = {key: each for key, each in found.items() if key not in lacking}
    return found


def _read(plan: Plan, finished: Collection[str], given_up: Collection[str]) -> set[str]:
    """Results that a remaining task reads."""
    tried = plan.possible(plan.remaining(finished), set(given_up) - set(finished))
    return {need for task in tried for need in task.needs if need in finished}
