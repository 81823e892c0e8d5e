"""Closed forms of contact carry the load they are given, and go over into one another in their limits."""

import numpy as np
import pytest
from scipy.integrate import quad

from solver.analytic import cattaneo_mindlin, flat_punch_pressure, hertz


def test_hertz_carries_its_load_and_closes_without_a_step() -> None:
    contact = hertz(load=1e-3, radius=200.0, poisson=1 / 3)
    a = contact.half_width
    carried, _ = quad(lambda x: float(contact.pressure(np.array(x))), -a, a)
    assert carried == pytest.approx(1e-3, rel=1e-8)
    assert contact.pressure(np.array([-a, a, 2 * a])) == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)
    # The paper's case: 70-75 of 129 nodes.
    assert a == pytest.approx(0.2913, abs=1e-4)


def test_hertz_surface_is_the_parabola() -> None:
    """The slope of the half-plane under p, (1 - ν)/π ∫ p(s)/(x - s) ds per G, is x/R inside the contact."""
    radius, poisson = 3.0, 0.3
    contact = hertz(load=0.02, radius=radius, poisson=poisson)
    a = contact.half_width
    x = 0.4 * a
    # ⨍ p(s)/(s - x) ds by the weighted principal value; p/√ is smooth inside.
    principal, _ = quad(lambda s: float(contact.pressure(np.array(s))), -a, a, weight="cauchy", wvar=x)
    assert -(1 - poisson) / np.pi * principal == pytest.approx(x / radius, rel=1e-6)


def test_a_flat_punch_carries_its_load() -> None:
    carried, _ = quad(
        lambda t: float(flat_punch_pressure(np.sin(t) * 0.25, 0.25, 2.0)) * 0.25 * np.cos(t), -np.pi / 2, np.pi / 2
    )
    assert carried == pytest.approx(2.0, rel=1e-8)


@pytest.mark.parametrize("ratio", [0.0, 0.3, 1.0])
def test_partial_slip_carries_its_friction_force(ratio: float) -> None:
    contact = hertz(load=1e-3, radius=200.0, poisson=1 / 3)
    a = contact.half_width
    x = np.linspace(-a, a, 200001)
    shear = cattaneo_mindlin(contact, 0.4, ratio, x)
    assert np.trapezoid(shear, x) == pytest.approx(ratio * 0.4 * 1e-3, abs=1e-8 * 1e-3 + 1e-6 * ratio * 0.4e-3)
    assert np.all(shear <= 0.4 * contact.pressure(x) + 1e-15)
