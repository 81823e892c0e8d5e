"""Turn the slab's compliance round at the nodes in contact, with the load given and the approach unknown.

With v = w + approach and the load W, the slab obeys [u; v; -W] = B [f_x; f_z; approach], where B is the compliance bordered
by ones (ΣN = W, constraint of the load). Exchanging the contact's displacements and -W for their forces and the approach
gives the tableau that contact and sliding work with: prescribed values in, unknown values out.

Nodes far from the contact cannot touch the pin before their nearer neighbours do, so the tableau follows a window only: the
contact and a margin. When a touch comes near the window's end, a wider window is set up.
"""

import math
import warnings
from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
from numpy.typing import NDArray

from solver.case import Case
from solver.contact.kernels import (
    DONE,
    DRIFT_LIMIT,
    DRIFTED,
    FULL,
    NO_EVENT,
    NOTHING,
    Machine,
    Profile,
    Rules,
    aim_displacement,
    drift,
    refine,
    refresh,
    resolve,
    seat,
)
from solver.contact.node_friction import node_friction
from solver.contact.pin import Pin, pin_of, surface_from_pin
from solver.elasticity.compliance import SurfaceCompliance
from solver.outcome import SingularOperator

Vector = NDArray[np.float64]

MARGIN = 8
"""Free nodes followed on each side of the contact, at least."""
LINE = 8
"""Floats in a cache line of 64 bytes."""
GUARD = 3
"""A touch this near to the window's end asks for a wider window."""


@dataclass(frozen=True, slots=True, eq=False)
class Core:
    """The compiled core's state and rules for the surface nodes of one window."""

    case: Case
    compliance: SurfaceCompliance
    window: slice
    state: Machine
    rules: Rules


def core_of(
    case: Case,
    compliance: SurfaceCompliance,
    contact: NDArray[np.bool_],
    u: Vector,
    v: Vector,
    displacement: float = 0.0,
    *,
    whole: bool = False,
) -> Core:
    """The compiled core for a given contact set and displacements (u, v at contact nodes; others ignored).

    contact, u, v: shape (n,); displacement: δ_p; whole: follow all surface nodes. Raises SingularOperator where the
    contact's compliance cannot be inverted.
    """
    n = compliance.slab.n_x
    # Beyond a rough pin's outermost contact any node may touch first.
    window = slice(0, n) if whole or case.heterogeneity.roughness else _window(contact)
    nodes = np.arange(n)[window]
    rows = np.concatenate((nodes, nodes + n))
    contact, u, v = contact[window], u[window], v[window]
    # One array type for all, plain and read-only, or the kernels would be compiled once per kind of array.
    matrix = np.ascontiguousarray(compliance.matrix[np.ix_(rows, rows)]).view(np.ndarray)
    matrix.setflags(write=False)
    sticks = math.isinf(case.intrinsic_friction)
    friction = np.full(len(nodes), 0.0) if sticks else node_friction(case)[window]
    state = Machine(
        matrix=matrix,
        tableau=in_lines(tableau(matrix, contact)),
        response=np.zeros(len(rows) + 1),
        inputs=np.concatenate((np.where(contact, u, 0.0), np.where(contact, v, 0.0), [-case.normal_load])),
        rate=np.zeros(len(rows) + 1),
        contact=contact.copy(),
        x=surface_from_pin(case)[window],
        friction=friction,
        sticks=np.full(len(nodes), sticks),
        limits=np.where(contact & (not sticks), friction, np.nan),
        totals=np.array([displacement, 0.0, 0.0]),
        counts=np.zeros(6, dtype=np.int64),
    )
    refresh(state)
    refine(state)
    return Core(case, compliance, window, state, _rules(case, window))


def rebuild(state: Machine) -> None:
    """Replace a tableau whose pivots have gathered rounding errors by a freshly inverted one, in place."""
    fresh = tableau(state.matrix, state.contact)
    state.tableau[:, : len(fresh)] = fresh
    state.totals[2] = 0.0
    refresh(state)
    refine(state)
    aim_displacement(state)


