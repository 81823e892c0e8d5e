"""Initial contact: constraints I-III and ΣN = W hold for every pin, load, friction, start and way of touching.

Below it the systems that find a contact set: a set's forces by a border around another set's factors, or by the tableau.
"""

import math
from dataclasses import replace
from functools import partial
from typing import get_args

import numpy as np
import pytest

from nanoslip.solver.case import Case, Effects, InitialContact, PinShape, SlipRule
from nanoslip.solver.contact import initial, normal
from nanoslip.solver.contact.compiled_contact import compile_contact
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.contact.normal import ContactSystem
from nanoslip.solver.contact.pin import surface_from_pin
from nanoslip.solver.contact.tableau import tableau
from nanoslip.solver.elasticity.compliance import SurfaceCompliance, surface_compliance, take_entries
from nanoslip.solver.outcome import SingularOperator, TooFarApart
from nanoslip.solver.slab import SCHEMES, Slab
from nanoslip.solver.sliding.slide import slide_to_state
from tests.physics import assert_contact_laws
from tests.rounding import blurred_compliance

SLAB = Slab(n_x=65)
N = SLAB.n_x
COMPLIANCE = surface_compliance(SLAB)
CASE = Case(slab=SLAB, radius=100.0)
FRICTIONLESS = replace(CASE, effects=Effects(friction=False))
UNCOUPLED = replace(CASE, effects=Effects(coupling=False))
WAYS = get_args(InitialContact)
U, W = slice(0, N), slice(N, 2 * N)


def lawful(case, compliance=COMPLIANCE):
    """Initial contact, which obeys all laws."""
    state = initial_contact(case, compliance)
    assert state.outcome.ok, state.outcome
    assert_contact_laws(state, case, compliance)
    return state


@pytest.mark.parametrize("pin", get_args(PinShape))
@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("scheme", SCHEMES)
def test_the_laws_of_contact_hold_between_nodes(scheme, way, pin):
    """At initial contact and 30 events on."""
    slab = Slab(33, scheme=scheme)
    case = Case(radius=20.0, half_width=0.17, slab=slab, pin=pin, initial_contact=way, start=0.37, max_events=30)
    compliance = surface_compliance(slab)
    record, end = slide_to_state(case, compliance, lawful(case, compliance))
    assert record.outcome.ok
    assert_contact_laws(end, case, compliance)


def test_the_pin_sees_every_node_further_left_the_further_right_it_starts():
    at_middle, between = surface_from_pin(CASE), surface_from_pin(replace(CASE, start=0.37))
    assert np.array_equal(at_middle, COMPLIANCE.x)
    # Rounding of positions up to 32 spacings. One spacing on, the pin stands over the next node.
    np.testing.assert_allclose(at_middle - between, 0.37 * SLAB.spacing, rtol=1e-13)
    assert np.array_equal(surface_from_pin(replace(CASE, start=1.0))[1:], at_middle[:-1])


@pytest.mark.parametrize(("start", "first"), [(0.0, 12), (0.4, 12), (0.6, 13), (1.0, 13)])
def test_a_punch_stands_over_the_nodes_under_it(start, first):
    """A node counts while the greater part of its width is covered: from 0.5 on the next one right does."""
    slab = Slab(33)
    punch = {"pin": "flat_punch", "half_width": 4 * slab.spacing, "initial_contact": "frictionless"}
    under = initial_contact(Case(slab=slab, start=start, **punch), surface_compliance(slab)).contact
    assert np.flatnonzero(under).tolist() == list(range(first, first + 9))


def test_the_paper_case_touches_with_70_to_75_of_129_nodes():
    assert 68 <= initial_contact(Case(), surface_compliance(Case().slab)).contact.sum() <= 76


