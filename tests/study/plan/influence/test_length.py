"""Shorter records and drives: the smaller the error by their lengths, the less they save, and never more than there is."""

import itertools
from dataclasses import replace

import pytest

from solver.case import Case
from study.accuracy.influence.scenes import random_scene
from study.plan.cost.drive import drive_seconds
from study.plan.cost.seconds import record_seconds
from study.plan.influence.length import (
    COUNTS,
    LOOKING,
    drive_saving,
    errors_within,
    record_saving,
    why_drives_stay,
    why_records_stay,
)
from study.plan.influence.scene import ASKED_FOR, Scene

SCENES = [random_scene(seed) for seed in range(12)]


@pytest.mark.parametrize("within", [0.001, 0.01, 0.1, 0.5])
def test_errors_stay_within_the_tolerance_and_fall(within: float) -> None:
    errors = errors_within(within)
    assert COUNTS * errors[0] == pytest.approx(within, rel=1e-12)
    assert all(after < before for before, after in itertools.pairwise(errors))


@pytest.mark.parametrize("scene", SCENES, ids=map(str, range(12)))
def test_a_smaller_error_saves_no_more_and_none_more_than_all(scene: Scene) -> None:
    assert scene.drive is not None
    case = replace(scene.case, max_events=None, max_spacings=2.0)
    saved = [record_saving(case, error) for error in errors_within(0.03)]
    assert saved == sorted(saved, reverse=True)
    assert -LOOKING <= saved[-1] <= saved[0] < record_seconds(case)
    for within in (0.003, 0.03):
        assert drive_saving(scene.drive, case, within, fitted=False) < drive_seconds(scene.drive, case, fitted=False)


def test_what_the_file_sets_and_what_no_length_is_told_by_stays() -> None:
    case, drive, both = Case(), SCENES[0].drive, ASKED_FOR["dynamics"]
    assert drive is not None
    assert (why_records_stay(case, both), why_drives_stay(drive, both)) == ("", "")
    for changes in ({"target_uncertainty": 0.1}, {"target_length_error": 0.1}):
        assert why_records_stay(replace(case, **changes), both) == "kept by the file"
    for more in ({"uncertainty": 0.1}, {"length_error": 0.1}, {"max_slips": 3}):
        assert why_drives_stay(replace(drive, **more), both) == "kept by the file"
    for name in ("peak_friction", "mean_step", "static_friction"):
        assert why_records_stay(case, (*both, name)) == f"{name} depends on it"
    assert why_drives_stay(drive, (*both, "static_friction")) == "static_friction depends on it"
    assert why_records_stay(case, ("approach",))
    assert why_drives_stay(drive, ("plateau_mean",))
