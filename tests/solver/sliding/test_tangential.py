"""With constant pressures a slip is one row of the tangential tableau; the law of friction and equilibrium along x hold."""

from dataclasses import replace

import numpy as np
import pytest

from nanoslip.solver.case import Case, Effects, Heterogeneity, SlipOrder, SlipRule
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.contact.pin import node_friction
from nanoslip.solver.elasticity.compliance import SurfaceCompliance, surface_compliance
from nanoslip.solver.outcome import Ending, InvalidInput
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding import slide as columns
from nanoslip.solver.sliding import slide as events
from nanoslip.solver.sliding import slide as full_contact
from nanoslip.solver.sliding.kernels.slide import Events
from nanoslip.solver.sliding.slide import slide, slide_to_state

SLAB = Slab(n_x=65)
N = SLAB.n_x
COMPLIANCE = surface_compliance(SLAB)
CONSTANT_PRESSURES = Case(slab=SLAB, radius=100.0, max_events=300, effects=Effects(pin_translation=False))
GOODMAN = replace(CONSTANT_PRESSURES, effects=Effects(pin_translation=False, coupling=False))


@pytest.mark.parametrize("case", [CONSTANT_PRESSURES, GOODMAN], ids=["coupled initial contact", "Goodman"])
@pytest.mark.parametrize("slip_order", ["worst_first", "simultaneous"])
def test_friction_and_equilibrium_hold_where_the_record_ends(case: Case, slip_order: SlipOrder) -> None:
    case = replace(
        case, slip_rule=SlipRule(slip_order=slip_order, residual_shear=0.3), heterogeneity=Heterogeneity(spread=0.2)
    )
    start = initial_contact(case, COMPLIANCE)
    record, end = slide_to_state(case, COMPLIANCE, start)
    assert record.outcome.ok
    np.testing.assert_array_equal(end.pressure, start.pressure)
    normal, shear = -end.nodal_force[1], np.abs(end.nodal_force[0])
    assert np.all(shear <= node_friction(case) * normal + 1e-11 * case.normal_load)
    along = COMPLIANCE.matrix[:N, :N] @ end.nodal_force[0]
    if case.effects.coupling:
        along += COMPLIANCE.matrix[:N, N:] @ end.nodal_force[1]
    np.testing.assert_allclose(end.u, along, atol=1e-10 * case.normal_load)
    assert end.friction_force == pytest.approx(record.final_force, abs=1e-11 * case.normal_load)


@pytest.mark.parametrize("case", [CONSTANT_PRESSURES, GOODMAN], ids=["coupled initial contact", "Goodman"])
def test_every_event_is_a_slip_and_loses_energy(case: Case) -> None:
    record = slide(case, COMPLIANCE)
    assert len(record.displacement) == 300
    assert not record.kind.any()
    assert not record.releases.any()
    assert not record.touches.any()
    assert record.dissipated.min() > 0.0
    np.testing.assert_allclose(record.stiffness, record.initial_stiffness, rtol=1e-14)  # the same sum in two orders


