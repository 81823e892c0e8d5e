"""A chain of blocks: its springs' own algebra, and the automaton of Olami, Feder and Christensen as the oracle of its slips."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from nanoslip.solver.case import Case, Effects, Heterogeneity, SlipRule
from nanoslip.solver.contact.closed_forms import winkler_half_width
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.contact.pin import estimate_half_width, node_friction
from nanoslip.solver.elasticity.compliance import conditioning, surface_compliance
from nanoslip.solver.elasticity.grid_scheme import stiffness
from nanoslip.solver.elasticity.schemes.chain import Chain, spring_stiffness
from nanoslip.solver.outcome import InvalidInput
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.slide import slide_to_state
from nanoslip.solver.sliding.validity import predict_flags
from nanoslip.study.accuracy.operators import discretizations

Vector = NDArray[np.float64]


def springs(chain: Chain, slab: Slab) -> Vector:
    """The stiffness of leaf springs and of n - 1 springs between neighbours, spring by spring."""
    leaf, coupling = spring_stiffness(chain, slab)
    found = leaf * np.eye(slab.n_x)
    for left in range(slab.n_x - 1):
        found[left : left + 2, left : left + 2] += coupling * np.array([[1.0, -1.0], [-1.0, 1.0]])
    return found


@pytest.mark.parametrize("coupling", [0.0, 0.5, 30.0, 1e4])
def test_the_compliance_is_that_of_its_springs(coupling: float) -> None:
    chain = Chain(leaf_stiffness=2.0, coupling_stiffness=coupling, foundation_stiffness=5.0)
    slab = Slab(33, scheme=chain)
    matrix = surface_compliance(slab).matrix
    np.testing.assert_array_equal(matrix, matrix.T)
    assert conditioning(matrix).positive_definite
    # The condition number of the springs, 1 + 4 coupling at most, times rounding.
    np.testing.assert_allclose(springs(chain, slab) @ matrix[:33, :33], np.eye(33), atol=1e-14 * (1 + 4 * coupling))
    np.testing.assert_array_equal(matrix[33:, 33:], np.eye(33) / (5.0 * slab.spacing))
    assert not matrix[:33, 33:].any()


def test_a_chain_moved_as_one_feels_its_leaf_springs() -> None:
    chain = Chain(leaf_stiffness=0.7)
    slab = Slab(65, scheme=chain)
    stiff = np.linalg.inv(surface_compliance(slab).matrix[:65, :65])
    assert stiff.sum() == pytest.approx(0.7 * 65 / 64, rel=1e-10)
    # The middle half alone, which drags the rest along.
    part = np.linalg.inv(surface_compliance(slab).matrix[16:49, 16:49])
    assert part.sum() == pytest.approx(chain.lateral_stiffness(slab, 33), rel=0.01)  # the ends are 3 decay lengths away


def test_settings_and_refusals() -> None:
    assert Slab(33, scheme="chain") == Slab(33, scheme=Chain())
    with pytest.raises(InvalidInput, match="support = 'right_side': needs"):
        Slab(33, scheme="chain", support="right_side")
    with pytest.raises(InvalidInput, match=r"coupling_stiffness = -1\.0: needs 0 ≤ coupling_stiffness ≤ 1e6"):
        Chain(coupling_stiffness=-1.0)
    with pytest.raises(InvalidInput, match="scheme = 'chain'"):
        stiffness(Slab(33, scheme="chain"))


def test_neither_height_nor_poisson_matters() -> None:
    one, other = (
        surface_compliance(Slab(17, height, nu, scheme="chain")).matrix for height, nu in ((1, 0.0), (7, 0.4))
    )
    np.testing.assert_array_equal(one, other)
    flat, tall = (predict_flags(Case(slab=Slab(129, height, scheme="chain"))) for height in (1e-4, 1.0))
    assert flat == tall


def automaton(threshold: Vector, leaf: float, coupling: float, events: int, together: bool) -> list[tuple[int, Vector]]:
    """Olami, Feder and Christensen in one dimension, free ends: after each avalanche the slips in it, and all forces.

    All blocks are loaded alike until one reaches its threshold; a block that gives way hands its force on, and keeps none.
    """
    force, found = np.zeros(len(threshold)), []
    neighbours = [[j for j in (i - 1, i + 1) if 0 <= j < len(force)] for i in range(len(force))]
    share = [coupling / (leaf + coupling * len(each)) for each in neighbours]
    for _ in range(events):
        first = int(np.argmin(threshold - force))
        force += threshold[first] - force[first]
        slips, toppling = 0, [first]
        while toppling:
            drops = [(i, force[i]) for i in toppling]
            for i, drop in drops:
                force[i] -= drop
                for j in neighbours[i]:
                    force[j] += share[i] * drop
            slips += len(drops)
            over = np.where(force > threshold * (1 + 1e-12), force / threshold, 0.0)
            toppling = list(np.flatnonzero(over)) if together else [int(np.argmax(over))] * bool(over.any())
        found.append((slips, force.copy()))
    return found


@pytest.mark.parametrize("together", [True, False])
@pytest.mark.parametrize("coupling", [0.0, 1.0, 8.0])
def test_with_full_stress_drop_it_is_the_automaton(coupling: float, together: bool) -> None:
    """A punch on all blocks with constant, uniform pressures, thresholds drawn: the same avalanches, one by one."""
    chain = Chain(coupling_stiffness=coupling)
    order = "simultaneous" if together else "worst_first"
    case = Case(
        pin="flat_punch",
        half_width=0.5,
        slab=Slab(65, scheme=chain),
        slip_rule=SlipRule(slip_order=order, event_floor=1e-14),
        effects=Effects(pin_translation=False, coupling=False),
        heterogeneity=Heterogeneity(spread=0.3),
        max_events=400,
    )
    compliance = surface_compliance(case.slab)
    start = initial_contact(case, compliance)
    np.testing.assert_allclose(start.pressure, case.normal_load / (65 * case.slab.spacing), rtol=1e-12)
    leaf, k_c = spring_stiffness(chain, case.slab)
    expected = automaton(node_friction(case) * case.normal_load / 65, leaf, k_c, 400, together)
    record, _ = slide_to_state(case, compliance, start)
    slips, forces = zip(*expected, strict=True)
    np.testing.assert_array_equal(record.slips, slips)
    # Rounding of a few thousand slips, as a share of the load.
    total = np.array([force.sum() for force in forces])
    np.testing.assert_allclose(record.force_after, total, rtol=0.0, atol=1e-11 * case.normal_load)
    assert (coupling == 0.0) == (max(slips) == 1)
    _, end = slide_to_state(replace(case, max_events=250), compliance, start)
    np.testing.assert_allclose(end.nodal_force[0], forces[249], rtol=0.0, atol=1e-11 * case.normal_load)


@pytest.mark.parametrize("start", [0.0, 0.4])
def test_a_parabola_presses_springs_by_its_own_height(start: float) -> None:
    """p = k (approach - x²/2R) under the pin, W = 2 k a³/(3 R): to a spacing, which is what nodes know of an edge."""
    chain = Chain(foundation_stiffness=20.0)
    case = Case(radius=50.0, slab=Slab(257, scheme=chain), start=start)
    state = initial_contact(case, surface_compliance(case.slab))
    x = np.linspace(-0.5, 0.5, 257) - start * case.slab.spacing
    expected = np.maximum(20.0 * (state.approach - x**2 / (2.0 * case.radius)), 0.0)
    np.testing.assert_allclose(state.pressure, expected, atol=1e-12)
    a = winkler_half_width(case.normal_load, case.radius, 20.0)
    assert a == estimate_half_width(case)
    assert state.approach == pytest.approx(a**2 / (2.0 * case.radius), rel=1e-3)  # the sum over nodes for the integral
    assert 0.5 * case.slab.spacing * state.contact.sum() == pytest.approx(a, abs=case.slab.spacing)
    assert not state.shear.any()


def test_accuracy_tries_no_chain_in_place_of_a_slab() -> None:
    assert all(each.scheme.continuum for each in discretizations(Slab(), 33))
