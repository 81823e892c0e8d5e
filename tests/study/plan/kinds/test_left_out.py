"""A target leaves out of a drive what the numbers asked for do not need, found with the case's own first members."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from nanoslip.solver.case import Case
from nanoslip.solver.drive import Drive
from nanoslip.solver.ensemble import Ensemble, change_by, mean_of
from nanoslip.solver.outcome import InvalidInput
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.plateau import Plateau
from nanoslip.solver.sliding.record import FrictionRecord
from nanoslip.study.plan.kinds import compliance_task, drive_task, record_task
from nanoslip.study.plan.task import TaskResult
from nanoslip.study.run import compute
from nanoslip.study.run.compute import PAIRS
from tests.study.plan.running import run

CASE = Case(slab=Slab(33), max_events=None, max_presliding=4.0)
DRIVE = Drive.from_si(duration=0.1)
KINETIC = Ensemble(6, 1e-4, ("plateau_mean", "kinetic_friction"))
"""So well that all members are needed."""


def pulled(ensemble: Ensemble, drive: Drive = DRIVE) -> TaskResult:
    return run(compliance_task(CASE.slab), record_task(CASE, ensemble), drive_task(CASE, drive, ensemble))


@pytest.fixture(scope="module")
def whole() -> TaskResult:
    return pulled(Ensemble(6))


@pytest.fixture(scope="module")
def spared() -> TaskResult:
    return pulled(replace(KINETIC, within=0.03))


@pytest.fixture(scope="module")
def plain() -> TaskResult:
    return pulled(Ensemble(6), replace(DRIVE, profile="mean"))


def test_members_beyond_the_first_two_are_pulled_without_teeth_where_that_is_allowed(
    whole: TaskResult, spared: TaskResult, plain: TaskResult
) -> None:
    """The first two are kept as they are, and their change is what is stated."""
    count = len(spared.scalars["kinetic_friction"])
    assert count > PAIRS
    expected = whole.scalars["kinetic_friction"][:PAIRS] + plain.scalars["kinetic_friction"][PAIRS:count]
    assert spared.scalars["kinetic_friction"] == expected
    assert {compute.SPARED[int(word) - 1].name for word in spared.scalars["left_out"]} == {"teeth"}
    stated = change_by(plain.scalars["kinetic_friction"][:PAIRS], whole.scalars["kinetic_friction"][:PAIRS])
    assert set(spared.scalars["left_out_error"]) == {stated}
    assert 0.0 < stated < 0.015


def test_the_answer_is_within_what_was_asked_for(whole: TaskResult, spared: TaskResult) -> None:
    """Of the mean over all six with teeth, as far as these know it."""
    known = mean_of(np.array(whole.scalars["kinetic_friction"]))
    found = mean_of(np.array(spared.scalars["kinetic_friction"]))
    assert 2.0 * found.uncertainty / found.mean + spared.scalars["left_out_error"][0] <= 0.03
    assert abs(found.mean - known.mean) <= 0.03 * known.mean + 2.0 * known.uncertainty


def test_what_was_not_asked_for_is_known_of_the_first_two_alone(spared: TaskResult) -> None:
    for name in ("static_friction", "time_stuck", "regime", "macroscopic_slips"):
        known = np.isfinite(spared.scalars[name])
        assert known.tolist() == [True] * PAIRS + [False] * (len(known) - PAIRS)


def test_teeth_stay_where_the_numbers_asked_for_depend_on_them() -> None:
    """Static friction does: without teeth it is the plateau, some 8 % less. Every member then knows everything."""
    found = pulled(Ensemble(4, 1e-6, ("plateau_mean", "static_friction")))
    assert set(found.scalars["left_out"]) == {0}
    assert set(found.scalars["left_out_error"]) == {0.0}
    assert np.isfinite(found.scalars["regime"]).all()


def test_nothing_is_left_out_by_campaigns_that_ask_for_members(whole: TaskResult) -> None:
    assert "left_out" not in whole.scalars
    assert np.isfinite(whole.scalars["static_friction"]).all()


@pytest.mark.parametrize("refused", [0, 1])
def test_a_first_member_that_is_refused_leaves_nothing_out(monkeypatch: pytest.MonkeyPatch, refused: int) -> None:
    """Then no change is known; the others are computed whole."""
    measured = compute.measured

    def failing(record: FrictionRecord, plateau: Plateau, drive: Drive) -> Any:
        if plateau.mean == plateaus[refused]:
            raise InvalidInput("why")
        return measured(record, plateau, drive)

    ensemble = Ensemble(4, 1e-6, ("plateau_mean", "kinetic_friction"))
    plateaus = run(compliance_task(CASE.slab), record_task(CASE, ensemble)).scalars["plateau_mean"]
    monkeypatch.setattr(compute, "measured", failing)
    found = pulled(ensemble)
    assert np.isnan(found.scalars["kinetic_friction"]).tolist() == [number == refused for number in range(4)]
    assert {value for value in found.scalars["left_out"] if not np.isnan(value)} == {0}
