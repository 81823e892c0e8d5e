"""A contact as the kernels follow it: its window of nodes, their tableau, state and constants; and as a value again."""

import math
import sys
from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.arrays import Indices, Nodes, Vector
from nanoslip.solver.case import Case
from nanoslip.solver.contact.kernels.events import project_onto_pin, resolve_violations
from nanoslip.solver.contact.kernels.pivots import new_pivots
from nanoslip.solver.contact.kernels.state import (
    FORWARD,
    RESIDUAL_LIMIT,
    RINGS,
    Direction,
    KernelConstants,
    KernelPin,
    KernelState,
    Plane as KernelPlane,
    Rise,
    SlipConstants,
    Stop,
    equilibrium_residual,
    margin,
    new_scalars,
    respond,
)
from nanoslip.solver.contact.pin import estimate_half_width, make_pin, node_friction, node_strength, surface_from_pin
from nanoslip.solver.contact.state import ContactState, state_from_forces
from nanoslip.solver.contact.tableau import Window, tableau, tableau_from_base, wider, window_entries, zero_lines
from nanoslip.solver.elasticity.compliance import (
    FEW_NODES,
    KEPT,
    Compliance,
    EndlessCompliance,
)
from nanoslip.solver.elasticity.schemes.planar import PlaneConvolution
from nanoslip.solver.layout import Layout, Plane, Row
from nanoslip.solver.outcome import Outcome
from nanoslip.solver.slab import Slab

# The window of surface nodes that the kernels follow: the contact and a margin. Slips cost what the window is wide.
#
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
    def around(self, slab: Slab, followed: Nodes, pin_rate: float) -> Window:
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

    def around(self, slab: Slab, followed: Nodes, pin_rate: float) -> Window:
        nodes, more = followed.nonzero()[0], margin(slab.n_x)
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
        return margin(slab.n_x)

    def is_in_spots(self, contact: Nodes) -> bool:
        nodes = np.flatnonzero(contact)
        return bool(len(nodes) < ONE_SPOT * (nodes[-1] - nodes[0] + 1))

    def travel(self, slab: Slab) -> int:
        return margin(slab.n_x) - GUARD

    def expected_nodes(self, case: Case) -> float:
        return 0.0


class PatchFollower(Follower):
    """A patch of a plane: the nodes followed, and rings of free nodes around them."""

    def around(self, slab: Slab, followed: Nodes, pin_rate: float) -> Window:
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
    return follower(case).around(case.slab, followed, smooth_rate)


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


def following(case: Case, compliance: Compliance, state: ContactState, nodes: int) -> ContactState:
    """Shift the contact to a grid that has advanced by `nodes` nodes; new nodes move as the forces require."""
    contact = np.roll(state.contact, -nodes)
    forces = np.roll(state.nodal_force, -nodes, axis=1)
    u, v = compliance.displacements(forces)
    v += state.approach
    # Nodes in contact keep their places to the last bit: those of the compliance are rounded.
    kept = np.flatnonzero(contact)
    u[kept] = state.u[kept + nodes]
    v[kept] = state.w[kept + nodes] + state.approach
    return state_from_forces(
        case,
        compliance.widths,
        contact,
        forces,
        u,
        v,
        state.approach,
        state.displacement,
        state.slips,
        state.outcome,
        state.first_node + nodes,
    )


@dataclass(slots=True, eq=False)
class CompiledContact:
    """State and constants of the kernels, for the surface nodes of a window."""

    case: Case
    compliance: Compliance
    window: Window
    state: KernelState
    constants: KernelConstants
    first_node: int
    """Number of the grid's first node on the surface."""

    def give_up(self) -> None:
        """Let the memory of the tableau go, as the next one needs it; the state's scalars stay."""
        self.state = self.state._replace(tableau=np.empty((0, 0)))


