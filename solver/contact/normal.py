"""Press the pin down (§3.1): the contact set, pressures and approach at a given load, before any node slips.

Three kinds of surface: stuck to the pin at u = 0, where shear and pressure act on each other through the coupling; free of
friction, where pressure alone acts and moves the surface sideways under the pin; and without coupling, where it does not
even do that, and stuck or free is the same. The last two need the normal forces' half of the compliance, or half of that.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solver.case import Case
from solver.contact.closed_forms import hertz_half_width, winkler_half_width
from solver.contact.pin import pin_of, surface_from_pin
from solver.elasticity.compliance import SurfaceCompliance
from solver.outcome import SingularOperator, TooFarApart

Vector = NDArray[np.float64]

PATIENCE = 10
"""Rounds in which a contact set may not improve before its wrong nodes are exchanged one at a time."""
MOST_ROUNDS = 500
"""Rounds after which no contact set is looked for any more; a round solves for all nodes in contact."""


class NormalContact(NamedTuple):
    """Contact of a pin pressed down; arrays (n,). converged: all constraints hold, else this is the last iterate."""

    contact: NDArray[np.bool_]
    normal_force: Vector
    """N of every node, zero where free."""
    u: Vector
    v: Vector
    """w + approach."""
    approach: float
    converged: bool


def normal_contact(case: Case, compliance: SurfaceCompliance, stuck: bool) -> NormalContact:
    """The contact at the case's load, its nodes stuck at u = 0 or free of friction. Raises SingularOperator, TooFarApart.

    Block principal pivoting (Kostreva; Júdice and Pires): all wrong nodes are exchanged at once; when their number has not
    fallen for PATIENCE rounds, only the one furthest right is exchanged (Murty's rule, which cannot cycle on a positive
    definite operator) until fewer are wrong than ever before.
    """
    x = surface_from_pin(case)
    contact = np.abs(x) <= max(expected_half_width(case), np.abs(x).min())
    u = np.zeros_like(x)
    fewest, patience = len(x) + 1, PATIENCE
    seen: set[bytes] = set()
    for _ in range(MOST_ROUNDS):
        found = NormalContact(contact, *_forces(case, compliance, contact, u, stuck), converged=True)
        wrong = _wrong(case, found)
        rounding = 1e-13 * case.normal_load + 4 * np.finfo(float).eps * np.abs(found.u).max()
        at_rest = np.abs(found.u - u).max() <= rounding
        u = found.u
        if not wrong.any():
            if at_rest:
                return found
            continue
        count = int(wrong.sum())
        if count < fewest:
            fewest, patience = count, PATIENCE
            seen.clear()
        patience -= 1
        if patience < 0:
            # Nodes stuck at u = 0 have no memory but their set: one that comes back comes back for ever.
            if (stuck or not case.effects.coupling) and contact.tobytes() in seen:
                break
            seen.add(contact.tobytes())
            wrong[: np.flatnonzero(wrong)[-1]] = False
        contact = contact ^ wrong
        if not contact.any():
            contact[np.argmin(np.abs(x))] = True
    return found._replace(contact=contact, converged=False)


def _wrong(case: Case, found: NormalContact) -> NDArray[np.bool_]:
    """Nodes (n,) in contact that pull, and free ones that lie inside the pin."""
    x, pin = surface_from_pin(case), pin_of(case)
    # A node beside a punch is never under it, even where it has moved there: see EDGE_REACHED.
    gap = np.where(np.abs(x) <= pin.half_width, pin.height(x + found.u) - found.v, np.inf)
    inside = np.where(np.isinf(gap), -1.0, -gap / case.normal_load)
    return np.asarray(np.where(found.contact, -found.normal_force / case.normal_load, inside) > 1e-12)


def expected_half_width(case: Case) -> float:
    """Hertz's contact half-width on a half-plane, that on a bed of springs, or the punch's own: a first guess."""
    if case.pin == "flat_punch":
        return case.half_width
    bed = case.slab.scheme.bed_stiffness
    if bed is not None:
        return winkler_half_width(case.normal_load, case.radius, bed)
    return hertz_half_width(case.normal_load, case.radius, case.slab.poisson)


def _forces(
    case: Case, compliance: SurfaceCompliance, contact: NDArray[np.bool_], u: Vector, stuck: bool
) -> tuple[Vector, Vector, Vector, float]:
    """Normal forces N (n,), u (n,), v = w + approach (n,) and the approach with the nodes of `contact` on the pin.

    Without friction the pin's height under a node depends on its u: one Newton step from the given u.
    """
    c, n, x, pin = compliance.matrix, compliance.slab.n_x, surface_from_pin(case), pin_of(case)
    coupled, nodes = case.effects.coupling, np.flatnonzero(contact)
    both = stuck and coupled
    rows = np.concatenate((nodes, nodes + n)) if both else nodes + n
    xi = (x + (0.0 if stuck else u))[nodes]
    block = c.take(rows, 0).take(rows, 1)  # much faster than a gather by lists of rows and columns
    right = pin.face(xi)
    if both:
        right = np.concatenate((np.zeros(len(nodes)), right))
    elif coupled:
        slope = pin.slope(xi)
        block = block - slope[:, None] * c.take(nodes, 0).take(rows, 1)
        right = right - slope * u[nodes]
    solution = _solved(_bordered(block, len(nodes)), np.concatenate((right, [-case.normal_load])), len(nodes))
    forces, approach = solution[:-1], float(solution[-1])
    normal_force = np.zeros(n)
    normal_force[nodes] = -forces[-len(nodes) :]
    if not coupled:
        return normal_force, np.zeros(n), c[n:, rows] @ forces + approach, approach
    displacements = c[:, rows] @ forces
    return normal_force, np.where(contact & stuck, 0.0, displacements[:n]), displacements[n:] + approach, approach


def _bordered(block: NDArray[np.float64], nodes: int) -> NDArray[np.float64]:
    """The block with a row and a column for the load, whose sum goes over its last entries, one of each of these nodes."""
    last = len(block)
    system = np.zeros((last + 1, last + 1))
    system[:last, :last] = block
    system[last - nodes : last, last] = system[last, last - nodes : last] = 1.0
    return system


def _solved(system: NDArray[np.float64], right: Vector, nodes: int) -> Vector:
    """The solution for a contact of so many nodes. Raises SingularOperator, TooFarApart."""
    try:
        solution = np.asarray(np.linalg.solve(system, right), dtype=np.float64)
    except np.linalg.LinAlgError as error:
        raise SingularOperator(
            f"the compliance of {nodes} nodes in contact is singular: use another scheme, or an aspect_ratio nearer 1"
        ) from error
    if not np.isfinite(solution).all():
        # Every comparison with a NaN is false: nothing would seem to be wrong.
        raise TooFarApart("the forces of the contact are no numbers: use a load, a radius and heights nearer 1")
    return solution
