"""A case and its drives end as the first of their tasks that failed: one word for it, wherever it is said."""

from pathlib import Path

from nanoslip.solver.outcome import COMPLETED, Ending, Outcome
from nanoslip.study.manifest.reader import parse_manifest
from nanoslip.study.plan.plan import PENDING, Plan, drive_outcome, ended, make_plan
from tests.conftest import SMALL

LIMIT = Outcome(Ending.CASCADE_LIMIT, "one event needed too many slips")


def outcomes_of(plan: Plan, **by_kind: Outcome) -> dict[str, Outcome]:
    """How all tasks ended, by kind; the others completed."""
    return {task.key: by_kind.get(task.kind, COMPLETED) for task in plan.tasks}


def small() -> Plan:
    return make_plan(parse_manifest(Path("small.toml"), SMALL, {}))


def test_a_drive_whose_record_failed_ended_as_its_case() -> None:
    plan = small()
    found = outcomes_of(plan, record=LIMIT, drive=Outcome(Ending.NEEDS_FAILED, "its record ended as cascade_limit"))
    assert ended(plan, found) == ({"cascade_limit": 4}, {"cascade_limit": 8})
    assert drive_outcome(plan, plan.cases[0], plan.manifest.drives[0], found) == LIMIT


def test_a_drive_that_failed_by_itself_keeps_its_own_word() -> None:
    plan = small()
    found = outcomes_of(plan, record=Outcome(Ending.NO_PLATEAU, "too short"), drive=Outcome(Ending.NO_SLIP, "soften"))
    assert ended(plan, found) == ({"no_plateau": 4}, {"no_slip": 8})


def test_what_has_no_outcome_is_pending() -> None:
    plan = small()
    assert ended(plan, {}) == ({PENDING: 4}, {PENDING: 8})