def test_sticking_needs_slips_and_frictionless_touch_none():
    case = Case(slab=SLAB, intrinsic_friction=0.1)
    assert initial_contact(case, COMPLIANCE).slips > 0
    smooth = initial_contact(replace(case, initial_contact="frictionless"), COMPLIANCE)
    assert smooth.slips == 0
    assert np.abs(smooth.shear).max() <= 1e-11 * smooth.pressure.max()


@pytest.mark.parametrize("poisson", [-0.5, 0.0, 0.3])
@pytest.mark.parametrize("scheme", ["half_plane", "galerkin"])
def test_slips_that_decide_the_contact_stay_within_the_first_window(scheme, poisson, monkeypatch):
    """Where no stuck set is settled the contact ends tens of nodes from where it began; all of the surface costs n_x³."""
    case = Case(slab=Slab(257, scheme=scheme, poisson=poisson, aspect_ratio=4.0), radius=100.0)
    compliance, windows = surface_compliance(case.slab), []

    def seen(*given):
        windows.append((compiled := compile_contact(*given)).window)
        return compiled

    monkeypatch.setattr(initial, "compile_contact", seen)
    state = initial_contact(case, compliance)
    assert (state.outcome.ok, len(windows)) == (True, 1)
    assert len(windows[0]) < 257
    monkeypatch.setattr(initial, "estimate_half_width", lambda _: 1.0)
    everywhere = initial_contact(case, compliance)
    assert np.array_equal(everywhere.contact, state.contact)
    # A wider tableau is inverted with other rounding; slips multiply it, as they do an error of any kind.
    assert everywhere.pressure == pytest.approx(state.pressure, abs=1e-9 * np.nanmax(state.pressure))


def test_without_friction_every_way_leads_to_the_same_pressure():
    """μ_i = 0 leaves normal contact alone; slipped nodes sit where frictionless contact puts them."""
    stick, smooth = (
        initial_contact(Case(0.0, slab=SLAB, initial_contact=way), COMPLIANCE).pressure for way in WAYS[:2]
    )
    # Slips one at a time end within 1e-12 of the load per node of the common state.
    np.testing.assert_allclose(stick, smooth, atol=1e-7 * smooth.max())


def test_the_compliance_of_another_slab_is_refused():
    with pytest.raises(ValueError, match="another slab"):
        initial_contact(Case(slab=Slab(n_x=33)), COMPLIANCE)


@pytest.mark.everyday(4)
@pytest.mark.parametrize("mu", [1e3, 1e5, 1e6, 1e12])
@pytest.mark.parametrize("n", [17, 33])
def test_a_contact_that_grows_with_its_load_sticks_where_friction_is_without_bound(n, mu):
    """Whatever the last digits of its compliance: rounding of a pressure, times μ_i, is no slip."""
    case = Case(mu, slab=Slab(n), slip_rule=SlipRule(residual_shear=1.0), initial_contact="gradual")
    given = surface_compliance(case.slab)
    stuck = initial_contact(replace(case, intrinsic_friction=1e3), given)
    for seed in range(4):
        found = initial_contact(case, blurred_compliance(given, seed))
        assert found.outcome.ok
        assert found.approach == pytest.approx(stuck.approach, rel=1e-9)


@pytest.mark.parametrize(("n", "mu"), [(17, 0.1), (33, 0.1), (33, 0.3)])
def test_a_load_that_rises_on_a_symmetric_pin_ends_in_one_contact_whatever_the_last_digits(n, mu):
    """Mirror nodes touch and slip at the same load: the one further ahead comes first. An event waits for the smallest step of
    the load, 1e-9 of it, or not: what remains is some of these."""
    case = Case(mu, radius=200.0, slab=Slab(n), initial_contact="gradual")
    given = surface_compliance(case.slab)
    known = initial_contact(case, given)
    for seed in range(4):
        found = initial_contact(case, blurred_compliance(given, seed))
        assert found.slips == known.slips
        np.testing.assert_array_equal(found.contact, known.contact)
        assert np.abs(found.nodal_force - known.nodal_force).max() < 1e-7 * case.normal_load


