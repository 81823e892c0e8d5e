"""Slide with the pressures of initial contact (pin_translation off): the tangential problem alone.

Nodes in contact keep their normal forces, [u] = C_uu [f_x] + C_uw [f_z], whatever the pin and their slips do; nothing touches,
nothing is released. That is right while δ_p is small against the contact's width and, unless the coupling is off too, while
shear lifts the surface by little (ν near 0.5).
"""

from dataclasses import replace

import numpy as np

from nanoslip.solver.case import MOST_EVENTS, Case
from nanoslip.solver.contact.compiled_contact import new_scalars, slip_constants
from nanoslip.solver.contact.kernels.state import Direction, Stop
from nanoslip.solver.contact.pin import node_limit
from nanoslip.solver.contact.soundness import NOT_FINITE, OUTCOME_OF_STOP
from nanoslip.solver.contact.state import ContactState
from nanoslip.solver.contact.tableau import zero_lines
from nanoslip.solver.elasticity.compliance import Compliance, inverse
from nanoslip.solver.outcome import Outcome
from nanoslip.solver.sliding.kernels.constant_pressures import TangentialState, refresh_shear, slide_tangentially
from nanoslip.solver.sliding.record import presliding_length
from nanoslip.solver.sliding.way import (
    Run,
    SlippedNodes,
    Way,
    allocate_events,
    first_room,
    grow_events,
    initial_limit,
    make_record_view,
)


def slide_with_constant_pressures(case: Case, start: ContactState, compliance: Compliance, way: Way) -> Run:
    """Follow the way of the pin from `start`.

    Raises SingularOperator if the tangential compliance of the contact cannot be inverted.
    """
    nodes = start.contact.nonzero()[0]
    limit = initial_limit(case, start, compliance)
    state, constants = _tangential_state(case, compliance, start, limit, way.direction), slip_constants(case)
    stiffness = float(state.rate.sum()) * way.direction.pin_rate
    slips = np.zeros(len(nodes), np.int64)
    most, end_at = case.max_events or MOST_EVENTS, way.end(case, presliding_length(limit, stiffness))
    events, count = first_room(most), 0
    while True:
        status, count = slide_tangentially(state, constants, allocate_events(events, most), slips, count, end_at)
        # No comparison in the kernel sees a NaN, and none ever leaves the shear again.
        finite = bool(np.isfinite(state.shear).all())
        if status != Stop.FULL or count == most or not finite:
            break
        events = grow_events(events)
    end = _tangential_end(case, compliance, start, state, OUTCOME_OF_STOP[status] if finite else NOT_FINITE)
    node_slips = np.zeros(case.slab.nodes, np.int64)
    node_slips[nodes] = slips
    slipped = SlippedNodes(start.first_node, node_slips)
    return make_record_view(case, start, compliance, stiffness, events, slipped, count, end)


def _tangential_end(
    case: Case, compliance: Compliance, start: ContactState, state: TangentialState, outcome: Outcome
) -> ContactState:
    """Build the current contact; its normal fields are unchanged since initial contact."""
    force = start.nodal_force.copy()
    force[0, state.nodes] = state.shear
    u = compliance.displacements(force, case.effects.coupling)[0]
    u[state.nodes] = state.u
    displacement = float(state.scalars["displacement"])
    slip = np.where(start.contact, u - displacement, 0.0)
    shear = force[0] / compliance.widths
    values = {"shear": shear, "slip": slip, "u": u, "nodal_force": force}
    for value in values.values():
        value.setflags(write=False)
    slips = int(state.scalars["slips"])
    return replace(start, **values, displacement=displacement, slips=slips, outcome=outcome)


def _tangential_state(
    case: Case, compliance: Compliance, start: ContactState, limit: float, direction: Direction
) -> TangentialState:
    nodes = start.contact.nonzero()[0]
    block = compliance.entries(nodes, nodes)
    stiffness = inverse(block, f"tangential compliance of {len(nodes)} nodes")
    limits = node_limit(case, compliance.widths, -start.nodal_force[1], start.first_node)[nodes]
    limits = np.maximum(limits, 0.0)
    u = start.u[nodes].copy()
    tableau = zero_lines(len(nodes))
    # By rows of what a displacement of one node does, as a slip adds one of them: the transpose.
    tableau[:, : len(nodes)] = stiffness.T
    state = TangentialState(
        tableau=tableau,
        # What shear is left at u = 0: it stems from pressures, which stay.
        base=start.nodal_force[0, nodes] - stiffness @ u,
        shear=np.empty(len(nodes)),
        u=u,
        rate=stiffness.sum(axis=1) * direction.pin_rate,
        shear_limit=limits,
        limits=limit,
        weights=1.0 / np.maximum(limits, 1e-12 * case.normal_load),
        nodes=nodes.astype(np.int32),
        node_slips=np.zeros(len(nodes), np.int64),
        scalars=new_scalars(start.displacement, direction),
    )
    refresh_shear(state)
    return state
