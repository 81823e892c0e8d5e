"""Tasks: the kinds there are, in the order of their stages, and how one is run. The only bridge into the solver."""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Final

from nanoslip.solver.outcome import Ending, Outcome, SolverError
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.origin import computing, stemming
from nanoslip.study.plan.cost import TASK
from nanoslip.study.plan.kinds.compliance import COMPLIANCE, compliance_needs, compliance_task
from nanoslip.study.plan.kinds.contact import CONTACT, contact_task
from nanoslip.study.plan.kinds.drive import DRIVE, drive_task
from nanoslip.study.plan.kinds.kind import Estimate, Kind, joint_outcome, numbers
from nanoslip.study.plan.kinds.record import RECORD, record_scalars_task, record_task
from nanoslip.study.plan.kinds.states import STATES, states_task
from nanoslip.study.plan.kinds.statistics import STATISTICS, statistics_task
from nanoslip.study.plan.task import Task, TaskResult

__all__ = [
    "KINDS",
    "Task",
    "TaskResult",
    "compliance_needs",
    "compliance_task",
    "contact_task",
    "drive_task",
    "estimate",
    "in_stages",
    "needed_kinds",
    "record_scalars_task",
    "record_task",
    "run_task",
    "states_task",
    "statistics_task",
]

KINDS: Final[dict[str, Kind]] = {kind.name: kind for kind in (COMPLIANCE, CONTACT, RECORD, STATISTICS, STATES, DRIVE)}
"""Name -> kind of task: a stage each, none of which needs a later one."""


def needed_kinds(manifest: Manifest) -> frozenset[str]:
    """The kinds of task that this manifest needs."""
    return frozenset(kind.name for kind in KINDS.values() if kind.needed(manifest))


def estimate(task: Task) -> Estimate:
    """What a task costs, roughly: its own kind's estimate, handing out, reading and writing included."""
    seconds, memory, disk = KINDS[task.kind].estimate(task)
    return Estimate(min(TASK + seconds, LONGEST), memory, disk)


LONGEST: Final = 1e12
"""Thirty thousand years will do for what never ends."""


def in_stages(tasks: Iterable[Task]) -> Iterator[Task]:
    """Tasks by kind, intermediate ones before those that use them: no task needs a later one."""
    stages: defaultdict[tuple[int, bool], list[Task]] = defaultdict(list)
    places = {kind: place for place, kind in enumerate(KINDS)}
    for task in tasks:
        stages[places[task.kind], not task.intermediate].append(task)
    for stage in sorted(stages):
        yield from stages[stage]


def run_task(task: Task, inputs: Mapping[str, TaskResult]) -> TaskResult:
    """Compute a task from the results it needs. Never raises for physics: a refusal is a result with its outcome.

    `OUT_OF_MEMORY` is of the machine, not of the task: such a result is not to be kept.
    """
    if task.needs and inputs[task.needs[0]].kind == task.kind:  # the scalars of a result that has more
        return replace(inputs[task.needs[0]], key=task.key, arrays={})
    used = stemming((computing(),), *(inputs[key].origins for key in task.needs))
    return replace(_computed(task, inputs), origins=used)


def _computed(task: Task, inputs: Mapping[str, TaskResult]) -> TaskResult:
    needs = [inputs[key] for key in task.needs]
    for need in needs:
        if not need.outcome.usable:  # a record without a plateau is still a record
            message = f"its {need.kind} ended as {need.outcome.ending}: {need.outcome.message}"
            return TaskResult(task.key, task.kind, Outcome(Ending.NEEDS_FAILED, message))
    try:
        return _result(task, inputs)
    except SolverError as error:
        return TaskResult(task.key, task.kind, error.outcome)
    except MemoryError as error:
        return TaskResult(task.key, task.kind, Outcome(Ending.OUT_OF_MEMORY, _NO_MEMORY.format(task.slab.n_x, error)))


_NO_MEMORY = "no memory left at n_x = {}: start fewer ranks on a machine, or use a smaller n_x or fewer events ({})"


def _result(task: Task, inputs: Mapping[str, TaskResult]) -> TaskResult:
    kind = KINDS[task.kind]
    computed = kind.run(task, inputs)
    scalars, arrays = numbers(kind, computed.members, scalars_only=task.scalars_only)
    kept = {} if task.scalars_only else {**computed.arrays, **arrays}
    ended = tuple([member.outcome for member in computed.members])
    outcome = joint_outcome(ended)
    return TaskResult(task.key, task.kind, outcome, scalars, kept, () if {outcome} == {*ended} else ended)
