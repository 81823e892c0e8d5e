"""Cases -> tasks: each distinct computation once, needed ones before those that need them, longest chain first."""

import itertools
from array import array
from collections import Counter, defaultdict
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Final

from nanoslip.solver.outcome import UNDONE, Ending, Outcome
from nanoslip.study.garbage import all_kept
from nanoslip.study.manifest.cases import CampaignCase, Heard, cases_of, expanding
from nanoslip.study.manifest.manifest import CampaignDrive, Manifest
from nanoslip.study.origin import Origins, foreign_among
from nanoslip.study.plan.cost import estimate
from nanoslip.study.plan.grids import settled
from nanoslip.study.plan.kinds import KINDS, Wanted, in_stages
from nanoslip.study.plan.task import Label, Task

# The tasks of each case.

TaskNames = tuple[tuple[str, str], ...]
"""Kinds of tasks, each with the label of its drive ("" without one)."""


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


class TasksOfCases(Mapping[str, CaseTasks]):
    """case_id -> its tasks. Of millions of cases little is kept: the kinds of tasks that they share, and keys in one list."""

    def __init__(self) -> None:
        self.cases: list[CampaignCase] = []
        self._names: list[TaskNames] = []
        self._known: dict[TaskNames, TaskNames] = {}
        self._keys: list[str] = []
        self._begins = array("Q")
        self._last = "", CaseTasks()

    def add(self, case: CampaignCase, keys: Mapping[tuple[str, str], str]) -> None:
        """keys: of its tasks, by kind and label of the drive, in the order of stages."""
        names = tuple(keys)
        self.cases.append(case)
        self._names.append(self._known.setdefault(names, names))
        self._begins.append(len(self._keys))
        self._keys += keys.values()

    def part(self, numbers: range) -> "TasksOfCases":
        """Those of the cases of these numbers."""
        found = TasksOfCases()
        for number in numbers:
            found.add(self.cases[number], self._tasks(number).keys)
        return found

    def alike(self) -> Iterator[tuple[TaskNames, list[int], list[str]]]:
        """Of cases with the same kinds of tasks: these, the positions of the cases, and their keys, one case behind the other."""
        for names in self._known:
            if len(self._known) == 1:
                yield names, list(range(len(self))), self._keys
                return
            numbers = [number for number, its in enumerate(self._names) if its is names]
            keys = (self._keys[begin : begin + len(names)] for begin in map(self._begins.__getitem__, numbers))
            yield names, numbers, list(itertools.chain.from_iterable(keys))

    def in_order(self) -> Iterator[tuple[CampaignCase, CaseTasks]]:
        """All cases with their tasks. While it is a case's turn, asking for its tasks by its name takes no search."""
        for number, case in enumerate(self.cases):
            self._last = case.case_id, self._tasks(number)
            yield case, self._last[1]

    def __getitem__(self, case_id: str) -> CaseTasks:
        if self._last[0] != case_id:  # a case is asked for again by each of its drives
            self._last = case_id, self._tasks(self._places[case_id])
        return self._last[1]

    def _tasks(self, number: int) -> CaseTasks:
        names, begin = self._names[number], self._begins[number]
        return CaseTasks(dict(zip(names, self._keys[begin : begin + len(names)], strict=True)))

    def __iter__(self) -> Iterator[str]:
        return (case.case_id for case in self.cases)

    def __len__(self) -> int:
        return len(self.cases)

    @cached_property
    def _places(self) -> dict[str, int]:
        return {case.case_id: place for place, case in enumerate(self.cases)}


# The order of tasks: needed ones before those that need them, longest chain of work first.


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


DOUBT: Final = 100.0
"""A task that takes so many times longer than estimated is taken to hang; the worst estimates known are 30 times off."""
LEAST_LIMIT: Final = 600.0
"""Seconds that every task may take."""
TOGETHER: Final = 512
"""Cases that are planned together, step by step: the processor's caches hold one step's program, not all of them."""


