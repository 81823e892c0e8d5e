"""A cone, a wedge: a profile on a pin whose own curvature is none, against closed forms (Sneddon, Johnson)."""

import math

import numpy as np

from nanoslip.solver.case import Case
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.contact.state import ContactState
from nanoslip.solver.elasticity.compliance import surface_compliance

SLOPE, HALF_WIDTH, POISSON = 1e-3, 0.25, 1.0 / 3.0
MODULUS = 2.0 / (1.0 - POISSON)
"""E/(1 - ν²) in G."""
FLAT = {"radius": 1e9, "poisson": POISSON, "start": 0.37, "friction": False, "coupling": False}


def pressed(**parameters: object) -> ContactState:
    """Initial contact of a pin that has only the given profile."""
    case = Case.of({**FLAT, **parameters})
    return initial_contact(case, surface_compliance(case.slab))


def test_a_wedge_has_the_pressure_of_the_closed_form() -> None:
    """p = E*·slope/π·acosh(a/|x|), W = E*·slope·a. 5e-3: twice the miss of the node next to the tip, where p is infinite."""
    n_x = 129
    at = np.linspace(-0.6, 0.6, 4001)
    profile = tuple(zip(at, SLOPE * np.abs(at), strict=True))
    state = pressed(n_x=n_x, scheme="half_plane", normal_load=MODULUS * SLOPE * HALF_WIDTH, roughness=profile)
    x = np.linspace(-0.5, 0.5, n_x) - 0.37 / (n_x - 1)
    inner = state.contact & (np.abs(x) > 0.02) & (np.abs(x) < 0.22)
    exact = MODULUS * SLOPE / math.pi * np.arccosh(HALF_WIDTH / np.abs(x[inner]))
    np.testing.assert_allclose(state.pressure[inner], exact, rtol=5e-3)
    assert abs(np.count_nonzero(state.contact) / (n_x - 1) - 2.0 * HALF_WIDTH) <= 1.0 / (n_x - 1)


def test_a_cone_has_sneddon_s_approach() -> None:
    """Approach π/2·slope·a at W = π/2·E*·slope·a²; 1e-3: 200 nodes in contact."""
    n_x = 33
    at = np.linspace(-0.7, 0.7, 6 * (n_x - 1) + 1)
    points = [(x, y, SLOPE * math.hypot(x, y)) for x in at for y in at]
    load = math.pi / 2.0 * MODULUS * SLOPE * HALF_WIDTH**2
    state = pressed(n_x=n_x, scheme="half_space", start_y=0.21, normal_load=load, roughness=tuple(points))
    assert math.isclose(state.approach, math.pi / 2.0 * SLOPE * HALF_WIDTH, rel_tol=1e-3)
