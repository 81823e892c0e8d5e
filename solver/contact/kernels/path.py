"""The path of pin and load from event to event, compiled: the loop around `next_event` and the cascade; columns of events."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.arrays import Floats
from nanoslip.solver.compiled import declare_kernel
from nanoslip.solver.contact.kernels.events import driven_downhill, limit_shear, next_event, project_onto_pin, resolve
from nanoslip.solver.contact.kernels.state import (
    RESIDUAL_LIMIT,
    EventKind,
    KernelConstants,
    KernelState,
    Scalars,
    SlipConstants,
    Stop,
    advance_path,
    equilibrium_residual,
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
    load: Floats


@declare_kernel(inline="always")
def note_trigger(events: Events, e: int, scalars: Scalars, force: float, kind: EventKind, node: int) -> None:
    """Row e of the record as its cascade begins."""
    events.displacement[e] = scalars.displacement
    events.force_before[e] = force
    events.kind[e] = kind
    events.node[e] = node


@declare_kernel(inline="always")
def note_event(events: Events, e: int, scalars: Scalars, force: float, nodes: int) -> None:
    """Row e of the record once its cascade is over."""
    events.force_after[e] = force
    events.dissipated[e] = scalars.dissipated
    events.slips[e] = scalars.slips
    events.releases[e] = scalars.releases
    events.touches[e] = scalars.touches
    events.contact_size[e] = nodes


@declare_kernel(inline="always")
def add_slips(total: NDArray[np.int64], node_slips: NDArray[np.int64]) -> int:
    """Add an event's slips of each node, (n,), to the record's totals; returns how many nodes slipped."""
    extent = 0
    for i in range(len(node_slips)):
        total[i] += node_slips[i]
        extent += node_slips[i] > 0
    return extent


# The smallest step, and by how much it may push shear beyond its limits.

STRETCHES = 24.0
"""The event floor counts in node spacings, or in this many stretches of the contact if these are shorter.

