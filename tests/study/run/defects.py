"""A solver with a defect: tasks of a campaign that crash."""

from collections.abc import Callable

from nanoslip.study.tasks.compute import run_task
from nanoslip.study.tasks.task import Inputs, Task, TaskResult


def crashing(where: Callable[[Task], bool]) -> Callable[[Task, Inputs], TaskResult]:
    """What computes tasks, but those for which `where` holds, which crash."""

    def run(task: Task, inputs: Inputs) -> TaskResult:
        if where(task):
            raise RuntimeError("a defect")
        return run_task(task, inputs)

    return run


def crashing_at(kind: str, radius: float) -> Callable[[Task, Inputs], TaskResult]:
    """The same of tasks of a kind at a radius; of records only in those that are kept, with their arrays."""
    return crashing(
        lambda task: (
            task.kind == kind and task.case is not None and task.case.radius == radius and not task.scalars_only
        )
    )
