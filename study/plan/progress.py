"""How far a plan is: its tasks by kind, and how its cases and drives ended, from the outcomes of their tasks."""

from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Final

from nanoslip.solver.outcome import UNDONE, Ending, Outcome
from nanoslip.study.manifest.cases import CampaignCase
from nanoslip.study.manifest.manifest import CampaignDrive
from nanoslip.study.plan.plan import Plan
from nanoslip.study.plan.task import Task

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
