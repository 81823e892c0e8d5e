"""Slide with classical Coulomb friction, residual_shear 1: forces are continuous, roles of nodes change."""

import math

import numpy as np

from solver.case import Case
from solver.contact.coulomb.contact import CoulombContact, CoulombError
from solver.contact.coulomb.motion import LONGEST_STEP, advance, change, next_change
from solver.contact.coulomb.roles import stick_and_slide_in_motion
from solver.contact.kernels.enumerations import EventKind
from solver.contact.kernels.violations import STEEPEST
from solver.contact.node_friction import node_friction
from solver.contact.outcomes import OUTCOME_OF_ENDING
from solver.contact.state import ContactState, coulomb_state
from solver.elasticity.compliance import SurfaceCompliance, uncoupled
from solver.outcome import COMPLETED, Ending
from solver.sliding.columns import empty_events, friction_record
from solver.sliding.kernels.events import Events
from solver.sliding.record import FrictionRecord

OFF_THE_SLAB = 2.0
"""δ_p in L_x at which a pin that slides on and on has certainly left the slab."""
CREATED_ON_THE_WAY = 1e-4
"""Energy that an event may create at residual_shear 1, in W²/G: it is an integral over steps there, not known to rounding."""


def slide_with_coulomb_friction(
    case: Case, start: ContactState, compliance: SurfaceCompliance
) -> tuple[FrictionRecord, ContactState]:
    """Slide from `start` to the limits of `case`: the record, and the contact where it ends.

    An event is a node that begins to slide, is released or touches; forces do not jump.

    The energy dissipated in sliding since the last event is counted at the event.
    """
    compliance = compliance if case.effects.coupling else uncoupled(compliance)
    slides = np.abs(start.nodal_force[0]) >= node_friction(case) * -start.nodal_force[1] * (1 - 1e-9)
    sign = np.where(start.contact & slides, np.sign(start.nodal_force[0]), 0.0)
    solved = CoulombContact(
        case, compliance, start.contact.copy(), sign, start.u.copy(), case.normal_load, start.displacement
    )
    rows: list[tuple[float, ...]] = []
    dissipated, initial_stiffness, outcome = 0.0, math.nan, COMPLETED
    farthest = min(case.farthest, OFF_THE_SLAB)
    try:
        rates = stick_and_slide_in_motion(solved, 1.0)
        initial_stiffness = float(rates[0][0].sum())
        while len(rows) < (case.max_events or math.inf) and solved.displacement < farthest:
            step, kind, node = next_change(solved, rates, 1.0)
            longest = min(LONGEST_STEP * case.slab.spacing, farthest - solved.displacement)
            dissipated += advance(solved, min(step, longest), rates, 1.0)
            before, touching, slips = float(solved.force[0].sum()), solved.contact.copy(), solved.slips
            change(solved, kind if step <= longest else EventKind.NOTHING, node)
            rates = stick_and_slide_in_motion(solved, 1.0)
            if step <= longest:
                _refuse_flanks(solved, dissipated)
                gone, come = int((touching & ~solved.contact).sum()), int((solved.contact & ~touching).sum())
                forces = (solved.displacement, before, float(solved.force[0].sum()), float(rates[0][0].sum()))
                counts = (solved.slips - slips, gone, come, int(solved.contact.sum()))
                row: tuple[float, ...] = (*forces, dissipated, kind, node, *counts)
                if rows and rows[-1][0] == solved.displacement:
                    row = _as_one(rows.pop(), row)
                rows.append(row)
                dissipated = 0.0
        if math.isinf(case.farthest) and solved.displacement >= OFF_THE_SLAB:
            outcome = OUTCOME_OF_ENDING[Ending.CONTACT_LOST]
    except CoulombError as error:
        outcome = OUTCOME_OF_ENDING[error.ending]
    events = empty_events(len(rows))
    for name, column in zip(Events._fields, zip(*rows, strict=True), strict=False):
        getattr(events, name)[:] = column
    end = coulomb_state(solved, outcome)
    return friction_record(case, start, initial_stiffness, events, len(rows), end), end


def _refuse_flanks(solved: CoulombContact, dissipated: float) -> None:
    """Raises CoulombError where a node is on a flank above 45°, or on one above its μ_i in an event that creates energy."""
    slope = np.abs(solved.pin.slope(solved.xi))[solved.contact]
    creates = dissipated < -CREATED_ON_THE_WAY * solved.normal_load**2 and bool(
        (slope > solved.node_friction[solved.contact]).any()
    )
    if creates or not (slope <= STEEPEST).all():
        raise CoulombError(Ending.STEEP_PIN)


def _as_one(first: tuple[float, ...], then: tuple[float, ...]) -> tuple[float, ...]:
    """Two events at one displacement as one: the first one's trigger and force before, the sums of what happened."""
    displacement, before, _, _, dissipated, kind, node, slips, releases, touches, _ = first
    _, _, after, stiffness, more_dissipated, _, _, *more, contact_size = then
    counts = (old + new for old, new in zip((slips, releases, touches), more, strict=True))
    return (displacement, before, after, stiffness, dissipated + more_dissipated, kind, node, *counts, contact_size)
