"""Sliding from event to event, compiled: on the tableau, and with constant pressures; and the columns of events that it fills."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.compiled import compiled
from nanoslip.solver.contact.kernels.events import (
    HALF_PLACE,
    REFRESH_SLIPS,
    TIE,
    bits,
    driven_downhill,
    highest_ranked,
    limited,
    next_event,
    project_onto_pin,
    ranked,
    resolve,
)
from nanoslip.solver.contact.kernels.state import (
    RESIDUAL_LIMIT,
    EventKind,
    Floats,
    KernelConstants,
    KernelState,
    Scalars,
    SlipConstants,
    Stop,
    add,
    equilibrium_residual,
    move_along,
    start_event,
    total_shear,
)


class Events(NamedTuple):
    """Columns of a friction record in the making (see FrictionRecord), each of shape (capacity,)."""

    displacement: Floats
    force_before: Floats
    force_after: Floats
    stiffness: Floats
    dissipated: Floats
    kind: NDArray[np.int8]
    node: NDArray[np.int32]
    slips: NDArray[np.int64]
    releases: NDArray[np.int32]
    touches: NDArray[np.int32]
    contact_size: NDArray[np.int32]
    extent: NDArray[np.int32]


@compiled(inline="always")
def add_slips(total: NDArray[np.int64], node_slips: NDArray[np.int64]) -> int:
    """Add the slips of each node (n,) in one event to those of the record; returns how many nodes slipped."""
    extent = 0
    for i in range(len(node_slips)):
        total[i] += node_slips[i]
        extent += node_slips[i] > 0
    return extent


@compiled(entry=True)
def cycle(node: NDArray[np.int32], before: Floats, after: Floats) -> int:
    """Number of events after which the last of these repeat themselves; 0 where they do not (see `cycle_of`)."""
    last, fallen = len(node) - 1, 0.0
    for period in range(1, len(node) // 3 + 1):
        fallen = max(fallen, abs(before[last - period + 1] - after[last - period + 1]))
        now = last
        while (
            now > last - 2 * period
            and node[now] == node[now - period]
            and abs(after[now] - after[now - period]) <= 1e-3 * fallen
        ):
            now -= 1
        if now == last - 2 * period:
            return period
    return 0


# The smallest step of the pin, and by how much it may push shear beyond its limits.

STRETCHES = 24.0
"""The event floor counts in node spacings, or in this many stretches of the contact where those are shorter.

