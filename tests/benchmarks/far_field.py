"""Would it pay to bring far nodes up to date only when a slip may matter to them? Cascades replayed, work counted.

Nodes are taken in blocks. A slip changes a block's margins |shear| - μ_i·pressure by no more than its distance times the
largest entry of its tableau rows there. A block waits until the sum of these bounds reaches its smallest margin; then the
slips that it missed, those of one node together, are added to it and to no other. The events are the same.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from nanoslip.solver import Case, ContactState, SurfaceCompliance
from nanoslip.solver.contact.kernels.events import displace, next_event, resolve, worst_violation
from nanoslip.solver.contact.kernels.state import (
    EventKind,
    Floats,
    KernelConstants,
    KernelState,
    slip_move,
    start_event,
)
from nanoslip.solver.sliding.kernels.slide import advance, smallest_step, stretching
from nanoslip.solver.sliding.slide import compiled_at
from tests.benchmarks.table import Row, verdict

EVENTS = 15
Counts = NDArray[np.int64]


@njit(cache=True, nogil=True)
def _bounds(state: KernelState, size: int, blocks: int) -> Floats:
    """(N, blocks): how much a unit of an input changes any margin of a block."""
    n = len(state.x)
    bounds = np.zeros((2 * n, blocks))
    for row in range(2 * n):
        for k in range(n):
            if state.active_friction[k] >= 0.0:
                change = abs(state.tableau[row, k]) + state.active_friction[k] * abs(state.tableau[row, n + k])
                bounds[row, k // size] = max(bounds[row, k // size], change)
    return bounds


@njit(cache=True, nogil=True)
def _margin(state: KernelState, block: int, size: int) -> float:
    n, margin = len(state.x), np.inf
    for k in range(block * size, min((block + 1) * size, n)):
        if state.active_friction[k] >= 0.0:
            margin = min(margin, -state.active_friction[k] * state.response[n + k] - abs(state.response[k]))
    return max(margin, 0.0)


@njit(cache=True, nogil=True)
def _cascade(
    state: KernelState, constants: KernelConstants, node: int, size: int, counts: Counts, jumps: Counts
) -> None:
    """One cascade until nothing slips; counts: slips, node pairs that waiting blocks are given, and those at the end."""
    n, y = len(state.x), state.response
    blocks = -(-n // size)
    bounds = _bounds(state, size, blocks)
    margins = np.array([_margin(state, block, size) for block in range(blocks)])
    missed, used = np.zeros((blocks, n), dtype=np.bool_), np.zeros(blocks)
    while node >= 0:
        xi = state.x[node] + state.inputs[node] - state.scalars["displacement"]
        along, down = slip_move(
            y, state.tableau, state.node_friction, node, xi, constants.pin, constants.slip.residual_shear
        )
        displace(y, state.tableau, state.inputs, node, along, down)
        counts[0] += 1
        for block in range(blocks):
            missed[block, node] = True
            used[block] += abs(along) * bounds[node, block] + abs(down) * bounds[n + node, block]
            if used[block] >= margins[block]:
                counts[1] += missed[block].sum() * size
                missed[block], used[block], margins[block] = False, 0.0, _margin(state, block, size)
        last = node
        node, tension = worst_violation(
            y[:n], y[n : 2 * n], state.active_friction, state.contact, constants.slip.tolerance, constants.slip.opposite
        )
        if tension > constants.slip.tolerance:
            break
        if node >= 0:
            jumps[abs(node - last)] += 1
    counts[2] += missed.sum() * size


def far_field_row(case: Case, compliance: SurfaceCompliance, start: ContactState) -> Row:
    """Work of lazy updates over that of whole ones in the events after `start`; entries only, no bookkeeping."""
    shares = []
    for size in (1, 16):
        compiled = compiled_at(case, compliance, start, whole=False)
        state, constants = compiled.state, compiled.constants
        counts, jumps = np.zeros(3, dtype=np.int64), np.zeros(len(state.x), dtype=np.int64)
        for _ in range(EVENTS):
            step, kind, node = next_event(state, constants, 1.0)
            floor = smallest_step(constants.slip, stretching(state), state.scalars["displacement"])
            advance(state, max(step, floor))
            start_event(state.scalars, state.node_slips)
            if kind == EventKind.SLIP:
                _cascade(state, constants, node, size, counts, jumps)
                kind, node = EventKind.NOTHING, -1
            resolve(state, constants, kind, node, 1.0)
        shares.append((counts[1] + counts[2]) / (counts[0] * len(state.x)))
    near = jumps[:17].sum() / jumps.sum()
    return Row(
        f"a far field updated only where a slip may matter, n_x = {case.slab.n_x}: {counts[0]} slips of {EVENTS} events, "
        f"{near:.0%} of them within 16 nodes of the one before",
        f"{shares[0]:.0%} of the entries node by node, {shares[1]:.0%} in blocks of 16",
        "every entry at every slip",
        f"1/{1 / shares[1]:.1f} in blocks; node by node the bounds alone are as long as a row",
        verdict("≥ 2 × fewer, or it is not worth building", shares[1] <= 0.5),
    )
