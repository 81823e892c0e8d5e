"""The order of tasks: needed ones before those that need them, longest chain of work first."""

from collections.abc import Iterable

from nanoslip.study.plan.task import Task
from nanoslip.study.plan.tasks import in_stages


def longest_chain_first(tasks: Iterable[Task]) -> tuple[Task, ...]:
    """Order by the cost of a task and the longest chain that depends on it: a task always has more than those that need it."""
    ordered = list(in_stages(tasks))
    after: dict[str, float] = {}  # work of the longest chain that hangs on a task, of those that are needed
    # One pass from the last stage back sees every chain whole.
    for task in reversed(ordered):
        for need in task.needs:
            after[need] = max(after.get(need, 0.0), task.cost + after.get(task.key, 0.0))
    ordered.sort(key=lambda task: -task.cost - after.get(task.key, 0.0))
    return tuple(ordered)
