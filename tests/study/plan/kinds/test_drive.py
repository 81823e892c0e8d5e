"""The result of a drive is what the solver's motion says, over the record that its result holds."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from nanoslip.solver.dynamics.regime import REGIMES
from nanoslip.solver.outcome import Ending
from nanoslip.study.plan.kinds import drive_task
from nanoslip.study.run.compute import run_task
from tests.study.plan.running import CASE, DRIVE, drive, first, slid


@pytest.mark.parametrize(
    "effect",
    [{"surface_compliance": False}, {"reverse_motion": False}, {"profile": "mean"}, {"damping_ratio": 0.0}],
    ids=str,
)
def test_an_effect_of_a_drive_is_in_its_key_and_leaves_its_record_alone(effect: dict[str, Any]) -> None:
    other = replace(DRIVE, **effect)
    assert drive_task(CASE, other).key != drive_task(CASE, DRIVE).key
    assert drive_task(CASE, other).needs == drive_task(CASE, DRIVE).needs
    result = drive(CASE, other)
    assert result.outcome.ok
    # Small effects here, but for the mean: without static excess the first slip needs 18 % less.
    assert first(result)["static_friction"] == pytest.approx(first(drive(CASE))["static_friction"], rel=0.2)


def test_a_drive_over_a_record_without_a_plateau_says_so() -> None:
    result = drive(replace(CASE, max_events=5))
    assert result.outcome.ending is Ending.NO_PLATEAU
    assert result.outcome.message.startswith("the friction record has none to repeat: the record ends after")
    assert not first(result)


def test_the_spring_pulls_as_far_as_the_stage_is_ahead() -> None:
    """Spring force = k(Vt - x) at every sample, to rounding of the stage's position."""
    result = drive(CASE)
    arrays = result.arrays
    stage = DRIVE.stage_velocity * arrays["time"]
    assert result.outcome.ok
    assert arrays["time"].shape == (51,)
    assert arrays["time"][-1] == pytest.approx(DRIVE.duration, rel=1e-15)
    np.testing.assert_allclose(
        arrays["spring_force"], DRIVE.spring_stiffness * (stage - arrays["position"]), atol=1e-15 * stage[-1]
    )


def test_a_drive_measures_its_friction() -> None:
    """μ_s is at most the record's peak, μ_k the plateau, and the fit finds both again.

    To a mean drop of the record: the closed form has no teeth, and where on one a slip begins is not its to know.
    """
    record, result = slid(CASE), drive(CASE)
    measured, plateau = first(result), first(record)["plateau_mean"]
    assert measured["macroscopic_slips"] == len(result.arrays["slip_time"]) >= 1
    assert measured["kinetic_friction"] == pytest.approx(plateau, abs=first(record)["mean_drop"])
    assert plateau < measured["static_friction"] < 1.01 * first(record)["peak_friction"]
    tooth = first(record)["mean_drop"]
    assert measured["fitted_static_friction"] == pytest.approx(measured["static_friction"], abs=tooth)
    assert measured["fitted_kinetic_friction"] == pytest.approx(measured["kinetic_friction"], abs=tooth)


def test_a_drive_too_short_to_slip_says_so_and_keeps_its_motion() -> None:
    result = drive(CASE, replace(DRIVE, duration=0.01 * DRIVE.duration))
    assert result.outcome.ending is Ending.NO_SLIP
    assert "raise the drive's duration" in result.outcome.message
    assert np.isnan(first(result)["static_friction"])
    assert np.isfinite(result.arrays["position"]).all()
    assert (first(result)["macroscopic_slips"], first(result)["resticks"], first(result)["time_stuck"]) == (
        0,
        0,
        1.0,
    )
    assert REGIMES[int(first(result)["regime"])] == "sticks"


def test_a_drive_that_ends_amid_its_oscillations_has_no_plateau_of_the_driving_force() -> None:
    """At 45 ms the pin has just begun to slip: μ_s is known, μ_k is not."""
    result = drive(CASE, replace(DRIVE, duration=0.45 * DRIVE.duration))
    assert result.outcome.ending is Ending.NO_PLATEAU
    assert result.outcome.message.startswith("the driving force ")
    assert first(result)["static_friction"] > 0.0
    assert np.isnan(first(result)["kinetic_friction"])


def test_what_a_drive_does_is_counted_from_its_slips() -> None:
    result = drive(CASE)
    slips, ends = result.arrays["slip_time"], result.arrays["restick_time"]
    ended = np.isfinite(ends)
    assert first(result)["resticks"] == ended.sum()
    stuck = 1.0 - np.sum(np.where(ended, ends, DRIVE.duration) - slips) / DRIVE.duration
    assert first(result)["time_stuck"] == pytest.approx(stuck, rel=1e-12)
    assert REGIMES[int(first(result)["regime"])] == "slides"  # as the paper's: it slides through the last half


def test_a_drive_knows_nothing_that_its_record_forgot() -> None:
    """The record is rebuilt from its result: through the store's numbers, the drive is the same bit for bit."""
    record = slid(CASE)
    copy = replace(record, arrays={name: array.copy() for name, array in record.arrays.items()})
    task = drive_task(CASE, DRIVE)
    first, second = (run_task(task, {task.needs[0]: need}) for need in (record, copy))
    np.testing.assert_array_equal(first.arrays["position"], second.arrays["position"])
