"""A contact as the kernels follow it: its window of nodes, their tableau, state and constants; and as a value again."""

import sys
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.arrays import Nodes, Vector, Window
from nanoslip.solver.case import Case
from nanoslip.solver.contact.kernels.events import project_onto_pin, resolve_violations
from nanoslip.solver.contact.kernels.path import Events
from nanoslip.solver.contact.kernels.pivots import EXCHANGE_SIZE, MOST_PIVOTS, Pivots
from nanoslip.solver.contact.kernels.state import (
    FORWARD,
    RESIDUAL_LIMIT,
    Direction,
    KernelConstants,
    KernelPin,
    KernelState,
    Plane as KernelPlane,
    Rise,
    Scalars,
    SlipConstants,
    Stop,
    equilibrium_residual,
    respond,
)
from nanoslip.solver.contact.pin import make_pin, node_friction, node_strength, surface_from_pin
from nanoslip.solver.contact.state import ContactState, state_from_forces
from nanoslip.solver.contact.tableau import tableau, tableau_from_base, window_entries, zero_lines
from nanoslip.solver.contact.window import follower, window_around, window_reach
from nanoslip.solver.elasticity.compliance import (
    FEW_NODES,
    KEPT,
    Compliance,
    EndlessCompliance,
)
from nanoslip.solver.elasticity.schemes.planar import PlaneConvolution
from nanoslip.solver.outcome import Outcome


def advance_grid(case: Case, compliance: Compliance, state: ContactState, nodes: int) -> ContactState:
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
    # Inputs of the tableau: displacements of nodes in contact, no force on free ones, and the load.
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
        pivots=new_pivots(entries, padded.shape[1], plane is not None),
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
            state.scalars["pivots"], state.pivots.followed[:], state.pivots.nodes[:] = 0, 0, -1
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
    prescribed, response = (values[:-1].reshape(2, -1) for values in (state.inputs, state.response))
    contact = np.zeros(n, dtype=np.bool_)
    contact[compiled.window] = state.contact
    forces = np.zeros((2, n))
    forces[:, compiled.window] = np.where(state.contact, response, 0.0)
    approach = float(state.response[-1])
    follows_all = len(state.x) == n
    # A window of all nodes leaves nothing to compute.
    uv = np.zeros((2, n)) if follows_all else compiled.compliance.displacements(forces)
    uv[1] += approach
    uv[:, compiled.window] = np.where(state.contact, prescribed, response)
    moved, slips = float(state.scalars["displacement"]), int(state.scalars["slips"])
    reached = (contact, forces, uv[0], uv[1], approach, moved, slips)
    return state_from_forces(compiled.case, compiled.compliance.widths, *reached, outcome, compiled.first_node)


def has_node_beyond_window(compiled: CompiledContact, state: ContactState) -> bool:
    """True if a node beyond the window lies inside the pin, so that a wider window is needed."""
    gap = state.gap.copy()
    gap[compiled.window] = 0.0
    return bool(gap.min() < -compiled.constants.tolerance_gap)


# Arrays that kernels fill.

_SCALARS = np.dtype(list(Scalars.__annotations__.items()))


def new_scalars(displacement: float, direction: Direction) -> Scalars:
    """The numbers of a state, all 0 but δ_p and the direction."""
    scalars: Scalars = np.zeros(1, _SCALARS)[0]
    scalars["displacement"] = displacement
    for name, value in direction._asdict().items():
        scalars[name] = value
    return scalars


def new_pivots(entries: int, length: int, in_plane: bool) -> Pivots:
    """No pivots yet of a tableau with this number of rows, and their length."""
    most, kept = (EXCHANGE_SIZE, 0) if in_plane else (MOST_PIVOTS, MOST_PIVOTS)
    return Pivots(
        rows=np.zeros((kept, 2, length)),
        inverses=np.zeros((kept, 4)),
        nodes=np.full(most, -1, np.int64),
        followed=np.zeros(entries, np.int64),
        factors=np.zeros((2, most, 2)),
        sources=np.zeros(most, np.int64),
    )


def _number_type(column: Any) -> Any:
    """The type of an array's numbers: the innermost of its annotation, whose layers differ between versions of numpy."""
    inner = get_args(column)
    return _number_type(inner[-1]) if inner else column


_KINDS = [_number_type(column) for column in Events.__annotations__.values()]


def empty_events(capacity: int) -> Events:
    """Allocate columns for this number of events, not filled."""
    return Events(*[np.empty(capacity, kind) for kind in _KINDS])
