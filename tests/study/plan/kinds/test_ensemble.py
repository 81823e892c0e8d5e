"""Further members are not needed as soon as those so far know the plateau well enough, and never before."""

import math
from collections.abc import Sequence

import numpy as np
import pytest

from solver.case import Case
from solver.outcome import COMPLETED, Ending, Outcome
from solver.slab import Slab
from solver.sliding.sampling import EVENLY, SHARED
from study.manifest.manifest import halving
from study.plan.kinds.ensemble import ensemble_task
from study.plan.task import Task, TaskResult
from study.plan.tasks import compliance_task, record_task, run_task

SLAB = Slab(17)
MEANS = (0.300, 0.304, 0.298, 0.302)
STATED = 0.002


def records(count: int) -> list[Task]:
    return [record_task(Case(slab=SLAB, start=number / count)) for number in range(count)]


def ended(
    enough: float, means: Sequence[float], stated: float = STATED, spacings: float = 0.3, last: Outcome = COMPLETED
) -> Ending:
    """How the question ends, of members with these plateaus; `last` is how the last one did."""
    tasks = records(len(means))
    results = {}
    for number, (task, mean) in enumerate(zip(tasks, means, strict=True)):
        scalars = {"plateau_mean": mean, "plateau_uncertainty": stated, "spacings": spacings}
        outcome = last if number == len(means) - 1 else COMPLETED
        results[task.key] = TaskResult(task.key, "record", outcome, {} if math.isnan(mean) else scalars)
    return run_task(ensemble_task(tasks, enough), results).outcome.ending


def by_hand(means: Sequence[float], spacings: float, even: float = EVENLY) -> float:
    """Standard error of the mean of members by the words of solver.sliding.sampling, over the mean."""
    found = [mean for mean in means if not math.isnan(mean)]
    mean = sum(found) / len(found)
    chance = even * math.sqrt(sum((each - mean) ** 2 for each in found) / (len(found) - 1) / len(found))
    return math.hypot(chance, SHARED[spacings >= 0.5] * STATED) / mean


@pytest.mark.parametrize("spacings", [0.3, 2.0])
def test_it_ends_at_the_uncertainty_that_the_dataset_states(spacings: float) -> None:
    limit = by_hand(MEANS, spacings)
    assert ended(limit * (1.0 + 1e-9), MEANS, spacings=spacings) is Ending.NOT_NEEDED
    assert ended(limit * (1.0 - 1e-9), MEANS, spacings=spacings) is Ending.COMPLETED


def test_a_member_that_failed_is_a_missing_phase_not_a_failure() -> None:
    means = (*MEANS[:3], math.nan)
    lost = Outcome(Ending.CONTACT_LOST, "why")
    limit = by_hand(means, 0.3, even=1.0)
    assert ended(limit * (1.0 + 1e-9), means, last=lost) is Ending.NOT_NEEDED
    assert ended(limit * (1.0 - 1e-9), means, last=lost) is Ending.COMPLETED


def test_short_members_have_to_know_enough_at_two_sizes_in_a_row() -> None:
    """Those of 0.3 spacings do not: eight that know enough are enough, whatever the first four knew."""
    wide, close = (0.300, 0.320, 0.290, 0.310), (0.305, 0.305, 0.305, 0.305)
    limit = by_hand((*wide, *close), 0.1) * 1.01
    assert limit < by_hand(wide, 0.1)
    assert ended(limit, (*wide, *close), spacings=0.1) is Ending.COMPLETED
    assert ended(limit, (*wide, *close), spacings=0.3) is Ending.NOT_NEEDED
    enough = by_hand(wide, 0.1) * 1.01
    assert ended(enough, wide, spacings=0.1) is Ending.COMPLETED
    assert ended(enough, (*wide, *close), spacings=0.1) is Ending.NOT_NEEDED


@pytest.mark.parametrize("means", [(math.nan,) * 4, (0.3, math.nan, math.nan, math.nan)])
def test_of_fewer_than_two_plateaus_nothing_is_known(means: tuple[float, ...]) -> None:
    assert ended(0.9, means) is Ending.COMPLETED


def test_what_waits_for_a_no_ends_so_at_once_and_whatever_waits_for_that() -> None:
    """Nothing is slid: the case's slab is not even there."""
    asked = TaskResult("asked", "ensemble", Outcome(Ending.NOT_NEEDED))
    waiting = Task("a", "record", SLAB, Case(slab=SLAB), needs=("compliance", "asked"))
    none = TaskResult("compliance", "compliance", COMPLETED)
    found = run_task(waiting, {"compliance": none, "asked": asked})
    assert (found.outcome, dict(found.scalars), dict(found.arrays)) == (Outcome(Ending.NOT_NEEDED), {}, {})
    for task in (Task("b", "drive", SLAB, Case(slab=SLAB), needs=("a",)), ensemble_task([waiting, *records(1)], 1e-9)):
        given = {key: found if key == "a" else none for key in task.needs}
        assert run_task(task, given).outcome == Outcome(Ending.NOT_NEEDED)


def test_what_waits_for_a_yes_is_computed_as_if_nobody_had_asked() -> None:
    case = Case(radius=50.0, slab=SLAB, max_events=60)
    plain, compliance = record_task(case), run_task(compliance_task(SLAB), {})
    waiting = Task("a", "record", SLAB, case, needs=(*plain.needs, "asked"))
    asked = TaskResult("asked", "ensemble", COMPLETED)
    known = {compliance.key: compliance, "asked": asked}
    one, other = run_task(plain, known), run_task(waiting, known)
    assert one.scalars == pytest.approx(dict(other.scalars), rel=0.0, abs=0.0, nan_ok=True)
    assert all(np.array_equal(one.arrays[name], other.arrays[name]) for name in one.arrays)


def modulated(random: np.random.Generator, count: int) -> np.ndarray:
    """Plateaus of members about 1: a modulation over the starts, of which a long record would see all, and what is chance."""
    phases = np.array([halving(number) for number in range(count)])
    waves = sum(
        random.normal() / wave * np.cos(2.0 * np.pi * (wave * phases + random.random())) for wave in (1, 2, 3, 5, 7)
    )
    return np.asarray(1.0 + 0.01 * waves / 1.2 + 0.008 * random.normal(size=count))


@pytest.mark.parametrize("enough", [0.006, 0.004, 0.003])
def test_one_look_is_enough_for_honest_uncertainties(enough: float) -> None:
    """Of ensembles that ended at their target as often twice ± holds as of those of any fixed number.

    Who stops at the first good picture picks lucky ones; looks are few and each is at twice as many members, so that it does not
    show. Members state what their scatter is, as those of short records do. 600 ensembles: 0.9 has an error of 0.012.
    """
    random = np.random.default_rng(5)
    held: list[bool] = []
    used: list[int] = []
    for _ in range(600):
        means = modulated(random, 32)
        for count in (4, 8, 16, 32):
            limit = _stated(means[:count], 0.01)
            if limit <= enough * means[:count].mean():
                held.append(abs(means[:count].mean() - 1.0) <= 2.0 * limit)
                used.append(count)
                break
    assert len(held) > 300
    assert len(set(used)) > 1 or enough == 0.006
    assert np.mean(held) > 0.9


def _stated(means: np.ndarray, stated: float) -> float:
    return math.hypot(EVENLY * float(np.std(means, ddof=1)) / math.sqrt(len(means)), SHARED[0] * stated)
