"""Displace a node in contact; release a node or bring it into contact (a pivot of the tableau)."""

import numpy as np

from nanoslip.solver.compiled import compiled
from nanoslip.solver.contact.kernels.equilibrium import (
    equilibrium_residual,
    refresh,
    set_rate_to_displacement,
    set_rate_to_load,
)
from nanoslip.solver.contact.kernels.pin_height import BLUR, pin_height
from nanoslip.solver.contact.kernels.state import Floats, KernelConstants, KernelState
from nanoslip.solver.contact.kernels.vectors import add_two, add_two_rows

REFRESH_CHANGES = 64
"""Touches and releases after which response and rate are summed afresh."""


@compiled(allocates=True)
def pivot(state: KernelState, i: int) -> bool:
    """Exchange inputs and responses of node i (a principal pivot with a 2 × 2 block); False where the block is singular."""
    n = len(state.x)
    p, q = i, n + i
    t = state.tableau
    a, b, c, d = t[p, p], t[q, p], t[p, q], t[q, q]  # the block itself is [[a, b], [c, d]]: storage is transposed
    determinant = a * d - b * c
    scale = abs(a * d) + abs(b * c)
    if not abs(determinant) > 1e-14 * scale:
        return False
    ia, ib, ic, id_ = d / determinant, -b / determinant, -c / determinant, a / determinant
    row_p, row_q = t[p].copy(), t[q].copy()
    for j in range(2 * n + 1):
        if j not in (p, q):
            # What the pivot's two inputs must be to hold its old responses, per unit of input j.
            first = -(ia * t[j, p] + ib * t[j, q])
            second = -(ic * t[j, p] + id_ * t[j, q])
            add_two(t[j], first, row_p, second, row_q)
            t[j, p], t[j, q] = first, second
    for j in range(
        2 * n + 1
    ):  # whole rows at once take numba a second longer to compile: what it says of shapes is a text
        t[p, j], t[q, j] = ia * row_p[j] + ic * row_q[j], ib * row_p[j] + id_ * row_q[j]
    t[p, p], t[p, q], t[q, p], t[q, q] = ia, ic, ib, id_
    for row in (p, q):
        state.inputs[row], state.response[row] = state.response[row], state.inputs[row]
    state.contact[i] = not state.contact[i]
    state.active_friction[i] = state.node_friction[i] if state.contact[i] and not state.sticks[i] else np.nan
    return True


@compiled(inline="always")
def displace(y: Floats, tableau: Floats, inputs: Floats, i: int, along: float, down: float) -> float:
    """Displace contact node i by (along, down); returns the work ∫ f·du that its forces do on the slab."""
    j = len(y) // 2 + i
    before_x, before_z = y[i], y[j]
    add_two_rows(y, tableau, i, along, j, down)
    inputs[i] += along
    inputs[j] += down
    return float(0.5 * ((before_x + y[i]) * along + (before_z + y[j]) * down))


@compiled()
def project_onto_pin(state: KernelState, constants: KernelConstants) -> bool:
    """Move contact nodes that the rounding of many slips has lifted off the pin back onto it; whether there were any."""
    n, moved = len(state.x), False
    for i in range(n):
        if state.contact[i]:
            height = pin_height(constants, state.x[i] + state.inputs[i] - state.scalars.displacement)
            lift = height - state.inputs[n + i]
            if abs(lift) > constants.slip.tolerance + BLUR * abs(height) and height < np.inf:
                displace(state.response, state.tableau, state.inputs, i, 0.0, lift)
                moved = True
    return moved


@compiled()
def look_for_rounding(state: KernelState, constants: KernelConstants) -> tuple[bool, float]:
    """Move lifted nodes back onto the pin; whether there were any, and the equilibrium residual."""
    return project_onto_pin(state, constants), equilibrium_residual(state)


@compiled()
def _refresh_after_changes(state: KernelState, pin_rate: float) -> None:
    """From time to time, after changes of the contact: a fresh response, a fresh rate, and the equilibrium residual."""
    state.scalars.changes_since_refresh += 1
    if state.scalars.changes_since_refresh < REFRESH_CHANGES:
        return
    state.scalars.changes_since_refresh = 0
    refresh(state)
    if pin_rate > 0.0:
        set_rate_to_displacement(state)
    else:
        set_rate_to_load(state)
    state.scalars.residual = max(state.scalars.residual, equilibrium_residual(state))


@compiled()
def release_node(state: KernelState, i: int, pin_rate: float) -> bool:
    """Release node i: its forces fall to zero, its displacements follow. pin_rate: how fast contact nodes move, see `resolve`."""
    if not pivot(state, i):
        return False
    n, y, rate = len(state.x), state.response, state.rate
    j = n + i
    force_x, force_z, before_x, before_z = state.inputs[i], state.inputs[j], y[i], y[j]
    add_two_rows(y, state.tableau, i, -force_x, j, -force_z)
    state.inputs[i], state.inputs[j] = 0.0, 0.0
    state.scalars.dissipated -= 0.5 * (force_x * (y[i] - before_x) + force_z * (y[j] - before_z))
    # The rate is a response like any other: its forces are taken away, the node's own rates were those of the pin.
    rate_x, rate_z = rate[i], rate[j]
    rate[i], rate[j] = pin_rate, 0.0
    add_two_rows(rate, state.tableau, i, -rate_x, j, -rate_z)
    state.scalars.releases += 1
    _refresh_after_changes(state, pin_rate)
    return True


@compiled()
def touch_node(state: KernelState, constants: KernelConstants, i: int, pin_rate: float) -> bool:
    """Bring node i into contact, stuck where it is; a penetration is pushed back along z. pin_rate: as in `release_node`."""
    j = len(state.x) + i
    height = pin_height(constants, state.x[i] + state.response[i] - state.scalars.displacement)
    if not pivot(state, i):
        return False
    state.scalars.dissipated -= displace(state.response, state.tableau, state.inputs, i, 0.0, height - state.inputs[j])
    rate_x, rate_z = state.rate[i], state.rate[j]
    state.rate[i], state.rate[j] = 0.0, 0.0
    add_two_rows(state.rate, state.tableau, i, pin_rate - rate_x, j, -rate_z)
    state.scalars.touches += 1
    if not constants.inner_nodes[0] <= i <= constants.inner_nodes[1]:
        state.scalars.touches_near_end += 1
    _refresh_after_changes(state, pin_rate)
    return True
