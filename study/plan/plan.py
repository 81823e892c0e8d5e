"""Plan tasks of cases: each distinct computation once, inputs before their dependents, longest chain first."""

from collections import Counter, defaultdict
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final, TypeVar

import numpy as np

from nanoslip.solver.drive import DURATIONS
from nanoslip.solver.outcome import UNDONE, Ending, Outcome
from nanoslip.study.manifest.cases import CampaignCase, Heard, expand
from nanoslip.study.manifest.manifest import CampaignDrive, Manifest
from nanoslip.study.origin import Origins, foreign_among
from nanoslip.study.tasks.estimates import estimate
from nanoslip.study.tasks.kind import KINDS, OWN, Wanted, order_by_stage
from nanoslip.study.tasks.task import PENDING, Label, Task

Some = TypeVar("Some")

CaseTasks = Mapping[tuple[str, str], str]
"""Kind of task and label of its drive ("" without one) -> key, in the order of stages; nothing of a case that is refused."""


# The order of tasks: needed ones before those that need them, longest chain of work first.


def longest_chain_first(tasks: Iterable[Task]) -> tuple[Task, ...]:
    """Order by the cost of a task plus the longest chain that depends on it, so inputs precede their dependents.

    Tasks of equal cost follow each other if they have the same inputs: the solver caches its values of a slab.
    """
    # Both sorts keep the order of equals: by inputs here, by work below.
    by_inputs = sorted(tasks, key=lambda task: task.needs)
    ordered = list(order_by_stage(by_inputs))
    # Work of the longest chain that hangs on a task, of those that are needed.
    after: dict[str, float] = {}
    # One pass from the last stage back sees every chain whole.
    for task in reversed(ordered):
        chain = task.cost + after.get(task.key, 0.0)
        for need in task.needs:
            after[need] = max(after.get(need, 0.0), chain)
    ordered.sort(key=lambda task: -task.cost - after.get(task.key, 0.0))
    return tuple(ordered)


def evenly(items: Sequence[Some], count: int) -> list[Some]:
    """Select `count` items of a sequence, or all, evenly spread from the first to the last."""
    last = len(items) - 1
    # Rounded positions from 0 to the last: both ends are among them.
    size = min(count, len(items))
    places = np.linspace(0, last, size).round().astype(int)
    return [items[place] for place in places]


DOUBT: Final = 100.0
"""Factor over the estimated time at which a task counts as hanging; the worst known estimates are 30 times off."""
LEAST_LIMIT: Final = 600.0
"""Seconds that every task may take, as its first one in a process may compile kernels: two minutes of a busy core for all."""


