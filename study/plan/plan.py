"""Cases -> tasks: each distinct computation once, needed ones before those that need them, longest chain first."""

import itertools
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

from nanoslip.solver.outcome import UNDONE, Ending, Outcome
from nanoslip.study.discretization.targets import settled
from nanoslip.study.garbage import all_kept
from nanoslip.study.manifest.cases import CampaignCase, Heard, cases_of, expanding
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.origin import Origins, foreign_among
from nanoslip.study.plan.case_tasks import TasksOfCases
from nanoslip.study.plan.kinds.kind import Wanted
from nanoslip.study.plan.order import longest_chain_first
from nanoslip.study.plan.task import Label, Task
from nanoslip.study.plan.tasks import KINDS, estimate, in_stages

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
    nanoslip.study.discretization.targets).
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
