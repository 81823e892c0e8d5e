"""Events of two and three nodes worked out by hand: when, who, how far, how much force drops, what is lost.

The compliances are made by hand: α is a node's own tangential compliance, β its neighbour's, κ the normal one, and
χ the coupling with the half-plane's sign, w_b = -χ f_a and w_a = χ f_b for b to the right of a; so reciprocity gives
u_a = … + χ N_b and u_b = … - χ N_a (N = -f_z). Nothing else couples. All formulas are elementary and hold exactly.
"""

import math

import numpy as np
import pytest

from nanoslip.solver.case import Case, SlipRule
from nanoslip.solver.elasticity.compliance import SurfaceCompliance
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.record import EVENT_KINDS
from nanoslip.solver.sliding.slide import slide_to_state
from tests.verification.seen import seen

SLAB = Slab(n_x=5)
N, H = SLAB.n_x, SLAB.spacing
LEFT, MIDDLE, RIGHT = 1, 2, 3
EXACT = {"rtol": 1e-12, "atol": 1e-14}
"""Rounding; what should be zero is compared with loads and lengths of 0.1."""


def compliance(tangential, normal, coupling=0.0):
    """Unit compliances but for the given entries (symmetric), and χ between MIDDLE and RIGHT."""
    matrix = np.eye(2 * N)
    for start, entries in ((0, tangential), (N, normal)):
        for (i, j), value in entries.items():
            matrix[start + i, start + j] = matrix[start + j, start + i] = value
    for row, column, value in ((RIGHT, MIDDLE, -coupling), (MIDDLE, RIGHT, coupling)):
        matrix[N + row, column] = matrix[column, N + row] = value
    assert np.linalg.eigvalsh(matrix).min() > 0.0
    return SurfaceCompliance(matrix, SLAB)


def slid(compliance, residual_shear=0.0, **changes):
    """Record and state of a punch on three nodes, under a load of 0.1, μ_i 0.5, after one event, unless it is said otherwise."""
    rule = {"residual_shear": residual_shear, **({"event_floor": changes.pop("floor")} if "floor" in changes else {})}
    punch = {"pin": "flat_punch", "half_width": 0.25, "normal_load": 0.1, "intrinsic_friction": 0.5, "max_events": 1}
    return slide_to_state(Case(slab=SLAB, slip_rule=SlipRule(**rule), **punch | changes), compliance)


def agree(law, record, most=1e-12, **by_hand):
    """The record's columns are those by hand, to a share of the column's largest value."""
    off = max(np.abs(getattr(record, name) - values).max() / np.abs(values).max() for name, values in by_hand.items())
    assert off <= most, seen(law, "by hand", f"off by {off:.1e}")
    seen(law, "by hand", f"off by {off:.1e}")


@pytest.mark.parametrize("residual_shear", [0.0, 0.6])
def test_two_coupled_nodes(residual_shear):
    """A punch on two nodes a, b: sums and differences decouple, F = (u_a + u_b)/S with S = α + β - χ²/κ,
    f_a - f_b = (u_a - u_b - χW)/(α - β), N_b - N_a = -χF/κ.

    The front node b bears shear from the first and loses pressure as F grows: it slips first, at μ N_b = f_b.
    """
    alpha, beta, kappa, chi, mu, normal_load = 1.0, 0.3, 1.2, 0.15, 0.5, 0.1
    # The third node under the punch sinks more than these two under their loads, so it bears none.
    sunk = {(LEFT, LEFT): 9.0, (LEFT, MIDDLE): 2.0, (LEFT, RIGHT): 2.0}
    own = {(MIDDLE, MIDDLE): kappa, (RIGHT, RIGHT): kappa}
    record, state = slid(compliance({(MIDDLE, RIGHT): beta}, own | sunk, chi), residual_shear)
    assert list(np.flatnonzero(state.contact)) == [MIDDLE, RIGHT]

    total, apart = alpha + beta - chi**2 / kappa, alpha - beta  # S and α - β
    displacement = total * (mu * normal_load / 2 - chi * normal_load / (2 * apart)) / (1 + mu * chi / kappa)
    force = 2 * displacement / total
    normal = normal_load / 2 - chi * force / (2 * kappa)
    # b slips by s: F changes by s/S, f_a - f_b by -s/(α - β), N_b by -χ s/(2κS), until f_b = residual_shear·μ N_b.
    stiffness = (1 / total + 1 / apart) / 2
    slip = -(1 - residual_shear) * mu * normal / (stiffness + residual_shear * mu * chi / (2 * kappa * total))
    shear_after = mu * normal + stiffness * slip
    agree(
        f"two coupled nodes slip, residual {residual_shear}",
        record,
        displacement=[displacement],
        force_before=[force],
        force_after=[force + slip / total],
        stiffness=[2 / total],
        dissipated=[-(mu * normal + shear_after) / 2 * slip],
    )
    assert record.initial_force == pytest.approx(0.0, abs=1e-15)
    assert (record.kind[0], record.node[0], record.slips[0]) == (EVENT_KINDS.index("slip"), RIGHT, 1)
    np.testing.assert_allclose(state.slip[[MIDDLE, RIGHT]], [0.0, slip], **EXACT)
    front = normal - chi * slip / (2 * kappa * total)
    np.testing.assert_allclose(-state.nodal_force[1, [MIDDLE, RIGHT]], [normal_load - front, front], **EXACT)
    back = mu * normal - normal_load * chi / apart + slip * (1 / total - 1 / apart) / 2
    np.testing.assert_allclose(state.nodal_force[0, [MIDDLE, RIGHT]], [back, shear_after], **EXACT)


