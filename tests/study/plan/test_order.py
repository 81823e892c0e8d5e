"""Tasks are in the order of the work that hangs on them; of equal ones the earlier stage is first, then what was given first."""

import random
from dataclasses import replace

from nanoslip.solver.slab import Slab
from nanoslip.study.plan.kinds import KINDS
from nanoslip.study.plan.plan import longest_chain_first
from nanoslip.study.plan.task import Task

STAGES = ("compliance", "record", "drive")


def made_up() -> list[Task]:
    """Tasks of three stages, with costs of which many are equal."""
    generator = random.Random(7)
    tasks: list[Task] = []
    for stage, kind in enumerate(STAGES):
        before = [task.key for task in tasks if task.kind == STAGES[stage - 1]] if stage else []
        for number in range(4 * 3**stage):
            needs = tuple(generator.sample(before, 1)) if before else ()
            tasks.append(
                Task(
                    f"{kind} {number}",
                    kind,
                    Slab(),
                    needs=needs,
                    cost=float(generator.randrange(3)),
                    intermediate=not stage,
                )
            )
    return generator.sample(tasks, len(tasks))


def chain(task: Task, tasks: list[Task]) -> float:
    """Work of the longest chain that begins with a task."""
    return task.cost + max((chain(each, tasks) for each in tasks if task.key in each.needs), default=0.0)


def test_the_longest_chain_is_first_and_needs_are_before_what_needs_them() -> None:
    tasks = made_up()
    wanted = sorted(tasks, key=lambda task: (-chain(task, tasks), list(KINDS).index(task.kind)))
    found = longest_chain_first(tasks)
    assert [task.key for task in found] == [task.key for task in wanted]
    places = {task.key: place for place, task in enumerate(found)}
    assert all(places[need] < places[task.key] for task in found for need in task.needs)


def test_of_one_kind_what_is_intermediate_is_first() -> None:
    scalars = Task("scalars", "record", Slab(), needs=("record",))
    record = replace(scalars, key="record", needs=(), intermediate=True)
    assert [task.key for task in longest_chain_first([scalars, record])] == ["record", "scalars"]
