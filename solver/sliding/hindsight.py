"""What only a whole friction record shows: a slab that pushes where it is pushed, or energy from nowhere."""

import numpy as np

from solver.case import Case
from solver.contact.node_friction import node_friction
from solver.contact.outcomes import STEEP_PIN
from solver.contact.pin import pin_of, surface_from_pin
from solver.contact.state import ContactState
from solver.outcome import COMPLETED, Ending, Outcome
from solver.sliding.record import FrictionRecord

CREATED = 1e-6
"""Energy that events may create, as a share of the pin's work and of what others lose: a touch pays back what a coarse event
floor overshot."""
ROUNDING = 2e-16
"""Energy that rounding may create in one event on average, as a share of the load times what is displaced."""
ENERGY_CREATED = Outcome(
    Ending.ENERGY_CREATED,
    "events created energy, more than a millionth of the work: slips of many nodes at once overshoot, or the operator is "
    'not an elastic body\'s; use slip.slip_order = "worst_first", or the scheme galerkin',
)


def in_hindsight(case: Case, record: FrictionRecord, end: ContactState) -> Outcome:
    """COMPLETED, or what is wrong with a record though all its events went well."""
    stiffness = record.initial_stiffness
    if case.slip_rule.residual_shear < 1.0 and stiffness <= 0.0:
        return Outcome(
            Ending.SINGULAR_OPERATOR,
            f"lateral stiffness K = {stiffness:.3g}: an elastic slab's is above 0; use the scheme galerkin",
        )
    # Classical sliding has looked at its energy event by event.
    if case.slip_rule.residual_shear == 1.0 or not _creates_energy(case, record, end):
        return COMPLETED
    xi = (surface_from_pin(case) + end.u - end.displacement)[end.contact]
    steep = (np.abs(pin_of(case).slope(xi)) > 0.5 * node_friction(case)[end.contact]).any()
    return STEEP_PIN if steep else ENERGY_CREATED


def _creates_energy(case: Case, record: FrictionRecord, end: ContactState) -> bool:
    """Whether little by little events have created more energy than rounding can."""
    created, lost = -np.minimum(record.dissipated, 0.0).sum(), np.maximum(record.dissipated, 0.0).sum()
    steps = np.diff(record.displacement)
    work = float(np.abs(record.force_after[:-1] + record.force_before[1:]) @ steps) / 2.0
    farthest = float(np.abs(end.u[end.contact]).max(initial=0.0))
    moved = case.normal_load + abs(end.approach) + abs(end.displacement) + farthest
    return bool(created > CREATED * (lost + work) + ROUNDING * case.normal_load * moved * len(record.dissipated))