def steadied(core: Core, status: int) -> int:
    """Mend what rounding has done to a run that ended with `status`, at its end; returns the status that is true then.

    Nodes are seated on the pin, a tableau that has drifted is rebuilt, and what both had hidden is settled; DRIFTED where
    that does not help.
    """
    if status not in (DONE, FULL, NO_EVENT):
        return status
    for _ in range(3):
        lifted, drifted = seat(core.state, core.rules), not drift(core.state) <= DRIFT_LIMIT
        if not (lifted or drifted):
            return status
        if drifted:
            rebuild(core.state)
        settled = resolve(core.state, core.rules, NOTHING, -1, 1.0)
        if settled != DONE:
            return settled
    return status if drift(core.state) <= 10.0 * DRIFT_LIMIT else DRIFTED


def _window(contact: NDArray[np.bool_]) -> slice:
    touching, more = np.flatnonzero(contact), margin(len(contact))
    return slice(max(int(touching[0]) - more, 0), min(int(touching[-1]) + more + 1, len(contact)))


def margin(n_x: int) -> int:
    """Free nodes followed on each side: where a tableau is dear, the contact has room to grow before the next one."""
    return max(MARGIN, n_x // 128)


def _rules(case: Case, window: slice) -> Rules:
    """The constants of a run; tolerances are relative to load and pin."""
    pin, slip, last = pin_of(case), case.slip_rule, window.stop - window.start - 1
    return Rules(
        profile=_profile(pin),
        half_width=pin.half_width,
        residual_shear=slip.residual_shear,
        simultaneous=slip.slip_order == "simultaneous",
        floor=slip.event_floor,
        spacing=case.slab.spacing,
        limit=case.intrinsic_friction * case.normal_load,
        cascade_limit=slip.cascade_limit,
        tolerance=1e-12 * case.normal_load,
        tolerance_gap=1e-12 * case.normal_load + 2 * np.finfo(float).eps * pin.curvature,
        offset=window.start,
        safe=(GUARD if window.start > 0 else 0, last - GUARD if window.stop < case.slab.n_x else last),
    )


def _profile(pin: Pin) -> float | Profile:
    if pin.knots is None or pin.rises is None:
        return pin.curvature
    return Profile(pin.curvature, np.ascontiguousarray(pin.knots), np.ascontiguousarray(pin.rises))


def tableau(matrix: NDArray[np.float64], contact: NDArray[np.bool_]) -> NDArray[np.float64]:
    """The bordered compliance turned round at `contact` (shape (n,)) and at the load: transposed, (2n + 1, 2n + 1)."""
    n = len(contact)
    bordered = np.zeros((2 * n + 1, 2 * n + 1))
    bordered[: 2 * n, : 2 * n] = matrix
    bordered[n : 2 * n, 2 * n] = bordered[2 * n, n : 2 * n] = 1.0
    turned = np.flatnonzero(np.concatenate((contact, contact, [True])))
    kept = np.flatnonzero(np.concatenate((~contact, ~contact, [False])))
    stiffness = inverse(bordered[np.ix_(turned, turned)], f"compliance of {int(contact.sum())} nodes")
    from_kept = bordered[np.ix_(kept, turned)] @ stiffness
    result = np.empty_like(bordered)
    result[np.ix_(turned, turned)] = stiffness.T
    result[np.ix_(turned, kept)] = from_kept.T
    result[np.ix_(kept, turned)] = -(stiffness @ bordered[np.ix_(turned, kept)]).T
    result[np.ix_(kept, kept)] = (bordered[np.ix_(kept, kept)] - from_kept @ bordered[np.ix_(turned, kept)]).T
    return result


def in_lines(square: NDArray[np.float64]) -> NDArray[np.float64]:
    """The same with every row padded to begin at a cache line: a row that straddles them takes a third longer to add."""
    entries = len(square)
    stride = -(-entries // LINE) * LINE
    room = np.zeros(entries * stride + LINE)
    first = -room.ctypes.data // room.itemsize % LINE
    padded = room[first : first + entries * stride].reshape(entries, stride)
    padded[:, :entries] = square
    return padded


def inverse(block: NDArray[np.float64], name: str) -> NDArray[np.float64]:
    """block⁻¹ of a `name`; SingularOperator where not a digit of it is sure."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", la.LinAlgWarning)  # its reciprocal condition is below machine precision
            return np.asarray(la.inv(block))
    except (la.LinAlgError, la.LinAlgWarning, ValueError) as error:
        raise SingularOperator(
            f"the {name} in contact is singular to rounding: use another scheme or n_x, or an aspect_ratio nearer 1"
        ) from error
