"""Classical Coulomb friction (residual_shear 1): the contact laws at every event, Amontons' law in the end, a balanced energy."""

import math
from dataclasses import replace

import numpy as np
import pytest

from nanoslip.solver.case import Case, InitialContact, SlipRule
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.elasticity.compliance import SurfaceCompliance, surface_compliance
from nanoslip.solver.outcome import Ending, InvalidInput
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding import slide as coulomb
from nanoslip.solver.sliding.plateau import plateau_of
from nanoslip.solver.sliding.slide import slide, slide_to_state
from tests.physics import assert_contact_laws, coupled_half_plane, half_plane, stored_energy

SLAB = Slab(n_x=33)
COMPLIANCE = surface_compliance(SLAB)
CASE = Case(slab=SLAB, slip_rule=SlipRule(residual_shear=1.0), max_events=None, max_displacement=4e-3)


@pytest.mark.parametrize("way", ["stick", "frictionless", "gradual"])
@pytest.mark.parametrize("friction", [0.0, 0.1, 0.5, 1.0])
def test_the_contact_laws_hold_after_every_event(friction: float, way: InitialContact) -> None:
    case = replace(CASE, intrinsic_friction=friction, initial_contact=way, max_events=1)
    state = initial_contact(case, COMPLIANCE)
    assert state.outcome.ok
    assert_contact_laws(state, case, COMPLIANCE)
    while state.displacement < 4e-3:
        record, state = slide_to_state(case, COMPLIANCE, state)
        assert record.outcome.ok
        assert_contact_laws(state, case, COMPLIANCE)


@pytest.mark.parametrize("friction", [0.25, 0.5, 1.0])
def test_the_friction_force_ends_at_the_intrinsic_friction(friction: float) -> None:
    record, state = slide_to_state(replace(CASE, intrinsic_friction=friction), COMPLIANCE)
    assert record.final_force == pytest.approx(friction * record.normal_load, rel=1e-12)
    # On the way there the force only rises: nothing drops, and a step meets its event to rounding.
    assert np.all(np.diff(record.force_before) >= -1e-9 * record.normal_load)
    np.testing.assert_allclose(record.force_after, record.force_before, atol=1e-9 * record.normal_load)
    assert np.all(np.abs(state.slip[state.contact]) > 0.0)


def test_it_is_the_limit_of_small_slips() -> None:
    """With a residual of 1 - ε the shears of slipping nodes lie ε below their limits at most, so does the force."""
    whole = slide(CASE, COMPLIANCE)
    for residual_shear, share in ((0.9, 0.1), (0.99, 0.01)):
        rule = SlipRule(residual_shear=residual_shear)
        slipping = slide(replace(CASE, slip_rule=rule, max_displacement=1.5e-3), COMPLIANCE)
        force = np.interp(slipping.displacement, whole.displacement, whole.force_after)
        lag = (force - slipping.force_before) / force
        assert lag.min() > -0.02
        assert lag.max() < share + 0.02  # the record of few events is interpolated


def test_a_long_slide_has_a_plateau_at_the_intrinsic_friction() -> None:
    """The pin walks over the slab: nodes are released behind it and touched in front, F/W stays μ_i."""
    slab = Slab(n_x=65)
    case = replace(CASE, slab=slab, radius=20.0, intrinsic_friction=0.2, max_displacement=0.25)
    record = slide(case, surface_compliance(slab))
    assert record.outcome.ok, record.outcome
    assert record.releases.sum() > 5
    assert record.touches.sum() > 5
    plateau = plateau_of(record)
    assert plateau.outcome.ok
    assert plateau.mean == pytest.approx(0.2, rel=1e-3)


def test_single_nodes_hand_the_load_over() -> None:
    """A pin so sharp that one or two nodes carry it walks from node to node at F/W = μ_i."""
    record = slide(replace(CASE, radius=5.0, normal_load=1e-4, max_displacement=0.3), COMPLIANCE)
    assert record.outcome.ok
    assert record.contact_size.max() <= 3
    late = record.displacement > 0.05
    np.testing.assert_allclose(record.force_after[late], 0.5 * record.normal_load, rtol=1e-9)


def test_friction_too_large_for_any_motion_is_an_outcome() -> None:
    record = slide(replace(CASE, intrinsic_friction=10.0, max_displacement=0.3), COMPLIANCE)
    assert record.outcome.ending is Ending.SLIP_UNBOUNDED
    assert "friction law" in record.outcome.message
    assert np.isfinite(record.force_after).all()


@pytest.mark.parametrize("operator", [half_plane, coupled_half_plane])
def test_the_work_of_pin_and_load_is_stored_or_dissipated(operator: object) -> None:
    slab = replace(SLAB, poisson=0.2)
    compliance: SurfaceCompliance = operator(slab)  # type: ignore[operator]
    case = replace(CASE, slab=slab, max_displacement=1e-3)
    start = initial_contact(case, compliance)
    record, end = slide_to_state(case, compliance, start)
    edges = np.concatenate(([0.0], record.displacement, [record.final_displacement]))
    force = np.concatenate(([record.initial_force], record.force_before, [record.final_force]))
    pin_work = float(((force[1:] + force[:-1]) / 2) @ np.diff(edges))
    balance = pin_work + case.normal_load * (end.approach - start.approach) - stored_energy(end) + stored_energy(start)
    # Forces are straight between events up to the pin's curvature; what slid after the last event is not in the record.
    last = record.force_before[-1] * (record.final_displacement - record.displacement[-1])
    lost = float(record.dissipated.sum())
    assert lost <= balance * (1 + 1e-3)
    assert balance <= lost + last + 1e-3 * pin_work
    assert record.dissipated.min() >= -1e-9 * pin_work


def test_infinite_friction_cannot_slide_and_is_refused() -> None:
    with pytest.raises(InvalidInput, match="needs a finite"):
        replace(CASE, intrinsic_friction=math.inf)


def test_a_pin_that_slides_on_and_on_leaves_the_slab(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(coulomb, "OFF_THE_SLAB", 5e-3)
    record = slide(replace(CASE, max_displacement=None, max_events=10**6), COMPLIANCE)
    assert record.outcome.ending is Ending.CONTACT_LOST
    assert record.final_displacement == record.displacement[-1]
