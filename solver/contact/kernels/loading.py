"""Raise the load event by event, the pin held."""

from nanoslip.solver.compiled import compiled
from nanoslip.solver.contact.kernels.cascade import resolve
from nanoslip.solver.contact.kernels.enumerations import EventKind, Stop
from nanoslip.solver.contact.kernels.next_event import next_event
from nanoslip.solver.contact.kernels.state import KernelConstants, KernelState
from nanoslip.solver.contact.kernels.vectors import move_along


@compiled()
def raise_load(state: KernelState, constants: KernelConstants, target: float) -> Stop:
    """Raise the load to `target` event by event, the pin held; slips are counted in `scalars`."""
    n = len(state.x)
    floor = 1e-9 * target
    while True:
        left = target + state.inputs[2 * n]
        if left <= 0.0:
            return Stop.DONE
        step, kind, node = next_event(state, constants, 0.0)
        last = step >= left
        step = left if last else min(max(step, floor), left)
        move_along(state.response, step, state.rate)
        state.inputs[2 * n] = -target if step == left else state.inputs[2 * n] - step
        if last:
            kind, node = EventKind.NOTHING, -1
        status = resolve(state, constants, kind, node, 0.0)
        if status != Stop.DONE:
            return status
        if state.scalars.touches_near_end:
            return Stop.WINDOW_TOO_NARROW
