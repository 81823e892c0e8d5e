"""Work of the pin = stored + dissipated, event by event and over twenty thousand events, several node spacings: what began is
forgotten, no energy is lost, pieces are the whole."""

import math
from dataclasses import replace
from itertools import product
from typing import get_args

import numpy as np
import pytest

from nanoslip.solver.case import Case, Heterogeneity, InitialContact, SlipRule
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.ensemble import Ensemble, mean_of
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.full_contact import RESUMABLE
from nanoslip.solver.sliding.plateau import plateau_of
from nanoslip.solver.sliding.record import EVENT_TYPES
from nanoslip.solver.sliding.slide import slide, slide_to_state
from tests.physics import ROWS, energy
from tests.verification.seen import seen


@pytest.mark.parametrize(
    ("residual_shear", "support", "radius"),
    [(0.0, "bonded", 200.0), (0.6, "bonded", 200.0), (0.0, "frictionless", 50.0), (0.0, "right_side", 20.0)],
)
def test_the_energy_of_every_event_is_balanced(residual_shear, support, radius):
    """One event at a time, so that the energy is known at both of its ends; the default scheme is reciprocal."""
    slab = Slab(n_x=65, scheme="galerkin", support=support)
    compliance = surface_compliance(slab)
    case = Case(slab=slab, radius=radius, slip_rule=SlipRule(residual_shear=residual_shear), max_events=1)
    state = initial_contact(case, compliance)
    worst, work, lost = 0.0, 0.0, 0.0
    for _ in range(300):
        start = state
        record, state = slide_to_state(case, compliance, start)
        assert record.outcome.ok, record.outcome
        found = energy(case, start, record, state)
        work, lost = work + found.work, lost + found.lost
        worst = max(worst, abs(found.work - found.kept - found.lost))
        assert found.lost >= -1e-12 * case.normal_load**2
    law = f"energy of every event, residual {residual_shear}, {support}, R = {radius:g}"
    figures = (
        f"300 events, {lost / work:.0%} of the pin's work dissipated, worst event off by {worst / work:.0e} of the work"
    )
    line = seen(law, "definition", figures)
    assert worst <= 1e-10 * work, line


@pytest.mark.slow
@pytest.mark.parametrize("n_x", [33, 65])
def test_the_plateau_does_not_know_how_the_pin_came_down(n_x):
    """Means over starts differ by no more than twice their ± together, as independent means do."""
    case, ensemble = Case(slab=Slab(n_x=n_x), max_events=5000), Ensemble(8)
    compliance, starts = surface_compliance(case.slab), [ensemble.case(case, number) for number in range(8)]
    ways = get_args(InitialContact)
    records = {way: [slide(replace(start, initial_contact=way), compliance) for start in starts] for way in ways}
    assert all(record.outcome.ok for each in records.values() for record in each)
    # Otherwise they would agree because they are one record.
    assert len({float(each[0].force_before[-1]) for each in records.values()}) == len(ways)
    found = {way: mean_of(np.array([plateau_of(record).mean for record in each])) for way, each in records.items()}
    shown = ", ".join(f"{way} {one.mean:.5f} ± {one.uncertainty:.1g}" for way, one in found.items())
    line = seen(f"plateau from three initial contactes, n_x = {n_x}", "the steady part is steady", shown)
    for one, other in product(found.values(), repeat=2):
        assert abs(one.mean - other.mean) <= 2.0 * math.hypot(one.uncertainty, other.uncertainty), line
        assert one.uncertainty < 5e-3 * one.mean, line  # the comparison means something


@pytest.mark.parametrize("scheme", ROWS)
def test_a_record_in_pieces_has_the_bits_of_one_in_one(scheme):
    """A ContactState is all that a record goes on from: pieces of RESUMABLE events, nodes unlike each other, a start between
    two nodes. No tolerance: the same arithmetic."""
    drawn = Heterogeneity(spread=0.2, seed=5)
    case = Case(slab=Slab(n_x=33, scheme=scheme), start=0.3, heterogeneity=drawn, max_events=2 * RESUMABLE)
    compliance = surface_compliance(case.slab)
    whole, end = slide_to_state(case, compliance)
    assert len(whole.node) == 2 * RESUMABLE
    first, state = slide_to_state(replace(case, max_events=RESUMABLE), compliance)
    second, last = slide_to_state(replace(case, max_events=RESUMABLE), compliance, state)
    for name in EVENT_TYPES:
        pieces = np.concatenate((getattr(first, name), getattr(second, name)))
        np.testing.assert_array_equal(pieces, getattr(whole, name))
    for name in ("contact", "u", "w", "nodal_force", "slip", "gap"):
        np.testing.assert_array_equal(getattr(last, name), getattr(end, name))
    seen(f"a record in two pieces, {scheme}", "the whole", f"{2 * RESUMABLE} events, the same bits")
