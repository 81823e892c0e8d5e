"""How the cases and drives of a plan ended, from the outcomes of their tasks."""

from collections.abc import Mapping
from typing import Final

from solver.outcome import UNDONE, Ending, Outcome
from study.manifest.cases import CampaignCase
from study.manifest.drives import CampaignDrive
from study.plan.plan import Plan

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
