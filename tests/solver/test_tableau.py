"""The tableau of a ball's contact: made from that of a disc of nodes, and changed by exchanges that rows follow later."""

import math
from dataclasses import replace

import numpy as np
import pytest

from nanoslip.solver.case import Case
from nanoslip.solver.contact import compiled_contact, normal, tableau
from nanoslip.solver.contact.disc import wider
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.contact.kernels.events import pivot
from nanoslip.solver.contact.kernels.pivots import EXCHANGE_SIZE
from nanoslip.solver.contact.kernels.state import RESIDUAL_LIMIT, equilibrium_residual, follow_all, respond
from nanoslip.solver.elasticity.compliance import FEW_NODES, surface_compliance
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.full_contact import compile_state
from nanoslip.solver.sliding.slide import slide, slide_to_state

SLAB = Slab(17, poisson=0.3, scheme="half_space")
CASE = Case(slab=SLAB, radius=20.0, normal_load=3e-3, start=0.37, start_y=0.21, max_events=1500)
COMPLIANCE = surface_compliance(SLAB)
ROUNDING = 1e-11
"""Over the largest entry of a tableau: the condition of these compliances is below 1e3, and some dozens of exchanges add up."""


def inverted(compliance, window, contact):
    """The tableau by the inverse of the contact's own compliance, without padding."""
    found = np.zeros((2 * len(window) + 1, 2 * len(window) + 1))
    tableau.tableau(tableau.window_entries(compliance, window), contact, found)
    return found


def assert_same(found, right):
    np.testing.assert_allclose(found[:, : len(right)], right, rtol=0, atol=ROUNDING * np.abs(right).max())
    assert not found[:, len(right) :].any()


@pytest.mark.parametrize("scheme", ["half_space", "layer"])
@pytest.mark.parametrize("coupled", [True, False])
def test_a_contact_set_up_from_a_disc_has_the_tableau_of_its_own_inverse(scheme, coupled):
    """The disc of the expected size, and a smaller one if the contact is; anywhere on the plane."""
    slab = replace(SLAB, scheme=scheme)
    compliance = surface_compliance(slab)
    compliance = compliance if coupled else compliance.decouple()
    random = np.random.default_rng(1)
    for nodes, moved in ((30.0, (0, 0)), (45.0, (-1, 2)), (20.0, (3, -3))):
        disc = np.roll(tableau.node_disc(slab.n_x, nodes), moved, (0, 1))
        rim = np.flatnonzero(wider(disc).ravel() & ~disc.ravel())
        touching = disc.ravel().copy()
        touching[random.choice(rim, 2, replace=False)] = True
        window = np.flatnonzero(wider(touching.reshape(disc.shape), 2))
        found = tableau.tableau_from_base(compliance, window, touching[window], 30.0)
        assert_same(found, inverted(compliance, window, touching[window]))


def test_what_is_not_nearly_a_disc_is_inverted_by_itself():
    """Spots of a rough pin, one at the plane's rim where a part of its disc is missing."""
    for columns, rows in (((2, 3, 13, 14), (2, 3, 13, 14)), ((0, 1), (0, 1, 2, 3))):
        contact = np.zeros((17, 17), np.bool_)
        contact[np.ix_(columns, rows)] = True
        window = np.flatnonzero(wider(contact, 2))
        touching = contact.ravel()[window]
        assert tableau.tableau_from_base(COMPLIANCE, window, touching, float(contact.sum())) is None
        half = tableau.zero_lines(2 * len(window) + 1)
        tableau.tableau(tableau.window_entries(COMPLIANCE, window), touching, half, reciprocal=True)
        assert_same(half, inverted(COMPLIANCE, window, touching))


