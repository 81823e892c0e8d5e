"""The cascade: what triggers an event is answered, then the worst violation until none is left."""

import numpy as np

from nanoslip.solver.compiled import compiled
from nanoslip.solver.contact.kernels.contact_change import displace, release_node, touch_node
from nanoslip.solver.contact.kernels.enumerations import EventKind, Stop
from nanoslip.solver.contact.kernels.equilibrium import refresh
from nanoslip.solver.contact.kernels.slip_distance import slip_move
from nanoslip.solver.contact.kernels.state import KernelConstants, KernelState
from nanoslip.solver.contact.kernels.violations import (
    deepest_penetration,
    largest_tension,
    limited,
    on_steep_flank,
    worst_violation,
)

REFRESH_SLIPS = 65536
"""Slips after which the response is summed afresh: rounding of a vector sum stays below 1e-12."""

CHANGES_PER_NODE = 20
"""Touches and releases in one cascade, per node, after which they count as a cycle."""


@compiled()
def _slip_in_turn(state: KernelState, constants: KernelConstants, first: int) -> tuple[Stop, EventKind, int]:
    """Slip `first` (if any), then the worst offender, the others held, until none is left or a node must be released.

    Returns why it stops, and RELEASE with its node or NOTHING with -1. The arrays are taken out of the state once,
    not for every slip.
    """
    n, tolerance, pin, residual_shear = (
        len(state.x),
        constants.slip.tolerance,
        constants.pin,
        constants.slip.residual_shear,
    )
    y, tableau, inputs, x, scalars = state.response, state.tableau, state.inputs, state.x, state.scalars
    shear, normal, contact = y[:n], y[n : 2 * n], state.contact
    node_friction, active_friction, node_slips = state.node_friction, state.active_friction, state.node_slips
    displacement, opposite = scalars.displacement, constants.slip.opposite
    node = first
    while True:
        if node < 0:
            node, tension = worst_violation(shear, normal, active_friction, contact, tolerance, opposite)
            if tension > tolerance:
                return Stop.DONE, EventKind.RELEASE, largest_tension(state, constants)
            if node < 0:
                return Stop.DONE, EventKind.NOTHING, -1
        if scalars.slips >= constants.slip.cascade_limit:
            return Stop.CASCADE_LIMIT, EventKind.NOTHING, -1
        xi = x[node] + inputs[node] - displacement
        along, down = slip_move(y, tableau, node_friction, node, xi, pin, residual_shear)
        if not abs(along) < np.inf:
            return Stop.SLIP_UNBOUNDED, EventKind.NOTHING, -1
        scalars.dissipated -= displace(y, tableau, inputs, node, along, down)
        node_slips[node] += 1
        scalars.slips += 1
        scalars.slips_since_refresh += 1
        if abs(xi + along) > constants.half_width:
            return Stop.DONE, EventKind.RELEASE, node
        if scalars.slips_since_refresh >= REFRESH_SLIPS:
            refresh(state)
        node = -1


@compiled(allocates=True)
def _slip_together(state: KernelState, constants: KernelConstants, first: int) -> tuple[Stop, EventKind, int]:
    """The same by rounds: every offender of a round slips by the distance it would slip alone."""
    n, tolerance, y, displacement = len(state.x), constants.slip.tolerance, state.response, state.scalars.displacement
    opposite = constants.slip.opposite
    along, down = np.zeros(n), np.zeros(n)
    while True:
        worst, tension = worst_violation(y[:n], y[n : 2 * n], state.active_friction, state.contact, tolerance, opposite)
        if tension > tolerance:
            return Stop.DONE, EventKind.RELEASE, largest_tension(state, constants)
        if worst < 0 and first < 0:
            return Stop.DONE, EventKind.NOTHING, -1
        if state.scalars.slips >= constants.slip.cascade_limit:
            return Stop.CASCADE_LIMIT, EventKind.NOTHING, -1
        for i in range(n):
            along[i] = 0.0
            size = limited(y[i], opposite)
            offends = size > tolerance and size + state.active_friction[i] * y[n + i] > tolerance
            if offends or i in (first, worst):  # the worst one may offend by the rounding of the search alone
                xi = state.x[i] + state.inputs[i] - displacement
                along[i], down[i] = slip_move(
                    y, state.tableau, state.node_friction, i, xi, constants.pin, constants.slip.residual_shear
                )
                if not abs(along[i]) < np.inf:
                    return Stop.SLIP_UNBOUNDED, EventKind.NOTHING, -1
        left, first = -1, -1
        for i in range(n):
            if along[i] != 0.0:
                state.scalars.dissipated -= displace(y, state.tableau, state.inputs, i, along[i], down[i])
                state.node_slips[i] += 1
                state.scalars.slips += 1
                state.scalars.slips_since_refresh += 1
                if abs(state.x[i] + state.inputs[i] - displacement) > constants.half_width:
                    left = i
        if left >= 0:
            return Stop.DONE, EventKind.RELEASE, left
        if state.scalars.slips_since_refresh >= REFRESH_SLIPS:
            refresh(state)


