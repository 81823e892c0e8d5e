"""A plan in little says of every state of a campaign just what the plan and its cases say, one by one."""

from collections import Counter
from collections.abc import Iterable
from dataclasses import astuple
from pathlib import Path

import numpy as np
import pytest

from solver.outcome import COMPLETED, UNDONE, Ending, Outcome
from study.manifest.reader import parse_manifest
from study.plan.plan import Plan, make_plan
from study.plan.standing.endings import PENDING, case_outcome, drive_outcome
from study.plan.standing.outline import Look, kind_counts, outline_of
from study.plan.task import Task
from tests.conftest import PARTLY_REFUSED, SMALL

CAMPAIGNS = {
    "drives": SMALL,
    "scalars": SMALL + "[outputs]\nrecords = false\nstatistics = true\ntractions_at = [3]\n",
    "contact": 'title = "t"\nstages = ["contact"]\n[axes]\nradius = [50.0, 60.0]\nn_x = [17, 33]\n',
    "a target": SMALL.replace("ensemble.members = 1", "target.within = 0.02"),
    "refused": PARTLY_REFUSED,
    "all refused": 'title = "t"\n[constants]\nintrinsic_friction = inf\n[slip]\nresidual_shear = 1.0\n',
    "drive refused": SMALL.split("[[drives]]")[0]
    + '[drive_axes]\ntime_step = [1e-6, 1e-3]\nduration = [1e-4, 1e-2]\n[[drives]]\nname = "a"\nintegrator = "rk4"\n',
}
ENDINGS = (COMPLETED, *(Outcome(ending, "why") for ending in Ending if ending not in UNDONE))
FAILURES = tuple(Outcome(ending, "why") for ending in UNDONE)


def planned(name: str) -> Plan:
    return make_plan(parse_manifest(Path("small.toml"), CAMPAIGNS[name], {}))


def one_by_one(plan: Plan, finished: dict[str, Outcome], failed: dict[str, Outcome], given_up: set[str]) -> Look:
    """The same without columns."""
    left = plan.remaining(finished)
    tried = {task.key for task in plan.possible(left, given_up - set(finished))}
    outcomes = plan.outcomes(finished, failed)
    cases = Counter(word(case_outcome(plan, case, outcomes)) for case in plan.cases)
    drives = plan.manifest.drives if "dynamics" in plan.manifest.stages else ()
    driven = Counter(word(drive_outcome(plan, case, drive, outcomes)) for case in plan.cases for drive in drives)
    assert len(tried) == sum(task.key in tried for task in left)
    found = outline_of(plan).look(finished, failed, given_up)
    here = [task for task in left if task.key in tried]
    lost = [task for task in left if task.key not in tried]
    counted = kind_counts(plan.tasks, here, lost)
    assert found.kinds.keys() == counted.keys()
    for kind, count in found.kinds.items():
        assert astuple(count) == pytest.approx(astuple(counted[kind]), rel=1e-12)
        assert (count.all, count.left) == (kind_of(plan.tasks, kind), kind_of(here, kind))
        assert count.finished == count.all - count.left - count.given_up
    return Look(found.kinds, cases, driven)


def kind_of(tasks: Iterable[Task], kind: str) -> int:
    return sum(task.kind == kind for task in tasks)


def word(outcome: Outcome | None) -> str:
    return outcome.ending.value if outcome else PENDING


@pytest.mark.parametrize("name", CAMPAIGNS)
def test_any_state_is_counted_as_one_by_one(name):
    plan, rng = planned(name), np.random.default_rng(3)
    keys = [task.key for task in plan.tasks]
    for _ in range(60):
        share, good = rng.random(2)
        finished = {
            key: COMPLETED if rng.random() < good else ENDINGS[rng.integers(len(ENDINGS))]
            for key in keys
            if rng.random() < share
        }
        failed = {key: FAILURES[rng.integers(len(FAILURES))] for key in keys if rng.random() < 0.3 * rng.integers(2)}
        given_up = {key for key in failed if rng.random() < 0.7}
        found = outline_of(plan).look(finished, failed, given_up)
        assert found == one_by_one(plan, finished, failed, given_up)
        assert found.all == len(plan.tasks)


def test_the_whole_and_the_empty():
    plan = planned("drives")
    found = outline_of(plan).look({task.key: COMPLETED for task in plan.tasks}, {}, ())
    assert (found.left, found.given_up, found.cases) == (0, 0, Counter(completed=4))
    found = outline_of(plan).look({}, {}, ())
    assert (found.left, found.cases, found.drives) == (len(plan.tasks), Counter(pending=4), Counter(pending=8))
