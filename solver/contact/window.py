"""The window of surface nodes that the kernels follow: the contact and a margin. Slips cost what the window is wide.

Nodes far from the contact cannot touch a smooth pin before their nearer neighbours do: a touch near the window's end asks for a
wider one. A rough pin skips nodes. Under it every node is followed that its profile could meet while it moves on by some
spacings, or comes nearer by what it falls on that way; then the next window is set up. One that touches in spots may tilt the
surface anywhere between them: all of the surface is followed.
"""

import math

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.case import Case
from nanoslip.solver.contact.kernels.state import KernelState
from nanoslip.solver.contact.pin import pin_of, surface_from_pin

Vector = NDArray[np.float64]
Nodes = NDArray[np.bool_]

MARGIN = 8
"""Free nodes followed on each side of the contact, at least."""
GUARD = 3
"""A touch this near to the window's end asks for a wider window."""
ONE_SPOT = 0.75
"""Share of the nodes from the first to the last one in contact that touch where a rough pin does so in one spot."""
SINKING = 0.1
"""Of W/G: how far a rough pin may sink, besides what its profile falls, before the next window is set up."""
NOT_SEEN = 2.0
"""How much nearer to the pin nodes beyond a window may come than those at its ends, which are watched."""


def margin(n_x: int) -> int:
    """Free nodes followed on each side: where a tableau is dear, the contact has room to grow before the next one."""
    return max(MARGIN, n_x // 128)


def around(followed: Nodes) -> slice:
    """The window of nodes (n,) to follow, with its margin."""
    nodes, more = np.flatnonzero(followed), margin(len(followed))
    return slice(max(int(nodes[0]) - more, 0), min(int(nodes[-1]) + more + 1, len(followed)))


def inner_nodes(window: slice, n_x: int) -> tuple[int, int]:
    """First and last node of a window, numbered from its start, that can touch without a wider one being asked for."""
    last = window.stop - window.start - 1
    return GUARD if window.start > 0 else 0, last - GUARD if window.stop < n_x else last


def within_reach(case: Case, contact: Nodes, u: Vector, v: Vector, displacement: float = 0.0) -> Nodes:
    """Nodes to follow: those in contact, and those that a rough pin could meet before the next window is set up.

    contact, u, v = w + approach: (n,), also of free nodes; displacement: δ_p. All in L_x.
    """
    if not case.heterogeneity.roughness:
        return contact
    if not _in_one_spot(contact):
        return np.ones_like(contact)
    farther, deeper = _reach(case)
    lowest = pin_of(case).lowest_within(surface_from_pin(case) + u - displacement, farther)
    return np.asarray(contact | (lowest - deeper <= v))


def good_until(case: Case, state: KernelState) -> tuple[float, float, float]:
    """Displacement, and heights of the window's two end nodes under the pin, up to which none beyond can meet a rough pin."""
    nodes = len(state.x)
    if not case.heterogeneity.roughness or nodes == case.slab.n_x:
        return math.inf, math.inf, math.inf
    farther, deeper = _reach(case)
    left, right = (float(state.response[nodes + end]) + deeper / NOT_SEEN for end in (0, nodes - 1))
    return float(state.scalars["displacement"]) + farther, left, right


def _in_one_spot(contact: Nodes) -> bool:
    nodes = np.flatnonzero(contact)
    return bool(len(nodes) >= ONE_SPOT * (nodes[-1] - nodes[0] + 1))


def _reach(case: Case) -> tuple[float, float]:
    """How far a rough pin may move with one window, less than its margin, and how much nearer it may come."""
    farther = (margin(case.slab.n_x) - GUARD) * case.slab.spacing
    return farther, pin_of(case).fall_within(farther) + SINKING * case.normal_load
