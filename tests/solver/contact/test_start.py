"""Where the pin comes down between two nodes, and records as long as so many of their spacings."""

from dataclasses import replace
from typing import Any, get_args

import numpy as np
import pytest

from nanoslip.solver.case import Case, Effects, Heterogeneity, InitialContact, PinShape, SlipRule
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.contact.pin import surface_from_pin
from nanoslip.solver.elasticity.compliance import SurfaceCompliance, surface_compliance
from nanoslip.solver.slab import SCHEMES, Slab
from nanoslip.solver.sliding.record import FrictionRecord
from nanoslip.solver.sliding.slide import slide, slide_to_state
from tests.physics import assert_contact_laws

WAYS: tuple[InitialContact, ...] = get_args(InitialContact)
FLAT = Case(radius=20.0, slab=Slab(129, scheme="half_plane", poisson=0.3), max_events=300)
"""23 nodes in contact, far from the ends."""
CONSTANT_PRESSURES = Effects(pin_translation=False)
FORCES = ("force_before", "force_after", "stiffness", "dissipated", "displacement")
COUNTS = ("kind", "slips", "releases", "touches", "contact_size")
COLUMNS = (*FORCES, *COUNTS, "node")
ENDS = ("initial_force", "initial_stiffness", "final_displacement", "final_force", "outcome")


@pytest.fixture(scope="module")
def flat() -> SurfaceCompliance:
    return surface_compliance(FLAT.slab)


def same(one: FrictionRecord, other: FrictionRecord) -> bool:
    """Whether two records have the same bits."""
    columns = all(np.array_equal(getattr(one, name), getattr(other, name)) for name in COLUMNS)
    return columns and all(getattr(one, name) == getattr(other, name) for name in ENDS)


def test_the_pin_sees_every_node_further_left() -> None:
    spacing = FLAT.slab.spacing
    at_middle, between = surface_from_pin(FLAT), surface_from_pin(replace(FLAT, start=0.37))
    assert np.array_equal(at_middle, surface_compliance(FLAT.slab).x)
    np.testing.assert_allclose(
        at_middle - between, 0.37 * spacing, rtol=1e-13
    )  # rounding of positions up to 64 spacings
    # One spacing on, it stands over the next node.
    assert np.array_equal(surface_from_pin(replace(FLAT, start=1.0))[1:], at_middle[:-1])


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize(
    ("effects", "residual_shear"),
    [(Effects(), 0.0), (Effects(), 0.5), (Effects(), 1.0), (CONSTANT_PRESSURES, 0.0), (CONSTANT_PRESSURES, 0.5)],
)
def test_one_spacing_on_a_half_plane_is_the_same_one_node_further(
    flat: SurfaceCompliance, way: InitialContact, effects: Effects, residual_shear: float
) -> None:
    """Its matrix is Toeplitz to the bit and the positions are binary fractions: every number is computed from the same ones.
    Sums over all nodes may be added up in another order, by the shift of the window: 1e-12 allows for 300 events of that."""
    case = replace(FLAT, initial_contact=way, effects=effects, slip_rule=SlipRule(residual_shear=residual_shear))
    case = replace(case, max_events=60) if residual_shear == 1.0 else case
    here, next_to = (slide(replace(case, start=start), flat) for start in (0.0, 1.0))
    assert here.outcome.ok
    assert len(here.node) == case.max_events
    assert np.array_equal(next_to.node, here.node + 1)
    for name in COUNTS:
        assert np.array_equal(getattr(next_to, name), getattr(here, name)), name
    for name in FORCES:
        mine, other = getattr(here, name), getattr(next_to, name)
        np.testing.assert_allclose(other, mine, rtol=0.0, atol=1e-12 * np.abs(mine).max(), err_msg=name)


@pytest.mark.parametrize("way", WAYS)
def test_between_nodes_it_is_another_record(flat: SurfaceCompliance, way: InitialContact) -> None:
    case = replace(FLAT, initial_contact=way)
    here, between = slide(case, flat), slide(replace(case, start=0.5), flat)
    assert between.outcome.ok
    count = min(len(here.node), len(between.node))
    assert np.abs(here.force_after[:count] - between.force_after[:count]).max() > 1e-3 * case.normal_load


