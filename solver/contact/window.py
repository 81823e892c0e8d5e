"""The window of surface nodes that the kernels follow: the contact and a margin. Slips cost what the window is wide."""

import math
from abc import ABC, abstractmethod
from typing import Final

import numpy as np

from nanoslip.solver.arrays import Indices, Nodes, Vector, Window
from nanoslip.solver.case import Case
from nanoslip.solver.contact.disc import wider
from nanoslip.solver.contact.kernels.state import KernelState
from nanoslip.solver.contact.pin import estimate_half_width, make_pin, surface_from_pin
from nanoslip.solver.layout import RINGS, Layout, Plane, Row
from nanoslip.solver.slab import Slab

# Nodes far from the contact cannot touch a smooth pin before their nearer neighbours do: a touch near the window's end asks for
# a wider one. A rough pin skips nodes. Under it every node is followed that its profile could meet while it moves on by some
# spacings, or comes nearer by what it falls on that way; then the next window is set up. One that touches in spots may tilt the
# surface anywhere between them: all of the surface is followed. Of a plane, where that is dear and spots are separate patches of
# the window, nodes next to what is not followed are watched all around.

GUARD = 3
"""Distance to the window's end, in nodes, within which a touch requires a wider window."""
ONE_SPOT = 0.75
"""Share of the nodes from the first to the last one in contact that touch where a rough pin does so in one spot."""
SINKING = 0.1
"""Largest sinking of a rough pin before the next window is set up, in W/G, besides the fall of its profile."""
NOT_SEEN = 2.0
"""Factor by which nodes beyond a window may come nearer to the pin than the nodes at its ends, which are watched."""


class Follower(ABC):
    """Follows a contact on one layout of nodes."""

    @abstractmethod
    def surround(self, slab: Slab, followed: Nodes, pin_rate: float) -> Window:
        """The nodes (n,) to follow, with their margin. pin_rate: of a smooth pin that slides on (`Scalars.pin_rate`), or 0."""

    @abstractmethod
    def outer_nodes(self, case: Case, window: Window, contact: Nodes, pin_rate: float | None) -> Nodes:
        """Nodes of a window, (n,), whose touch requires a new window.

        contact: of the window. On a surface without ends the grid goes on beyond, the way that the pin moves
        (`Scalars.pin_rate`, None at initial contact; to both sides where it rests), unless the contact is as wide.
        """

    @abstractmethod
    def ends(self, outer: Nodes) -> Indices:
        """Numbers in the window of the nodes that are watched for others beyond it, from its outer nodes (n,)."""

    @abstractmethod
    def margin(self, slab: Slab) -> int:
        """Distance to the end of a grid, in columns of nodes, within which it goes on, on a surface without ends."""

    @abstractmethod
    def is_in_spots(self, contact: Nodes) -> bool:
        """True if a contact (n,) of a rough pin is so scattered that all of the surface is to be followed."""

    @abstractmethod
    def travel(self, slab: Slab) -> int:
        """Spacings that a rough pin may move on before the next window: less than the margin."""

    @abstractmethod
    def expected_nodes(self, case: Case) -> float:
        """Number of nodes in contact, as it follows from the case, from which a base of tableaus is chosen; 0 without bases."""


class RowFollower(Follower):
    """Neighbours in a row, from the margin before the first node followed to that behind the last."""

    def surround(self, slab: Slab, followed: Nodes, pin_rate: float) -> Window:
        nodes, more = followed.nonzero()[0], slab.layout.followed_margin
        first = max(int(nodes[0]) - more, 0)
        last = min(int(nodes[-1]) + more, slab.n_x - 1)
        return np.arange(first, last + 1)

    def outer_nodes(self, case: Case, window: Window, contact: Nodes, pin_rate: float | None) -> Nodes:
        slab, goes_on = case.slab, case.slab.scheme.endless and pin_rate is not None
        last = len(window) - 1
        grows_behind = goes_on and pin_rate != 1.0 and not contact[: GUARD + 1].any()
        grows_ahead = goes_on and pin_rate != -1.0 and not contact[last - GUARD :].any()
        outer = np.zeros(len(window), np.bool_)
        if window[0] > 0 or grows_behind:
            outer[:GUARD] = True
        if window[-1] + 1 < slab.n_x or grows_ahead:
            outer[max(last - GUARD + 1, 0) :] = True
        return outer

    def ends(self, outer: Nodes) -> Indices:
        return np.array([0, len(outer) - 1])

    def margin(self, slab: Slab) -> int:
        return slab.layout.followed_margin

    def is_in_spots(self, contact: Nodes) -> bool:
        nodes = np.flatnonzero(contact)
        return bool(len(nodes) < ONE_SPOT * (nodes[-1] - nodes[0] + 1))

    def travel(self, slab: Slab) -> int:
        return slab.layout.followed_margin - GUARD

    def expected_nodes(self, case: Case) -> float:
        return 0.0


