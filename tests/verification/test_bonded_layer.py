"""The scheme strip against the integral equation of a pin on a bonded layer, which bonded_layer.py solves; no friction.

Half-widths are 0.25 L_x, heights 0.125 to 1 L_x. The solver's pressure is linear between nodes: its errors fall as the square of
the spacing, but for the pressure of a parabola's edge nodes, where p has a vertical tangent, and the place of a punch's edge.
"""

from itertools import product

import numpy as np
import pytest

from nanoslip.solver.case import Case, Effects
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.contact.state import ContactState
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.slab import Slab
from tests.verification.bonded_layer import pressed
from tests.verification.seen import converges

FREE = Effects(friction=False)
RADIUS = 1e6
"""So blunt that strains are small: without friction the radius scales the load and nothing else."""
LIGHT = 1e-6  # a punch's load, which scales everything
HALF_WIDTH = 0.25
GRIDS = (129, 257, 513)
CASES = list(product((0.3, 0.45, 0.5), (0.25, 0.5, 1.0, 2.0)))
SOURCE = "integral equation by Gauss-Chebyshev"


def solved(case: Case) -> tuple[ContactState, float]:
    """The solver's contact, and the mean of x² under its forces."""
    state = initial_contact(case, surface_compliance(case.slab))
    assert state.outcome.ok
    return state, float(-state.nodal_force[1] @ state.x**2) / case.normal_load


def test_the_reference_tends_to_a_layer_pressed_flat_and_to_one_that_flows() -> None:
    """Flat punches. At ν = 0.3 what is added to the half-width bears (λ+2G)δ/h. At ν = 1/2, p'' = -3Gδ/h³ leads to
    W = 2Gδ(a + c)³/h³, where the edges' c tends to a multiple of h."""
    flat, wider = (pressed("flat_punch", a, 1.0, 0.3, 120).load for a in (8.0, 12.0))
    assert (wider - flat) / 4 == pytest.approx(2 * 2 * 0.7 / 0.4, rel=1e-7)
    roots = [np.cbrt(pressed("flat_punch", a, 1.0, 0.5, 240).load / 2) for a in (4.0, 8.0, 16.0)]
    rest = np.diff(roots) / (4.0, 8.0) - 1
    assert 0.0 < 3 * rest[1] < rest[0] < 1e-2


@pytest.mark.parametrize(("poisson", "slimness"), CASES)
def test_a_parabola_on_a_bonded_layer(poisson: float, slimness: float) -> None:
    """Under the load that the half-width needs. The outermost nodes' error is 1 % of the peak at 513, as √spacing: the root mean
    square falls as the spacing."""
    height = HALF_WIDTH / slimness
    theory, errors = pressed("parabola", HALF_WIDTH, height, poisson), []
    for n_x in GRIDS:
        slab = Slab(n_x, height, poisson, scheme="strip")
        state, moment = solved(Case(slab=slab, radius=RADIUS, normal_load=theory.load / RADIUS, effects=FREE))
        inside, pressure = np.abs(state.x) < HALF_WIDTH, np.zeros(n_x)
        pressure[inside] = theory.pressure(state.x[inside])
        off = (RADIUS * state.pressure - pressure) / pressure.max()
        rms = np.sqrt((off**2).sum() * slab.spacing / (2 * HALF_WIDTH))
        width = np.sqrt(moment / theory.second_moment) - 1
        errors.append((RADIUS * state.approach / theory.approach - 1, off[n_x // 2], rms, width))
        assert np.abs(np.abs(state.x[state.contact]).max() - HALF_WIDTH) <= slab.spacing
    named = dict(zip(("approach", "in the middle", "pressure (rms)", "half-width"), np.array(errors).T, strict=True))
    law = f"parabola on a bonded layer, a/h = {slimness}, ν = {poisson}"
    line, orders = converges(law, SOURCE, GRIDS, named)
    # Seen: at most 1.4e-6, 0.9e-5, 1.5e-3 and 2.1e-5.
    assert np.all(np.abs(errors[-1]) <= (2e-6, 1.5e-5, 2e-3, 3e-5)), line
    assert orders["pressure (rms)"] > 0.95, line
    assert min(orders["in the middle"], orders["half-width"]) > 1.9, line
    assert orders["approach"] > 1.6, line  # two errors of the opposite sign at a/h = 2, 1.7 seen


@pytest.mark.parametrize(("poisson", "slimness"), CASES)
def test_a_flat_punch_on_a_bonded_layer(poisson: float, slimness: float) -> None:
    """The edge lies 0.3849 spacings beyond the last node, as on a half-plane (test_elastic_slab.py): with that, order 2.

    Load per approach, half-width by the second moment, and the pressure on the inner 70 %."""
    height, errors = HALF_WIDTH / slimness, []
    for n_x in GRIDS:
        slab = Slab(n_x, height, poisson, scheme="strip")
        punch = Case(slab=slab, pin="flat_punch", half_width=HALF_WIDTH, normal_load=LIGHT, effects=FREE)
        state, moment = solved(punch)
        theory = pressed("flat_punch", state.x[state.contact].max() + 0.3849 * slab.spacing, height, poisson)
        inner = np.abs(state.x) <= 0.7 * HALF_WIDTH
        off = state.pressure[inner] / LIGHT * theory.load / theory.pressure(state.x[inner]) - 1
        width = np.sqrt(moment / theory.second_moment) - 1
        errors.append((LIGHT / state.approach / theory.load - 1, np.abs(off).max(), width))
    named = dict(zip(("load", "inner pressure", "half-width"), np.array(errors).T, strict=True))
    line, orders = converges(f"flat punch on a bonded layer, a/h = {slimness}, ν = {poisson}", SOURCE, GRIDS, named)
    assert np.all(np.abs(errors[-1]) <= (3e-5, 5e-5, 1e-5)), line  # at most 2.5e-5, 3.8e-5 and 0.9e-5 seen
    assert min(orders.values()) > 1.8, line