@compiled()
def _change_contact(state: KernelState, constants: KernelConstants, kind: EventKind, i: int, pin_rate: float) -> Stop:
    """Release node i or bring it into contact; DONE or why not."""
    if kind == EventKind.RELEASE:
        if state.contact.sum() == 1:
            return Stop.CONTACT_LOST
        return Stop.DONE if release_node(state, i, pin_rate) else Stop.SLIP_UNBOUNDED
    xi = state.x[i] + state.response[i] - state.scalars.displacement
    if abs(state.x[i]) > constants.half_width or abs(xi) > constants.half_width:
        # The sharp edge of a punch meets a node that was not under it, or has passed over one within a step of the floor:
        # neither side of the edge is an equilibrium.
        return Stop.EDGE_REACHED
    return Stop.DONE if touch_node(state, constants, i, pin_rate) else Stop.SLIP_UNBOUNDED


@compiled()
def resolve(state: KernelState, constants: KernelConstants, kind: EventKind, node: int, pin_rate: float) -> Stop:
    """The cascade: answer the trigger, then the worst violation until none is left: tension, then shear, then penetration.

    kind, node: what triggers it; NOTHING, -1 where the cascade begins with its worst violation. pin_rate: how far nodes in
    contact move per unit step of the rate: 1 where the pin moves, 0 where the load does. Nodes that take turns in touching
    and leaving for ever are a CONTACT_CYCLE: a change costs what hundreds of slips do, so few are waited for.
    """
    changes, most = 0, 100 + CHANGES_PER_NODE * len(state.x)
    while True:
        if kind in (EventKind.RELEASE, EventKind.TOUCH):
            changes += 1
            if changes > most:
                return Stop.CONTACT_CYCLE
            status = _change_contact(state, constants, kind, node, pin_rate)
            if status != Stop.DONE:
                return status
            node = -1
        if constants.slip.simultaneous:
            status, kind, node = _slip_together(state, constants, node)
        else:
            status, kind, node = _slip_in_turn(state, constants, node)
        if status != Stop.DONE:
            return status
        if kind == EventKind.NOTHING:
            node = deepest_penetration(state, constants)
            if node < 0:
                return _soundness(state, constants)
            kind = EventKind.TOUCH


@compiled()
def answer_violations(state: KernelState, constants: KernelConstants, pin_rate: float) -> Stop:
    """The cascade that begins with the worst violation. Python calls it: numba takes long to recognise an EventKind."""
    nowhere = int(np.int64(-1))  # for a plain -1 numba would compile the whole cascade once more
    return resolve(state, constants, EventKind.NOTHING, nowhere, pin_rate)


@compiled()
def _soundness(state: KernelState, constants: KernelConstants) -> Stop:
    """DONE where the end of a cascade means something: all numbers finite (none of the comparisons above sees a NaN), and
    no node on a flank steeper than STEEPEST."""
    for k in range(len(state.response)):
        if not abs(state.response[k]) < np.inf:
            return Stop.NOT_FINITE
    return Stop.STEEP if on_steep_flank(state, constants, False) else Stop.DONE