def compile_contact(
    case: Case,
    compliance: Compliance,
    contact: NDArray[np.bool_],
    u: Vector,
    v: Vector,
    followed: NDArray[np.bool_],
    displacement: float = 0.0,
    first_node: int = 0,
    load: float | None = None,
    direction: Direction = FORWARD,
    slides: bool = False,
) -> CompiledContact:
    """State and constants for a contact set and displacements u, v at its nodes, (n,) each.

    followed, (n,): nodes followed, with a margin (`nodes_in_reach`). displacement: δ_p. load: now, if it is not the case's; to
    it tolerances are relative. slides: whether the grid may go on. direction: of the path.
    Raises SingularOperator if the contact's compliance has no inverse.
    """
    window = window_around(case, followed, direction.pin_rate if slides else 0.0)
    state = _state(case, compliance, window, contact[window], displacement, first_node, direction)
    state.inputs[-1] = -(case.normal_load if load is None else load)
    nodes = len(state.x)
    state.inputs[:nodes] = np.where(state.contact, u[window], 0.0)
    state.inputs[nodes:-1] = np.where(state.contact, v[window], 0.0)
    respond(state)
    constants = _constants(case, window, state, direction.pin_rate if slides else None)
    return CompiledContact(case, compliance, window, state, constants, first_node)


def _state(
    case: Case,
    compliance: Compliance,
    window: Window,
    contact: Nodes,
    displacement: float,
    first_node: int,
    direction: Direction,
) -> KernelState:
    """The state for a contact set (n,) in the window, before its nodes are displaced; the response is not yet summed."""
    few = compliance.slab.nodes <= FEW_NODES and compliance.lasting
    set_up = _set_up_before if few else _set_up
    expected = follower(case).expected_nodes(case)
    columns, plane, padded = set_up(compliance, window.tobytes(), contact.tobytes(), expected)
    entries, nodes = 2 * len(contact) + 1, len(contact)
    if few:
        # Kernels write into a tableau: the cached one has to stay as it was.
        cached, padded = padded, zero_lines(entries)
        padded[:] = cached
    friction = node_friction(case, first_node)[window]
    return KernelState(
        columns=columns,
        plane=plane,
        tableau=padded,
        response=np.zeros(entries),
        inputs=np.zeros(entries),
        rate=np.zeros(entries),
        contact=contact.copy(),
        x=surface_from_pin(case, first_node)[window],
        node_friction=friction,
        active_friction=np.where(contact & (friction < np.inf), friction, np.nan),
        node_strength=node_strength(case, compliance.widths, first_node)[window],
        node_slips=np.zeros(nodes, np.int64),
        work=np.zeros((2, entries)),
        scalars=new_scalars(displacement, direction),
        pivots=new_pivots(entries, padded.shape[1]),
    )


def _set_up(
    compliance: Compliance, window: bytes, contact: bytes, expected: float
) -> tuple[NDArray[np.float64], KernelPlane | None, NDArray[np.float64]]:
    """The compliance between the window's nodes, (2n, 2n), or their places on a plane; and the tableau of the nodes
    in contact.

    expected: number of nodes in contact on a plane that follows from the case.
    """
    nodes = np.frombuffer(window, np.int64)
    touching = np.frombuffer(contact, np.bool_)
    plane, padded = None, None
    within = np.empty((0, 0))
    if isinstance(compliance, EndlessCompliance) and isinstance(compliance.convolution, PlaneConvolution):
        plane = KernelPlane(compliance.convolution.by_offset, *compliance.convolution.runs(nodes))
        padded = tableau_from_base(compliance, nodes, touching, expected)
    else:
        within = compliance.window(nodes)
    # One array type for all, plain and read-only, or the kernels would be compiled once per kind of array.
    columns = np.ascontiguousarray(within.T)
    columns.setflags(write=False)
    if padded is None:
        padded = zero_lines(2 * len(nodes) + 1)
        tableau(window_entries(compliance, nodes, within), touching, padded, reciprocal=plane is not None)
    return columns, plane, padded


_set_up_before = lru_cache(maxsize=KEPT)(_set_up)
"""`_set_up` with a cache, for few nodes: sliding begins with a contact found before, and cases share contacts."""


def answer_violations(compiled: CompiledContact) -> Stop:
    """The cascade that begins with the worst violation."""
    return resolve_violations(compiled.state, compiled.constants)


