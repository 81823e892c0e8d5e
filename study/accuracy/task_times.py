"""Times of a campaign's tasks on this machine, measured on a few of them; no result is kept."""

from typing import Final

import threadpoolctl

from nanoslip.study.accuracy.effects import Done, compute_tasks
from nanoslip.study.plan.plan import Plan
from nanoslip.study.run.dispatch import MeasuredTimes
from nanoslip.study.tasks.estimates import TASK
from nanoslip.study.tasks.task import Task

LONGEST: Final = 5.0
"""Predicted seconds of a task that is measured, at most, with all that it needs."""


def measure_tasks(plan: Plan) -> MeasuredTimes:
    """Compute, for each kind, the longest task that is predicted to take at most a few seconds, and its inputs."""
    places = {task.key: place for place, task in enumerate(plan.tasks)}
    chains: dict[str, list[Task]] = {}
    # In rising cost, so that of each kind the longest chain that is short enough stays.
    for task in sorted(plan.tasks, key=lambda task: task.cost):
        needed = sorted(places[key] for key in plan.with_needs([task.key]))
        chain = [plan.tasks[place] for place in needed]
        if sum(link.cost for link in chain) <= LONGEST:
            chains[task.kind] = chain
    distinct = {task.key: task for chain in chains.values() for task in chain}
    tasks = [("", task) for task in distinct.values()]
    times, done = MeasuredTimes(), Done()
    with threadpoolctl.threadpool_limits(limits=1):
        # The first computation loads libraries and compiles kernels, which is not to be measured.
        compute_tasks(tasks, {})
        compute_tasks(tasks, done)
    for task in distinct.values():
        _, seconds = done[task.key]
        times.learn(task, TASK + seconds)
    return times
