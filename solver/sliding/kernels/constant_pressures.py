"""Sliding with constant pressures, compiled: shear alone, so that a slip is one row of the tangential tableau.

Over the m nodes of the contact, with their displacements u along x as inputs:

    shear = base + u @ tableau              (row i: the shear forces per displacement of node i)

`base` holds what the constant normal forces contribute.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.arrays import Floats
from nanoslip.solver.compiled import declare_kernel
from nanoslip.solver.contact.kernels.events import (
    HALF_PLACE,
    REFRESH_SLIPS,
    TIE,
    bits,
    from_front,
    highest_ranked,
    limit_shear,
    rank_ratio,
    reversing_bits,
)
from nanoslip.solver.contact.kernels.path import (
    Events,
    add_slips,
    note_event,
    note_trigger,
    overshot,
    smallest_step,
    step_blur,
)
from nanoslip.solver.contact.kernels.state import (
    EventKind,
    Scalars,
    SlipConstants,
    Stop,
    add_row,
    advance_quantities,
    start_event,
)


class TangentialState(NamedTuple):
    """State of a contact with constant pressures; arrays over its m nodes are changed in place."""

    tableau: Floats
    """(m, at least m), row i: response to u of node i, then padding."""
    base: Floats
    """(m,) shear at u = 0."""
    shear: Floats
    """(m,) f_x"""
    u: Floats
    """(m,)"""
    rate: Floats
    """(m,) shear per unit step along the path."""
    shear_limit: Floats
    """(m,) τ_0·area + μ_i N; infinite if a node never slips."""
    limits: float
    """The sum of all limits; infinite if nodes never slip."""
    weights: Floats
    """(m,) 1/shear_limit, with the tolerance as smallest limit."""
    nodes: NDArray[np.int32]
    """(m,) surface node that each is."""
    node_slips: NDArray[np.int64]
    """(m,) slips of each node in the current event."""
    scalars: Scalars


@declare_kernel(entry=True)
def refresh_shear(state: TangentialState) -> None:
    """Sum the shear afresh."""
    for i in range(len(state.u)):
        state.shear[i] = state.base[i]
    for i in range(len(state.u)):
        add_row(state.shear, state.u[i], state.tableau[i])
    state.scalars.slips_since_refresh = 0


@declare_kernel(error_model="numpy")
def _worst_violation(
    shear: Floats, shear_limit: Floats, weights: Floats, tolerance: float, opposite: float, ahead: int
) -> int:
    """The node with the largest limited shear over its limit, of ties the node further ahead, or -1; without a
    branch, as in `nanoslip.solver.contact.kernels.events.worst_violation`."""
    cut, shifted, turned = 0, 0, reversing_bits(ahead)
    for i in range(len(shear)):
        size = limit_shear(shear[i], opposite)
        # Limits stay constant here, so that their inverses are kept: a product takes a fraction of a
        # division's time.
        ratio = bits(size * weights[i])
        offends = size - shear_limit[i] > tolerance
        cut = max(cut, rank_ratio(ratio, i ^ turned) if offends else 0)
        shifted = max(shifted, rank_ratio(ratio + HALF_PLACE, i ^ turned) if offends else 0)
    return highest_ranked(cut, shifted, turned)


@declare_kernel(inline="always")
def _distance(shear: Floats, tableau: Floats, shear_limit: Floats, residual_shear: float, i: int) -> float:
    """Distance that node i slips, the others held, until residual_shear of its limit is left of its shear."""
    # Shear falls by tableau[i, i] per distance, from its value to ±left.
    left = residual_shear * shear_limit[i]
    target = left if shear[i] > 0.0 else -left
    return float((target - shear[i]) / tableau[i, i])


@declare_kernel(inline="always")
def _displace(shear: Floats, tableau: Floats, u: Floats, i: int, along: float) -> float:
    """Displace node i; returns the work that its shear does on the slab."""
    before = shear[i]
    add_row(shear, along, tableau[i])
    u[i] += along
    # Shear is linear in the way: the mean of both ends gives its work exactly.
    return float(0.5 * (before + shear[i]) * along)


@declare_kernel()
def _slip_in_turn(state: TangentialState, constants: SlipConstants, first: int) -> Stop:
    """Slip `first`, then the worst offender, the others held, until none is left.

    The arrays are taken out of the state once, not for every slip.
    """
    shear, tableau, u, scalars = state.shear, state.tableau, state.u, state.scalars
    shear_limit, weights, node_slips = state.shear_limit, state.weights, state.node_slips
    node, residual_shear, tolerance = first, constants.residual_shear, constants.tolerance
    while node >= 0:
        if scalars.slips >= constants.cascade_limit:
            return Stop.CASCADE_LIMIT
        # Without a resistance of its own (an indefinite compliance) no slip lowers the node's shear.
        if not tableau[node, node] > 0.0:
            return Stop.SLIP_UNBOUNDED
        along = _distance(shear, tableau, shear_limit, residual_shear, node)
        scalars.dissipated -= _displace(shear, tableau, u, node, along)
        node_slips[node] += 1
        scalars.slips += 1
        scalars.slips_since_refresh += 1
        if scalars.slips_since_refresh >= REFRESH_SLIPS:
            refresh_shear(state)
        node = _worst_violation(shear, shear_limit, weights, tolerance, constants.opposite, scalars.ahead)
    return Stop.DONE


@declare_kernel(allocates=True)
def _slip_together(state: TangentialState, constants: SlipConstants, first: int) -> Stop:
    """Resolve a cascade in rounds: every offender of a round slips by the distance it would slip alone."""
    shear, tableau, u, scalars, m = state.shear, state.tableau, state.u, state.scalars, len(state.u)
    # All distances are found before any node moves, so that the order of nodes does not matter.
    along = np.zeros(m)
    while True:
        offenders = 0
        for i in range(m):
            slips = limit_shear(shear[i], constants.opposite) - state.shear_limit[i] > constants.tolerance or i == first
            along[i] = _distance(shear, tableau, state.shear_limit, constants.residual_shear, i) if slips else 0.0
            offenders += slips
            if slips and not tableau[i, i] > 0.0:
                return Stop.SLIP_UNBOUNDED
        if offenders == 0:
            return Stop.DONE
        if scalars.slips >= constants.cascade_limit:
            return Stop.CASCADE_LIMIT
        # The trigger slips unasked in the first round only.
        first = -1
        for i in range(m):
            if along[i] != 0.0:
                scalars.dissipated -= _displace(shear, tableau, u, i, along[i])
                state.node_slips[i] += 1
                scalars.slips += 1
                scalars.slips_since_refresh += 1
        if scalars.slips_since_refresh >= REFRESH_SLIPS:
            refresh_shear(state)


@declare_kernel()
def _next_slip(state: TangentialState, opposite: float, blur: float) -> tuple[float, int]:
    """Smallest step of the pin at which a node reaches its limit, and the node, of ties (see `next_event`) the node
    further ahead; infinite and -1 if no node does."""
    nearest, node, m = np.inf, -1, len(state.u)
    for k in range(m):
        i = from_front(k, m, state.scalars.ahead)
        # Shear that falls heads for the opposite limit; the factor 0 stands for none.
        sign = 1.0 if state.rate[i] > 0.0 else opposite
        speed = sign * state.rate[i]
        if speed > 0.0:
            step = max(state.shear_limit[i] - sign * state.shear[i], 0.0) / speed
            if step < nearest * (1.0 - TIE) - blur:
                node = i
            nearest = min(nearest, step)
    return nearest, node


@declare_kernel(inline="always")
def _advance(state: TangentialState, step: float) -> None:
    advance_quantities(state.shear, step, state.rate)
    moved = step * state.scalars.pin_rate
    for i in range(len(state.u)):
        state.u[i] += moved
    state.scalars.displacement += moved


@declare_kernel(inline="always")
def _overshoot(state: TangentialState, opposite: float) -> float:
    """Excess of limited shear over its limits, summed over all nodes."""
    total = 0.0
    # As `overshoot` of the whole contact, with limits that no pressure changes.
    for i in range(len(state.u)):
        total += max(limit_shear(state.shear[i], opposite) - state.shear_limit[i], 0.0)
    return total


@declare_kernel(entry=True)
def slide_tangentially(
    state: TangentialState,
    constants: SlipConstants,
    events: Events,
    node_slips: NDArray[np.int64],
    first: int,
    until: float,
) -> tuple[Stop, int]:
    """Slide from event to event up to δ_p = until; returns why it stopped and how many events the record now holds.

    node_slips: (m,) slips of each node in the record, added to.
    """
    scalars = state.scalars
    # No node leaves or comes, so that K is the same after every event.
    stiffness = state.rate.sum() * scalars.pin_rate
    for e in range(first, len(events.displacement)):
        step, node = _next_slip(state, constants.opposite, step_blur(constants, stiffness))
        # The floor is that of the whole contact, so that both friction laws count events alike.
        step = max(step, smallest_step(constants, state.limits, stiffness, abs(scalars.displacement)))
        left = (until - scalars.displacement) * scalars.pin_rate
        if node < 0 and left == np.inf:
            return Stop.NO_EVENT, e
        if step >= left:
            _advance(state, left)
            return Stop.DONE, e
        _advance(state, step)
        note_trigger(events, e, scalars, state.shear.sum(), EventKind.SLIP, state.nodes[node])
        status = _answer_event(state, constants, node)
        if status != Stop.DONE:
            return status, e
        note_event(events, e, scalars, state.shear.sum(), len(state.u))
        events.stiffness[e] = stiffness
        events.extent[e] = add_slips(node_slips, state.node_slips)
    return Stop.FULL, len(events.displacement)


@declare_kernel(inline="always")
def _answer_event(state: TangentialState, constants: SlipConstants, node: int) -> Stop:
    """Run the slips of an event; DONE, or why the event is invalid."""
    start_event(state.scalars, state.node_slips)
    if overshot(constants, state.limits, _overshoot(state, constants.opposite), len(state.u)):
        return Stop.OVERSHOT
    return _slip_offenders(state, constants, node, constants.simultaneous)


@declare_kernel()
def _slip_offenders(state: TangentialState, constants: SlipConstants, first: int, simultaneous: bool | None) -> Stop:
    """Slips in the order of the slip rule."""
    if simultaneous is None:
        return _slip_in_turn(state, constants, first)
    return _slip_together(state, constants, first)