@dataclass(frozen=True)
class Plan:
    """Whole work of a campaign, finished or not. Tasks are estimated on request."""

    manifest: Manifest
    cases: tuple[CampaignCase, ...]
    distinct: tuple[Task, ...]
    """Each distinct task once, needs first, neither labelled nor estimated."""
    case_tasks: Mapping[str, CaseTasks]
    """case_id -> its tasks."""
    firsts: Mapping[str, tuple[CampaignCase, str]]
    """Key of a task -> the first case, and its drive, that it is computed for."""

    @cached_property
    def tasks(self) -> tuple[Task, ...]:
        """All tasks, estimated: needs first, then the longest chain of work first."""
        return longest_chain_first(map(self._estimate, self.distinct))

    def remaining(self, finished: Collection[str]) -> tuple[Task, ...]:
        """Tasks still to do, estimated and in order, given the keys that are finished.

        Intermediate results are recomputed only if an unfinished task needs them.
        """
        pending = self._pending_tasks(finished)
        if len(pending) == len(self.distinct):
            return self.tasks
        return longest_chain_first(map(self._estimate, pending))

    @cached_property
    def _estimates(self) -> dict[str, Task]:
        return {}

    def _estimate(self, task: Task) -> Task:
        estimated = self._estimates.get(task.key)
        if estimated is None:
            cost, memory, disk = estimate(task)
            limit = self.manifest.task_seconds
            if limit is None:
                limit = max(LEAST_LIMIT, DOUBT * cost)
            case, drive = self.firsts[task.key]
            label = _label(task, case, drive)
            estimated = task.with_estimate(label, cost, memory, disk, limit)
            self._estimates[task.key] = estimated
        return estimated

    def _pending_tasks(self, finished: Collection[str]) -> list[Task]:
        needed: set[str] = set()
        pending = []
        # From the ends of the chains to their beginnings: what a task needs is known before its needs are met.
        for task in reversed(self.distinct):
            is_wanted = not task.intermediate or task.key in needed
            if is_wanted and task.key not in finished:
                needed.update(task.needs)
                pending.append(task)
        return pending[::-1]

    def possible(
        self, pending: Sequence[Task], given_up: Collection[str], failed: Collection[str] = ()
    ) -> tuple[Task, ...]:
        """Unfinished tasks that can be tried: neither they nor their needs are given up. Those that failed before come last."""
        if not given_up and not failed:
            return tuple(pending)
        lost = set(given_up)
        for task in order_by_stage(pending):
            if not lost.isdisjoint(task.needs):
                lost.add(task.key)
        # Sorted by False and True, each in the order in which they came: a task that kills its process again should find
        # all others done.
        tried = [task for task in pending if task.key not in lost]
        return tuple(sorted(tried, key=lambda task: task.key in failed))

    def outcomes(self, finished: Mapping[str, Outcome], failed: Mapping[str, Outcome]) -> dict[str, Outcome]:
        """Outcomes of tasks, including tasks that cannot start because an input failed.

        finished: outcomes of stored results, which take precedence over failures. failed: outcomes of failed
            attempts.
        """
        undone = {key: outcome for key, outcome in failed.items() if key not in finished}
        if not undone:
            return dict(finished)
        tasks = {task.key: task for task in self.distinct}
        # Needs come first in `distinct`: one pass carries a failure down the whole chain.
        for task in self.distinct:
            lost = next((need for need in task.needs if need in undone), None)
            if lost is None or task.key in finished or task.key in undone:
                continue
            outcome, need = undone[lost], tasks[lost]
            # The scalars of a record end as the record does: they have no need of another kind to blame.
            if need.kind != task.kind:
                message = f"its {need.kind} {UNDONE.get(outcome.ending, 'failed')}: {outcome.message}"
                cause = outcome.cause and f"{need.kind} {outcome.ending} {outcome.cause}"
                outcome = Outcome(Ending.NEEDS_FAILED, message, cause=cause)
            undone[task.key] = outcome
        return undone | dict(finished)

    def foreign(self, finished: Mapping[str, Origins]) -> dict[str, Origins]:
        """The plan's results that other software than this had a hand in, given all that are finished."""
        of_plan = {task.key: finished[task.key] for task in self.distinct if task.key in finished}
        return foreign_among(of_plan)

    @cached_property
    def _needs(self) -> dict[str, tuple[str, ...]]:
        return {task.key: task.needs for task in self.distinct}

    def with_needs(self, keys: Iterable[str]) -> set[str]:
        """Keys of these tasks and of all tasks that they need."""
        with_needs, waiting = set[str](), [*keys]
        while waiting:
            key = waiting.pop()
            if key not in with_needs:
                with_needs.add(key)
                waiting += self._needs[key]
        return with_needs

    def obsolete(self, finished: Collection[str]) -> tuple[str, ...]:
        """Intermediate results that no task needs any more, given the keys that are finished."""
        finished_passing = [task.key for task in self.distinct if task.passing and task.key in finished]
        if not finished_passing:
            return ()
        wanted: set[str] = set()
        for task in self._pending_tasks(finished):
            wanted.update(task.needs)
        return tuple(key for key in finished_passing if key not in wanted)


def make_plan(manifest: Manifest, heard: Heard = lambda _: None) -> Plan:
    """Plan all computations of a campaign. Raises ManifestError if two cases are the same.

    heard: called with the number of cases.
    """
    return make_partial_plan(manifest, expand(manifest), heard)


def make_partial_plan(manifest: Manifest, cases: Sequence[CampaignCase], heard: Heard = lambda _: None) -> Plan:
    """The plan of some cases of a manifest."""
    kinds = [kind for kind in KINDS.values() if kind.needed(manifest)]
    tasks = dict[str, Task]()
    case_tasks = dict[str, CaseTasks]()
    firsts = dict[str, tuple[CampaignCase, str]]()
    for number, case in enumerate(cases, 1):
        requests: list[Wanted] = []
        for kind in kinds:
            requests += kind.tasks(case.case, manifest) if case.case else ()
        keys: dict[tuple[str, str], str] = {}
        for task, drive, is_part in requests:
            # Cases that share a compliance, or a record below several drives, share the task: it is computed once.
            if task.key not in tasks:
                tasks[task.key] = task
                firsts[task.key] = (case, drive)
            # A part is in the result of another task of the case, which is the one that a dataset reads.
            if not is_part:
                keys[task.kind, drive] = task.key
        case_tasks[case.case_id] = keys
        heard(number)
    distinct = tuple(order_by_stage(tasks.values()))
    return Plan(manifest, tuple(cases), distinct, case_tasks, firsts)


def _label(task: Task, campaign_case: CampaignCase, drive: str) -> Label:
    names, values = campaign_case.labels.names, campaign_case.values
    if drive:
        return (*names, "drive"), (*values, drive)
    if task.case is not None:
        return names, values
    # A compliance is that of many cases, which differ in load and friction: only what its slab has labels it.
    of_slab = task.slab.flat
    parameters = dict(zip(names, values, strict=True))
    shared = {name: parameters[name] for name in names if of_slab.get(name) is not None}
    label = {"n_x": task.slab.n_x, **shared}
    return tuple(label), tuple(label.values())


