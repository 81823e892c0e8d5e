"""Hertz: a small contact, a/L_x = 1/25, sees no slab edges; a rigid parabola on a half-plane is its limit."""

import numpy as np
import pytest

from solver.analytic import hertz
from solver.case import Case, Slab
from solver.compliance import slab_compliance
from solver.contact import first_touch

HALF_WIDTH, RADIUS, POISSON = 0.04, 1.0, 1 / 3


@pytest.mark.parametrize(
    ("n_x", "pressure_error", "moment_error"),
    # The observed errors are 4.4, 3.5 and 1.4 % of the peak pressure, and 0.5, 0.1 and 0.5 % of the half-width: the edge
    # nodes' share falls with the spacing, the stencil's 1-2 % in compliance do not.
    [(257, 0.046, 0.006), (513, 0.037, 0.006), pytest.param(1025, 0.016, 0.006, marks=pytest.mark.slow)],
)
def test_pressure_and_half_width(n_x: int, pressure_error: float, moment_error: float) -> None:
    load = np.pi * HALF_WIDTH**2 / (2 * RADIUS * (1 - POISSON))
    theory = hertz(load, RADIUS, POISSON)
    assert theory.half_width == pytest.approx(HALF_WIDTH, rel=1e-14)
    slab = Slab(n_x=n_x, poisson=POISSON, scheme="biquadratic")
    compliance = slab_compliance(slab)
    state = first_touch(Case(slab=slab, radius=RADIUS, load=load, first_touch="frictionless"), compliance)
    assert state.outcome.ok
    error = np.abs(state.pressure - theory.pressure(compliance.x)).max() / theory.peak_pressure
    assert error <= pressure_error
    # The second moment of an elliptic pressure is a²/4: a half-width that does not depend on the edge nodes.
    moment = float((-state.nodal_force[1] * compliance.x**2).sum()) / load
    assert 2 * np.sqrt(moment) == pytest.approx(HALF_WIDTH, rel=moment_error)