def test_without_friction_the_contact_laws_hold_and_nothing_is_dragged():
    assert not lawful(FRICTIONLESS).nodal_force[0].any()


@pytest.mark.parametrize(
    ("case", "unread"),
    [(FRICTIONLESS, [(U, U), (W, U)]), (UNCOUPLED, [(U, U), (W, U), (U, W)])],
    ids=["without friction", "without coupling"],
)
def test_half_the_compliance_or_a_quarter_is_all_that_is_read(case, unread, monkeypatch):
    """The rest is no number, and no tableau is set up."""
    matrix = COMPLIANCE.matrix.copy()
    for block in unread:
        matrix[block] = np.nan
    monkeypatch.setattr(initial, "compile_contact", None)
    found = initial_contact(case, SurfaceCompliance(matrix, SLAB))
    np.testing.assert_array_equal(found.nodal_force, initial_contact(case, COMPLIANCE).nodal_force)
    assert found.u.any() == case.effects.coupling


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("residual_shear", [0.0, 1.0])
def test_without_coupling_every_first_touch_is_the_same(way, residual_shear):
    """The full solvers agree with the normal problem alone when they are given an uncoupled compliance."""
    zero, alone = COMPLIANCE.decouple(), initial_contact(UNCOUPLED, COMPLIANCE)
    whole = initial_contact(replace(CASE, initial_contact=way, slip_rule=SlipRule(residual_shear=residual_shear)), zero)
    assert_contact_laws(alone, UNCOUPLED, zero)
    # 1e-9: raised event by event, the load gathers the rounding of some hundred steps.
    np.testing.assert_allclose(alone.nodal_force, whole.nodal_force, atol=1e-9 * CASE.normal_load)


@pytest.mark.parametrize("radius", [3.0, 100.0, 500.0], ids=["narrow", "paper's", "wide"])
@pytest.mark.parametrize("case", [FRICTIONLESS, UNCOUPLED, CASE], ids=["free", "uncoupled", "stuck"])
def test_a_set_found_by_borders_of_others_is_the_set_found_by_systems_of_its_own(case, radius, monkeypatch):
    case = replace(case, radius=radius, intrinsic_friction=math.inf)
    alone = initial_contact(case, COMPLIANCE)
    monkeypatch.setattr(normal, "FEW_NODES", 0)
    monkeypatch.setattr(normal, "NEAR_SHARE", 1.0)
    bordered = initial_contact(case, COMPLIANCE)
    assert alone.outcome.ok
    np.testing.assert_array_equal(bordered.contact, alone.contact)
    # Pressures are solved for by the found set's own factors in either way; u is where Newton's method comes to rest.
    np.testing.assert_allclose(bordered.nodal_force, alone.nodal_force, atol=1e-12 * case.normal_load)


def test_held_frictionless_the_contact_is_that_without_friction_bit_by_bit(monkeypatch):
    """Nothing bears shear, so nothing slips, and no tableau is set up."""
    monkeypatch.setattr(initial, "compile_contact", None)
    held = initial_contact(replace(CASE, initial_contact="frictionless"), COMPLIANCE)
    free = initial_contact(FRICTIONLESS, COMPLIANCE)
    np.testing.assert_array_equal(held.nodal_force, free.nodal_force)
    np.testing.assert_array_equal(held.u, free.u)


@pytest.mark.parametrize("start", [0.0, 0.3])
def test_stuck_sets_that_were_looked_through_before_are_found_again_without_new_factors(start):
    case, own = replace(CASE, start=start), SurfaceCompliance(COMPLIANCE.matrix.copy(), SLAB)  # which may change
    normal._previous_system.cache_clear()
    found = [normal.normal_contact(case, compliance, stuck=True) for compliance in (COMPLIANCE, COMPLIANCE, own)]
    seen = normal._previous_system.cache_info()
    assert seen.misses == seen.hits > 0
    for again in found[1:]:
        np.testing.assert_array_equal(again.contact, found[0].contact)
        # Answers kept for all right sides have other last bits than factors; of a stuck contact the set alone is taken.
        np.testing.assert_allclose(again.normal_force, found[0].normal_force, atol=1e-12 * case.normal_load)
        assert again.approach == pytest.approx(found[0].approach, rel=1e-12)


