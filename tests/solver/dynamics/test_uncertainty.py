"""A drive that is to know kinetic friction lasts as long as that takes: it is the drive of that duration, bit for bit."""

import math
from dataclasses import fields, replace
from functools import lru_cache

import numpy as np
import pytest

from solver.case import Case
from solver.drive import Drive, Scales
from solver.dynamics.coefficients import LONGER, measured
from solver.dynamics.result import DynamicsResult
from solver.dynamics.rk4 import RK4
from solver.outcome import Ending
from solver.simulate import drive_result, friction_record
from solver.slab import Slab
from solver.sliding.plateau import Plateau, plateau_of
from solver.sliding.record import FrictionRecord

LONG = Drive.from_si(Scales(), stage_travel=2e-2, stage_velocity=0.02, samples=100)
"""The paper's, ten times as fast, over twenty slab widths."""
TARGET = 0.004


@lru_cache
def slid() -> tuple[FrictionRecord, Plateau]:
    record = friction_record(Case(slab=Slab(65), max_events=None, max_spacings=3.3))
    return record, plateau_of(record)


def same(one: DynamicsResult, other: DynamicsResult) -> bool:
    return all(
        np.array_equal(getattr(one, item.name), getattr(other, item.name), equal_nan=True)
        for item in fields(DynamicsResult)
        if item.name != "outcome"
    )


def test_it_is_the_drive_of_the_duration_that_it_takes() -> None:
    motion, friction = measured(*slid(), replace(LONG, uncertainty=TARGET))
    assert motion.end_time < LONG.duration
    again, known = measured(*slid(), replace(LONG, duration=motion.end_time))
    assert same(motion, again)
    assert friction.kinetic_friction == known.kinetic_friction
    assert friction.kinetic_friction_uncertainty == known.kinetic_friction_uncertainty
    assert friction.outcome == known.outcome
    assert friction.outcome.ok


def test_it_ends_as_soon_as_it_knows_and_never_before() -> None:
    motion, friction = measured(*slid(), replace(LONG, uncertainty=TARGET))
    assert friction.relative_uncertainty <= TARGET
    duration = motion.end_time / LONGER
    while duration > 0.05 * motion.end_time:
        _, shorter = measured(*slid(), replace(LONG, duration=duration))
        assert not shorter.relative_uncertainty <= TARGET
        duration /= LONGER


def test_its_duration_is_the_most_it_lasts() -> None:
    """Bit for bit what it is without an uncertainty, and it says what it lacks."""
    short = replace(LONG, duration=0.05 * LONG.duration)
    nearly = 1.001 * slid()[1].relative_uncertainty
    motion, friction = measured(*slid(), replace(short, uncertainty=nearly))
    plain, known = measured(*slid(), short)
    assert same(motion, plain)
    assert friction.kinetic_friction == known.kinetic_friction
    assert friction.outcome.ending is known.outcome.ending is Ending.COMPLETED
    assert "raise duration" in friction.outcome.message


def test_where_the_record_knows_too_little_no_time_is_spent_and_that_is_said() -> None:
    record, plateau = slid()
    motion, friction = measured(record, plateau, replace(LONG, uncertainty=plateau.relative_uncertainty / 2.0))
    assert motion.end_time == pytest.approx(LONG.duration, rel=1e-12)
    assert friction.outcome.ending is Ending.COMPLETED
    assert "lower limits.uncertainty" in friction.outcome.message
    assert math.isfinite(friction.kinetic_friction)


@pytest.mark.parametrize(
    "drive",
    [
        replace(LONG, stage_velocity=0.0),
        replace(LONG, duration=1e-3 * LONG.duration),
        replace(LONG, duration=0.01 * LONG.duration, integrator=RK4(0.002 * LONG.duration)),
    ],
    ids=["a stage at rest", "a moment", "steps"],
)
def test_what_never_knows_is_what_it_is_without_an_uncertainty(drive: Drive) -> None:
    motion, friction = measured(*slid(), replace(drive, uncertainty=1e-3))
    plain, known = measured(*slid(), drive)
    assert same(motion, plain)
    assert friction.outcome.ending is known.outcome.ending


def test_a_drive_with_an_error_by_its_length_is_the_one_of_a_duration_that_is_enough() -> None:
    """It skips durations that are not expected to be: never longer than the next one of all that could be tried, twice over."""
    target = 0.001
    motion, friction = measured(*slid(), replace(LONG, length_error=target))
    assert motion.end_time < LONG.duration
    assert friction.relative_length_error <= target
    again, known = measured(*slid(), replace(LONG, duration=motion.end_time))
    assert same(motion, again)
    assert friction.kinetic_friction_uncertainty == known.kinetic_friction_uncertainty
    assert friction.outcome.ok


def test_what_its_record_does_not_know_is_no_error_by_the_length_of_a_drive() -> None:
    record, plateau = slid()
    worse = replace(plateau, uncertainty=0.1, of_length=0.1)
    one, other = (measured(record, each, replace(LONG, length_error=0.001)) for each in (plateau, worse))
    assert same(one[0], other[0])
    assert other[1].relative_uncertainty > 0.1 > one[1].relative_uncertainty


def test_a_pin_that_has_hardly_slid_does_not_know_what_a_longer_drive_changes() -> None:
    record, plateau = slid()
    slides = plateau.mean * record.normal_load / LONG.spring_stiffness / LONG.stage_velocity
    for spacings in (0.5, 1.5):
        short = replace(LONG, duration=slides + spacings * record.spacing / LONG.stage_velocity)
        assert math.isinf(measured(record, plateau, short)[1].relative_length_error)


def test_an_error_by_its_length_that_is_out_of_reach_leaves_the_whole_drive_and_no_complaint() -> None:
    motion, friction = measured(*slid(), replace(LONG, length_error=1e-9))
    plain, known = measured(*slid(), LONG)
    assert same(motion, plain)
    assert friction.outcome == known.outcome


def test_from_python_too() -> None:
    record, _ = slid()
    result = drive_result(Case(slab=Slab(65)), replace(LONG, uncertainty=TARGET), record)
    assert result.motion.end_time < LONG.duration
    assert result.coefficients.relative_uncertainty <= TARGET
