"""A pin that slides on over a surface without ends: the grid follows, and nothing shows that it has ends."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from nanoslip.solver.case import Case, Heterogeneity, SlipRule
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.contact.pin import node_friction
from nanoslip.solver.contact.state import ContactState
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.outcome import Ending
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.full_contact import RESUMABLE
from nanoslip.solver.sliding.record import FrictionRecord
from nanoslip.solver.sliding.slide import find_states, slide_to_state
from nanoslip.solver.sliding.validity import Flag, predict_flags, record_flags
from tests.mirror import mirrored
from tests.physics import assert_contact_laws, assert_friction_law

PROFILE = np.column_stack((np.linspace(-2.0, 2.0, 800), 4e-5 * np.sin(np.linspace(0.0, 400.0, 800) ** 1.2)))
SOFT = Case(slab=Slab(65, 0.5, 0.49, scheme="strip"), radius=60.0, max_events=10**6, max_spacings=20.0)
COULOMB = SlipRule(residual_shear=1.0)
SCENES = {
    "smooth": replace(SOFT, max_spacings=45.0),  # its grid follows twice
    "half-plane": replace(SOFT, slab=Slab(65, 2.0, 0.3, scheme="half_plane")),
    "rough": replace(SOFT, heterogeneity=Heterogeneity(roughness=tuple(map(tuple, PROFILE.tolist())))),
    "classical": replace(SOFT, slip_rule=COULOMB),
    "pressures without shear": replace(SOFT, effects=replace(SOFT.effects, coupling=False)),
}


@cache
def slid(case: Case) -> tuple[FrictionRecord, ContactState]:
    return slide_to_state(case, surface_compliance(case.slab))


def twice_as_wide(case: Case) -> Case:
    """The same in units of an L_x twice as long: more surface on either side, node by node the same."""
    slab = replace(case.slab, n_x=2 * case.slab.n_x - 1, aspect_ratio=case.slab.aspect_ratio / 2)
    rough = tuple((xi / 2, height / 2) for xi, height in case.heterogeneity.roughness)
    more = {"radius": case.radius / 2, "normal_load": case.normal_load / 2}
    return replace(case, slab=slab, heterogeneity=replace(case.heterogeneity, roughness=rough), **more)


@pytest.mark.everyday(1)
@pytest.mark.parametrize("name", SCENES)
def test_a_grid_that_follows_gives_the_record_of_one_that_reaches_all_the_way(name: str) -> None:
    """Units of powers of two change no digit: the records are equal bit for bit where their windows are."""
    case = SCENES[name]
    (near, end), (far, _) = slid(case), slid(twice_as_wide(case))
    assert near.outcome.ok
    assert end.first_node > 0
    apart = 1e-9 * case.slab.spacing
    np.testing.assert_allclose(near.displacement, 2.0 * far.displacement, rtol=0.0, atol=apart)
    np.testing.assert_allclose(near.force_after, 2.0 * far.force_after, rtol=0.0, atol=1e-9 * case.normal_load)
    np.testing.assert_array_equal(near.node, far.node - case.slab.n_x // 2)


@pytest.mark.parametrize("name", SCENES)
def test_laws_hold_behind_the_grids_first_place(name: str) -> None:
    case = SCENES[name]
    compliance = surface_compliance(case.slab)
    start = initial_contact(case, compliance)
    record, end = slid(case)
    assert_friction_law(case, record, compliance)
    if case.slip_rule.residual_shear < 1.0:
        assert_contact_laws(end, case, compliance if case.effects.coupling else compliance.decouple())
    flags = record_flags(case, start, record, end)
    assert flags == predict_flags(case, record.final_displacement)
    assert set(flags) <= {Flag.unresolved_roughness}  # a profile has more knots than nodes
    assert record.node_slips.sum() == record.slips.sum() > 0
    assert len(record.node_x) == len(record.node_slips) >= case.slab.n_x + end.first_node > case.slab.n_x
    np.testing.assert_allclose(np.diff(record.node_x), case.slab.spacing, rtol=1e-12)
    assert end.x[end.contact].mean() == pytest.approx(end.displacement, abs=4 * case.slab.spacing)


@pytest.mark.slow
def test_a_hundred_spacings_take_the_memory_of_one() -> None:
    """What the pin has left is forgotten: the contact at the end is held by as many numbers as at the start."""
    case = replace(SOFT, max_spacings=100.0)
    record, end = slid(case)
    assert record.outcome.ok
    assert record.final_displacement == 100.0 * case.slab.spacing
    assert end.u.shape == (65,)
    assert end.first_node > 80


def test_a_record_goes_on_from_its_own_state_wherever_it_is() -> None:
    case = replace(SOFT, max_spacings=60.0)
    whole, _ = slid(case)
    assert len(whole.displacement) > 3 * RESUMABLE
    state, compliance = initial_contact(case, surface_compliance(case.slab)), surface_compliance(case.slab)
    for piece in range(3):
        record, state = slide_to_state(replace(case, max_events=RESUMABLE), compliance, state)
        there = slice(piece * RESUMABLE, (piece + 1) * RESUMABLE)
        np.testing.assert_array_equal(record.force_after, whole.force_after[there])
        np.testing.assert_array_equal(record.node, whole.node[there])
    last = len(whole.displacement)
    (seen,), outcome = find_states(replace(case, max_events=None), compliance, [last])
    assert outcome.ok
    assert seen.first_node > 0
    assert seen.friction_force == pytest.approx(float(whole.force_after[-1]), rel=1e-9)


def test_a_grid_that_comes_on_draws_on_its_friction() -> None:
    """Nodes keep their μ_i whichever grid they are in, on either side of the first."""
    case = replace(SOFT, heterogeneity=Heterogeneity("lognormal", 0.3, seed=5))
    np.testing.assert_array_equal(node_friction(case, 7)[:-7], node_friction(case)[7:])
    np.testing.assert_array_equal(node_friction(case, -7)[7:], node_friction(case)[:-7])
    assert slid(case)[0].outcome.ok


@pytest.mark.slow
def test_a_pin_turns_back_from_far_off() -> None:
    """Without friction nothing remembers the way: back over the middle it stands there as it came down."""
    case = replace(SOFT, intrinsic_friction=0.0, slip_rule=COULOMB)
    compliance = surface_compliance(case.slab)
    start = initial_contact(case, compliance)
    _, end = slide_to_state(case, compliance, start)
    turned = mirrored(end)
    assert turned.first_node == -end.first_node < 0
    assert not turned.pressure.flags.writeable  # as of any state, which others share
    _, home = slide_to_state(replace(case, max_spacings=None, max_displacement=1e-300), compliance, turned)
    assert home.outcome.ok
    ours, first = (np.flatnonzero(state.contact) + state.first_node for state in (home, start))
    np.testing.assert_array_equal(ours, first)
    np.testing.assert_allclose(
        home.pressure[home.contact], start.pressure[start.contact], atol=1e-9 * start.pressure.max()
    )


def test_a_contact_as_wide_as_the_grid_is_outgrown() -> None:
    case = replace(SOFT, slab=Slab(33, 1.0, 0.3, scheme="strip"), normal_load=5e-3, radius=200.0, max_events=200)
    compliance = surface_compliance(case.slab)
    start = initial_contact(case, compliance)
    record, end = slide_to_state(case, compliance, start)
    assert record.outcome.ending is Ending.COMPLETED
    assert {"outgrown", "whole_slab"} & {flag.name for flag in record_flags(case, start, record, end)}
