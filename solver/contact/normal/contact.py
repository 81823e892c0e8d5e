"""Press the pin down (§3.1): the contact set, pressures and approach at a given load, before any node slips.

Three kinds of surface are computed:

- Stuck to the pin at u = 0: shear and pressure act on each other through the coupling of the compliance.
- Without friction: only pressure acts, and it moves the surface sideways under the pin. Half of the compliance is needed.
- Without coupling: pressure causes no sideways motion, so stuck and frictionless contacts are the same. A quarter is needed.
"""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.case import Case
from nanoslip.solver.contact.closed_forms import hertz_half_width, winkler_half_width
from nanoslip.solver.contact.normal.exchange import Exchange
from nanoslip.solver.contact.normal.system import FEW, KEPT, ContactSystem
from nanoslip.solver.contact.pin import pin_of, surface_from_pin
from nanoslip.solver.elasticity.compliance import SurfaceCompliance
from nanoslip.solver.last import of_the_last

Vector = NDArray[np.float64]

MOST_ROUNDS = 500
"""Rounds after which no contact set is looked for any more."""
RESTING = 1e-13
"""Share of the load that nodes may move by and be at rest, in L_x·G."""
INSIDE = 1e-12
"""Gap, in L_x per load, below which a free node is inside the pin; and share of the load that a node in contact may pull."""
ANSWERED = 65
"""Nodes of a surface for whose stuck sets all right sides are solved beforehand: it takes as long as a dozen."""
SLOW = 0.1
"""Ratio of successive changes of u above which the pin's slopes under the nodes are taken anew: Newton's method proper."""


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

    Wrong nodes are exchanged (Exchange) until none is. Sets that are near share factors (ContactSystem); what is returned was
    solved for by the found set's own, unless only the set is asked for.
    """
    x = surface_from_pin(case)
    contact = np.abs(x) <= max(expected_half_width(case), np.abs(x).min())
    u, moved = np.zeros_like(x), math.inf
    exchange = Exchange(x)
    system = _system(case, compliance, contact, u, stuck)
    for _ in range(MOST_ROUNDS):
        if not system.is_near(contact):
            system = _system(case, compliance, contact, u, stuck)
        found = _pressed(case, compliance, system, contact, u, stuck)
        wrong = _wrong(case, found)
        right = not wrong.any()
        if right and stuck:  # what comes of a stuck contact is its set alone
            return found
        before, moved, u = moved, float(np.abs(found.u - u).max()), found.u
        if right:
            if system.is_of(contact) and moved <= _rounding(case, found):
                return found
            if not system.is_of(contact) or moved > SLOW * before:
                system = _system(case, compliance, contact, u, stuck)
            continue
        following = exchange.exchanged(contact, wrong)
        # Nodes stuck at u = 0 have no memory but their set: one that comes back comes back for ever.
        if following.again and (stuck or not case.effects.coupling):
            break
        contact, moved = following.contact, math.inf
    return found._replace(contact=contact, converged=False)


def _rounding(case: Case, found: NormalContact) -> float:
    """By how much nodes at rest may move from round to round, in L_x."""
    xi = (surface_from_pin(case) + found.u)[found.contact]
    return RESTING * case.normal_load + pin_of(case).rounding(xi)


def _wrong(case: Case, found: NormalContact) -> NDArray[np.bool_]:
    """Nodes (n,) in contact that pull, and free ones that lie inside the pin."""
    x, pin = surface_from_pin(case), pin_of(case)
    # A node beside a punch is never under it, even where it has moved there: see EDGE_REACHED.
    gap = pin.height(x + found.u) - found.v
    if pin.half_width < math.inf:
        gap = np.where(np.abs(x) <= pin.half_width, gap, np.inf)
    return np.asarray(np.where(found.contact, -found.normal_force, -gap) / case.normal_load > INSIDE)


@of_the_last
def expected_half_width(case: Case) -> float:
    """Hertz's contact half-width on a half-plane, that on a bed of springs, or the punch's own: a first guess."""
    if case.pin == "flat_punch":
        return case.half_width
    bed = case.slab.scheme.bed_stiffness
    if bed is not None:
        return winkler_half_width(case.normal_load, case.radius, bed)
    return hertz_half_width(case.normal_load, case.radius, case.slab.poisson)


def _system(
    case: Case, compliance: SurfaceCompliance, contact: NDArray[np.bool_], u: Vector, stuck: bool
) -> ContactSystem:
    """The system of this contact set: without friction, the pin's height under a node depends on its u, linear near this one."""
    coupled = case.effects.coupling
    slope = pin_of(case).slope(surface_from_pin(case) + u) if coupled and not stuck else None
    if slope is None and compliance.lasting and len(contact) <= FEW:  # no border changes what is kept
        return _system_before(compliance, contact.tobytes(), coupled and stuck)
    return ContactSystem(compliance, contact, slope, held=coupled and stuck)


@lru_cache(maxsize=KEPT)
def _system_before(compliance: SurfaceCompliance, contact: bytes, held: bool) -> ContactSystem:
    system = ContactSystem(compliance, np.frombuffer(contact, np.bool_), None, held)
    # Of a stuck contact the set alone counts, not the last bits. On larger grids it takes longer than it saves.
    return system.keep() if held and compliance.slab.n_x <= ANSWERED else system


def _pressed(
    case: Case, compliance: SurfaceCompliance, system: ContactSystem, contact: NDArray[np.bool_], u: Vector, stuck: bool
) -> NormalContact:
    """The contact with just these nodes on the pin, one Newton step from the given u."""
    n, coupled = compliance.slab.n_x, case.effects.coupling
    heights = pin_of(case).face(surface_from_pin(case) + (0.0 if stuck else u))
    if system.slope is not None:
        heights = heights - system.slope * u
    if system.answers is None:
        forces, approach = system.forces(contact, heights, case.normal_load)
        moved = _displacements(compliance.matrix, forces, contact, coupled, stuck)
    else:
        forces, approach, moved = system.answered(contact, heights, case.normal_load)
    u = np.where(contact, 0.0, moved[:n]) if stuck else moved[:n]
    return NormalContact(contact, -forces[n:], u, moved[n:] + approach, approach, converged=True)


def _displacements(
    matrix: NDArray[np.float64], forces: Vector, contact: NDArray[np.bool_], coupled: bool, stuck: bool
) -> Vector:
    """[u; w] (2n,) under these forces (2n,); only what is loaded, and what moves, is read of the compliance."""
    n, nodes = len(contact), contact.nonzero()[0]
    first = 0 if coupled else n
    found = np.zeros(2 * n)
    for start in (0, n) if stuck and coupled else (n,):
        loaded = slice(start + nodes[0], start + nodes[-1] + 1)
        found[first:] += matrix[first:, loaded] @ forces[loaded]
    return found
