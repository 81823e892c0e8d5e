"""A drive whose forces or teeth would drown in rounding is refused, and only such a one."""

import math
from dataclasses import replace

import numpy as np
import pytest

from nanoslip.solver.drive import Drive
from nanoslip.solver.dynamics import integrators as precision
from nanoslip.solver.dynamics.integrators import RK4, integrate
from nanoslip.solver.dynamics.result import DynamicsResult
from nanoslip.solver.outcome import Ending
from tests.synthetic import constant_profile, profile_through

FORCE, CONTACT = 3e-4, 1e3
EVEN = profile_through([0.0, 1e6], [FORCE], [FORCE])
FINE = profile_through([0.0, 1e-6], [0.4], [0.6])
FAR = Drive(1e12, 1.0, 1.0, 1e4, samples=50)
"""k V t = 1e16: the spring force is rounded to 2.2, some 7000 times the friction force."""


def driven(**changed: object) -> DynamicsResult:
    return integrate(EVEN, replace(FAR, **changed), CONTACT)


def test_a_spring_force_without_digits_is_refused_with_numbers_and_advice():
    result = driven()
    assert result.outcome.ending is Ending.ROUNDING
    for word in ("spring_stiffness × stage_velocity × duration", "7.4e+03 of the friction force", "7.4e+07 or more"):
        assert word in result.outcome.message
    assert np.isnan(result.position[1:]).all()
    assert (len(result.slip_time), result.steps) == (0, 0)


def test_what_is_refused_would_be_noise(monkeypatch):
    monkeypatch.setattr(precision, "LARGEST", math.inf)
    result = driven()
    assert result.outcome.ok
    assert np.abs(result.spring_force[10:]).max() > 1e3 * FORCE


@pytest.mark.parametrize("name", ["spring_stiffness", "stage_velocity", "duration"])
def test_the_advice_is_enough(name):
    """Each of the three factors reduced as much as the message says, and a little: steady sliding shows the friction."""
    less = getattr(FAR, name) / (1.01 * float(driven().outcome.message.split("by a factor of ")[-1].split()[0]))
    result = driven(**{name: less})
    assert result.outcome.ok
    assert np.abs(result.spring_force[-5:] / FORCE - 1.0).max() < 3.0 * precision.LARGEST
    assert driven(**{name: 1.1 * less}).outcome.ending is Ending.ROUNDING


def test_teeth_below_the_rounding_of_the_position_are_refused_and_an_even_profile_is_not():
    """Teeth of 1e-6 at x = 1e9, known to 1e-7: 0.2 of a tooth. What is the same everywhere has no teeth to be met."""
    drive = Drive(1e-9, 1.0, 1e3, 1e6, integrator=RK4(1e3), samples=10)
    refused = integrate(FINE, drive, 1e-9)
    assert refused.outcome.ending is Ending.ROUNDING
    assert "of the friction profile's mean tooth" in refused.outcome.message
    assert integrate(constant_profile(0.5), drive, 1e-9).outcome.ok


@pytest.mark.parametrize(
    ("profile", "drive"),
    [
        (constant_profile(0.0), Drive(1.0, 0.0, 1.0, 100.0, samples=10)),
        (FINE, Drive(1e-10, 0.0, 1e7, 100.0, samples=10)),
        (constant_profile(FORCE), Drive(1.0, 0.1, 0.0, 1e9, samples=10)),
    ],
    ids=["no friction to be lost", "a pin that never gets away", "a stage at rest"],
)
def test_what_rounding_cannot_hurt_is_not_refused(profile, drive):
    """The second is pulled by a fifth of its friction; a pin that got away would cross teeth as fine as its rounding."""
    assert integrate(profile, drive, CONTACT).outcome.ending is not Ending.ROUNDING
