"""A record's columns are what their declarations say, and nodes that slip are counted."""

from dataclasses import replace

import numpy as np
import pytest

from nanoslip.solver.case import Case, Effects, Heterogeneity, SlipRule
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.record import EVENT_TYPES, FrictionRecord, drops
from nanoslip.solver.sliding.slide import slide, slide_to_state

SMALL = Case(radius=50.0, slab=Slab(33))
TOGETHER = SlipRule(slip_order="simultaneous")
WAYS = {
    "worst first": SMALL,
    "together": replace(SMALL, slip_rule=TOGETHER),
    "constant pressures": replace(SMALL, effects=Effects(pin_translation=False)),
    "constant pressures, together": replace(SMALL, effects=Effects(pin_translation=False), slip_rule=TOGETHER),
    "rough pin": replace(SMALL, heterogeneity=Heterogeneity(roughness=((-0.1, 0.0), (0.0, 1e-5), (0.1, 0.0)))),
}


def test_columns_have_the_types_that_they_declare_whoever_slides() -> None:
    case = Case(radius=50.0, slab=Slab(17), max_events=10)
    cases = (
        case,
        Case(radius=50.0, slab=Slab(17), effects=Effects(pin_translation=False), max_events=10),
        Case(radius=50.0, slab=Slab(17), slip_rule=SlipRule(residual_shear=1.0), max_events=10),
    )
    for each in cases:
        record: FrictionRecord = slide(each, surface_compliance(case.slab))
        for name, dtype in EVENT_TYPES.items():
            column = getattr(record, name)
            assert column.dtype == np.dtype(dtype), name
            assert column.shape == (10,)
            assert not column.flags.writeable


@pytest.mark.parametrize("label", WAYS)
def test_extent_and_map_count_the_nodes_that_slipped(label: str) -> None:
    """Event by event: who slipped stands elsewhere on the pin. A node that slips there and back to the last bit was not seen."""
    case = WAYS[label]
    compliance = surface_compliance(case.slab)
    state = initial_contact(case, compliance)
    slipped = np.zeros(case.slab.n_x, np.int64)
    for _ in range(12):
        before = state
        record, state = slide_to_state(replace(case, max_events=1), compliance, state)
        # What rounding moves is 1e-16 of the slab's width, a slip at least 1e-9.
        moved = before.contact & (np.abs(state.slip - before.slip) > 1e-13) & state.contact
        gone = before.contact & ~state.contact  # a node may slip and leave
        assert int(moved.sum()) <= int(record.extent[0]) <= int(moved.sum() + gone.sum() + record.touches[0])
        assert (record.node_slips > 0).sum() == record.extent[0]
        slipped += record.node_slips
    whole = slide(replace(case, max_events=12), compliance)
    np.testing.assert_array_equal(whole.node_slips, slipped)
    assert whole.extent.max() > 1


@pytest.mark.parametrize("residual_shear", [0.0, 1.0])
def test_the_map_holds_the_slips_of_all_events(residual_shear: float) -> None:
    rule = SlipRule(residual_shear=residual_shear)
    record = slide(Case(radius=50.0, slab=Slab(33), slip_rule=rule, max_events=60), surface_compliance(Slab(33)))
    assert record.node_slips.sum() == record.slips.sum() > 0
    np.testing.assert_array_equal(record.extent > 0, record.slips > 0)
    assert (record.extent <= record.slips).all()
    np.testing.assert_allclose(record.node_x, np.linspace(-0.5, 0.5, 33))


def test_nodes_that_begin_to_slide_at_once_are_one_event() -> None:
    """On a half-plane without coupling both edges of a contact begin to slide at once, one node on either side."""
    slab = Slab(33, scheme="half_plane")
    rule, effects = SlipRule(residual_shear=1.0), Effects(coupling=False)
    record = slide(
        Case(radius=50.0, slab=slab, slip_rule=rule, effects=effects, max_events=2), surface_compliance(slab)
    )
    np.testing.assert_array_equal(record.extent, [2, 2])
    slid = np.flatnonzero(record.node_slips)
    np.testing.assert_array_equal(slid, 32 - slid[::-1])


def test_a_force_that_falls_by_rounding_alone_falls_by_nothing() -> None:
    before = np.array([0.3, 0.3, 0.3, 0.3])
    found = drops(before, before - np.array([1e-3, 2e-12, 5e-17, -1e-13]))
    np.testing.assert_allclose(found, [1e-3, 2e-12, 0.0, 0.0], rtol=1e-4)  # 2e-12 of 0.3: to 1e-17/2e-12
    assert not np.any(found[2:])


def test_classical_sliding_drops_nothing_but_what_it_is_solved_to() -> None:
    """Classical sliding goes on at μ_i·p: what is left is how well its roles are solved, and rounding."""
    case = Case(radius=50.0, slab=Slab(17), slip_rule=SlipRule(residual_shear=1.0), max_events=10)
    record = slide(case, surface_compliance(case.slab))
    found = drops(record.force_before / case.normal_load, record.force_after / case.normal_load)
    raw = (record.force_before - record.force_after) / case.normal_load
    assert np.all((found == 0.0) | (np.abs(found) > 1e-12))
    assert np.any((found == 0.0) & (raw != 0.0))
