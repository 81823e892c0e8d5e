"""Would it pay to bring far nodes up to date only when a slip may matter to them? Cascades replayed, work counted.

Nodes are taken in blocks. A slip changes a block's margins |shear| - μ_i·pressure by no more than its distance times the
largest entry of its tableau rows there. A block waits until the sum of these bounds reaches its smallest margin; then the
slips that it missed, those of one node together, are added to it and to no other. The events are the same.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from solver import Case, ContactState, SurfaceCompliance
from solver.contact import kernels
from solver.sliding.events import _core_at
from tests.benchmarks.table import Row, verdict

EVENTS = 15
Counts = NDArray[np.int64]


@njit(cache=True, nogil=True)
def _bounds(m: kernels.Machine, size: int, blocks: int) -> kernels.Floats:
    """(N, blocks): how much a unit of an input changes any margin of a block."""
    n = len(m.x)
    bounds = np.zeros((2 * n, blocks))
    for row in range(2 * n):
        for k in range(n):
            if m.limits[k] >= 0.0:
                change = abs(m.tableau[row, k]) + m.limits[k] * abs(m.tableau[row, n + k])
                bounds[row, k // size] = max(bounds[row, k // size], change)
    return bounds


@njit(cache=True, nogil=True)
def _margin(m: kernels.Machine, block: int, size: int) -> float:
    n, margin = len(m.x), np.inf
    for k in range(block * size, min((block + 1) * size, n)):
        if m.limits[k] >= 0.0:
            margin = min(margin, -m.limits[k] * m.response[n + k] - abs(m.response[k]))
    return max(margin, 0.0)


@njit(cache=True, nogil=True)
def _cascade(m: kernels.Machine, rules: kernels.Rules, node: int, size: int, counts: Counts, jumps: Counts) -> None:
    """One cascade until nothing slips; counts: slips, node pairs that waiting blocks are given, and those at the end."""
    n, y = len(m.x), m.response
    blocks = -(-n // size)
    bounds = _bounds(m, size, blocks)
    margins = np.array([_margin(m, block, size) for block in range(blocks)])
    missed, used = np.zeros((blocks, n), dtype=np.bool_), np.zeros(blocks)
    while node >= 0:
        xi = m.x[node] + m.inputs[node] - m.totals[0]
        along, down = kernels._slip_move(y, m.tableau, m.friction, node, xi, rules.profile, rules.residual_shear)
        kernels._glide(y, m.tableau, m.inputs, node, along, down)
        counts[0] += 1
        for block in range(blocks):
            missed[block, node] = True
            used[block] += abs(along) * bounds[node, block] + abs(down) * bounds[n + node, block]
            if used[block] >= margins[block]:
                counts[1] += missed[block].sum() * size
                missed[block], used[block], margins[block] = False, 0.0, _margin(m, block, size)
        last = node
        node, tension = kernels._look(y[:n], y[n : 2 * n], m.limits, m.contact, rules.tolerance)
        if tension > rules.tolerance:
            break
        if node >= 0:
            jumps[abs(node - last)] += 1
    counts[2] += missed.sum() * size


def far_field_row(case: Case, compliance: SurfaceCompliance, start: ContactState) -> Row:
    """Work of lazy updates over that of whole ones in the events after `start`; entries only, no bookkeeping."""
    shares = []
    for size in (1, 16):
        core = _core_at(case, compliance, start, whole=False)
        machine, rules = core.state, core.rules
        counts, jumps = np.zeros(3, dtype=np.int64), np.zeros(len(machine.x), dtype=np.int64)
        for _ in range(EVENTS):
            step, kind, node = kernels.next_event(machine, rules, 1.0)
            kernels.advance(machine, max(step, kernels.smallest_step(machine, rules)))
            machine.counts[:] = 0
            if kind == kernels.SLIP:
                _cascade(machine, rules, node, size, counts, jumps)
                kind, node = kernels.NOTHING, -1
            kernels.resolve(machine, rules, kind, node, 1.0)
        shares.append((counts[1] + counts[2]) / (counts[0] * len(machine.x)))
    near = jumps[:17].sum() / jumps.sum()
    return Row(
        f"a far field updated only where a slip may matter, n_x = {case.slab.n_x}: {counts[0]} slips of {EVENTS} events, "
        f"{near:.0%} of them within 16 nodes of the one before",
        f"{shares[0]:.0%} of the entries node by node, {shares[1]:.0%} in blocks of 16",
        "every entry at every slip",
        f"1/{1 / shares[1]:.1f} in blocks; node by node the bounds alone are as long as a row",
        verdict("≥ 2 × fewer, or it is not worth building", shares[1] <= 0.5),
    )
