"""Segments end where the motion turns, not where rounding says so."""

import math

import numpy as np
import pytest

from nanoslip.solver.drive import Drive
from nanoslip.solver.dynamics.friction_limit import FrictionLimit
from nanoslip.solver.dynamics.integrators import integrate


@pytest.mark.parametrize("compliant", [False, True])
def test_a_pin_that_creeps_up_a_far_tooth_takes_a_few_segments_for_each_oscillation(compliant: bool) -> None:
    """A pin comes to rest against a rising tooth, and is dragged up it at the pace of the spring.

    The oscillation dies out to less than the rounding of a friction force that is read off a position far out. Some of a hundred
    such drives took millions of segments: at each, rounding put an extremum of the velocity a millionth of a period ahead.
    """
    random = np.random.default_rng(1)
    for _ in range(250):
        slope, spring = 10.0 ** random.uniform(-2.0, 1.0), 10.0 ** random.uniform(-4.0, -2.0)
        damping, stage = float(random.choice([0.02, 0.1, 0.5])), 10.0 ** random.uniform(-5.0, -3.0)
        left, level = random.uniform(0.05, 2.0), 10.0 ** random.uniform(-4.0, -2.0)
        width = 1e-3 / slope
        teeth = FrictionLimit(
            np.array([0.0, left, left + width]), np.array([level, 1.5 * level]), np.array([0.0, slope]), 0
        )
        duration = (left + (1.5 * level + 0.5 * slope * width) / spring) / stage
        periods = duration * math.sqrt(spring + slope) / (2.0 * math.pi)
        most = math.ceil(20.0 * periods) + 100
        drive = Drive(spring, damping, stage, duration, samples=2, surface_compliance=compliant, step_limit=most)
        assert integrate(teeth, drive, 2.0 * slope if compliant else 0.5).outcome.ok