def test_a_base_holds_a_quarter_of_the_disc_and_every_entry_of_it(monkeypatch):
    """As a disc is its own image along x and along y, whose nodes on an axis are their own."""
    bases, find = [], tableau.find_base
    monkeypatch.setattr(tableau, "find_base", lambda *given: bases.append(find(*given)) or bases[-1])
    disc = tableau.node_disc(SLAB.n_x, 30.0)
    window = np.flatnonzero(wider(disc, tableau.BASE_RINGS))
    found = tableau.tableau_from_base(COMPLIANCE, window, disc.ravel()[window], 30.0)
    assert_same(found, inverted(COMPLIANCE, window, disc.ravel()[window]))
    (base,) = bases
    across = np.ptp(window // SLAB.n_x) + 1
    assert base.rows.size <= 4 * (len(found) / 4 + across + 2) ** 2  # nodes on the axes are in two quarters


@pytest.mark.parametrize("nodes", [1.0, 5.0, 9.0])
def test_a_disc_of_one_node_or_few_is_no_special_case(nodes):
    """With a single node two of the four parts have no entry in contact, with a few nodes some parts have few."""
    disc = tableau.node_disc(SLAB.n_x, nodes)
    window = np.flatnonzero(wider(disc, 2))
    found = tableau.tableau_from_base(COMPLIANCE, window, disc.ravel()[window], nodes)
    assert_same(found, inverted(COMPLIANCE, window, disc.ravel()[window]))
    half_width = math.sqrt(nodes / math.pi) * SLAB.spacing
    case = Case(slab=SLAB, pin="flat_punch", half_width=half_width, normal_load=3e-3)
    pressed = normal.normal_contact(case, COMPLIANCE, stuck=True)
    assert pressed.contact.sum() == disc.sum()
    assert pressed.normal_force.sum() == pytest.approx(case.normal_load, rel=1e-12)


@pytest.mark.parametrize(("poisson", "scheme"), [(0.0, "half_space"), (0.3, "half_space"), (0.49, "layer")])
def test_a_stuck_contact_is_the_same_by_the_parts_of_a_disc_and_as_a_whole(monkeypatch, poisson, scheme):
    """A pin between nodes presses on no disc of nodes: the nodes that differ are exchanged."""
    slab = Slab(33, poisson=poisson, scheme=scheme)
    compliance = surface_compliance(slab)
    for start, start_y, load in ((0.0, 0.0, 3e-4), (0.37, 0.21, 3e-4), (0.63, 0.8, 2e-4)):
        case = Case(slab=slab, radius=200.0, normal_load=load, start=start, start_y=start_y)
        in_parts = normal.normal_contact(case, compliance, stuck=True)
        with monkeypatch.context() as whole:
            whole.setattr(normal, "nearest_disc", lambda *_: None)
            right = normal.normal_contact(case, compliance, stuck=True)
        assert in_parts.contact.sum() > FEW_NODES
        assert in_parts.converged == right.converged
        assert np.array_equal(in_parts.contact, right.contact)
        # Forces to the rounding error of a solution, which the condition number multiplies.
        assert in_parts.normal_force == pytest.approx(right.normal_force, abs=1e-11 * load)


def test_a_record_has_the_same_bits_whatever_the_process_has_set_up_before():
    """The base is shared, so it follows from the case alone: not from other loads, nor from where this record has been."""
    fresh = slide(CASE, COMPLIANCE)
    assert fresh.outcome.ok
    assert fresh.touches.sum() + fresh.releases.sum() > EXCHANGE_SIZE
    for before in (replace(CASE, normal_load=2e-3), replace(CASE, start=0.9), CASE):
        slide(replace(before, max_events=200), COMPLIANCE)
        again = slide(CASE, COMPLIANCE)
        assert again.force_after.tobytes() == fresh.force_after.tobytes()
        assert again.node.tobytes() == fresh.node.tobytes()


def test_a_base_is_shared_by_windows_members_and_cases_and_only_the_last_is_kept(monkeypatch):
    """One disc for three records of several windows; another load asks for another disc, and to return for the first again."""
    bases, quarter = [], tableau.quarter
    monkeypatch.setattr(tableau, "quarter", lambda *given: bases.append(given) or quarter(*given))
    light = replace(CASE, normal_load=2e-3)
    counts = []
    for case in (light, CASE, replace(CASE, start=0.9), replace(CASE, intrinsic_friction=0.3), light, CASE):
        slide(replace(case, max_events=300), COMPLIANCE)
        counts.append(len(bases))
    first, base, member, axis, again, back = counts
    assert base == member == axis == first + 1
    assert back > again > axis


def test_events_follow_the_same_nodes_with_a_base_and_without(monkeypatch):
    """Means to 1e-9: rounding of a base differs from that of an inverse, and slips multiply it."""
    from_base = slide(CASE, COMPLIANCE)
    monkeypatch.setattr(compiled_contact, "tableau_from_base", lambda *_: None)
    alone = slide(CASE, COMPLIANCE)
    assert np.array_equal(from_base.node, alone.node)
    assert from_base.force_after.mean() == pytest.approx(alone.force_after.mean(), rel=1e-9)
    assert from_base.force_after == pytest.approx(alone.force_after, abs=1e-6 * alone.force_after.max())


# Rows that follow pivots later, several in one pass.


@pytest.fixture
def state():
    """A ball in contact, whose rows have followed everything."""
    touched = initial_contact(CASE, COMPLIANCE)
    return compile_state(CASE, COMPLIANCE, touched, whole=False).state


@pytest.mark.parametrize("repeats", [1, 3])
@pytest.mark.parametrize("order", ["nested", "crossing", "random", "many"])
def test_rows_that_follow_late_are_those_of_the_inverse(state, order, repeats):
    """Pairs that cancel one in the other, pairs that cross, any order, and more nodes than there is room for."""
    contact, free = np.flatnonzero(state.contact), np.flatnonzero(~state.contact)
    a, b, c, d = (int(node) for node in (contact[0], contact[-1], free[0], free[-1]))
    orders = {
        "nested": [a, b, c, c, b, d, d, a, c],
        "crossing": [a, b, a, c, b, a, c, d],
        "random": np.random.default_rng(2).choice([a, b, c, d, int(contact[5])], 3 * EXCHANGE_SIZE).tolist(),
        "many": [*free.tolist(), *contact[::2].tolist()],
    }
    assert len(orders["many"]) > EXCHANGE_SIZE
    window = window_of(state)
    for step, node in enumerate(orders[order] * repeats):
        assert pivot(state, node)
        if step % 3 == 1:  # some rows follow early, others late
            respond(state)
    follow_all(state)
    assert_same(state.tableau, inverted(COMPLIANCE, window, state.contact))


def test_nodes_that_are_back_on_their_side_leave_all_other_rows_as_they_were(state):
    """To the last bit and in any order, as a row lacks the nodes alone that have changed sides an odd number of times."""
    follow_all(state)
    a, b, *others = range(len(state.x))
    before = state.tableau.copy()
    for node in (a, b, a, a, b, a):
        assert pivot(state, node)
    follow_all(state)
    rows = [*others, *(len(state.x) + node for node in others), -1]
    assert np.array_equal(state.tableau[rows], before[rows])


def window_of(state):
    """Numbers of the window's nodes on the plane."""
    return state.plane.columns * SLAB.n_x + state.plane.rows


def test_thousands_of_exchanges_leave_the_residual_at_rounding(state):
    """No inverse is ever computed anew on account of them."""
    random, nodes = np.random.default_rng(3), np.arange(len(state.x))
    load = -state.inputs[-1]
    for node in random.choice(nodes, 3000):
        if state.contact.sum() > 10 or not state.contact[node]:
            assert pivot(state, int(node))
    state.inputs[:-1] = np.where(np.concatenate((state.contact, state.contact)), 1e-3 * load, 0.0)
    respond(state)
    assert equilibrium_residual(state) < 0.01 * RESIDUAL_LIMIT


def test_a_pin_that_slides_on_has_a_ring_less_behind_it():
    touched = initial_contact(CASE, COMPLIANCE)
    ahead = compile_state(CASE, COMPLIANCE, touched, whole=False)
    window = np.zeros(SLAB.nodes, np.bool_)
    window[ahead.window] = True
    columns = np.flatnonzero(window.reshape(17, 17).any(axis=1))
    touching = np.flatnonzero(touched.contact.reshape(17, 17).any(axis=1))
    assert columns[-1] - touching[-1] == touching[0] - columns[0] + 1
    record, end = slide_to_state(CASE, COMPLIANCE, touched)
    assert record.outcome.ok
    assert end.gap.min() > -1e-12
