"""Roles of the surface nodes (free, stick, slide): changed one at a time, the worst violation first, until all constraints hold.

A sticking node slides where its shear would exceed its limit. A sliding node sticks where it would move in the direction of its
own shear. Where an earlier assignment of roles comes back, none (or no unique one) satisfies all constraints.
"""

import numpy as np

from nanoslip.solver.contact.coulomb.contact import TOLERANCE, CoulombContact, CoulombError, Rates, Vector
from nanoslip.solver.outcome import Ending


def resolve_violations(solved: CoulombContact) -> None:
    """Change one role per violated constraint, the worst first, until none is violated: tension, shear, penetration."""
    seen: set[bytes] = set()
    while True:
        solved.solve()
        tolerance = solved.tolerance
        tension = np.where(np.abs(solved.xi) > solved.pin.half_width, solved.normal_load, -solved.normal_force)
        answers = ((solved.release, np.where(solved.contact, tension, -1.0)), (solved.let_slide, solved.excess))
        for answer, violation in (*answers, (solved.touch, -solved.gap)):
            worst = _largest(violation, tolerance)
            if violation[worst] > tolerance:
                answer(worst)
                break
        else:
            return
        _refuse_cycles(seen, solved)


def stick_and_slide_in_motion(solved: CoulombContact, pin_rate: float) -> Rates:
    """Change roles until all of them agree with the motion to come; returns its rates (see `CoulombContact.rates`)."""
    seen: set[bytes] = set()
    while True:
        rates = force_rate, _, u_rate, _ = solved.rates(pin_rate)
        # A node that has just touched bears no force yet, and slides the way its shear begins to push.
        near = max(1e-9 * solved.normal_load * min(solved.case.intrinsic_friction, 1.0), solved.tolerance)
        none = np.abs(solved.force[0]) <= near
        sign = np.sign(np.where(none, force_rate[0], solved.force[0]))
        growth = sign * force_rate[0] + solved.node_friction * force_rate[1]
        growth = np.where(solved.excess > -near, growth, -1.0)
        dragged = np.where(solved.sliding != 0.0, solved.sliding * (u_rate - pin_rate), -1.0)
        least = TOLERANCE * max(np.abs(force_rate).max(), 1.0)
        if growth.max() > least:
            node = _largest(growth, least)
            solved.sliding[node] = sign[node]
            solved.node_slips[node] += 1
        elif solved.case.intrinsic_friction > 0.0 and dragged.max() > 1e-9:
            solved.sliding[_largest(dragged, 1e-9)] = 0.0
        else:
            return rates
        _refuse_cycles(seen, solved)


def stick_and_slide_at_rest(solved: CoulombContact) -> None:
    """Find the roles at rest: resolve violations, and let nodes stick again at u = 0 that slide against their shear."""
    seen: set[bytes] = set()
    while True:
        resolve_violations(solved)
        _refuse_cycles(seen, solved)
        # Without friction the sign of a sliding node means nothing.
        against = (solved.sliding * solved.u > solved.tolerance) & (solved.case.intrinsic_friction > 0.0)
        if not against.any():
            return
        solved.sliding[against], solved.u[against] = 0.0, 0.0


def _largest(values: Vector, tolerance: float) -> int:
    """The node with the largest value, of those nearer to it than the tolerance the one furthest right."""
    return int(np.flatnonzero(values >= values.max() - tolerance)[-1])


def _refuse_cycles(seen: set[bytes], solved: CoulombContact) -> None:
    """Raises CoulombError where the same roles come back."""
    roles = np.where(solved.contact, solved.sliding, 2.0).tobytes()
    if roles in seen:
        # For large μ_i there need not be an assignment of roles that satisfies all conditions.
        raise CoulombError(Ending.SLIP_UNBOUNDED)
    seen.add(roles)