A stretch is the displacement that would raise the friction force of a sticking contact from 0 to the sum of all
limits."""

OVERSHOOT = 1e-4
"""Shear that may exceed its limit before an event, summed over all nodes, as a share of all limits together."""


@declare_kernel(inline="always")
def step_blur(constants: SlipConstants, stiffness: float) -> float:
    """Step that changes no force by more than a tenth of the tolerance: steps that differ by less count as equal."""
    return 0.1 * constants.tolerance / stiffness if stiffness > 0.0 else 0.0


@declare_kernel(inline="always")
def smallest_step(constants: SlipConstants, limits: float, stiffness: float, displacement: float) -> float:
    """The event floor as a length, at δ_p = displacement. limits: of all nodes together.

    It is in stretches of the contact if these are shorter than a node spacing (not in the paper's case), and large enough to
    change a force beyond its tolerance and δ_p beyond rounding. stiffness: change of shear and its limits per displacement.
    """
    # Two units of rounding of δ_p: less might not move it at all.
    least = 4.5e-16 * displacement
    # Without friction or sticking nodes (or with a NaN) no force gives a length.
    if not stiffness > 0.0:
        return float(max(constants.event_floor * constants.spacing, least))
    unit = min(constants.spacing, STRETCHES * limits / stiffness)
    return float(max(constants.event_floor * unit, step_blur(constants, stiffness), least))


@declare_kernel(inline="always")
def overshot(constants: SlipConstants, limits: float, overshoot: float, nodes: int) -> bool:
    """True if shear exceeds its limits by too much, summed over all nodes, or is not a number. limits: of all nodes together."""
    return not overshoot <= OVERSHOOT * limits + nodes * constants.tolerance


CHECK_EVENTS = 64
"""Events after which the equilibrium residual is computed, changes of the contact or not."""


WIDE = 256
"""Nodes of a window above which its matrix, no longer in a processor's cache, is read for the residual less often."""
CHECK_WIDE = 1024
"""Events after which the residual of a wide window is computed, beside that after REFRESH_CHANGES."""


@declare_kernel(inline="always")
def _is_due(state: KernelState, event: int) -> bool:
    """True if the equilibrium residual is to be computed after this event, one with changes or the last of CHECK_EVENTS."""
    return len(state.x) <= WIDE or event % CHECK_WIDE == 0


@declare_kernel(inline="always")
def limits_together(state: KernelState, constants: SlipConstants) -> float:
    """Limits of shear of all nodes in contact, summed: μ_i·W, as all of the load is theirs, and their strengths."""
    total = constants.friction_bound
    for i in range(len(state.x)):
        total += state.node_strength[i] if state.contact[i] else 0.0
    return total


@declare_kernel(inline="always")
def stretching(state: KernelState) -> float:
    """Change of shear and its limits per unit step along the path, summed over all nodes."""
    n, stiffness = len(state.x), 0.0
    # |T_i| - L_i of node i rises by at most |T_i'| + μ_i |N_i'| per step; its strength does not change.
    for i in range(n):
        if state.contact[i]:
            stiffness += abs(state.rate[i]) + state.node_friction[i] * abs(state.rate[n + i])
    return stiffness


@declare_kernel(inline="always")
def limits_and_overshoot(state: KernelState, constants: SlipConstants) -> tuple[float, float]:
    """Limits of shear of all nodes in contact (`limits_together`), and the excess of limited shear over them, each summed: in one
    loop, as one sum waits for its last addition and two wait together."""
    n, limits, beyond = len(state.x), constants.friction_bound, 0.0
    # NaN, of a free node or one that never slips, is not above 0 and adds nothing.
    for i in range(n):
        limits += state.node_strength[i] if state.contact[i] else 0.0
        borne = state.node_strength[i] - state.active_friction[i] * state.response[n + i]
        excess = limit_shear(state.response[i], constants.opposite) - borne
        beyond += excess if excess > 0.0 else 0.0
    return limits, beyond


@declare_kernel(inline="always")
def _floor(state: KernelState, constants: SlipConstants, stiffness: float, limits: float) -> float:
    """The smallest step along the path; of a load, `load_floor`, or a smaller step that pushes shear beyond its
    limits by half of OVERSHOOT.

    stiffness: as from `stretching`. limits: of all nodes together; with larger ones it is no shorter.
    """
    # A moving pin has lengths to count in, a growing load has not.
    if state.scalars.pin_rate != 0.0:
        return float(smallest_step(constants, limits, stiffness, abs(state.scalars.displacement)))
    if not stiffness > 0.0:
        return constants.load_floor
    # Shear exceeds its limits by `stiffness` per step at most, all nodes together: with half of OVERSHOOT
    # the check in `answer_event` has room for rounding.
    most = max(0.5 * OVERSHOOT * limits, 0.1 * constants.tolerance)
    return float(min(constants.load_floor, most / stiffness))


@declare_kernel(inline="always")
def _lengthen_step(state: KernelState, constants: SlipConstants, stiffness: float, step: float) -> float:
    """The step, or the smallest one if that is longer."""
    # Nearly all steps are longer than any smallest one, for which no limits need to be summed.
    if step >= _floor(state, constants, stiffness, np.inf):
        return step
    return max(step, _floor(state, constants, stiffness, limits_together(state, constants)))


@declare_kernel(inline="always")
def _remaining_length(state: KernelState, until: float) -> float:
    """Length of the path up to δ_p = until, or up to this load where the pin rests."""
    scalars = state.scalars
    if scalars.pin_rate == 0.0:
        # The last input is -W.
        return float((until + state.inputs[2 * len(state.x)]) * scalars.load_rate)
    return float((until - scalars.displacement) * scalars.pin_rate)


@declare_kernel(inline="always")
def _sum_over_contact(state: KernelState) -> tuple[float, float, int]:
    """Shear and its rate, summed over the nodes in contact, and the number of these."""
    shear, shear_rate, nodes = 0.0, 0.0, 0
    for i in range(len(state.x)):
        shear += state.response[i] if state.contact[i] else 0.0
        shear_rate += state.rate[i] if state.contact[i] else 0.0
        nodes += state.contact[i]
    return shear, shear_rate, nodes


@declare_kernel(entry=True)
def follow_path(
    state: KernelState,
    constants: KernelConstants,
    events: Events,
    node_slips: NDArray[np.int64],
    first: int,
    until: float,
) -> tuple[Stop, int]:
    """Follow the path from event to event; returns why it stopped and how many events the record now holds.

    until: δ_p, or the load where the pin rests, at which the path ends. node_slips: (n,) slips of each node, added to.
    """
    scalars = state.scalars
    for e in range(first, len(events.displacement)):
        stiffness = stretching(state)
        step, kind, node = next_event(state, constants, step_blur(constants.slip, stiffness))
        left = _remaining_length(state, until)
        # No event and no end: the step would be infinite.
        if node < 0 and left == np.inf:
            return Stop.NO_EVENT, e
        if step >= left:
            advance_path(state, left)
            return Stop.DONE, e
        # A floor beyond the end of the run does not hide the event before it.
        advance_path(state, min(_lengthen_step(state, constants.slip, stiffness, step), left))
        note_trigger(events, e, scalars, total_shear(state.contact, state.response), kind, node)
        status = answer_event(state, constants, kind, node)
        if status != Stop.DONE:
            return status, e
        force, force_rate, nodes = _sum_over_contact(state)
        note_event(events, e, scalars, force, nodes)
        # The rate is per step along the path: backward it has the other sign per displacement.
        events.stiffness[e] = force_rate * scalars.pin_rate
        events.extent[e] = add_slips(node_slips, state.node_slips)
        events.load[e] = -state.inputs[2 * len(state.x)]
        if scalars.touches_near_end or has_left_window(
            constants.window_until, state, scalars.pin_rate * scalars.displacement
        ):
            # This event is sound and stays in the record: only the next one may need nodes beyond the window.
            return Stop.WINDOW_TOO_NARROW, e + 1
        if scalars.releases + scalars.touches > 0 or e % CHECK_EVENTS == 0:
            # Slips follow the parabola exactly but for rounding, which no later slip would undo.
            project_onto_pin(state, constants)
            if _is_due(state, e):
                scalars.residual = max(scalars.residual, equilibrium_residual(state))
        if scalars.residual > RESIDUAL_LIMIT:
            return Stop.INACCURATE, e + 1
    return Stop.FULL, len(events.displacement)


@declare_kernel()
def has_left_window(
    window_until: tuple[float, NDArray[np.int64], Floats] | None, state: KernelState, moved: float
) -> bool:
    """True if nodes beyond the window could meet a rough pin, as it has moved so far or sunk or the surface has heaved."""
    if window_until is None:
        return False
    displacement, ends, heights = window_until
    n, y = len(state.x), state.response
    for k in range(len(ends)):
        if y[n + ends[k]] > heights[k]:
            return True
    return moved > displacement


@declare_kernel(inline="always")
def answer_event(state: KernelState, constants: KernelConstants, kind: EventKind, node: int) -> Stop:
    """Run the cascade of an event; DONE, or why the event is invalid."""
    start_event(state.scalars, state.node_slips)
    # Before the cascade, which would hide that the step went too far.
    limits, beyond = limits_and_overshoot(state, constants.slip)
    if overshot(constants.slip, limits, beyond, len(state.x)):
        return Stop.OVERSHOT
    last = 2 * len(state.x)
    approach = state.response[last]
    status = resolve(state, constants, kind, node)
    # In a cascade the load is constant and the pin only sinks or rises under it. The input is -W.
    state.scalars.load_work -= state.inputs[last] * (state.response[last] - approach)
    return Stop.DOWNHILL if status == Stop.DONE and driven_downhill(state, constants) else status
