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


def in_hindsight(case: Case, record: FrictionRecord, end: ContactState) -> Outcome:
    """COMPLETED, or what is wrong with a record though all its events went well."""
    stiffness = record.initial_stiffness
    if case.slip_rule.residual_shear < 1.0 and stiffness <= 0.0:
        other = "an aspect_ratio nearer 1" if case.slab.scheme.reciprocal else "the scheme galerkin"
        message = f"lateral stiffness K = {stiffness:.3g}: an elastic slab's is above 0; use {other}"
        return Outcome(Ending.SINGULAR_OPERATOR, message)
    # Classical sliding has looked at its energy event by event.
    if case.slip_rule.residual_shear == 1.0 or not _creates_energy(case, record, end):
        return COMPLETED
    xi = (surface_from_pin(case) + end.u - end.displacement)[end.contact]
    steep = (np.abs(pin_of(case).slope(xi)) > 0.5 * node_friction(case)[end.contact]).any()
    return STEEP_PIN if steep else energy_created(case)


def energy_created(case: Case) -> Outcome:
    """The outcome of a record whose events created energy, with the causes that the case may have and what to do about each."""
    causes = []
    if case.slip_rule.slip_order != "worst_first":
        causes.append('slips of many nodes at once overshoot: use slip.slip_order = "worst_first"')
    if not case.slab.scheme.reciprocal:
        causes.append("the operator is not an elastic body's: use the scheme galerkin")
    if case.heterogeneity.roughness:
        causes.append("the pin is rougher than its nodes can follow: use a smoother heterogeneity.roughness")
    if not causes:
        causes.append(
            "use a poisson further from 0.5, an aspect_ratio nearer 1, another n_x, or a lower slip.event_floor"
        )
    return Outcome(
        Ending.ENERGY_CREATED, f"events created energy, more than a millionth of the work: {'; or '.join(causes)}"
    )


def _creates_energy(case: Case, record: FrictionRecord, end: ContactState) -> bool:
    """Whether little by little events have created more energy than rounding can."""
    created, lost = -np.minimum(record.dissipated, 0.0).sum(), np.maximum(record.dissipated, 0.0).sum()
    steps = np.diff(record.displacement)
    work = float(np.abs(record.force_after[:-1] + record.force_before[1:]) @ steps) / 2.0
    farthest = float(np.abs(end.u[end.contact]).max(initial=0.0))
    moved = case.normal_load + abs(end.approach) + abs(end.displacement) + farthest
    return bool(created > CREATED * (lost + work) + ROUNDING * case.normal_load * moved * len(record.dissipated))