FEW, LOAD = 33, 1e-3
BASE = np.abs(np.arange(FEW) - 16) <= 8


def test_a_singular_compliance_and_forces_that_overflow_are_named():
    slab = Slab(FEW)
    with pytest.raises(SingularOperator, match="17 nodes"):
        ContactSystem(SurfaceCompliance(np.zeros((2 * FEW, 2 * FEW)), slab), BASE, None, held=False)
    system = ContactSystem(surface_compliance(slab), BASE, None, held=False)
    with pytest.raises(TooFarApart, match="overflow"):
        system.forces(BASE, np.full(FEW, np.nan), LOAD)


TOUCHING = {"middle": [3, 4, 5], "with a gap": [1, 2, 6], "at both ends": [0, 8], "all": list(range(9))}


@pytest.mark.parametrize("scheme", ["galerkin", "biquadratic"], ids=["symmetric", "not symmetric"])
@pytest.mark.parametrize("nodes", TOUCHING.values(), ids=TOUCHING)
def test_the_tableau_exchanges_what_is_given_and_what_is_unknown_in_the_bordered_compliance(nodes, scheme):
    n, matrix = 9, surface_compliance(Slab(9, scheme=scheme)).matrix
    contact = np.isin(np.arange(n), nodes)
    bordered = np.zeros((2 * n + 1, 2 * n + 1))
    bordered[:-1, :-1] = matrix
    bordered[n:-1, -1] = bordered[-1, n:-1] = 1.0
    exchanged = np.concatenate((contact, contact, [True]))
    forces = np.random.default_rng(1).standard_normal(2 * n + 1)
    moved = bordered @ forces
    given, unknown = np.where(exchanged, moved, forces), np.where(exchanged, forces, moved)
    pivoted = np.zeros((2 * n + 1, 2 * n + 1))
    tableau(partial(take_entries, matrix), contact, pivoted)
    # The condition of these compliances is below 1e3.
    np.testing.assert_allclose(given @ pivoted, unknown, rtol=0, atol=1e-9 * np.abs(given).max())


def test_a_contact_that_is_set_up_again_is_the_same_whatever_was_done_to_the_first():
    """Its tableau is remembered, as slips and other cases begin with it, too; kernels change theirs in place."""
    contact, height = np.abs(np.arange(N) - 32) < 4, np.linspace(0.0, 1e-3, N)
    given = (contact, np.zeros(N), height, contact)
    first, alone = (compile_contact(CASE, each, *given).state for each in (COMPLIANCE, replace(COMPLIANCE)))
    before = first.tableau.copy()
    first.tableau[:] = np.nan
    for each in (alone, compile_contact(CASE, COMPLIANCE, *given).state):
        assert each.tableau.tobytes() == before.tobytes()
        assert each.response.tobytes() == first.response.tobytes()


def test_a_compliance_that_may_change_is_looked_at_each_time():
    slab, contact, zero = Slab(n_x=9), np.arange(9) == 4, np.zeros(9)
    changing = replace(surface_compliance(slab), matrix=surface_compliance(slab).matrix.copy())
    soft = compile_contact(Case(slab=slab), changing, contact, zero, zero, contact)
    changing.matrix[:] *= 0.5
    stiff = compile_contact(Case(slab=slab), changing, contact, zero, zero, contact)
    # Row and column of the node that is in contact hold its stiffness, less what the load asks for.
    np.testing.assert_allclose(stiff.state.tableau[4, 4], 2.0 * soft.state.tableau[4, 4], rtol=1e-12)
