"""Response of the slab to its inputs, its rate as pin or load move, and how far both are from equilibrium."""

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.compiled import compiled
from nanoslip.solver.contact.kernels.pin_height import BLUR
from nanoslip.solver.contact.kernels.state import Floats, KernelState
from nanoslip.solver.contact.kernels.vectors import add, add_two_rows

RESIDUAL_LIMIT = 1e-11
"""Relative residual of the prescribed displacements or of the load at which the tableau is rebuilt."""


@compiled()
def refresh(state: KernelState) -> None:
    """Sum the response afresh from the inputs."""
    state.response[:] = 0.0
    for j in range(len(state.inputs)):
        if state.inputs[j] != 0.0:
            add(state.response, state.inputs[j], state.tableau[j])
    state.scalars.slips_since_refresh = 0


@compiled()
def set_rate_to_displacement(state: KernelState) -> None:
    """Set the rate to the response per unit of pin displacement: all contact nodes move along."""
    state.rate[:] = 0.0
    for i in range(len(state.x)):
        if state.contact[i]:
            add(state.rate, 1.0, state.tableau[i])


@compiled()
def set_rate_to_load(state: KernelState) -> None:
    """Set the rate to the response per unit of load, the pin held."""
    last = 2 * len(state.x)
    for k in range(len(state.rate)):
        state.rate[k] = -state.tableau[last, k]


@compiled()
def total_shear(contact: NDArray[np.bool_], values: Floats) -> float:
    """Sum of the tangential entries of `values` (response or rate) over the contact, (n,)."""
    total = 0.0
    for i in range(len(contact)):
        if contact[i]:
            total += values[i]
    return total


@compiled(fastmath={"contract", "reassoc"})
def _displaced(compliances: Floats, forces: Floats) -> tuple[float, float]:
    """What forces displace one entry, and the same with all signs alike. In any order: one by one the sums take several times
    as long as a pivot."""
    total, moved = 0.0, 0.0
    for k in range(len(forces)):
        by = compliances[k] * forces[k]
        total += by
        moved += abs(by)
    return total, moved


@compiled(allocates=True)
def _residual(state: KernelState, missing: Floats) -> float:
    """Fill `missing`, (N,), with the residual of equilibrium; returns its largest entry as a share of what is displaced.

    The residual is what the compliance gives for the forces of the contact, less the inputs in contact and the responses
    elsewhere; its last entry is the load less the sum of the forces. Infinite where anything is not a number or where nothing
    bears the load.
    """
    n, response, inputs = len(state.x), state.response, state.inputs
    error, largest, carried, forces = 0.0, 0.0, 0.0, np.zeros(2 * n)
    for i in range(n):
        if state.contact[i]:
            forces[i], forces[n + i] = response[i], response[n + i]
            carried += response[n + i]
    blur = 8.0 * BLUR * abs(response[2 * n])  # far out on a sharp pin heights are more than all the load displaces
    for row in range(2 * n):
        seen, moved = _displaced(state.matrix[row], forces)
        if row >= n:
            seen += response[2 * n]
        missing[row] = inputs[row] - seen if state.contact[row % n] else seen - response[row]
        off = abs(missing[row]) - blur
        if not off <= error:
            error = off if off < np.inf else np.inf  # no number is above infinity, which NaN becomes
        largest = max(largest, moved)
    missing[2 * n] = inputs[2 * n] - carried
    unborne = abs(missing[2 * n] / inputs[2 * n])
    if not (largest > 0.0 and unborne < np.inf):
        return np.inf
    return float(max(error / largest, unborne))


@compiled(allocates=True)
def equilibrium_residual(state: KernelState) -> float:
    """How far the response is from equilibrium, relative: see RESIDUAL_LIMIT."""
    return _residual(state, np.empty(len(state.inputs)))


@compiled(allocates=True)
def _refine(state: KernelState) -> None:
    """One step of iterative refinement, where the response of a fresh tableau leaves a residual.

    An inverse alone loses the digits of its condition number; an inverse and its residual do not.
    """
    n, missing = len(state.x), np.empty(len(state.inputs))
    if not _residual(state, missing) > 0.01 * RESIDUAL_LIMIT:
        return
    for i in range(n):
        if state.contact[i]:
            add_two_rows(state.response, state.tableau, i, missing[i], n + i, missing[n + i])
    add(state.response, missing[2 * n], state.tableau[2 * n])
    _residual(state, missing)
    for i in range(n):
        if not state.contact[i]:
            state.response[i] += missing[i]
            state.response[n + i] += missing[n + i]


@compiled()
def respond(state: KernelState) -> None:
    """Set response and rate to those of a fresh tableau, the nodes in contact moving with the pin."""
    refresh(state)
    _refine(state)
    set_rate_to_displacement(state)