A stretch is the displacement that would raise the friction force of a sticking contact from 0 to μ_i·W."""

OVERSHOOT = 1e-4
"""What shear may exceed its limit by before an event, all nodes together, as a share of μ_i·W."""


@compiled(inline="always")
def smallest_step(constants: SlipConstants, stiffness: float, displacement: float) -> float:
    """The event floor as a length, at δ_p = displacement.

    It is in stretches of the contact if these are shorter than a node spacing (not in the paper's case), and large enough to
    change a force beyond its tolerance and δ_p beyond rounding. stiffness: change of shear and its limits per displacement.
    """
    least = 4.5e-16 * displacement
    if not stiffness > 0.0:
        return float(max(constants.event_floor * constants.spacing, least))
    unit = min(constants.spacing, STRETCHES * constants.friction_bound / stiffness)
    return float(max(constants.event_floor * unit, 0.1 * constants.tolerance / stiffness, least))


@compiled(inline="always")
def overshot(constants: SlipConstants, overshoot: float, nodes: int) -> bool:
    """Whether shear exceeds its limits by too much, all nodes together; so does what is not a number."""
    return not overshoot <= OVERSHOOT * constants.friction_bound + nodes * constants.tolerance


# Slide the pin from event to event with the whole contact: the loop around `next_event` and the cascade.

CHECK_EVENTS = 64
"""Events after which the equilibrium residual is computed, changes of the contact or not."""


@compiled()
def advance(state: KernelState, step: float) -> None:
    """Move the pin by `step`, every contact node stuck to it."""
    move_along(state.response, step, state.rate)
    for i in range(len(state.x)):
        if state.contact[i]:
            state.inputs[i] += step
    state.scalars.displacement += step


@compiled(inline="always")
def stretching(state: KernelState) -> float:
    """By how much shear and its limits change per displacement of the pin, all nodes together."""
    n, stiffness = len(state.x), 0.0
    for i in range(n):
        if state.contact[i]:
            stiffness += abs(state.rate[i]) + state.node_friction[i] * abs(state.rate[n + i])
    return stiffness


@compiled(inline="always")
def overshoot(state: KernelState, opposite: float) -> float:
    """By how much limited shear exceeds μ_i·pressure, all nodes together."""
    n, total = len(state.x), 0.0
    for i in range(n):
        excess = limited(state.response[i], opposite) + state.active_friction[i] * state.response[n + i]
        total += excess if excess > 0.0 else 0.0
    return total


@compiled(entry=True)
def slide_events(
    state: KernelState,
    constants: KernelConstants,
    events: Events,
    node_slips: NDArray[np.int64],
    first: int,
    farthest: float,
) -> tuple[Stop, int]:
    """Slide from event to event; returns why it stopped and how many events the record now holds.

    node_slips: (n_x,) slips of each surface node in the record, added to.
    """
    scalars = state.scalars
    of_window = node_slips[constants.first_node : constants.first_node + len(state.x)]
    for e in range(first, len(events.displacement)):
        step, kind, node = next_event(state, constants, 1.0)
        if node < 0 and farthest == np.inf:
            return Stop.NO_EVENT, e
        left = farthest - scalars.displacement
        if step >= left:
            advance(state, left)
            return Stop.DONE, e
        # A floor beyond the end of the run does not hide the event before it.
        floor = smallest_step(constants.slip, stretching(state), scalars.displacement)
        step = min(max(step, floor), left)
        advance(state, step)
        events.displacement[e] = scalars.displacement
        events.force_before[e] = total_shear(state.contact, state.response)
        events.kind[e] = kind
        events.node[e] = constants.first_node + node
        status = _answer(state, constants, kind, node)
        if status != Stop.DONE:
            return status, e
        _record(state, events, e)
        events.extent[e] = add_slips(of_window, state.node_slips)
        if scalars.touches_near_end or _left_window(state, constants):
            return Stop.WINDOW_TOO_NARROW, e + 1
        if scalars.releases + scalars.touches > 0 or e % CHECK_EVENTS == 0:
            project_onto_pin(state, constants)
            scalars.residual = max(scalars.residual, equilibrium_residual(state))
        if scalars.residual > RESIDUAL_LIMIT:
            return Stop.INACCURATE, e + 1
    return Stop.FULL, len(events.displacement)


@compiled(inline="always")
def _left_window(state: KernelState, constants: KernelConstants) -> bool:
    """Whether a rough pin has moved, or sunk, or the surface heaved so far that nodes beyond the window could meet it."""
    displacement, left, right = constants.window_until
    n, y = len(state.x), state.response
    return bool(state.scalars.displacement > displacement or y[n] > left or y[2 * n - 1] > right)


@compiled(inline="always")
def _answer(state: KernelState, constants: KernelConstants, kind: EventKind, node: int) -> Stop:
    """The cascade of one event; DONE, or why the event means nothing."""
    start_event(state.scalars, state.node_slips)
    if overshot(constants.slip, overshoot(state, constants.slip.opposite), len(state.x)):
        return Stop.OVERSHOT
    status = resolve(state, constants, kind, node, 1.0)
    return Stop.STEEP if status == Stop.DONE and driven_downhill(state, constants) else status


@compiled(inline="always")
def _record(state: KernelState, events: Events, e: int) -> None:
    """Row e of the record once its cascade is over."""
    scalars = state.scalars
    events.force_after[e] = total_shear(state.contact, state.response)
    events.stiffness[e] = total_shear(state.contact, state.rate)
    events.dissipated[e] = scalars.dissipated
    events.slips[e] = scalars.slips
    events.releases[e] = scalars.releases
    events.touches[e] = scalars.touches
    events.contact_size[e] = state.contact.sum()


# Compiled core of sliding with constant pressures: shear alone, so that a slip is one row of the tangential tableau.
#
# Over the m nodes of the contact, with their displacements u along x as inputs:
#
#     shear = base + u @ tableau              (row i: the shear forces per displacement of node i)
#
# `base` holds what the constant normal forces contribute.


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
    """(m,) shear per unit of pin displacement."""
    shear_limit: Floats
    """(m,) μ_i N; infinite where a node never slips."""
    weights: Floats
    """(m,) 1/shear_limit, with the tolerance as smallest limit."""
    nodes: NDArray[np.int32]
    """(m,) surface node that each is."""
    node_slips: NDArray[np.int64]
    """(m,) slips of each node in the current event."""
    scalars: Scalars


@compiled(entry=True)
def refresh(state: TangentialState) -> None:
    """Sum the shear afresh."""
    for i in range(len(state.u)):
        state.shear[i] = state.base[i]
    for i in range(len(state.u)):
        add(state.shear, state.u[i], state.tableau[i])
    state.scalars.slips_since_refresh = 0


@compiled(fastmath={"contract"}, error_model="numpy")
def _worst_violation(shear: Floats, shear_limit: Floats, weights: Floats, tolerance: float, opposite: float) -> int:
    """The offender with the largest limited shear over μ_i·N, of ties the one further right, or -1; without a branch, as in
    `nanoslip.solver.contact.kernels.events.worst_violation`."""
    cut, shifted = 0, 0
    for i in range(len(shear)):
        size = limited(shear[i], opposite)
        ratio = bits(size * weights[i])
        offends = size - shear_limit[i] > tolerance
        cut = max(cut, ranked(ratio, i) if offends else 0)
        shifted = max(shifted, ranked(ratio + HALF_PLACE, i) if offends else 0)
    return highest_ranked(cut, shifted)


@compiled(inline="always")
def _distance(shear: Floats, tableau: Floats, shear_limit: Floats, residual_shear: float, i: int) -> float:
    """How far node i slips, the others held, until residual_shear·μ_i·N is left of its shear."""
    left = residual_shear * shear_limit[i]
    return float(((left if shear[i] > 0.0 else -left) - shear[i]) / tableau[i, i])


@compiled(inline="always")
def _displace(shear: Floats, tableau: Floats, u: Floats, i: int, along: float) -> float:
    """Displace node i; returns the work that its shear does on the slab."""
    before = shear[i]
    add(shear, along, tableau[i])
    u[i] += along
    return float(0.5 * (before + shear[i]) * along)


@compiled()
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
        if not tableau[node, node] > 0.0:
            return Stop.SLIP_UNBOUNDED
        along = _distance(shear, tableau, shear_limit, residual_shear, node)
        scalars.dissipated -= _displace(shear, tableau, u, node, along)
        node_slips[node] += 1
        scalars.slips += 1
        scalars.slips_since_refresh += 1
        if scalars.slips_since_refresh >= REFRESH_SLIPS:
            refresh(state)
        node = _worst_violation(shear, shear_limit, weights, tolerance, constants.opposite)
    return Stop.DONE


@compiled(allocates=True)
def _slip_together(state: TangentialState, constants: SlipConstants, first: int) -> Stop:
    """The same by rounds: every offender of a round slips by the distance it would slip alone."""
    shear, tableau, u, scalars, m = state.shear, state.tableau, state.u, state.scalars, len(state.u)
    along = np.zeros(m)
    while True:
        offenders = 0
        for i in range(m):
            slips = limited(shear[i], constants.opposite) - state.shear_limit[i] > constants.tolerance or i == first
            along[i] = _distance(shear, tableau, state.shear_limit, constants.residual_shear, i) if slips else 0.0
            offenders += slips
            if slips and not tableau[i, i] > 0.0:
                return Stop.SLIP_UNBOUNDED
        if offenders == 0:
            return Stop.DONE
        if scalars.slips >= constants.cascade_limit:
            return Stop.CASCADE_LIMIT
        first = -1
        for i in range(m):
            if along[i] != 0.0:
                scalars.dissipated -= _displace(shear, tableau, u, i, along[i])
                state.node_slips[i] += 1
                scalars.slips += 1
                scalars.slips_since_refresh += 1
        if scalars.slips_since_refresh >= REFRESH_SLIPS:
            refresh(state)


@compiled()
def _next_slip(state: TangentialState, opposite: float) -> tuple[float, int]:
    """Smallest step of the pin at which a node reaches its limit, and the node, of ties the one further right; infinite and
    -1 if none does."""
    nearest, node = np.inf, -1
    for i in range(len(state.u) - 1, -1, -1):
        sign = 1.0 if state.rate[i] > 0.0 else opposite
        speed = sign * state.rate[i]
        if speed > 0.0:
            step = max(state.shear_limit[i] - sign * state.shear[i], 0.0) / speed
            if step < nearest * (1.0 - TIE):
                node = i
            nearest = min(nearest, step)
    return nearest, node


@compiled(inline="always")
def _advance(state: TangentialState, step: float) -> None:
    move_along(state.shear, step, state.rate)
    for i in range(len(state.u)):
        state.u[i] += step
    state.scalars.displacement += step


@compiled(inline="always")
def _overshoot(state: TangentialState, opposite: float) -> float:
    """By how much limited shear exceeds its limits, all nodes together."""
    total = 0.0
    for i in range(len(state.u)):
        total += max(limited(state.shear[i], opposite) - state.shear_limit[i], 0.0)
    return total


@compiled(entry=True)
def slide_tangentially(
    state: TangentialState,
    constants: SlipConstants,
    events: Events,
    node_slips: NDArray[np.int64],
    first: int,
    farthest: float,
) -> tuple[Stop, int]:
    """Slide from event to event; returns why it stopped and how many events the record now holds.

    node_slips: (m,) slips of each node in the record, added to.
    """
    stiffness, scalars = state.rate.sum(), state.scalars
    for e in range(first, len(events.displacement)):
        step, node = _next_slip(state, constants.opposite)
        position = scalars.displacement
        step = max(step, smallest_step(constants, stiffness, position))
        if node < 0 and farthest == np.inf:
            return Stop.NO_EVENT, e
        if position + step >= farthest:
            _advance(state, farthest - position)
            return Stop.DONE, e
        _advance(state, step)
        events.displacement[e] = scalars.displacement
        events.force_before[e] = state.shear.sum()
        events.kind[e] = EventKind.SLIP
        events.node[e] = state.nodes[node]
        status = _answer_event(state, constants, node)
        if status != Stop.DONE:
            return status, e
        events.force_after[e] = state.shear.sum()
        events.stiffness[e] = stiffness
        events.dissipated[e] = scalars.dissipated
        events.slips[e] = scalars.slips
        events.releases[e] = 0
        events.touches[e] = 0
        events.contact_size[e] = len(state.u)
        events.extent[e] = add_slips(node_slips, state.node_slips)
    return Stop.FULL, len(events.displacement)


@compiled(inline="always")
def _answer_event(state: TangentialState, constants: SlipConstants, node: int) -> Stop:
    """The slips of one event; DONE, or why the event means nothing."""
    start_event(state.scalars, state.node_slips)
    if overshot(constants, _overshoot(state, constants.opposite), len(state.u)):
        return Stop.OVERSHOT
    return _slip_offenders(state, constants, node, constants.simultaneous)


@compiled()
def _slip_offenders(state: TangentialState, constants: SlipConstants, first: int, simultaneous: bool | None) -> Stop:
    """Slips in the order of the slip rule."""
    if simultaneous is None:
        return _slip_in_turn(state, constants, first)
    return _slip_together(state, constants, first)
