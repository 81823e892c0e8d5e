"""Cases -> tasks: each distinct computation once, needed ones before those that need them, longest chain first."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

from solver.outcome import UNDONE, Ending, Outcome
from study.discretization.targets import settled
from study.manifest.cases import MEMBER, CampaignCase, expand
from study.manifest.manifest import Manifest
from study.manifest.parameters import Value, in_words
from study.origin import Origins, foreign, here
from study.plan.task import Task
from study.plan.tasks import KINDS, estimate, stage_of

DOUBT: Final = 100.0
"""A task that takes so many times longer than estimated is taken to hang; the worst estimates known are 30 times off."""
LEAST_LIMIT: Final = 600.0
"""Seconds that every task may take."""


@dataclass(frozen=True, slots=True)
class CaseTasks:
    """Keys of the tasks of one case; none of a case that the physics refuses."""

    keys: Mapping[tuple[str, str], str] = field(default_factory=dict)
    """Kind of task and label of its drive ("" without one) -> key, in the order of stages."""

    def key(self, kind: str, drive: str = "") -> str | None:
        """Key of the case's task of this kind; None where there is none."""
        return self.keys.get((kind, drive))

    @property
    def compliance(self) -> str | None:
        """Key of the slab's compliance."""
        return self.key("compliance")

    @property
    def record(self) -> str | None:
        """Key of the friction record, or of its scalars where it is not kept."""
        return self.key("record")

    @property
    def drives(self) -> dict[str, str]:
        """Label of the drive -> key."""
        return {drive: key for (_, drive), key in self.keys.items() if drive}


@dataclass(frozen=True, slots=True)
class Plan:
    """The whole work of a campaign, finished or not."""

    manifest: Manifest
    cases: tuple[CampaignCase, ...]
    tasks: tuple[Task, ...]
    """Each distinct task once: needs first, then the longest chain of work first."""
    case_tasks: Mapping[str, CaseTasks]
    """case_id -> its tasks."""

    def remaining(self, finished: Collection[str]) -> tuple[Task, ...]:
        """Tasks still to do, in order, given the keys that are finished.

        Intermediate results are recomputed only if an unfinished task needs them.
        """
        wanted: set[str] = set()
        for task in reversed(self.tasks):  # from the ends of the chains to their beginnings
            if task.key not in finished and (not task.intermediate or task.key in wanted):
                wanted |= {task.key, *task.needs}
        return tuple(task for task in self.tasks if task.key in wanted and task.key not in finished)

    def possible(
        self, left: Sequence[Task], given_up: Collection[str], failed: Collection[str] = ()
    ) -> tuple[Task, ...]:
        """Of tasks that are left those that can be tried: not given up, and needing none that is; what has failed comes last."""
        lost = set(given_up)
        for task in sorted(left, key=stage_of):
            if not lost.isdisjoint(task.needs):
                lost.add(task.key)
        return tuple(sorted((task for task in left if task.key not in lost), key=lambda task: task.key in failed))

    def outcomes(self, finished: Mapping[str, Outcome], failed: Mapping[str, Outcome]) -> dict[str, Outcome]:
        """How tasks ended, those included that cannot be begun, as what they need has failed.

        finished: of the results that are there, which count more than failures. failed: of attempts.
        """
        found = {key: outcome for key, outcome in failed.items() if key not in finished}
        tasks = {task.key: task for task in self.tasks}
        for task in sorted(self.tasks, key=stage_of):
            lost = next((need for need in task.needs if need in found), None)
            if lost is None or task.key in finished or task.key in found:
                continue
            outcome, need = found[lost], tasks[lost]
            message = f"its {need.kind} {UNDONE.get(outcome.ending, 'failed')}: {outcome.message}"
            own = need.kind == task.kind  # the scalars of a record
            found[task.key] = outcome if own else Outcome(Ending.NEEDS_FAILED, message)
        return found | dict(finished)

    def foreign(self, finished: Mapping[str, Origins]) -> dict[str, Origins]:
        """The plan's results that other software than this had a hand in, given all that are finished."""
        home = here()
        mine = (task.key for task in self.tasks if task.key in finished)
        return {key: finished[key] for key in mine if foreign(finished[key], home)}

    def obsolete(self, finished: Collection[str]) -> tuple[str, ...]:
        """Intermediate records that no task needs any more, given the keys that are finished."""
        wanted = {need for task in self.remaining(finished) for need in task.needs}
        return tuple(
            task.key
            for task in self.tasks
            if task.intermediate and task.kind == "record" and task.key in finished and task.key not in wanted
        )


def make_plan(manifest: Manifest) -> Plan:
    """Everything a campaign has to compute. Raises ManifestError where two cases are the same.

    Of an error asked for, the plan's manifest has the numerics that were chosen for it (see study.discretization.targets).
    """
    manifest = settled(manifest)
    cases = expand(manifest)
    tasks: dict[str, Task] = {}
    case_tasks = {}
    for case in cases:
        mine, keys = _tasks_of(manifest, case)
        case_tasks[case.case_id] = keys
        for task in mine:
            tasks.setdefault(task.key, task)
    return Plan(manifest, cases, _longest_chain_first(tuple(tasks.values())), case_tasks)


def _tasks_of(manifest: Manifest, campaign_case: CampaignCase) -> tuple[list[Task], CaseTasks]:
    case = campaign_case.case
    if case is None:
        return [], CaseTasks()
    label = {name: campaign_case.parameters[name] for name in manifest.axes if name in campaign_case.parameters}
    of_slab = case.slab.flat
    slab = {"n_x": case.slab.n_x, **{name: value for name, value in label.items() if of_slab.get(name) is not None}}
    if MEMBER in campaign_case.parameters:
        label[MEMBER] = campaign_case.parameters[MEMBER]
    found: list[Task] = []
    keys: dict[tuple[str, str], str] = {}
    for kind in KINDS.values():
        for wanted in kind.tasks(case, manifest) if kind.needed(manifest) else ():
            task, drive = wanted.task, wanted.drive
            words = {**label, "drive": drive} if drive else slab if task.case is None else label
            found.append(_estimated(task, words, wanted.free, manifest.task_seconds))
            keys[kind.name, drive] = task.key
    return found, CaseTasks(keys)


def _longest_chain_first(tasks: Collection[Task]) -> tuple[Task, ...]:
    """Order by the work that hangs on a task, itself included: what is needed always has more than what needs it."""
    costs = {task.key: task.cost for task in tasks}
    chain = dict(costs)
    # One pass from the last stage back sees every chain whole.
    for task in sorted(tasks, key=stage_of, reverse=True):
        for need in task.needs:
            chain[need] = max(chain[need], costs[need] + chain[task.key])
    return tuple(sorted(tasks, key=lambda task: (-chain[task.key], stage_of(task))))


def _estimated(task: Task, label: Mapping[str, Value], free: bool, limit: float | None) -> Task:
    words = (f"{name}={value:g}" if isinstance(value, float) else f"{name}={value}" for name, value in label.items())
    cost = 0.0 if free else estimate(task).seconds
    limit = max(LEAST_LIMIT, DOUBT * cost) if limit is None else limit
    return replace(task, cost=cost, limit=limit, label=in_words(" ".join((task.kind, *words))))
