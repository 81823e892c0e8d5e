"""What tasks of a campaign take on this machine, measured on a few of them; no result is kept."""

import time
from typing import Final

import threadpoolctl

from nanoslip.study.plan.cost import TASK
from nanoslip.study.plan.plan import Plan
from nanoslip.study.plan.tasks import Task, TaskResult, run_task
from nanoslip.study.run.progress import Measured

LONGEST: Final = 5.0
"""Predicted seconds of a task that is measured, at most, with all that it needs."""


def measured_here(plan: Plan) -> Measured:
    """Compute of each kind the longest task that is predicted to take a few seconds at most, and what it needs."""
    tasks = {task.key: task for task in plan.tasks}
    chosen: dict[str, tuple[Task, ...]] = {}
    for task in sorted(plan.tasks, key=lambda task: task.cost):
        chain = (*_needed(task, tasks), task)
        if sum(each.cost for each in chain) <= LONGEST:
            chosen[task.kind] = chain
    found, results = Measured(), dict[str, TaskResult]()
    with threadpoolctl.threadpool_limits(limits=1):
        for task in {task.key: task for chain in chosen.values() for task in chain}.values():
            seconds = []
            for _ in range(2):  # the first one loads libraries and compiles kernels
                start = time.perf_counter()
                results[task.key] = run_task(task, results)
                seconds.append(TASK + time.perf_counter() - start)
            found.learn((task,), (min(seconds),))
            for array in results[task.key].arrays.values():
                array.setflags(write=False)  # as a store gives it: kernels are compiled for that
    return found


def _needed(task: Task, tasks: dict[str, Task]) -> tuple[Task, ...]:
    """All that a task needs, the first one first."""
    direct = [tasks[key] for key in task.needs]
    return tuple({each.key: each for need in direct for each in (*_needed(need, tasks), need)}.values())