@pytest.mark.parametrize("start", [0.1, 0.37, 0.5])
def test_starts_on_either_side_of_a_node_are_mirror_images_at_first_touch(
    flat: SurfaceCompliance, start: float
) -> None:
    """Pressed down without friction, s right of a node and s left of the next one: the pressures of one turned round and one
    node on. The order of sums is turned round too, which the contact's condition (some 1e3) amplifies."""
    case = replace(FLAT, initial_contact="frictionless")
    right, left = (initial_contact(replace(case, start=one), flat) for one in (start, 1.0 - start))
    turned = np.zeros_like(left.nodal_force[1])
    turned[1:] = left.nodal_force[1, ::-1][:-1]
    np.testing.assert_allclose(right.nodal_force[1], turned, atol=1e-11 * case.normal_load)


@pytest.mark.parametrize("pin", get_args(PinShape))
@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("scheme", SCHEMES)
def test_the_laws_of_contact_hold_between_nodes(scheme: str, way: InitialContact, pin: PinShape) -> None:
    """At initial contact and 30 events on."""
    slab = Slab(33, scheme=scheme)
    case = Case(radius=20.0, half_width=0.17, slab=slab, pin=pin, initial_contact=way, start=0.37, max_events=30)
    compliance = surface_compliance(slab)
    state = initial_contact(case, compliance)
    assert state.outcome.ok
    assert_contact_laws(state, case, compliance)
    record, end = slide_to_state(case, compliance, state)
    assert record.outcome.ok
    assert_contact_laws(end, case, compliance)


def test_a_punch_stands_over_the_nodes_under_it() -> None:
    """A node counts while the greater part of its width is covered: from 0.5 on the next one right does."""
    slab = Slab(33)
    case = Case(slab=slab, pin="flat_punch", half_width=4 * slab.spacing, initial_contact="frictionless")
    compliance = surface_compliance(slab)

    def under(start: float) -> list[int]:
        return np.flatnonzero(initial_contact(replace(case, start=start), compliance).contact).tolist()

    assert under(0.0) == list(range(12, 21))
    assert under(0.4) == list(range(12, 21))
    assert under(0.6) == list(range(13, 22))
    assert under(1.0) == list(range(13, 22))


LIMITED: dict[str, dict[str, Any]] = {
    "slips": {},
    "some shear left": {"slip_rule": SlipRule(residual_shear=0.5)},
    "classical": {"slip_rule": SlipRule(residual_shear=1.0)},
    "constant pressures": {"effects": CONSTANT_PRESSURES},
    "no coupling": {"effects": Effects(coupling=False)},
    "spread": {"heterogeneity": Heterogeneity(spread=0.2)},
}


@pytest.mark.parametrize("changes", LIMITED.values(), ids=LIMITED)
@pytest.mark.parametrize("spacings", [0.03, 0.7])
def test_a_limit_in_spacings_is_a_displacement(spacings: float, changes: dict[str, Any]) -> None:
    """Ends at exactly that place, and has the bits of a record with that limit as displacement."""
    slab = Slab(33)
    case = Case(radius=50.0, slab=slab, max_events=None, max_spacings=spacings, **changes)
    compliance = surface_compliance(slab)
    record = slide(case, compliance)
    assert record.outcome.ok
    assert len(record.node) > 0 or spacings < 0.1
    assert record.final_displacement == spacings * slab.spacing
    other = slide(replace(case, max_spacings=None, max_displacement=spacings * slab.spacing), compliance)
    assert same(record, other)


def test_whichever_limit_comes_first_ends_the_record() -> None:
    slab = Slab(33)
    compliance = surface_compliance(slab)
    whole = slide(Case(slab=slab, max_events=None, max_spacings=0.2), compliance)
    far = slab.spacing
    assert same(whole, slide(Case(slab=slab, max_events=10**6, max_spacings=0.2, max_displacement=far), compliance))
    assert same(
        whole, slide(Case(slab=slab, max_events=10**6, max_spacings=5.0, max_displacement=0.2 * far), compliance)
    )
    few = slide(Case(slab=slab, max_events=20, max_spacings=0.2), compliance)
    assert len(few.node) == 20
    assert few.final_displacement == whole.displacement[19]
