"""What is counted of a drive is what an independent reading of its trajectory counts, on random drives over many teeth."""

import math
from typing import NamedTuple

import numpy as np
import pytest

from nanoslip.solver.drive import Drive
from nanoslip.solver.dynamics.friction_limit import sawtooth
from nanoslip.solver.dynamics.integrators import integrate
from nanoslip.solver.dynamics.regime import StickSlipCount, count_sticks
from nanoslip.solver.dynamics.result import DynamicsResult
from nanoslip.solver.sliding.plateau import plateau_of
from tests.synthetic import STIFFNESS, noisy_record

RECORD = noisy_record()
LIMIT = sawtooth(RECORD, plateau_of(RECORD))

DRIVES = 24
SAMPLES = 200_000
"""About 1e3 in a period: no slip is shorter than the contact's own period, a tenth of it at the most."""


def counted(motion: DynamicsResult, drive: Drive) -> StickSlipCount:
    return count_sticks(motion, drive)


class Reading(NamedTuple):
    """Macroscopic slips and re-sticks as samples of position and velocity show them."""

    slips: int
    resticks: int
    slipping: float
    """Seconds in macroscopic slips."""
    waiting: float
    """Seconds right before them at the stick velocity itself, to rounding: as a well damped pin waits."""


def read(motion: DynamicsResult) -> Reading:
    """Stretches of samples faster than a stuck pin is dragged along, of those that are longer than the presliding length,
    beyond the first stretch of the contact."""
    fast = np.concatenate(([False], motion.velocity > motion.stick_velocity, [False]))
    begins, ends = np.flatnonzero(np.diff(fast.astype(int)) == 1), np.flatnonzero(np.diff(fast.astype(int)) == -1)
    last = len(motion.time) - 1
    slips = resticks = 0
    slipping = waiting = 0.0
    moving = np.abs(motion.velocity / motion.stick_velocity - 1.0) > 1e-12
    for begin, end in zip(begins, np.minimum(ends, last), strict=True):
        from_here = max(motion.position[max(begin - 1, 0)], motion.presliding_length)
        if motion.position[end] - from_here > motion.presliding_length:
            slips += 1
            resticks += int(end < last)
            slipping += float(motion.time[end] - motion.time[begin])
            before = np.flatnonzero(moving[:begin])
            waiting += float(motion.time[begin] - motion.time[before[-1] if len(before) else 0])
    return Reading(slips, resticks, slipping, waiting)


def random_drive(number: int) -> Drive:
    """Soft to stiff, slow to fast, without damper to critically damped; long enough to slip and to repeat it."""
    rng = np.random.default_rng([2022, number])
    k, stage = 10.0 ** rng.uniform(-4.0, -1.8), 10.0 ** rng.uniform(-5.5, -3.5)
    duration = 2.0 * LIMIT.steady_force / (k * stage) + 30.0 * 2.0 * math.pi / math.sqrt(k)
    return Drive(k, float(rng.choice([0.0, 0.01, 0.1, 0.3, 1.0])), stage, duration, samples=SAMPLES)


@pytest.mark.parametrize("number", range(DRIVES))
def test_slips_and_resticks_are_those_that_the_trajectory_shows(number: int) -> None:
    drive = random_drive(number)
    motion = integrate(LIMIT, drive, STIFFNESS)
    found, seen = counted(motion, drive), read(motion)
    assert motion.outcome.ok
    assert (found.macroscopic_slips, found.resticks) == (seen.slips, seen.resticks)
    # Samples know each slip to 1e-5 of the time; a velocity at which a pin waits is passed by rounding before the slip does.
    most = 1.0 - seen.slipping / motion.end_time
    assert most - seen.waiting / motion.end_time - 1e-3 < found.time_stuck < most + 1e-3
    force = motion.spring_force[SAMPLES // 2 :]
    if math.isfinite(found.spring_force_amplitude):
        assert found.spring_force_amplitude == pytest.approx(np.ptp(force), rel=1e-3)  # of what samples miss


def test_the_random_drives_stick_and_slip_and_slide_and_a_stuck_pin_moves() -> None:
    """So that the test above sees all of it. A stuck pin's micro slips are why a threshold of velocity counts too many."""
    drives = [random_drive(number) for number in range(DRIVES)]
    motions = [integrate(LIMIT, drive, STIFFNESS) for drive in drives]
    counts = [counted(motion, drive) for motion, drive in zip(motions, drives, strict=True)]
    regimes = [count.regime for count in counts]
    assert min(regimes.count("stick_slip"), regimes.count("slides")) >= 5
    assert sum(motion.micro_slips > count.resticks for motion, count in zip(motions, counts, strict=True)) > DRIVES / 3