def test_a_cascade_of_three_nodes():
    """A punch on three nodes with tangential compliance α, and β between neighbours; the inverse, times α(α² - 2β²), is
    [α² - β², -αβ, β²; -αβ, α², -αβ; β², -αβ, α² - β²]. Each node carries N_i = W/(κ_i Σ 1/κ), unchanged.

    The right node slips first; that takes the middle one beyond its limit, whose slip does so to the left one: three slips,
    each of -shear/own stiffness.
    """
    alpha, beta, mu, normal_load = 1.0, 0.35, 0.5, 0.1
    kappa = np.array([1.0, 2.3, 1.1])
    limit = mu * normal_load / kappa / (1 / kappa).sum()
    edge, cross, far, own = np.array([alpha**2 - beta**2, -alpha * beta, beta**2, alpha**2]) / (
        alpha * (alpha**2 - 2 * beta**2)
    )
    inverse = np.array([[edge, cross, far], [cross, own, cross], [far, cross, edge]])
    nodes = [LEFT, MIDDLE, RIGHT]
    normal = {(node, node): float(value) for node, value in zip(nodes, kappa, strict=True)}
    record, state = slid(compliance({(LEFT, MIDDLE): beta, (MIDDLE, RIGHT): beta}, normal))

    # Stuck, each edge bears (α - β)/(α² - 2β²) per δ_p and the middle (α - 2β)/(α² - 2β²).
    displacement = limit[2] / (edge + cross + far)
    shear = displacement * np.array([edge + cross + far, own + 2 * cross, edge + cross + far])
    before, slips, lost = shear.sum(), np.zeros(3), 0.0
    for node in (2, 1, 0):
        assert shear[node] / limit[node] == max(shear / limit) >= 1.0  # the worst offender
        slip = -shear[node] / inverse[node, node]
        lost -= shear[node] * slip / 2
        slips[node] += slip
        shear = shear + slip * inverse[node]
    assert np.all(shear < limit)
    numbers = {
        "displacement": [displacement],
        "force_before": [before],
        "force_after": [shear.sum()],
        "dissipated": [lost],
    }
    agree("a cascade of three nodes", record, **numbers)
    assert (record.node[0], record.slips[0]) == (RIGHT, 3)
    np.testing.assert_allclose(state.slip[nodes], slips, **EXACT)
    np.testing.assert_allclose(state.nodal_force[0, nodes], shear, **EXACT)


def test_touch_then_slip_by_a_step_of_the_floor():
    """A parabola on one node a; b, to the right, is drawn along by β/α and touches where its gap closes,
    (h - (1 - β/α) δ)²/(2R) = κW, from then on F = (u_a + u_b)/(α + β), and N_b = -Δheight/(2κ) as W is shared.

    A node that has just touched bears no pressure, hence no shear: it slips after the smallest step, the floor, until it
    bears no shear; sliding down the pin's flank brings it pressure. What is lost is ½ |f_b s| less what the load gains.
    """
    alpha, beta, kappa, mu, normal_load, radius, floor = 1.0, 0.3, 1.0, 0.8, 0.1, 0.25, 2e-5
    pin = {"pin": "parabola", "radius": radius, "intrinsic_friction": mu}
    record, state = slid(compliance({(MIDDLE, RIGHT): beta}, {}), floor=floor, max_events=2, **pin)
    assert record.initial_contact_size == 1

    touch = (H - math.sqrt(2 * radius * kappa * normal_load)) / (1 - beta / alpha)
    assert touch < alpha * mu * normal_load  # a does not slip before
    step = floor * H
    force = touch / alpha + 2 * step / (alpha + beta)
    shear = step / (alpha + beta)
    own, cross = alpha / (alpha**2 - beta**2), -beta / (alpha**2 - beta**2)
    slip = -shear / own
    place = math.sqrt(2 * radius * kappa * normal_load)
    fall = ((place + slip) ** 2 - place**2) / (2 * radius)
    normal = -fall / (2 * kappa)
    lost = -shear * slip / 2 + normal * fall / 2
    agree(
        "touch, then slip",
        record,
        1e-11,  # rounding: the step is a hundred-thousandth of the displacements it is added to
        displacement=[touch, touch + step],
        force_before=[touch / alpha, force],
        force_after=[touch / alpha, force + slip * (own + cross)],
        stiffness=[2 / (alpha + beta)] * 2,
        dissipated=[0.0, lost],
    )
    assert [EVENT_KINDS[kind] for kind in record.kind] == ["touch", "slip"]
    assert list(record.node) == [RIGHT, RIGHT]
    np.testing.assert_allclose(-state.nodal_force[1, [MIDDLE, RIGHT]], [normal_load - normal, normal], **EXACT)
    # Its slip is counted from where it stuck: it touched at u = β/α δ, δ_p being δ.
    np.testing.assert_allclose(state.slip[RIGHT], slip - (1 - beta / alpha) * touch, **EXACT)
    assert lost > 0.0
