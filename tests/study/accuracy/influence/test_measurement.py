"""Scenes are measured side by side, and their influences written down in the scenes' order."""

import json
import os
from collections.abc import Mapping

import numpy as np
import pytest

from study.accuracy.influence import measurement
from study.accuracy.influence.scenes import random_scene
from study.plan.influence.omissions import OMISSIONS
from study.plan.influence.scene import Scene


def square(seed: int) -> tuple[int, int]:
    return seed**2, os.getpid()


def made_up(scene: Scene) -> Mapping[str, np.ndarray]:
    """Without computing anything."""
    there = {name: omission for name, omission in OMISSIONS.items() if omission.there(scene)}
    return {name: np.full(len(omission.observables), 0.25) for name, omission in there.items()}


def test_work_is_spread_over_processes_and_keeps_its_order() -> None:
    heard: list[int] = []
    found = list(measurement.spread_out(square, range(6), 2, heard.append))
    assert [value for value, _ in found] == [0, 1, 4, 9, 16, 25]
    assert heard == [1, 2, 3, 4, 5, 6]
    assert os.getpid() not in {process for _, process in found}


def test_each_effect_has_a_row_for_each_scene_that_has_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(measurement, "reduced_in", lambda scene: made_up(scene).items())
    monkeypatch.setattr(measurement, "influences_among", lambda values: values)
    monkeypatch.setattr(measurement, "spread_out", lambda work, seeds, processes, heard: [work(seed) for seed in seeds])
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
