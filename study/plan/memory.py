"""Whether tasks fit the memory of the machine that is to compute them: it depends on the machine, so it is no case's outcome."""

import heapq
import math
import os
from collections.abc import Sequence
from operator import attrgetter

from nanoslip.study.plan.cost.arrays import record_bytes
from nanoslip.study.plan.plan import Plan
from nanoslip.study.plan.tasks import Task, compliance_needs

PROGRAM = 2e8
"""Bytes of a process that has computed nothing yet."""
NAMED = 5
"""Tasks that are named where many do not fit."""


def machine_memory() -> float:
    """Bytes of physical memory of this machine; infinite where the system does not say."""
    try:
        return float(os.sysconf("SC_PAGE_SIZE")) * float(os.sysconf("SC_PHYS_PAGES"))
    except (ValueError, OSError, AttributeError):
        return math.inf


def shortages(planned: Plan, tasks: Sequence[Task], ranks: int = 1) -> tuple[str, ...]:
    """One line for each of these tasks that this machine has no memory for, the worst first; else one where it has none for
    the largest ones at once, as many as it has ranks. Empty where all fit."""
    there, path = machine_memory(), planned.manifest.path
    if ranks * _most(tasks) <= there:
        return ()
    worst = heapq.nlargest(max(NAMED, ranks), tasks, key=need_of)
    large = sum(need_of(task) > there for task in tasks) if need_of(*worst[:1]) > there else 0
    named = worst[: min(large, NAMED)]
    lines = [f"{path}: {_named(task)}: {_short(need_of(task), there)}: {_advice(task)}" for task in named]
    if large > NAMED:
        lines.append(f"{path}: {large - NAMED} more tasks need more memory than this machine has")
    together = need_of(*worst[:ranks])
    if not large and together > there:
        fitting = max(count for count in range(1, ranks) if need_of(*worst[:count]) <= there)
        advice = f"start at most {fitting}, or use more machines"
        lines.append(f"{path}: {ranks} ranks on one machine: {_short(together, there)}: {advice}")
    return tuple(lines)


def _most(tasks: Sequence[Task]) -> float:
    """No task of these needs more; said faster than what the worst ones need, as there may be millions."""
    memory, n_x = (max(map(attrgetter(name), tasks), default=0) for name in ("memory", "slab.n_x"))
    return PROGRAM + float(memory) + _map_bytes(n_x)


def need_of(*tasks: Task) -> float:
    """Bytes that processes with one task of a plan each need; all that read a compliance map the same copy of it."""
    read = {task.slab for task in tasks if task.needs[:1] == compliance_needs(task.slab)}
    return sum(_map_bytes(slab.n_x) for slab in read) + sum(PROGRAM + task.memory for task in tasks)


def _map_bytes(n_x: int) -> float:
    return 8.0 * (2.0 * n_x) ** 2


def _named(task: Task) -> str:
    """The task by its label, and the size that decides."""
    size = f"n_x={task.slab.n_x}"
    return task.label if size in task.label.split() else f"{task.label} {size}"


def _short(need: float, there: float) -> str:
    return f"needs about {need / 1e9:.3g} GB of memory, this machine has {there / 1e9:.3g} GB"


def _advice(task: Task) -> str:
    if (
        task.kind == "record"
        and task.case is not None
        and task.ensemble.likely * record_bytes(task.case) > task.memory / 2.0
    ):
        return "use fewer limits.events, a shorter limits.displacement, or a machine with more memory"
    return "use a smaller n_x, or a machine with more memory"