@dataclass(frozen=True, slots=True)
class Plan:
    """The whole work of a campaign, finished or not."""

    manifest: Manifest
    cases: tuple[CampaignCase, ...]
    tasks: tuple[Task, ...]
    """Each distinct task once: needs first, then the longest chain of work first."""
    case_tasks: TasksOfCases
    """case_id -> its tasks."""

    @property
    def count(self) -> int:
        """How many cases there are."""
        return len(self.cases)

    def piece(self, numbers: range) -> "Plan":
        """The plan of the cases of these numbers, without tasks."""
        cases = self.cases[numbers.start : numbers.stop]
        return replace(self, cases=cases, tasks=(), case_tasks=self.case_tasks.part(numbers))

    def remaining(self, finished: Collection[str]) -> tuple[Task, ...]:
        """Tasks still to do, in order, given the keys that are finished.

        Intermediate results are recomputed only if an unfinished task needs them.
        """
        needed: set[str] = set()
        left = []
        for task in reversed(self.tasks):  # from the ends of the chains to their beginnings
            if task.key not in finished and (not task.intermediate or task.key in needed):
                needed.update(task.needs)
                left.append(task)
        return tuple(reversed(left)) if len(left) < len(self.tasks) else self.tasks

    def possible(
        self, left: Sequence[Task], given_up: Collection[str], failed: Collection[str] = ()
    ) -> tuple[Task, ...]:
        """Unfinished tasks that can be tried: neither they nor their needs are given up. Those that failed before come last."""
        if not given_up and not failed:
            return tuple(left)
        lost = set(given_up)
        for task in in_stages(left):
            if not lost.isdisjoint(task.needs):
                lost.add(task.key)
        return tuple(sorted((task for task in left if task.key not in lost), key=lambda task: task.key in failed))

    def outcomes(self, finished: Mapping[str, Outcome], failed: Mapping[str, Outcome]) -> dict[str, Outcome]:
        """How tasks ended, those included that cannot be begun, as what they need has failed.

        finished: of the results that are there, which count more than failures. failed: of attempts.
        """
        found = {key: outcome for key, outcome in failed.items() if key not in finished}
        tasks = {task.key: task for task in self.tasks} if found else {}
        for task in in_stages(self.tasks) if found else ():
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
        return foreign_among({task.key: finished[task.key] for task in self.tasks if task.key in finished})

    def obsolete(self, finished: Collection[str]) -> tuple[str, ...]:
        """Intermediate records that no task needs any more, given the keys that are finished."""
        ended = [
            task.key for task in self.tasks if task.intermediate and task.kind == "record" and task.key in finished
        ]
        wanted = {need for task in self.remaining(finished) for need in task.needs} if ended else set()
        return tuple(key for key in ended if key not in wanted)


def make_plan(manifest: Manifest, heard: Heard = lambda _: None) -> Plan:
    """Everything a campaign has to compute. Raises ManifestError where two cases are the same.

    Of an error asked for, the plan's manifest has the numerics that were chosen for it (see
    nanoslip.study.plan.grids).
    heard: callback, called repeatedly with the number of cases so far.
    """
    with all_kept():
        return plan_of(settled(manifest), heard)


def plan_of(manifest: Manifest, heard: Heard = lambda _: None) -> Plan:
    """The plan of a manifest whose grid is chosen already."""
    with all_kept():
        planning = Planning(manifest)
        while planning.go_on():
            heard(planning.count)
        return planning.plan()


class Planning:
    """A plan in the making, some cases at a time."""

    def __init__(self, manifest: Manifest, tasks: bool = True, numbers: range | None = None) -> None:
        """manifest: with its grid chosen. tasks: whether they are wanted, and not their keys alone: those take half of the time.

        numbers: of the cases, where not all are wanted; whether two of the campaign are the same is not looked at then.
        """
        self._manifest = manifest
        self._tasks_wanted = tasks
        self._ahead = expanding(manifest) if numbers is None else cases_of(manifest, numbers)
        self._of_cases = TasksOfCases()
        self._kinds = [kind for kind in KINDS.values() if kind.needed(manifest)]
        self._found: dict[str, Task] = {}

    @property
    def count(self) -> int:
        """How many cases are planned."""
        return len(self._of_cases)

    def go_on(self) -> bool:
        """Plan the next cases; whether there were any. Raises ManifestError behind the last one where two are the same."""
        together = list(itertools.islice(self._ahead, TOGETHER))
        self._add(together)
        return bool(together)

    def plan(self) -> Plan:
        """The plan of what is planned. It takes over the tasks: memory is what limits its size."""
        tasks = list(self._found.values())
        self._found.clear()
        return Plan(self._manifest, tuple(self._of_cases.cases), longest_chain_first(tasks), self._of_cases)

    def _add(self, cases: list[CampaignCase]) -> None:
        """More cases: their tasks, estimated and labelled; none of one that is refused."""
        wanted = [self._wanted(case) for case in cases]
        for case, its in zip(cases, wanted, strict=True) if self._tasks_wanted else ():
            for each in its:
                if each.task.key not in self._found:
                    self._found[each.task.key] = self._planned(each, case)
        for case, its in zip(cases, wanted, strict=True):
            self._of_cases.add(case, {(each.task.kind, each.drive): each.task.key for each in its})

    def _wanted(self, case: CampaignCase) -> list[Wanted]:
        if case.case is None:
            return []
        return [wanted for kind in self._kinds for wanted in kind.tasks(case.case, self._manifest)]

    def _planned(self, wanted: Wanted, campaign_case: CampaignCase) -> Task:
        seconds, memory, disk = estimate(wanted.task)
        cost = 0.0 if wanted.free else seconds
        limit = self._manifest.task_seconds
        limit = max(LEAST_LIMIT, DOUBT * cost) if limit is None else limit
        return wanted.task.planned(cost, memory, disk, limit, _label(wanted, campaign_case))


