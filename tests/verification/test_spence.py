"""Spence: under a growing load, the stick zone of a parabola keeps its share of the contact, which depends on μ and ν only."""

import numpy as np
import pytest

from nanoslip.solver.case import Case, SlipRule
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.elasticity.compliance import SurfaceCompliance, surface_compliance
from nanoslip.solver.slab import Slab
from tests.verification.seen import listed, observed_order, seen
from tests.verification.stick_zone import stick_zone, uncoupled_ratio

RADIUS = 2e5  # so flat that u does not matter to the pin's height under a node
SOURCE = "Spence 1973, J. Elasticity 3; collocation of its integral equation"


def loaded(operator: SurfaceCompliance, friction: float, half_width: float) -> tuple[float, float, float]:
    """Half-widths of contact and stick zone as their nodes count, and the shear force of the right half over the load."""
    slab = operator.slab
    normal_load = np.pi * half_width**2 / (2 * RADIUS * (1 - slab.poisson))
    case = Case(
        slab=slab, normal_load=normal_load, radius=RADIUS, intrinsic_friction=friction,
        slip_rule=SlipRule(residual_shear=1.0), initial_contact="gradual",
    )  # fmt: skip
    state = initial_contact(case, operator)
    assert state.outcome.ok, state.outcome
    stuck = state.contact & (np.abs(state.shear) < friction * state.pressure * (1 - 1e-9))
    np.testing.assert_allclose(state.shear, -state.shear[::-1], atol=1e-10 * state.pressure.max())
    outward = float(state.nodal_force[0, slab.n_x // 2 + 1 :].sum()) / normal_load
    return float(state.contact.sum()) * slab.spacing / 2, float(stuck.sum()) * slab.spacing / 2, outward


@pytest.mark.parametrize(
    ("friction", "poisson", "coupled"),
    [(0.25, 1 / 3, True), (0.1, 0.4, True), (0.5, 0.0, True), (0.3, 0.0, True), (0.25, 1 / 3, False)],
)
def test_the_stick_zone_grows_with_the_contact(friction: float, poisson: float, coupled: bool) -> None:
    """Over a factor of 3 in half-width. Widths are whole nodes: both ends of both zones may be off by one node.

    Not coupled: the shear leaves the pressure alone, and K(c/a)/K(√(1 - c²/a²)) = μ/β holds in closed form.
    """
    slab = Slab(n_x=129, poisson=poisson, scheme="half_plane")
    operator = surface_compliance(slab)
    if not coupled:
        matrix = operator.matrix.copy()
        matrix[slab.n_x :, : slab.n_x] = 0.0
        operator = SurfaceCompliance(matrix, slab)
    contact, stick, outward = np.array([loaded(operator, friction, a) for a in (0.1, 0.15, 0.22, 0.3)]).T
    theory = stick_zone(friction, poisson, coupled=coupled)
    ratio = float(stick.sum() / contact.sum())
    shear = float(outward[-1] / theory.half_shear - 1)
    line = seen(
        f"stick zone of a growing contact, μ = {friction}, ν = {poisson:.2f}", SOURCE,
        f"c/a = {ratio:.3f} ({theory.ratio:.4f}), constant within {np.abs(stick - ratio * contact).max() / slab.spacing:.1f} "
        f"nodes; shear force of one half off by {100 * shear:.2f} %",
    )  # fmt: skip
    assert np.all(np.abs(stick - theory.ratio * contact) <= slab.spacing), line
    # Four loads with nodes that fall anywhere.
    assert ratio == pytest.approx(theory.ratio, abs=0.015), line
    assert abs(shear) <= 2e-3, line  # 5e-4 to 1.1e-3 seen


@pytest.mark.parametrize(("friction", "poisson"), [(0.25, 1 / 3), (0.1, 1 / 3), (0.5, 0.0), (0.3, 0.0)])
def test_the_collocation_meets_the_closed_form_without_coupling(friction: float, poisson: float) -> None:
    found = stick_zone(friction, poisson, coupled=False).ratio
    closed = uncoupled_ratio(friction, poisson)
    line = seen("c/a by collocation, pressure left alone", "K(k)/K'(k) = μ/β", f"off by {abs(found / closed - 1):.0e}")
    assert found == pytest.approx(closed, rel=1e-4), line


@pytest.mark.slow
def test_the_shear_force_converges() -> None:
    friction, poisson = 0.25, 1 / 3
    theory = stick_zone(friction, poisson)
    grids, errors = (65, 129, 257), []
    for n_x in grids:
        operator = surface_compliance(Slab(n_x=n_x, poisson=poisson, scheme="half_plane"))
        errors.append(loaded(operator, friction, 0.35)[2] / theory.half_shear - 1)
    order = observed_order([1 / (n_x - 1) for n_x in grids], errors)
    line = seen(
        "shear force of one half of a growing contact",
        SOURCE,
        f"n_x = {grids}: off by {listed(errors)}, order {order:.1f}",
    )
    assert order > 0.7, line
