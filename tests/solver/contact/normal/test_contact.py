"""Without friction or coupling the normal problem is all of initial contact: half the compliance, or a quarter, is never read."""

import math
from dataclasses import replace

import numpy as np
import pytest

from nanoslip.solver.case import Case, Effects, InitialContact, SlipRule
from nanoslip.solver.contact import initial, normal
from nanoslip.solver.contact import normal as system
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.elasticity.compliance import SurfaceCompliance, surface_compliance, uncoupled
from nanoslip.solver.slab import Slab
from tests.physics import assert_contact_laws

SLAB = Slab(n_x=65)
N = SLAB.n_x
COMPLIANCE = surface_compliance(SLAB)
CASE = Case(slab=SLAB, radius=100.0)
FRICTIONLESS = replace(CASE, effects=Effects(friction=False))
UNCOUPLED = replace(CASE, effects=Effects(coupling=False))


def spoilt(*blocks: tuple[slice, slice]) -> SurfaceCompliance:
    """The compliance with NaN in the blocks that nobody is to read."""
    matrix = COMPLIANCE.matrix.copy()
    for block in blocks:
        matrix[block] = np.nan
    return SurfaceCompliance(matrix, SLAB)


U, W = slice(0, N), slice(N, 2 * N)


def test_without_friction_the_contact_laws_hold_and_nothing_is_dragged() -> None:
    state = initial_contact(FRICTIONLESS, COMPLIANCE)
    assert state.outcome.ok
    assert_contact_laws(state, FRICTIONLESS, COMPLIANCE)
    assert not state.shear.any()
    assert state.friction_force == 0.0


def test_without_friction_the_tangential_half_of_the_compliance_is_not_read(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(initial, "compiled_contact", None)  # no tableau is set up
    found = initial_contact(FRICTIONLESS, spoilt((U, U), (W, U)))
    np.testing.assert_array_equal(found.nodal_force, initial_contact(FRICTIONLESS, COMPLIANCE).nodal_force)


def test_without_coupling_the_normal_block_is_all_that_is_read(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(initial, "compiled_contact", None)
    found = initial_contact(UNCOUPLED, spoilt((U, U), (W, U), (U, W)))
    np.testing.assert_array_equal(found.nodal_force, initial_contact(UNCOUPLED, COMPLIANCE).nodal_force)
    assert not found.u.any()


@pytest.mark.parametrize("way", ["stick", "frictionless", "gradual"])
@pytest.mark.parametrize("residual_shear", [0.0, 1.0])
def test_without_coupling_every_first_touch_is_the_same(way: InitialContact, residual_shear: float) -> None:
    """The full solvers agree with the normal problem alone when they are given an uncoupled compliance."""
    zero = uncoupled(COMPLIANCE)
    whole = initial_contact(replace(CASE, initial_contact=way, slip_rule=SlipRule(residual_shear=residual_shear)), zero)
    alone = initial_contact(UNCOUPLED, COMPLIANCE)
    assert_contact_laws(alone, UNCOUPLED, zero)
    # 1e-9: raised event by event, the load gathers the rounding of some hundred steps.
    np.testing.assert_allclose(alone.nodal_force, whole.nodal_force, atol=1e-9 * CASE.normal_load)


@pytest.mark.parametrize("radius", [3.0, 100.0, 500.0], ids=["narrow", "paper's", "wide"])
@pytest.mark.parametrize("case", [FRICTIONLESS, UNCOUPLED, CASE], ids=["free", "uncoupled", "stuck"])
def test_a_set_found_by_borders_of_others_is_the_set_found_by_systems_of_its_own(
    case: Case, radius: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    case = replace(case, radius=radius, intrinsic_friction=math.inf)
    alone = initial_contact(case, COMPLIANCE)
    monkeypatch.setattr(system, "FEW", 0)
    monkeypatch.setattr(normal, "FEW", 0)
    monkeypatch.setattr(system, "NEAR", 1.0)
    bordered = initial_contact(case, COMPLIANCE)
    assert alone.outcome.ok
    np.testing.assert_array_equal(bordered.contact, alone.contact)
    # Pressures are solved for by the found set's own factors in either way; u is where Newton's method comes to rest.
    np.testing.assert_allclose(bordered.nodal_force, alone.nodal_force, atol=1e-12 * case.normal_load)


def test_held_frictionless_the_contact_is_that_without_friction_bit_by_bit(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing bears shear, so nothing slips, and no tableau is set up."""
    monkeypatch.setattr(initial, "compiled_contact", None)
    held = initial_contact(replace(CASE, initial_contact="frictionless"), COMPLIANCE)
    free = initial_contact(FRICTIONLESS, COMPLIANCE)
    np.testing.assert_array_equal(held.nodal_force, free.nodal_force)
    np.testing.assert_array_equal(held.u, free.u)


@pytest.mark.parametrize("start", [0.0, 0.3])
def test_stuck_sets_that_were_looked_through_before_are_found_again_without_new_factors(start: float) -> None:
    case = replace(CASE, slab=SLAB, start=start)
    kept, own = COMPLIANCE, SurfaceCompliance(COMPLIANCE.matrix.copy(), SLAB)  # nothing is kept of one that may change
    normal._system_before.cache_clear()
    found = [normal.normal_contact(case, compliance, stuck=True) for compliance in (kept, kept, own)]
    seen = normal._system_before.cache_info()
    assert seen.misses == seen.hits > 0
    for again in found[1:]:
        np.testing.assert_array_equal(again.contact, found[0].contact)
        # Answers kept for all right sides have other last bits than factors; of a stuck contact the set alone is taken.
        np.testing.assert_allclose(again.normal_force, found[0].normal_force, atol=1e-12 * case.normal_load)
        assert again.approach == pytest.approx(found[0].approach, rel=1e-12)