def _label(wanted: Wanted, campaign_case: CampaignCase) -> Label:
    names, values = campaign_case.labels.names, campaign_case.values
    if wanted.drive:
        return (*names, "drive"), (*values, wanted.drive)
    if wanted.task.case is not None:
        return names, values
    of_slab = wanted.task.slab.flat
    given = dict(zip(names, values, strict=True))
    found = {"n_x": wanted.task.slab.n_x, **{name: given[name] for name in names if of_slab.get(name) is not None}}
    return tuple(found), tuple(found.values())


# How far a plan is: its tasks by kind, and how its cases and drives ended, from the outcomes of their tasks.

PENDING: Final = "pending"
"""What stands for the outcome of what is not computed yet."""
NOTHING_KNOWN: Final = (PENDING, *(ending.value for ending in UNDONE), Ending.NEEDS_FAILED.value)
"""Outcomes that say nothing of a case: pending, failed for want of time or memory or as a process died, or waiting for that."""


def after(kind: str, outcome: Outcome | None, found: Outcome | None) -> Outcome | None:
    """How a case ended with one task more, which is of this kind.

    outcome: how it ended up to there. found: how the task did. None: not yet.
    """
    if outcome is None or not outcome.usable:
        return outcome
    if found is None:
        return outcome if kind == "compliance" else None  # it is intermediate: once used it may go without being missed
    return outcome if found.usable and not outcome.ok else found


def as_its_case(found: Outcome | None) -> bool:
    """Whether a drive ended as its case did, given how its task has."""
    return found is not None and found.ending is Ending.NEEDS_FAILED


def case_outcome(plan: Plan, case: CampaignCase, outcomes: Mapping[str, Outcome]) -> Outcome | None:
    """How a case ended up to its friction record: the first failure, else what is missing; None while unfinished.

    outcomes: key of each finished task -> how it ended.
    """
    outcome: Outcome | None = case.outcome
    for (kind, drive), key in plan.case_tasks[case.case_id].keys.items():
        if not drive:
            outcome = after(kind, outcome, outcomes.get(key))
    return outcome


def drive_outcome(
    plan: Plan, case: CampaignCase, drive: CampaignDrive, outcomes: Mapping[str, Outcome]
) -> Outcome | None:
    """How a drive ended: as its case where that leaves nothing to be driven over, or by itself; None while unfinished."""
    if case.case is None or drive.drive is None:
        return case.outcome if case.case is None else drive.outcome
    found = outcomes.get(plan.case_tasks[case.case_id].key("drive", drive.label) or "")
    return case_outcome(plan, case, outcomes) if as_its_case(found) else found


def ended(plan: Plan, outcomes: Mapping[str, Outcome]) -> tuple[Counter[str], Counter[str]]:
    """How many cases, and how many drives, ended how: ending or `pending` -> count.

    outcomes: key of each finished task -> how it ended.
    """
    drives = plan.manifest.drives if "dynamics" in plan.manifest.stages else ()
    cases = Counter(_word(case_outcome(plan, case, outcomes)) for case in plan.cases)
    return cases, Counter(_word(drive_outcome(plan, case, each, outcomes)) for case in plan.cases for each in drives)


def _word(outcome: Outcome | None) -> str:
    return outcome.ending.value if outcome else PENDING


@dataclass(frozen=True, slots=True)
class KindCount:
    """Tasks of one kind: how many, and what they cost."""

    all: int
    finished: int
    left: int
    given_up: int
    core_seconds_left: float
    memory_bytes: float
    """Of the largest one."""
    disk_bytes: float
    """Of all of them."""


def kind_counts(tasks: Iterable[Task], left: Iterable[Task], given_up: Iterable[Task]) -> dict[str, KindCount]:
    """Kind of task -> count and costs, in the order in which they begin, where tasks are at hand themselves."""
    lost, tried = Counter(task.kind for task in given_up), Counter[str]()
    seconds: defaultdict[str, float] = defaultdict(float)
    for task in left:
        tried[task.kind] += 1
        seconds[task.kind] += task.cost
    every: defaultdict[str, list[Task]] = defaultdict(list)
    for task in tasks:
        every[task.kind].append(task)
    found = {}
    for kind, its in every.items():
        rest, memory, disk = tried[kind] + lost[kind], max(task.memory for task in its), sum(task.disk for task in its)
        found[kind] = KindCount(len(its), len(its) - rest, tried[kind], lost[kind], seconds[kind], memory, disk)
    return found


# How much disk space a campaign takes: files of results, and the dataset made of those that it keeps.

DATASET = 1.5e5
"""Bytes of a dataset without arrays: its variables, and all that they say of themselves."""
PACKED = 0.6
"""Share of an array's bytes that is left in the dataset, which is compressed."""


def disk_of_plan(plan: Plan) -> tuple[float, float]:
    """Bytes of all results, intermediate ones included, and of the dataset: to a factor of two or three."""
    kept = sum(task.disk for task in plan.tasks if not task.intermediate)
    return sum(task.disk for task in plan.tasks), DATASET + PACKED * kept