def correct_rounding(compiled: CompiledContact, status: Stop) -> Stop:
    """Correct the rounding errors of a run that stopped with `status`; returns the reason that is true then.

    Lifted nodes are moved back onto the pin, a tableau whose residual is above its limit is inverted afresh, and
    violations that both had hidden are resolved; INACCURATE where that does not help.
    """
    # A run that stopped inside a cascade is in no equilibrium that could be restored.
    if status not in (Stop.DONE, Stop.FULL, Stop.NO_EVENT):
        return status
    state, constants = compiled.state, compiled.constants
    for _ in range(3):
        lifted = project_onto_pin(state, constants)
        inaccurate = not equilibrium_residual(state) <= RESIDUAL_LIMIT
        if not (lifted or inaccurate):
            return status
        if inaccurate:
            within = np.ascontiguousarray(state.columns.T)
            entries = window_entries(compiled.compliance, compiled.window, within)
            tableau(entries, state.contact, state.tableau, reciprocal=state.plane is not None)
            # A fresh tableau has followed all pivots.
            state.scalars["pivots"], state.pivots.followed[:] = 0, 0
            state.scalars["residual"] = 0.0
            respond(state)
        resolved = answer_violations(compiled)
        if resolved != Stop.DONE:
            return resolved
    # The 1e-10 of the message that users get: what misses the limit by less still means something.
    return status if equilibrium_residual(state) <= 10.0 * RESIDUAL_LIMIT else Stop.INACCURATE


LOAD_FLOOR = 1e-9
"""Smallest step of a load that rises, as a share of it."""


def slip_constants(case: Case) -> SlipConstants:
    """The constants of slips and steps; tolerances are relative to the load."""
    rule = case.slip_rule
    return SlipConstants(
        residual_shear=rule.residual_shear,
        simultaneous=rule.slip_order == "simultaneous" or None,
        opposite=-1.0 if rule.limited_shear == "both_ways" else 0.0,
        event_floor=rule.event_floor,
        load_floor=LOAD_FLOOR * case.normal_load,
        spacing=case.slab.spacing,
        friction_bound=case.intrinsic_friction * case.normal_load,
        cascade_limit=rule.cascade_limit,
        tolerance=1e-12 * case.normal_load,
    )


def _constants(case: Case, window: Window, state: KernelState, pin_rate: float | None) -> KernelConstants:
    pin, watched = make_pin(case), follower(case)
    outer = watched.outer_nodes(case, window, state.contact, pin_rate)
    ends = watched.ends(outer)
    rows = window % len(pin.rises)
    rise = Rise(pin.knots, pin.rises, rows) if pin.rough else None
    # Some roundings of a parabola's height, L_x from its lowest point.
    rounding = 2 * sys.float_info.epsilon * pin.curvature
    return KernelConstants(
        slip=slip_constants(case),
        pin=KernelPin(pin.curvature, rise),
        half_width=_window_numbers(pin.half_width, window),
        across=_window_numbers(pin.across, window),
        tolerance_gap=1e-12 * case.normal_load + rounding,
        outer=outer,
        window_until=window_reach(case, state, ends),
    )


def _window_numbers(of_pin: float | Vector, window: Window) -> Vector:
    """A number of the pin, or one over each surface node, over the nodes of a window."""
    if isinstance(of_pin, np.ndarray):
        return of_pin[window]
    return np.full(len(window), of_pin)


def contact_value(compiled: CompiledContact, outcome: Outcome) -> ContactState:
    """A compiled contact as a value; nodes beyond its window follow from the compliance."""
    state, n = compiled.state, compiled.case.slab.nodes
    given, response = (values[:-1].reshape(2, -1) for values in (state.inputs, state.response))
    contact = np.zeros(n, dtype=np.bool_)
    contact[compiled.window] = state.contact
    forces = np.zeros((2, n))
    forces[:, compiled.window] = np.where(state.contact, response, 0.0)
    approach = float(state.response[-1])
    whole = len(state.x) == n
    # A window of all nodes leaves nothing to compute.
    uv = np.zeros((2, n)) if whole else compiled.compliance.displacements(forces)
    uv[1] += approach
    uv[:, compiled.window] = np.where(state.contact, given, response)
    moved, slips = float(state.scalars["displacement"]), int(state.scalars["slips"])
    found = (contact, forces, uv[0], uv[1], approach, moved, slips)
    return state_from_forces(compiled.case, compiled.compliance.widths, *found, outcome, compiled.first_node)


def has_node_beyond_window(compiled: CompiledContact, state: ContactState) -> bool:
    """True if a node beyond the window lies inside the pin, so that a wider window is needed."""
    gap = state.gap.copy()
    gap[compiled.window] = 0.0
    return bool(gap.min() < -compiled.constants.tolerance_gap)
