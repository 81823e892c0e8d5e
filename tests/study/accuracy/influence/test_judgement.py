"""A trial compares the ways to choose in one scene that nothing was measured on."""

from dataclasses import replace

import numpy as np
import pytest

from study.accuracy.influence import judgement, measurement
from study.accuracy.influence.ensembles import Ensemble
from study.accuracy.influence.judgement import (
    EVERYTHING,
    FIRST,
    NOTHING,
    THUMB,
    TOLERANCES,
    asked_for,
    named,
    tolerance,
    trial,
)
from study.accuracy.influence.verdict import as_markdown, ways
from study.plan.influence.length import WHOLE_LENGTH
from study.plan.influence.omissions import OMISSIONS
from study.plan.influence.scene import OBSERVABLES, Scene
from tests.study.plan.influence.made_up import GRAVE, SLIGHT, influences

STARTS = 8


@pytest.fixture
def computed(monkeypatch: pytest.MonkeyPatch) -> list[Scene]:
    """Ensembles of which each effect that is there adds a tenth, and takes a second; the scenes that were computed."""
    found: list[Scene] = []

    def values(scene: Scene) -> np.ndarray:
        there = sum(omission.there(scene) for omission in OMISSIONS.values())
        return np.full((STARTS, len(OBSERVABLES)), 1.0 + 0.1 * there) + np.linspace(-1e-9, 1e-9, STARTS)[:, None]

    def ensemble_of(scene: Scene, _: object, starts: int = STARTS) -> Ensemble:
        found.append(scene)
        return Ensemble(values(scene)[:starts], (), 1.0, 0.0)

    monkeypatch.setattr(judgement, "compliance_of", lambda _: None)
    monkeypatch.setattr(judgement, "ensemble_of", ensemble_of)
    monkeypatch.setattr(judgement, "driven", lambda scene, each: each._replace(values=values(scene), drive_seconds=0.5))
    monkeypatch.setattr(judgement, "_warm", lambda: None)
    return found


def test_scenes_that_promises_are_tried_on_are_not_those_that_were_measured() -> None:
    assert measurement.FIRST + 100_000 < FIRST


def test_every_way_is_tried_once_against_everything(computed: list[Scene]) -> None:
    found = trial(FIRST)
    assert tuple(found.tried) == (EVERYTHING, THUMB, *(named(within) for within in TOLERANCES), NOTHING)
    assert set(found.tried) == set(ways())
    everything = sum(omission.there(found.scene) for omission in OMISSIONS.values())
    assert found.tried[EVERYTHING].left_out == frozenset()
    assert found.tried[EVERYTHING].actual.tolist() == [0.0] * len(asked_for())
    for each in found.tried.values():
        parts = {name for name, of in OMISSIONS.items() if of.part_of in each.left_out and of.there(found.scene)}
        change = 0.1 * len(each.left_out | parts) / (1.0 + 0.1 * everything)
        assert each.actual.tolist() == pytest.approx([change] * len(asked_for()), rel=1e-6, abs=1e-12)
    assert "reverse_motion" not in found.tried[NOTHING].left_out
    assert len({scene.case for scene in computed}) == len(computed)  # records that are the same are computed once


def test_larger_tolerances_leave_out_what_is_expected_to_stay_within_them(
    computed: list[Scene], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(judgement, "load_influences", lambda: influences(dict.fromkeys(OMISSIONS, 0.004)))
    found = trial(FIRST + 1)
    for within in TOLERANCES:
        assert np.nanmax(found.tried[named(within)].expected) <= within
    assert found.tried[named(0.003)].left_out == frozenset()
    assert found.tried[named(0.1)].left_out
    assert computed


@pytest.mark.parametrize(("changes", "some"), [(SLIGHT, True), (GRAVE, False)])
def test_what_matters_decides_what_is_left_out(
    computed: list[Scene], monkeypatch: pytest.MonkeyPatch, changes: dict[str, float], some: bool
) -> None:
    monkeypatch.setattr(judgement, "load_influences", lambda: influences(changes))
    assert bool(trial(FIRST + 2).tried[named(0.1)].left_out) == some
    assert computed


def test_scenes_are_judged_as_a_campaign_that_computes_each_by_itself_to_its_whole_length() -> None:
    found, whole = tolerance(0.01), frozenset({WHOLE_LENGTH})
    assert (found.within, found.asked_for, found.kept, found.cases_on_a_slab) == (0.01, asked_for(), whole, 1.0)


@pytest.mark.slow
def test_a_real_scene_is_tried_and_told() -> None:
    """Seconds: the scene with all its ways, and one that warms up."""
    found = next(each for each in map(trial, range(FIRST, FIRST + 5)) if not np.isnan(each.scatter).any())
    assert found.tried[EVERYTHING].actual.tolist() == [0.0] * len(asked_for())
    assert all(each.seconds > 0.0 for each in found.tried.values())
    text = as_markdown([found, replace(found, seed=1)])
    assert all(f"| {way} |" in text for way in ways())
