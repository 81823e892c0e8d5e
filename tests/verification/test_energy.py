"""No event creates or loses energy: work of the pin = stored + dissipated, event by event, over a whole record."""

import numpy as np
import pytest

from nanoslip.solver.case import Case, SlipRule
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.contact.state import ContactState
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.slab import Slab, Support
from nanoslip.solver.sliding.slide import slide_to_state
from tests.physics import stored_energy
from tests.verification.seen import seen

EVENTS = 600


def total_energy(case: Case, state: ContactState) -> float:
    """Stored in the slab, less the work of the load since the undeformed slab."""
    return stored_energy(state) - case.normal_load * state.approach


@pytest.mark.parametrize(
    ("residual_shear", "support", "radius"),
    [(0.0, "bonded", 200.0), (0.6, "bonded", 200.0), (0.0, "frictionless", 50.0), (0.0, "right_side", 20.0)],
)
def test_every_event_is_balanced(residual_shear: float, support: Support, radius: float) -> None:
    """One event at a time, so that the energy is known at both of its ends; the default scheme is reciprocal."""
    slab = Slab(n_x=65, scheme="galerkin", support=support)
    compliance = surface_compliance(slab)
    case = Case(slab=slab, radius=radius, slip_rule=SlipRule(residual_shear=residual_shear), max_events=1)
    state = initial_contact(case, compliance)
    worst, work, lost = 0.0, 0.0, 0.0
    for _ in range(EVENTS):
        before, start = total_energy(case, state), state
        record, state = slide_to_state(case, compliance, state)
        assert record.outcome.ok, record.outcome
        step = float(record.displacement[0]) - start.displacement
        done = float(record.initial_force + record.force_before[0]) / 2 * step
        gone = float(record.dissipated[0])
        work, lost = work + done, lost + gone
        worst = max(worst, abs(done - (total_energy(case, state) - before) - gone))
        assert gone >= -1e-12 * case.normal_load**2
    line = seen(
        f"energy of every event, residual {residual_shear}, {support}, R = {radius:g}", "definition",
        f"{EVENTS} events, {100 * lost / work:.0f} % of the pin's work dissipated, "
        f"worst event off by {worst / work:.0e} of the work done",
    )  # fmt: skip
    assert worst <= 1e-10 * work, line


def test_the_record_in_one_piece_is_balanced() -> None:
    slab = Slab(n_x=65, scheme="galerkin")
    compliance = surface_compliance(slab)
    case = Case(slab=slab, max_events=2000)
    start = initial_contact(case, compliance)
    record, end = slide_to_state(case, compliance, start)
    assert len(record.kind) == 2000
    forces = np.concatenate(([record.initial_force], record.force_after[:-1])) + record.force_before
    work = float(forces / 2 @ np.diff(record.displacement, prepend=0.0))
    off = work - (total_energy(case, end) - total_energy(case, start)) - float(record.dissipated.sum())
    line = seen("energy of a record", "definition", f"2000 events, off by {abs(off) / work:.0e} of the pin's work")
    assert abs(off) <= 1e-10 * work, line
    assert np.all(record.dissipated >= -1e-12 * work), line