class PatchFollower(Follower):
    """A patch of a plane: the nodes followed, and rings of free nodes around them."""

    def surround(self, slab: Slab, followed: Nodes, pin_rate: float) -> Window:
        by_column = followed.reshape(-1, slab.rows)
        patch = wider(by_column, RINGS)
        # A smooth pin that slides on does not return to the nodes behind it: there one ring less is enough.
        if pin_rate:
            columns = np.flatnonzero(by_column.any(axis=1))
            from_middle = 2 * np.arange(len(by_column)) - columns[0] - columns[-1]  # twice the distance
            behind = from_middle * pin_rate < 0.0
            patch[behind] = wider(by_column, RINGS - 1)[behind]
        return np.flatnonzero(patch)

    def outer_nodes(self, case: Case, window: Window, contact: Nodes, pin_rate: float | None) -> Nodes:
        slab, goes_on = case.slab, case.slab.scheme.endless and pin_rate is not None
        columns = window[contact] // slab.rows
        # A column more on either side stands for what is beyond the grid.
        beyond = np.ones((slab.n_x + 2, slab.rows), np.bool_)
        beyond[0] = goes_on and pin_rate != 1.0 and columns.min() > 0
        beyond[-1] = goes_on and pin_rate != -1.0 and columns.max() < slab.n_x - 1
        beyond[1:-1].reshape(-1)[window] = False
        return wider(beyond)[1:-1].ravel()[window]

    def ends(self, outer: Nodes) -> Indices:
        return np.flatnonzero(outer)

    def margin(self, slab: Slab) -> int:
        return RINGS + 1

    def is_in_spots(self, contact: Nodes) -> bool:
        return False

    def travel(self, slab: Slab) -> int:
        return RINGS - 1

    def expected_nodes(self, case: Case) -> float:
        return math.pi * (estimate_half_width(case) / case.slab.spacing) ** 2


_FOLLOWERS: Final[dict[type[Layout], Follower]] = {Row: RowFollower(), Plane: PatchFollower()}


def follower(case: Case) -> Follower:
    """The follower of a case's contacts."""
    return _FOLLOWERS[type(case.slab.layout)]


def window_around(case: Case, followed: Nodes, pin_rate: float = 0.0) -> Window:
    """The window of nodes (n,) to follow, with its margin. pin_rate: of a pin that slides on (`Scalars.pin_rate`), or 0."""
    smooth_rate = 0.0 if case.heterogeneity.roughness else pin_rate
    return follower(case).surround(case.slab, followed, smooth_rate)


def dropped_nodes(case: Case, followed: Nodes, contact: Nodes, pin_rate: float) -> int:
    """Nodes at its left end that the grid of a surface without ends gives up, to go on as far to its right, so that what is
    followed keeps its margin; 0 while it has it, below 0 to go on to the left. followed, contact: (n,)."""
    rows, columns = case.slab.rows, case.slab.n_x
    nodes = (contact if followed.all() else followed).nonzero()[0] // rows
    more = follower(case).margin(case.slab)
    off = int(nodes[0] + nodes[-1] + 1 - columns)  # twice the distance from the grid's middle
    is_near_right = int(nodes[-1]) + more >= columns and pin_rate != -1.0
    is_near_left = int(nodes[0]) < more and pin_rate != 1.0
    is_near = is_near_right if off > 0 else is_near_left
    # Towards 0, not down: to the left the grid goes on as to the right.
    return rows * int(off / 2) if case.slab.scheme.endless and is_near else 0


def nodes_in_reach(
    case: Case, contact: Nodes, u: Vector, v: Vector, displacement: float = 0.0, first_node: int = 0
) -> Nodes:
    """Nodes to follow: nodes in contact, and nodes that a rough pin could meet before the next window is set up.

    contact, u, v = w + approach: (n,), also of free nodes; displacement: δ_p. All in L_x.
    """
    if not case.heterogeneity.roughness:
        return contact
    if follower(case).is_in_spots(contact):
        return np.ones_like(contact)
    farther, deeper = _reach(case)
    lowest = make_pin(case).lower_bound(surface_from_pin(case, first_node) + u - displacement, farther)
    return np.asarray(contact | (lowest - deeper <= v))


def window_reach(case: Case, state: KernelState, ends: Window) -> tuple[float, Window, Vector] | None:
    """Displacement in the pin's direction, nodes at the window's ends and their heights under the pin, up to which none beyond
    can meet a rough pin. ends: their numbers in the window. None for a smooth pin."""
    nodes = len(state.x)
    moved = float(state.scalars["pin_rate"] * state.scalars["displacement"])
    if not case.heterogeneity.roughness:
        return None
    if nodes == case.slab.nodes and not case.slab.scheme.endless:
        return math.inf, ends[:0], np.zeros(0)
    farther, deeper = _reach(case)
    if nodes == case.slab.nodes:  # the next grid is to follow halfway to this one's end
        columns = np.flatnonzero(state.contact) // case.slab.rows
        to_left, to_right = columns[0], case.slab.n_x - 1 - columns[-1]
        room = min(to_left, to_right)
        if state.scalars["pin_rate"]:
            room = to_right if state.scalars["ahead"] > 0 else to_left
        halfway = room // 2 * case.slab.spacing
        return moved + max(halfway, farther), ends[:0], np.zeros(0)
    heights = state.response[nodes + ends] + deeper / NOT_SEEN
    return moved + farther, ends, heights


def _reach(case: Case) -> tuple[float, float]:
    """Travel of a rough pin that one window allows (less than its margin), and the largest approach to nodes beyond."""
    farther = follower(case).travel(case.slab) * case.slab.spacing
    return farther, make_pin(case).largest_fall(farther) + SINKING * case.normal_load
