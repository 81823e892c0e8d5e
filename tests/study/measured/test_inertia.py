"""The largest force of a pull that rings is inertia, and no friction."""

import math

import numpy as np
import pytest

from nanoslip.study.measured.recording import Trace
from nanoslip.study.measured.trace import measure_trace

LOAD, FRICTION, STIFFNESS, MASS, VELOCITY, ZETA = 14.7, 0.30, 7e3, 1.5, 0.064, 0.03


@pytest.mark.parametrize("seed", range(4))
def test_a_block_that_overshoots_has_the_friction_of_its_contact(seed: int) -> None:
    """V√(km) is 1.5 times friction here: the largest force reads 0.74."""
    time = np.arange(0.0, 1.5, 0.001)
    omega = math.sqrt(STIFFNESS / MASS)
    begin, rate = 0.1, STIFFNESS * VELOCITY
    slides = begin + FRICTION * LOAD / rate
    since = np.clip(time - slides, 0.0, None)
    damped = omega * math.sqrt(1.0 - ZETA**2)
    rings = rate / damped * np.exp(-ZETA * omega * since) * np.sin(damped * since)
    force = np.where(time < slides, rate * np.clip(time - begin, 0.0, None), FRICTION * LOAD + rings)
    noisy = force + 0.01 * np.random.default_rng(seed).standard_normal(len(time))
    found = measure_trace(Trace(time, noisy, "time"), LOAD, VELOCITY)
    assert "inertia" in found.flagged
    assert noisy.max() > 2.0 * FRICTION * LOAD
    static = found.numbers["static_friction"]
    assert abs(static.value - FRICTION) <= min(3.0 * static.uncertainty, 0.15 * FRICTION)
    assert found.numbers["kinetic_friction"].value == pytest.approx(FRICTION, rel=0.05)
    assert found.numbers["rising_stiffness"].value == pytest.approx(STIFFNESS, rel=0.02)
