"""Slide with classical Coulomb friction, residual_shear 1: forces are continuous, roles of nodes change."""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.case import Case
from nanoslip.solver.contact.coulomb.contact import CoulombContact, CoulombError
from nanoslip.solver.contact.coulomb.motion import LONGEST_STEP, advance, change, next_change
from nanoslip.solver.contact.coulomb.roles import stick_and_slide_in_motion
from nanoslip.solver.contact.kernels.enumerations import EventKind
from nanoslip.solver.contact.kernels.violations import STEEPEST
from nanoslip.solver.contact.node_friction import node_friction
from nanoslip.solver.contact.outcomes import OUTCOME_OF_ENDING
from nanoslip.solver.contact.state import ContactState, coulomb_state
from nanoslip.solver.elasticity.compliance import SurfaceCompliance, uncoupled
from nanoslip.solver.outcome import COMPLETED, Ending
from nanoslip.solver.sliding.columns import empty_events, farthest, friction_record
from nanoslip.solver.sliding.kernels.events import Events
from nanoslip.solver.sliding.record import FrictionRecord

OFF_THE_SLAB = 2.0
"""δ_p in L_x at which a pin that slides on and on has certainly left the slab."""
CREATED_ON_THE_WAY = 1e-4
"""Energy that an event may create at residual_shear 1, in W²/G: it is an integral over steps there, not known to rounding."""


def slide_with_coulomb_friction(
    case: Case, start: ContactState, compliance: SurfaceCompliance
) -> tuple[FrictionRecord, ContactState]:
    """Slide from `start` to the limits of `case`: the record, and the contact where it ends.

    An event is a node that begins to slide, is released or touches; forces do not jump. The energy dissipated in sliding
    since the last event is counted at the event.
    """
    run = _Run(case, start, _contact_at(case, start, compliance if case.effects.coupling else uncoupled(compliance)))
    outcome = COMPLETED
    try:
        run.slide_to_limits()
        if math.isinf(farthest(case, run.initial_stiffness)) and run.solved.displacement >= OFF_THE_SLAB:
            outcome = OUTCOME_OF_ENDING[Ending.CONTACT_LOST]
    except CoulombError as error:
        outcome = OUTCOME_OF_ENDING[error.ending]
    end = coulomb_state(run.solved, outcome)
    record = friction_record(case, start, run.initial_stiffness, run.events(), run.node_slips, len(run.rows), end)
    return record, end


def _contact_at(case: Case, start: ContactState, compliance: SurfaceCompliance) -> CoulombContact:
    """The contact in this state; nodes at their limit of friction slide."""
    slides = np.abs(start.nodal_force[0]) >= node_friction(case) * -start.nodal_force[1] * (1 - 1e-9)
    sign = np.where(start.contact & slides, np.sign(start.nodal_force[0]), 0.0)
    contact, u = start.contact.copy(), start.u.copy()
    return CoulombContact(case, compliance, contact, sign, u, case.normal_load, start.displacement)


@dataclass(eq=False)
class _Run:
    """A run in the making: the contact, and a row per event in the order of `Events`."""

    case: Case
    start: ContactState
    solved: CoulombContact
    rows: list[tuple[float, ...]] = field(default_factory=list)
    initial_stiffness: float = math.nan
    dissipated: float = 0.0
    """Energy lost since the last event."""
    node_slips: NDArray[np.int64] = field(init=False)
    """(n,) how often each node began to slide in an event of the record, and in its last row."""
    last_slips: NDArray[np.int64] = field(init=False)

    def __post_init__(self) -> None:
        self.node_slips = np.zeros(self.case.slab.n_x, np.int64)
        self.last_slips = self.node_slips.copy()

    def slide_to_limits(self) -> None:
        """Step from change of roles to change of roles. Raises CoulombError where the contact has no solution."""
        case, solved = self.case, self.solved
        rates = stick_and_slide_in_motion(solved, 1.0)
        self.initial_stiffness = float(rates[0][0].sum())
        end_at = min(farthest(case, self.initial_stiffness), OFF_THE_SLAB)
        while len(self.rows) < (case.max_events or math.inf) and solved.displacement < end_at:
            step, kind, node = next_change(solved, rates, 1.0)
            longest = min(LONGEST_STEP * case.slab.spacing, end_at - solved.displacement)
            self.dissipated += advance(solved, min(step, longest), rates, 1.0)
            before, touching, slips = float(solved.force[0].sum()), solved.contact.copy(), solved.node_slips.copy()
            change(solved, kind if step <= longest else EventKind.NOTHING, node)
            rates = stick_and_slide_in_motion(solved, 1.0)
            if step <= longest:
                _refuse_flanks(solved, self.dissipated)
                changes = ((touching & ~solved.contact).sum(), (solved.contact & ~touching).sum())
                self._add((kind, node, before, float(rates[0][0].sum())), solved.node_slips - slips, changes)

    def _add(
        self, event: tuple[EventKind, int, float, float], slips: NDArray[np.int64], changes: tuple[int, int]
    ) -> None:
        """The row of an event: its kind, node, force before and stiffness after; slips of each node (n,); releases, touches."""
        solved, (kind, node, before, stiffness) = self.solved, event
        self.node_slips += slips
        forces = (solved.displacement, before, float(solved.force[0].sum()), stiffness)
        again = bool(self.rows) and self.rows[-1][0] == solved.displacement
        self.last_slips = self.last_slips + slips if again else slips
        sizes = (int(solved.contact.sum()), int(np.count_nonzero(self.last_slips)))
        row: tuple[float, ...] = (*forces, self.dissipated, kind, node, int(slips.sum()), *changes, *sizes)
        self.rows.append(_as_one(self.rows.pop(), row) if again else row)
        self.dissipated = 0.0

    def events(self) -> Events:
        """The rows as columns."""
        events = empty_events(len(self.rows))
        for name, column in zip(Events._fields, zip(*self.rows, strict=True), strict=False):
            getattr(events, name)[:] = column
        return events


def _refuse_flanks(solved: CoulombContact, dissipated: float) -> None:
    """Raises CoulombError where a node is on a flank above 45°, or on one above its μ_i in an event that creates energy."""
    slope = np.abs(solved.pin.slope(solved.xi))[solved.contact]
    creates = dissipated < -CREATED_ON_THE_WAY * solved.normal_load**2
    above_friction = bool((slope > solved.node_friction[solved.contact]).any())
    if (creates and above_friction) or not (slope <= STEEPEST).all():
        raise CoulombError(Ending.STEEP_PIN)


def _as_one(first: tuple[float, ...], then: tuple[float, ...]) -> tuple[float, ...]:
    """Two events at one displacement as one: the first one's trigger and force before, the sums of what happened."""
    displacement, before, _, _, dissipated, kind, node, slips, releases, touches, _, _ = first
    _, _, after, stiffness, more_dissipated, _, _, *more, contact_size, extent = then
    counts = (old + new for old, new in zip((slips, releases, touches), more, strict=True))
    return (
        displacement,
        before,
        after,
        stiffness,
        dissipated + more_dissipated,
        kind,
        node,
        *counts,
        contact_size,
        extent,
    )