# Progress of a plan: its tasks by kind, and outcomes of its cases and drives, from those of their tasks.

NOTHING_KNOWN: Final = (PENDING, *(ending.value for ending in UNDONE), Ending.NEEDS_FAILED.value)
"""Outcomes of the machine, not of the physics: pending, out of time, out of memory, crashed, or waiting for such a task."""


def combine_outcomes(kind: str, outcome: Outcome | None, further: Outcome | None) -> Outcome | None:
    """Combine the outcome of a case so far with the outcome of another task of this kind.

    outcome: of the case so far. further: of the task. None: unfinished.
    """
    if outcome is None or not outcome.usable:
        return outcome
    # A failure of one's own numbers is theirs alone.
    if further is not None and kind in OWN:
        return outcome
    # A compliance is intermediate: once used it may go without being missed.
    if further is None:
        return outcome if kind == "compliance" else None
    # Of two remarks the first one stays: a record without a plateau is the reason why a drive lacks a number.
    return outcome if further.usable and not outcome.ok else further


def case_outcome(plan: Plan, case: CampaignCase, outcomes: Mapping[str, Outcome]) -> Outcome | None:
    """Outcome of a case up to its friction record: the first failure, else the missing numbers; None while unfinished.

    outcomes: key of each finished task -> how it ended.
    """
    outcome: Outcome | None = case.outcome
    for (kind, drive), key in plan.case_tasks[case.case_id].items():
        if not drive:
            outcome = combine_outcomes(kind, outcome, outcomes.get(key))
    return outcome


def drive_outcome(
    plan: Plan, case: CampaignCase, drive: CampaignDrive, outcomes: Mapping[str, Outcome]
) -> Outcome | None:
    """Outcome of a drive, or of its case if there is no record to be driven over; None while unfinished."""
    if case.case is None:
        return case.outcome
    if drive.drive is None:
        return drive.outcome
    tasks = plan.case_tasks[case.case_id]
    key = tasks.get(("drive", drive.label), "")
    outcome = outcomes.get(key)
    # It ended as its case did.
    if outcome and outcome.ending is Ending.NEEDS_FAILED:
        return case_outcome(plan, case, outcomes)
    own_key = tasks.get(("drive_observables", drive.label))
    if own_key is not None:
        outcome = combine_outcomes("drive_observables", outcome, outcomes.get(own_key))
    return outcome and outcome.naming(key_of_duration(drive))


def key_of_duration(drive: CampaignDrive) -> str:
    """The key by which a drive's table gives its duration, for advice."""
    durations = (name for name in DURATIONS if name in drive.given and drive.settings[name] is not None)
    return next(durations, "duration above end_time, where auto ended it")


def ended(plan: Plan, outcomes: Mapping[str, Outcome]) -> tuple[Counter[str], Counter[str]]:
    """Count cases, and drives, by outcome: ending or `pending` -> count.

    outcomes: key of each finished task -> how it ended.
    """
    cases, drives = Counter[str](), Counter[str]()
    has_drives = "dynamics" in plan.manifest.stages
    for case in plan.cases:
        cases[_word(case_outcome(plan, case, outcomes))] += 1
        for drive in plan.manifest.drives if has_drives else ():
            drives[_word(drive_outcome(plan, case, drive, outcomes))] += 1
    return cases, drives


def _word(outcome: Outcome | None) -> str:
    return outcome.ending.value if outcome else PENDING


@dataclass(frozen=True, slots=True)
class KindCount:
    """Tasks of a kind: their number and costs."""

    all: int
    finished: int
    left: int
    given_up: int
    core_seconds_left: float
    memory_bytes: float
    """Memory of the largest task."""
    disk_bytes: float
    """Disk space of all tasks."""


def kind_counts(tasks: Iterable[Task], pending: Iterable[Task], given_up: Iterable[Task]) -> dict[str, KindCount]:
    """Kind of task -> count and costs, in the order of stages; without bytes where `tasks` are not estimated."""
    lost = Counter(task.kind for task in given_up)
    tried = Counter[str]()
    seconds: defaultdict[str, float] = defaultdict(float)
    for task in pending:
        tried[task.kind] += 1
        seconds[task.kind] += task.cost
    every: defaultdict[str, list[Task]] = defaultdict(list)
    for task in tasks:
        every[task.kind].append(task)
    counts = {}
    for kind in filter(every.get, KINDS):
        its = every[kind]
        rest = tried[kind] + lost[kind]
        memory = max(task.memory for task in its)
        disk = sum(task.disk for task in its)
        counts[kind] = KindCount(len(its), len(its) - rest, tried[kind], lost[kind], seconds[kind], memory, disk)
    return counts