def test_after_first_touch_only_the_tangential_block_is_read(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without coupling either; no tableau of normal and tangential entries is set up."""
    start = initial_contact(GOODMAN, COMPLIANCE)
    matrix = np.full_like(COMPLIANCE.matrix, np.nan)
    matrix[:N, :N] = COMPLIANCE.matrix[:N, :N]
    whole = slide(GOODMAN, COMPLIANCE, start)
    monkeypatch.setattr(events, "initial_contact", None)
    for builder in ("compiled_contact", "uncoupled"):
        monkeypatch.setattr(full_contact, builder, None)
    alone = slide(GOODMAN, SurfaceCompliance(matrix, SLAB), start)
    for name in ("displacement", "force_after", "node", "slips", "dissipated"):
        np.testing.assert_array_equal(getattr(alone, name), getattr(whole, name))


def test_a_record_continues_from_the_state_it_ended_in() -> None:
    """150 + 150 events are 300; rounding of the fresh sums between (1e-9 of the load over 20 thousand slips)."""
    half = replace(GOODMAN, max_events=150)
    first, state = slide_to_state(half, COMPLIANCE)
    second = slide(half, COMPLIANCE, state)
    whole = slide(GOODMAN, COMPLIANCE)
    np.testing.assert_array_equal(np.concatenate((first.node, second.node)), whole.node)
    np.testing.assert_allclose(second.force_after, whole.force_after[150:], atol=1e-9 * GOODMAN.normal_load)


def test_a_displacement_limit_ends_a_record() -> None:
    record = slide(replace(GOODMAN, max_events=None, max_displacement=1e-3), COMPLIANCE)
    assert record.final_displacement == 1e-3
    assert record.displacement[-1] < 1e-3
    many = replace(GOODMAN, max_events=None, max_displacement=0.04)
    assert len(slide(many, COMPLIANCE).displacement) > columns.FIRST_CAPACITY


def test_adhesive_stick_has_no_event() -> None:
    stuck = slide(replace(GOODMAN, intrinsic_friction=np.inf), COMPLIANCE)
    assert stuck.outcome.ending is Ending.NO_EVENT
    pulled = replace(GOODMAN, intrinsic_friction=np.inf, max_events=None, max_displacement=1e-3)
    assert slide(pulled, COMPLIANCE).final_force == pytest.approx(1e-3 * stuck.initial_stiffness, rel=1e-12)


def test_a_cascade_can_be_given_up() -> None:
    case = replace(CONSTANT_PRESSURES, slip_rule=SlipRule(cascade_limit=3))
    assert slide(case, COMPLIANCE).outcome.ending is Ending.CASCADE_LIMIT


def test_what_means_nothing_is_refused() -> None:
    with pytest.raises(InvalidInput, match=r"residual_shear = 1\.0 with pin_translation = false"):
        replace(CONSTANT_PRESSURES, slip_rule=SlipRule(residual_shear=1.0))
    with pytest.raises(InvalidInput, match="friction = false: needs the stage contact alone"):
        slide(replace(CONSTANT_PRESSURES, effects=Effects(friction=False)), COMPLIANCE)


def test_a_record_takes_no_more_room_than_its_events_need(monkeypatch: pytest.MonkeyPatch) -> None:
    """Not for all that it may hold: a limit of 1e9 events beside a displacement is 70 GB. The events are the same ones."""
    whole, room, empty = slide(CONSTANT_PRESSURES, COMPLIANCE), [], columns.empty_events

    def noted(capacity: int) -> Events:
        room.append(capacity)
        assert capacity <= 1024
        return empty(capacity)

    monkeypatch.setattr(columns, "empty_events", noted)
    monkeypatch.setattr(columns, "FIRST_CAPACITY", 8)
    far = float(whole.displacement[-1])
    for limited in (
        CONSTANT_PRESSURES,
        replace(CONSTANT_PRESSURES, max_events=10**9, max_displacement=far * (1.0 + 1e-12)),
    ):
        record = slide(limited, COMPLIANCE)
        for name in ("displacement", "force_before", "force_after", "node", "slips", "dissipated"):
            np.testing.assert_array_equal(getattr(record, name), getattr(whole, name))
    assert room == 2 * [8, 16, 32, 64, 128, 256, 512]


def test_a_pin_that_is_not_carried_along_is_as_steep_as_at_first_touch() -> None:
    """A parabola dragged three quarters of a slab to the side would stand on a flank of 50° there."""
    case = replace(
        CONSTANT_PRESSURES,
        radius=0.5,
        normal_load=1e-4,
        intrinsic_friction=10.0,
        max_events=None,
        max_displacement=0.75,
    )
    assert slide(case, COMPLIANCE).outcome.ok


def test_a_shear_that_is_no_number_is_seen() -> None:
    """No comparison in the kernel is true of it: nothing would seem to slip."""
    start = initial_contact(GOODMAN, COMPLIANCE)
    u = start.u.copy()
    u[np.flatnonzero(start.contact)[0]] = np.nan
    assert slide(GOODMAN, COMPLIANCE, replace(start, u=u)).outcome.ending is Ending.ROUNDING
