"""Slide with the pressures of initial contact (pin_translation off): the tangential problem alone.

Nodes in contact keep their normal forces, [u] = C_uu [f_x] + C_uw [f_z], whatever the pin and their slips do; nothing
touches, nothing is released. That is right while δ_p is small against the contact's width and, unless the coupling is off
too, while shear lifts the surface by little (ν near 0.5).
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.case import MOST_EVENTS, Case
from nanoslip.solver.contact.compiled_contact import slip_constants
from nanoslip.solver.contact.kernels.enumerations import Stop
from nanoslip.solver.contact.kernels.state import new_scalars
from nanoslip.solver.contact.node_friction import node_friction
from nanoslip.solver.contact.outcomes import NOT_FINITE, OUTCOME_OF_STOP
from nanoslip.solver.contact.state import ContactState
from nanoslip.solver.contact.tableau import in_lines, inverse
from nanoslip.solver.elasticity.compliance import SurfaceCompliance
from nanoslip.solver.outcome import COMPLETED, Outcome
from nanoslip.solver.sliding.columns import farthest, first_of, first_room, friction_record, grown
from nanoslip.solver.sliding.kernels.events import Events
from nanoslip.solver.sliding.kernels.tangential import TangentialState, refresh, slide_tangentially
from nanoslip.solver.sliding.record import FrictionRecord


def slide_with_constant_pressures(
    case: Case, start: ContactState, compliance: SurfaceCompliance
) -> tuple[FrictionRecord, ContactState]:
    """Slide from `start` to the limits of `case`: the record, and the contact where it ends."""
    contact = TangentialContact(case, compliance, start)
    most, end_at = case.max_events or MOST_EVENTS, farthest(case, contact.stiffness)
    events, held = first_room(most), 0
    while True:
        outcome, held = contact.slide(first_of(events, most), held, end_at)
        if outcome is not None or held == most:
            break
        events = grown(events)
    end = contact.state(outcome or COMPLETED)
    return friction_record(case, start, contact.stiffness, events, contact.node_slips(), held, end), end


class TangentialContact:
    """A contact whose nodes slide under the pressures of `start`; nodes in contact need not be neighbours."""

    def __init__(self, case: Case, compliance: SurfaceCompliance, start: ContactState) -> None:
        """Raises SingularOperator where the tangential compliance of the contact cannot be inverted."""
        self._case, self._compliance, self._start = case, compliance, start
        self._nodes = np.flatnonzero(start.contact)
        self._state = _tangential_state(case, compliance, start, self._nodes)
        self._constants = slip_constants(case)
        self._node_slips = np.zeros(len(self._nodes), np.int64)

    @property
    def stiffness(self) -> float:
        """dF/dδ_p while all nodes stick, in G·L_y."""
        return float(self._state.rate.sum())

    def node_slips(self) -> NDArray[np.int64]:
        """Slips of each surface node in the record so far, (n_x,)."""
        slips = np.zeros(self._case.slab.n_x, np.int64)
        slips[self._nodes] = self._node_slips
        return slips

    def slide(self, events: Events, held: int, end_at: float) -> tuple[Outcome | None, int]:
        """Fill `events` from number `held` on, up to δ_p = end_at: how it ended, None where they are full; and how many
        there are now."""
        status, held = slide_tangentially(self._state, self._constants, events, self._node_slips, held, end_at)
        if not np.isfinite(self._state.shear).all():
            # No comparison in the kernel sees a NaN, and none ever leaves the shear again.
            return NOT_FINITE, held
        return None if status == Stop.FULL else OUTCOME_OF_STOP[status], held

    def state(self, outcome: Outcome) -> ContactState:
        """The contact as it is now; its normal fields are those of initial contact."""
        start, c, n = self._start, self._compliance, self._case.slab.n_x
        force = start.nodal_force.copy()
        force[0, self._nodes] = self._state.shear
        u = c.matrix[:n, self._nodes] @ self._state.shear + _pushed(self._case, c, start)
        u[self._nodes] = self._state.u
        displacement = float(self._state.scalars["displacement"])
        values = {
            "shear": force[0] / c.widths,
            "slip": np.where(start.contact, u - displacement, 0.0),
            "u": u,
            "nodal_force": force,
        }
        for value in values.values():
            value.setflags(write=False)
        slips = int(self._state.scalars["slips"])
        return replace(start, **values, displacement=displacement, slips=slips, outcome=outcome)


def _tangential_state(
    case: Case, compliance: SurfaceCompliance, start: ContactState, nodes: NDArray[np.int64]
) -> TangentialState:
    block = compliance.matrix[np.ix_(nodes, nodes)]
    stiffness = inverse(block, f"tangential compliance of {len(nodes)} nodes")
    limits = node_friction(case)[nodes] * -start.nodal_force[1, nodes]
    # A node without pressure has no shear either, even where μ_i is infinite.
    limits = np.where(np.isnan(limits), 0.0, np.maximum(limits, 0.0))
    u = start.u[nodes].copy()
    state = TangentialState(
        tableau=in_lines(stiffness.T),
        base=start.nodal_force[0, nodes] - stiffness @ u,
        shear=np.empty(len(nodes)),
        u=u,
        rate=stiffness.sum(axis=1),
        shear_limit=limits,
        weights=1.0 / np.maximum(limits, 1e-12 * case.normal_load),
        nodes=nodes.astype(np.int32),
        node_slips=np.zeros(len(nodes), np.int64),
        scalars=new_scalars(start.displacement),
    )
    refresh(state)
    return state


def _pushed(case: Case, compliance: SurfaceCompliance, start: ContactState) -> NDArray[np.float64]:
    """u of all surface nodes by the constant normal forces, (n,)."""
    n = case.slab.n_x
    if not case.effects.coupling:
        return np.zeros(n)
    return np.asarray(compliance.matrix[:n, n:] @ start.nodal_force[1])
