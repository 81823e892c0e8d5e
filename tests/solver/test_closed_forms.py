"""Closed forms of contact carry the load they are given, and go over into one another in their limits."""

import numpy as np
import pytest
from scipy.integrate import quad

from nanoslip.solver.contact.closed_forms import (
    SlidingContact,
    cattaneo_mindlin,
    film_radius,
    flat_punch_pressure,
    hertz,
    sliding_parabola,
    sliding_punch,
)


def test_hertz_carries_its_load_and_closes_without_a_step():
    contact = hertz(normal_load=1e-3, radius=200.0, poisson=1 / 3)
    a = contact.half_width
    carried, _ = quad(lambda x: float(contact.pressure(np.array(x))), -a, a)
    assert carried == pytest.approx(1e-3, rel=1e-8)
    assert contact.pressure(np.array([-a, a, 2 * a])) == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)
    # The paper's case: 70-75 of 129 nodes.
    assert a == pytest.approx(0.2913, abs=1e-4)


def test_a_flat_punch_carries_its_load():
    carried, _ = quad(
        lambda t: float(flat_punch_pressure(np.sin(t) * 0.25, 0.25, 2.0)) * 0.25 * np.cos(t), -np.pi / 2, np.pi / 2
    )
    assert carried == pytest.approx(2.0, rel=1e-8)


@pytest.mark.parametrize("ratio", [0.0, 0.3, 1.0])
def test_partial_slip_carries_its_friction_force(ratio: float):
    contact = hertz(normal_load=1e-3, radius=200.0, poisson=1 / 3)
    a = contact.half_width
    x = np.linspace(-a, a, 200001)
    shear = cattaneo_mindlin(contact, 0.4, ratio, x)
    assert np.trapezoid(shear, x) == pytest.approx(ratio * 0.4 * 1e-3, abs=1e-8 * 1e-3 + 1e-6 * ratio * 0.4e-3)
    assert np.all(shear <= 0.4 * contact.pressure(x) + 1e-15)


def slope_under(contact: SlidingContact, friction: float, poisson: float, x: float) -> float:
    """Slope of the half-plane's surface at x: pressed, (1 - ν)/π ⨍ p/(x - s) ds, and dented ahead of the shear μp."""
    left, right = contact.centre - contact.half_width, contact.centre + contact.half_width
    powers = (contact.power - contact.skew, contact.power + contact.skew)
    level = float(contact.pressure(np.array(x))) / ((x - left) ** powers[0] * (right - x) ** powers[1])

    def principal(start: float, stop: float, near: float) -> float:
        """∫ p/(s - x) from the contact's end `near` to the other limit, its algebraic end taken as weight."""
        ends = (powers[0], 0.0) if near == left else (0.0, powers[1])
        other = (lambda s: (right - s) ** powers[1]) if near == left else (lambda s: (s - left) ** powers[0])
        return float(quad(lambda s: other(s) / (s - x), start, stop, weight="alg", wvar=ends)[0])

    margin = 0.5 * min(x - left, right - x)
    smooth, _ = quad(
        lambda s: (s - left) ** powers[0] * (right - s) ** powers[1], x - margin, x + margin, weight="cauchy", wvar=x
    )
    total = principal(left, x - margin, left) + smooth + principal(x + margin, right, right)
    return -(1 - poisson) / np.pi * level * total - friction / 2 * (1 - 2 * poisson) * float(
        contact.pressure(np.array(x))
    )


@pytest.mark.parametrize("place", [-0.5, 0.1, 0.7])
def test_the_surface_under_a_sliding_contact_is_the_pin(place: float):
    friction, poisson, radius = 0.8, 0.1, 3.0
    parabola = sliding_parabola(0.02, radius, friction, poisson)
    x = parabola.centre + place * parabola.half_width
    assert slope_under(parabola, friction, poisson, x) == pytest.approx(x / radius, rel=1e-8)
    punch = sliding_punch(0.02, 0.3, friction, poisson)
    pressed = (1 - poisson) * float(punch.pressure(np.array(0.3 * place)))
    assert slope_under(punch, friction, poisson, 0.3 * place) == pytest.approx(0.0, abs=1e-8 * pressed)


def test_sliding_contacts_carry_their_load_further_back():
    for contact in (sliding_parabola(0.02, 3.0, 0.8, 0.1), sliding_punch(0.02, 0.3, 0.8, 0.1)):
        x = contact.centre + contact.half_width * np.sin(np.linspace(-np.pi / 2, np.pi / 2, 20002))
        middle = (x[1:] + x[:-1]) / 2
        share = np.diff(contact.load_share(x))
        assert share.sum() == pytest.approx(1.0, rel=1e-12)
        # The midpoint rule's error, and more of it beside the punch's edges.
        np.testing.assert_allclose(
            (contact.pressure(middle) * np.diff(x) / contact.normal_load)[100:-100], share[100:-100], rtol=3e-5
        )
        assert share @ middle == pytest.approx(contact.centroid, abs=1e-6 * contact.half_width)
        assert contact.centroid < 0.0


def test_sliding_without_friction_is_hertz_and_the_flat_punch():
    x = np.linspace(-0.2, 0.2, 9)
    theory = hertz(0.02, 3.0, 0.1)
    np.testing.assert_allclose(
        sliding_parabola(0.02, 3.0, 0.0, 0.1).pressure(x / 10), theory.pressure(x / 10), rtol=1e-12
    )
    np.testing.assert_allclose(
        sliding_punch(0.02, 0.3, 0.0, 0.1).pressure(x), flat_punch_pressure(x, 0.3, 0.02), rtol=1e-12
    )


def test_a_film_under_a_ball_bears_the_load_of_springs_or_of_what_flows_sideways():
    """W = π k a⁴/(4R) with k = 2(1-ν)/((1-2ν)H), and W = π a⁶/(32 R H³) where nothing is compressed."""
    a, radius, height = 0.25, 100.0, 0.01
    springs = np.pi * (2.0 / height) * a**4 / (4.0 * radius)
    assert film_radius(springs, radius, 0.0, height) == pytest.approx(a)
    flowing = np.pi * a**6 / (32.0 * radius * height**3)
    assert film_radius(flowing, radius, 0.5, height) == pytest.approx(a)
