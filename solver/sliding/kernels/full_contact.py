"""Slide the pin from event to event with the whole contact: the loop around `next_event` and the cascade."""

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.compiled import compiled
from nanoslip.solver.contact.kernels.cascade import resolve
from nanoslip.solver.contact.kernels.contact_change import project_onto_pin
from nanoslip.solver.contact.kernels.enumerations import EventKind, Stop
from nanoslip.solver.contact.kernels.equilibrium import RESIDUAL_LIMIT, equilibrium_residual, total_shear
from nanoslip.solver.contact.kernels.next_event import next_event
from nanoslip.solver.contact.kernels.state import KernelConstants, KernelState, start_event
from nanoslip.solver.contact.kernels.vectors import move_along
from nanoslip.solver.contact.kernels.violations import limited, on_steep_flank
from nanoslip.solver.sliding.kernels.events import Events, add_slips
from nanoslip.solver.sliding.kernels.step import overshot, smallest_step

CHECK_EVENTS = 64
"""Events after which the equilibrium residual is computed, changes of the contact or not."""

CREATED = 1e-14
"""Energy that rounding may create in one event, as a share of the load times what it displaces (W² / G)."""


@compiled()
def advance(state: KernelState, step: float) -> None:
    """Move the pin by `step`, every contact node stuck to it."""
    move_along(state.response, step, state.rate)
    for i in range(len(state.x)):
        if state.contact[i]:
            state.inputs[i] += step
    state.scalars.displacement += step


@compiled()
def stretching(state: KernelState) -> float:
    """By how much shear and its limits change per displacement of the pin, all nodes together."""
    n, stiffness = len(state.x), 0.0
    for i in range(n):
        if state.contact[i]:
            stiffness += abs(state.rate[i]) + state.node_friction[i] * abs(state.rate[n + i])
    return stiffness


@compiled()
def overshoot(state: KernelState, opposite: float) -> float:
    """By how much limited shear exceeds μ_i·pressure, all nodes together."""
    n, total = len(state.x), 0.0
    for i in range(n):
        excess = limited(state.response[i], opposite) + state.active_friction[i] * state.response[n + i]
        total += excess if excess > 0.0 else 0.0
    return total


@compiled()
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


@compiled()
def _left_window(state: KernelState, constants: KernelConstants) -> bool:
    """Whether a rough pin has moved, or sunk, or the surface heaved so far that nodes beyond the window could meet it."""
    displacement, left, right = constants.window_until
    n, y = len(state.x), state.response
    return bool(state.scalars.displacement > displacement or y[n] > left or y[2 * n - 1] > right)


@compiled()
def _answer(state: KernelState, constants: KernelConstants, kind: EventKind, node: int) -> Stop:
    """The cascade of one event; DONE, or why the event means nothing."""
    start_event(state.scalars, state.node_slips)
    if overshot(constants.slip, overshoot(state, constants.slip.opposite), len(state.x)):
        return Stop.OVERSHOT
    status = resolve(state, constants, kind, node, 1.0)
    created = state.scalars.dissipated < -CREATED * state.inputs[-1] * state.inputs[-1]
    if status == Stop.DONE and created and on_steep_flank(state, constants, True):
        return Stop.STEEP
    return status


@compiled()
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
