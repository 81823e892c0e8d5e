"""Scenes are measured side by side, and their influences written down in the scenes' order."""

import json
import os
from collections.abc import Collection, Mapping

import numpy as np
import pytest

from study.accuracy.influence import measurement
from study.accuracy.influence.scenes import random_scene
from study.plan.influence.omissions import OMISSIONS
from study.plan.influence.scene import Scene
from study.plan.influence.table import load_influences
from study.plan.keys import SOLVER_VERSION


def square(seed: int) -> tuple[int, int]:
    return seed**2, os.getpid()


def made_up(scene: Scene, effects: Collection[str]) -> Mapping[str, np.ndarray]:
    """Without computing anything."""
    there = {name: OMISSIONS[name] for name in effects if OMISSIONS[name].there(scene)}
    return {name: np.full(len(omission.observables), 0.25) for name, omission in there.items()}


def test_work_is_spread_over_processes_and_keeps_its_order() -> None:
    heard: list[int] = []
    found = list(measurement.spread_out(square, range(6), 2, heard.append))
    assert [value for value, _ in found] == [0, 1, 4, 9, 16, 25]
    assert heard == [1, 2, 3, 4, 5, 6]
    assert os.getpid() not in {process for _, process in found}


@pytest.fixture
def at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Influences are made up, one scene after the other."""
    monkeypatch.setattr(measurement, "reduced_in", lambda scene, effects: made_up(scene, effects).items())
    monkeypatch.setattr(measurement, "influences_among", lambda values: values)
    monkeypatch.setattr(measurement, "spread_out", lambda work, seeds, processes, heard: [work(seed) for seed in seeds])


@pytest.mark.usefixtures("at_once")
def test_one_effect_is_measured_beside_what_is_known_of_the_others() -> None:
    found, known = json.loads(measurement.measure(40, 1, lambda _: None, ("teeth",))), load_influences()
    assert found["about"]["solver_version"] == known.about["solver_version"]
    assert found["about"]["teeth"] == f"on 40 random ones, seeds from 0, by solver_version {SOLVER_VERSION}"
    assert len(found["effects"]["teeth"]) == 40
    for name, measured in known.effects.items():
        assert name == "teeth" or len(found["effects"][name]) == len(measured.places)


@pytest.mark.usefixtures("at_once")
def test_each_effect_has_a_row_for_each_scene_that_has_it() -> None:
    found = json.loads(measurement.measure(40, 1, lambda _: None))
    assert found["about"]["scenes"] == "40 random ones, seeds from 0"
    assert {"starts", "solver_version"} <= set(found["about"])
    scenes = [random_scene(seed) for seed in range(40)]
    for name, omission in OMISSIONS.items():
        having = [scene for scene in scenes if omission.there(scene)]
        rows = found["effects"][name]
        assert len(rows) == len(having)
        for row, scene in zip(rows, having, strict=True):
            places = [group.place(scene) for group in omission.groups]
            assert row[: len(places)] == pytest.approx(places, rel=5e-3)
            assert row[len(places) :] == [0.25] * len(omission.observables)
