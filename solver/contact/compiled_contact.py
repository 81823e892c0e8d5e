"""State and constants of the kernels for one contact, set up from its nodes and displacements."""

import math
import sys
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.case import Case
from nanoslip.solver.contact.kernels.cascade import answer_violations
from nanoslip.solver.contact.kernels.contact_change import look_for_rounding
from nanoslip.solver.contact.kernels.enumerations import Stop
from nanoslip.solver.contact.kernels.equilibrium import RESIDUAL_LIMIT, equilibrium_residual, respond
from nanoslip.solver.contact.kernels.state import KernelConstants, KernelState, RoughPin, SlipConstants, new_scalars
from nanoslip.solver.contact.node_friction import node_friction
from nanoslip.solver.contact.normal.system import FEW, KEPT
from nanoslip.solver.contact.pin import Pin, pin_of, surface_from_pin
from nanoslip.solver.contact.tableau import in_lines, tableau
from nanoslip.solver.contact.window import around, good_until, inner_nodes
from nanoslip.solver.elasticity.compliance import SurfaceCompliance

Vector = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class CompiledContact:
    """What the kernels work on: state and constants for the surface nodes of one window."""

    case: Case
    compliance: SurfaceCompliance
    window: slice
    state: KernelState
    constants: KernelConstants


def compiled_contact(
    case: Case,
    compliance: SurfaceCompliance,
    contact: NDArray[np.bool_],
    u: Vector,
    v: Vector,
    followed: NDArray[np.bool_],
    displacement: float = 0.0,
) -> CompiledContact:
    """State and constants for a given contact set and displacements (u, v at contact nodes; others ignored), the rate that per
    pin displacement.

    contact, u, v: shape (n,); followed, (n,): nodes to follow, with a margin (`within_reach`); displacement: δ_p.
    Raises SingularOperator where the contact's compliance cannot be inverted.
    """
    window = around(followed)
    state = _state(case, compliance, window, contact[window], displacement)
    nodes = len(state.x)
    state.inputs[:nodes] = np.where(state.contact, u[window], 0.0)
    state.inputs[nodes:-1] = np.where(state.contact, v[window], 0.0)
    respond(state)
    return CompiledContact(case, compliance, window, state, _constants(case, window, state))


def _state(
    case: Case, compliance: SurfaceCompliance, window: slice, contact: NDArray[np.bool_], displacement: float
) -> KernelState:
    """The state for a contact set (n,) in the window, before its nodes are displaced; the response is not yet summed."""
    few = compliance.slab.n_x <= FEW and compliance.lasting
    set_up = _set_up_before if few else _set_up
    matrix, inverted = set_up(compliance, window.start, window.stop, contact.tobytes())
    entries, nodes = 2 * len(contact) + 1, len(contact)
    inputs = np.zeros(entries)
    inputs[-1] = -case.normal_load
    sticks = math.isinf(case.intrinsic_friction)
    friction_of_nodes = np.zeros(nodes) if sticks else node_friction(case)[window]
    return KernelState(
        matrix=matrix,
        tableau=in_lines(inverted),
        response=np.zeros(entries),
        inputs=inputs,
        rate=np.zeros(entries),
        contact=contact.copy(),
        x=surface_from_pin(case)[window].copy(),  # one array type here too
        node_friction=friction_of_nodes,
        sticks=np.full(nodes, sticks),
        active_friction=np.where(contact & (not sticks), friction_of_nodes, np.nan),
        node_slips=np.zeros(nodes, np.int64),
        scalars=new_scalars(displacement),
    )


def _set_up(
    compliance: SurfaceCompliance, start: int, stop: int, contact: bytes
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The compliance of the window's nodes among each other, (2n, 2n), and the tableau of those in contact."""
    surface, nodes = compliance.slab.n_x, stop - start
    # Blocks are copied as pieces in a row: much faster than by lists of rows and columns.
    blocks = compliance.matrix.reshape(2, surface, 2, surface)[:, start:stop, :, start:stop]
    # One array type for all, plain and read-only, or the kernels would be compiled once per kind of array.
    within = np.array(blocks, order="C").reshape(2 * nodes, 2 * nodes)
    within.setflags(write=False)
    return within, tableau(within, np.frombuffer(contact, np.bool_))


_set_up_before = lru_cache(maxsize=KEPT)(_set_up)
"""The same of few nodes: sliding begins with the contact that was found, and cases of a campaign have the same ones again."""


def rebuild(state: KernelState) -> None:
    """Replace a tableau whose pivots have gathered rounding errors by a freshly inverted one, in place."""
    fresh = tableau(state.matrix, state.contact)
    state.tableau[:, : len(fresh)] = fresh
    state.scalars["residual"] = 0.0
    respond(state)


def corrected_for_rounding(compiled: CompiledContact, status: Stop) -> Stop:
    """Correct what rounding has done to a run that stopped with `status`; returns the reason that is true then.

    Lifted nodes are moved back onto the pin, a tableau whose residual is above its limit is inverted afresh, and violations
    that both had hidden are resolved; INACCURATE where that does not help.
    """
    if status not in (Stop.DONE, Stop.FULL, Stop.NO_EVENT):
        return status
    state, constants = compiled.state, compiled.constants
    for _ in range(3):
        lifted, residual = look_for_rounding(state, constants)
        inaccurate = not residual <= RESIDUAL_LIMIT
        if not (lifted or inaccurate):
            return status
        if inaccurate:
            rebuild(state)
        resolved = answer_violations(state, constants, 1.0)
        if resolved != Stop.DONE:
            return resolved
    return status if equilibrium_residual(state) <= 10.0 * RESIDUAL_LIMIT else Stop.INACCURATE


def slip_constants(case: Case) -> SlipConstants:
    """The constants of slips and steps; tolerances are relative to the load."""
    rule = case.slip_rule
    return SlipConstants(
        residual_shear=rule.residual_shear,
        simultaneous=rule.slip_order == "simultaneous",
        opposite=-1.0 if rule.limited_shear == "both_ways" else 0.0,
        event_floor=rule.event_floor,
        spacing=case.slab.spacing,
        friction_bound=case.intrinsic_friction * case.normal_load,
        cascade_limit=rule.cascade_limit,
        tolerance=1e-12 * case.normal_load,
    )


def _constants(case: Case, window: slice, state: KernelState) -> KernelConstants:
    pin = pin_of(case)
    return KernelConstants(
        slip=slip_constants(case),
        pin=_kernel_pin(pin),
        half_width=pin.half_width,
        tolerance_gap=1e-12 * case.normal_load + 2 * sys.float_info.epsilon * pin.curvature,
        first_node=window.start,
        inner_nodes=inner_nodes(window, case.slab.n_x),
        window_until=good_until(case, state),
    )


def _kernel_pin(pin: Pin) -> float | RoughPin:
    if pin.knots is None or pin.rises is None:
        return pin.curvature
    return RoughPin(pin.curvature, np.ascontiguousarray(pin.knots), np.ascontiguousarray(pin.rises))
