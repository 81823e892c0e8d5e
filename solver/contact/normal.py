"""Contact sets found from the matrix of the surface's compliance, before any node slips."""

import math
from collections.abc import Callable, Iterator
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import scipy

from nanoslip.solver.arrays import Dense, Floats, Indices, Nodes, Vector
from nanoslip.solver.case import Case
from nanoslip.solver.contact.disc import CHARACTERS, Quarter, nearest_disc
from nanoslip.solver.contact.pin import guess_contact, make_pin, surface_from_axis, surface_from_pin
from nanoslip.solver.elasticity.compliance import FEW_NODES, KEPT, Compliance, Entries
from nanoslip.solver.layout import Plane
from nanoslip.solver.outcome import SingularOperator, TooFarApart

# The linear system of a contact set: forces and approach from the heights of its nodes and the load.
#
# [A 1; 1ᵀ 0] [f; approach] = [heights; -W], A being the compliance of the nodes in contact. It is factorized for one set. A set
# that differs in a few nodes has the same system with a border: a node that has left adds the row f = 0, a node that has come
# adds its own row and column. So a change of the set costs one solution with the existing factors.


NEAR_SHARE = 0.25
"""Share of a set's nodes that may change before its system is factorized anew: the border would take as long."""


def is_similar(base: Nodes, contact: Nodes) -> bool:
    """True if a set (n,) differs so little from that of a system that a bordered update pays off."""
    changes, nodes = np.count_nonzero(contact ^ base), np.count_nonzero(base)
    return bool(changes == 0 or (nodes > FEW_NODES and changes <= NEAR_SHARE * nodes))


class ContactSystem:
    """The system factorized for the set `base`, and solutions for sets near it.

    slope: of the pin's face under every node, (n,), where the nodes' u moves them along it; held: whether nodes are stuck at
    u = 0, so that forces f_x count too; of_disc: a quarter of a `base` that is a disc of nodes that are held. Raises
    SingularOperator.
    """

    def __init__(
        self, compliance: Compliance, base: Nodes, slope: Vector | None, held: bool, of_disc: Quarter | None = None
    ) -> None:
        self._compliance, self.slope, self._held = compliance, slope, held
        self._base, self._members = base, np.concatenate((base & held, base))
        self._entries = np.flatnonzero(self._members)
        self._with_load = np.append(self._entries, 2 * len(base))
        self._ones = (self._entries >= len(base)).astype(np.float64)
        nodes = int(base.sum())
        if of_disc is None:
            symmetric = compliance.slab.scheme.reciprocal and slope is None
            self._solve = _solve_factorized(self._block(self._entries, self._entries), symmetric, nodes)
        else:
            self._solve = _solve_in_parts(of_disc, self._base_block, nodes)
        # The load's row and column by elimination: forces of equal heights, and their sum, give the approach.
        self._alone = self._solve(self._ones[None])[0]
        self._share = float(self._ones @ self._alone)
        # The border so far: a row for every entry that has changed, its column solved for, and the products of the two.
        self._places = np.full(2 * len(base), -1)
        self._rows = self._columns = np.empty((0, len(self._entries) + 1))
        self._products = np.empty((0, 0))
        self.answers: Dense | None = None
        """Matrix that maps right sides to results, if kept: [heights of its entries; -W] to forces, approach and [u; w]."""

    def keep(self) -> "ContactSystem":
        """Store the results for all right sides, which pays off for a set that recurs often."""
        solved = self._solve_with_load(np.eye(len(self._with_load)))
        # Right sides that are a unit matrix give the inverse; its forces, times the compliance, all
        # displacements.
        all_entries = np.arange(2 * len(self._base))
        everywhere = self._compliance.entries(all_entries, self._entries)
        self.answers = np.hstack((solved, solved[:, :-1] @ everywhere.T))
        return self

    def matches_set(self, contact: Nodes) -> bool:
        """True if the system was factorized for exactly this set."""
        return np.array_equal(contact, self._base)

    def is_similar(self, contact: Nodes) -> bool:
        """True if the system serves this set (n,), too."""
        return is_similar(self._base, contact)

    def forces(self, contact: Nodes, heights: Vector, normal_load: float) -> tuple[Vector, float]:
        """Forces (2n,) on the nodes of a set (n,) and the approach, where its nodes are to have these heights (n,).

        Raises SingularOperator, TooFarApart.
        """
        n, members = len(contact), np.concatenate((contact & self._held, contact))
        # From the lowest node: a small load's forces would else be small differences of what large heights demand.
        lowest = float(heights[contact].min())
        right = np.zeros(2 * n + 1)
        right[n:-1][contact] = heights[contact] - lowest
        right[-1] = -normal_load
        answer = self._solve_with_load(right[self._with_load][None])[0]
        changed = (members ^ self._members).nonzero()[0]
        forces = np.zeros(2 * n)
        if len(changed):
            border = self._border(changed, members[changed], answer, right[changed])
            answer -= border @ self._columns
        forces[self._entries] = answer[:-1]
        if len(changed):
            added = border[self._places[changed]]
            forces[changed] = np.where(members[changed], added, 0.0)
        return finite(forces), float(answer[-1]) + lowest

    def look_up_answer(self, contact: Nodes, heights: Vector, normal_load: float) -> tuple[Vector, float, Vector]:
        """Forces and approach of the set that it is kept for, and the displacements [u; w] (2n,) under them."""
        assert self.answers is not None
        entries, pressed = len(self._entries), heights[contact]
        lowest = float(pressed.min())
        right, forces = np.zeros(entries + 1), np.zeros(2 * len(contact))
        right[-1 - len(pressed) : -1] = pressed - lowest
        right[-1] = -normal_load
        answer = right @ self.answers
        forces[self._entries] = answer[:entries]
        return finite(forces), float(answer[entries]) + lowest, answer[entries + 1 :]

    def _solve_with_load(self, rows: Dense) -> Dense:
        """Forces and approach (any, size + 1) for right sides that are rows, the load's last."""
        forces = self._solve(rows[:, :-1])
        solution = np.empty_like(rows)
        # f = A⁻¹ h - approach·A⁻¹ 1; the sum of the forces f_z is the load's entry of the right side.
        approach = (forces @ self._ones - rows[:, -1]) / self._share
        solution[:, -1] = approach
        solution[:, :-1] = forces - approach[:, None] * self._alone
        return solution

    def _border(self, changed: Indices, come: Nodes, answer: Vector, right: Vector) -> Vector:
        """Forces on added entries, and corrections for removed ones, by the current border's rows."""
        self._extend(changed[self._places[changed] < 0])
        at = self._places[changed]
        # Schur complement of the border: its own entries less what the base answers to it.
        corner = -self._products[at[:, None], at]
        added = changed[come]
        corner[come[:, None] & come] += self._block(added, added).ravel()
        border = np.zeros(len(self._rows))
        lacking = right - (self._rows @ answer)[at]
        try:
            border[at] = np.linalg.solve(corner, lacking)
        except np.linalg.LinAlgError as error:
            raise _singular(int(self._base.sum())) from error
        return border

    def _extend(self, entries: Indices) -> None:
        """Give these entries, which have changed for the first time, a row and a column in the border."""
        gone = self._members[entries]
        come = entries[~gone]
        size = (len(entries), len(self._entries) + 1)
        rows, columns = np.zeros(size), np.zeros(size)
        # An entry that is gone is held at no force: its row and column are those of a unit matrix.
        rows[gone, np.searchsorted(self._entries, entries[gone])] = 1.0
        columns[gone] = rows[gone]
        rows[~gone, :-1] = self._block(come, self._entries)
        columns[~gone, :-1] = self._block(self._entries, come).T
        # Normal forces, the second half of all entries, count for the load.
        rows[~gone, -1] = come >= len(self._base)
        columns[~gone, -1] = rows[~gone, -1]
        columns = self._solve_with_load(columns)
        above = [self._products, self._rows @ columns.T]
        below = [rows @ self._columns.T, rows @ columns.T]
        self._products = np.block([above, below])
        first = len(self._rows)
        self._places[entries] = np.arange(first, first + len(entries))
        self._rows = np.concatenate((self._rows, rows))
        self._columns = np.concatenate((self._columns, columns))

    def _block(self, rows: Indices, columns: Indices) -> Dense:
        """Displacements [u; w] of these entries by forces on those, with w corrected for u along the pin."""
        block = self._compliance.entries(rows, columns)
        if self.slope is None:
            return block
        nodes = rows - len(self._base)
        return block - self.slope[nodes, None] * self._compliance.entries(nodes, columns)

    def _base_block(self, rows: Indices, columns: Indices) -> Dense:
        """Displacements of `_block`, numbered as the entries of the base."""
        return self._block(self._entries[rows], self._entries[columns])


def finite(forces: Vector) -> Vector:
    """The forces of a contact. Raises TooFarApart if they overflow."""
    if not np.isfinite(forces).all():
        # Every comparison with a NaN is false: nothing would seem to be wrong.
        raise TooFarApart("the contact forces overflow: use a load, radius and heights closer to 1")
    return forces


def _solve_factorized(matrix: Dense, symmetric: bool, nodes: int) -> Callable[[Dense], Dense]:
    """Solve for right sides that are rows, (any, size). Overwrites the matrix; raises SingularOperator."""
    if symmetric:
        # Into a copy: rounding may leave the matrix without such a factor, and then it is needed as it is.
        factor, failed = scipy.linalg.lapack.dpotrf(matrix.T, clean=0)
        if not failed:
            return lambda rows: np.asarray(scipy.linalg.lapack.dpotrs(factor, rows.T)[0].T)
    # The transpose is what LAPACK, which counts by columns, reads without a copy; trans=1 below undoes it.
    factors, pivots, failed = scipy.linalg.lapack.dgetrf(matrix.T, overwrite_a=1)
    if failed:
        raise _singular(nodes)
    return lambda rows: np.asarray(scipy.linalg.lapack.dgetrs(factors, pivots, rows.T, trans=1)[0].T)


def _solve_in_parts(of_disc: Quarter, matrix: Entries, nodes: int) -> Callable[[Dense], Dense]:
    """Solver for a disc's symmetric matrix, factorized in its four parts."""
    solved = []
    for number, part in enumerate(of_disc.parts(matrix)):
        members = of_disc.members(CHARACTERS[number])
        if len(members):  # of a single node some parts are empty
            solve_part = _solve_factorized(part[np.ix_(members, members)], True, nodes)
            solved.append((number, members, solve_part))

    def solve(rows: Dense) -> Dense:
        given = of_disc.vector_parts(rows)
        found = np.zeros_like(given)
        for number, members, solve_part in solved:
            found[number][:, members] = solve_part(given[number][:, members])
        return of_disc.from_vector_parts(found)

    return solve


def _singular(nodes: int) -> SingularOperator:
    return SingularOperator(
        f"the compliance of {nodes} nodes in contact is singular: use another scheme, or an aspect_ratio nearer 1",
        cause="singular_contact",
    )


# Choice of the nodes that a contact set exchanges next (block principal pivoting: Kostreva; Júdice and Pires).
#
# All wrong nodes at once, those that pull and those inside the pin. When their number has not fallen for PATIENCE rounds, only
# the one furthest right (Murty's rule, which cannot cycle on a positive definite operator), until fewer are wrong than ever
# before.

PATIENCE = 10
"""Rounds in which a contact set may not improve before its wrong nodes are exchanged one at a time."""


class Exchanged(NamedTuple):
    """The set to try next."""

    contact: Nodes
    all_at_once: bool
    """True if every wrong node changed sides."""
    again: bool
    """True if exchanging one node at a time led back to an earlier set."""


class Exchange:
    """The search for a contact set among surface nodes at these distances, (n,), from the pin's lowest point; it keeps one
    node at least."""

    def __init__(self, away: Floats) -> None:
        self._lowest = int(np.argmin(away))
        self._fewest, self._patience = len(away) + 1, PATIENCE
        self._left: set[bytes] = set()

    def exchange_wrong_nodes(self, contact: Nodes, wrong: Nodes) -> Exchanged:
        """Exchange wrong nodes (n,) of a contact (n,) for the next round."""
        count = int(wrong.sum())
        if count < self._fewest:
            self._fewest, self._patience = count, PATIENCE
            # Fewer wrong nodes than ever: none of the earlier sets can come back.
            self._left.clear()
        self._patience -= 1
        if self._patience >= 0:
            return Exchanged(self._keep_a_node(contact ^ wrong), all_at_once=True, again=False)
        as_bytes = contact.tobytes()
        again = as_bytes in self._left
        self._left.add(as_bytes)
        following = contact.copy()
        # Always the one furthest right: a fixed order excludes cycles, the worst node first may go round in them.
        following[np.flatnonzero(wrong)[-1]] ^= True
        return Exchanged(self._keep_a_node(following), all_at_once=False, again=again)

    def _keep_a_node(self, contact: Nodes) -> Nodes:
        if not contact.any():
            contact[self._lowest] = True
        return contact


# Press the pin down (§3.1): the contact set, pressures and approach at a given load, before any node slips.
#
# Three kinds of surface are computed:
#
# - Stuck to the pin at u = 0: shear and pressure act on each other through the coupling of the compliance.
# - Without friction: only pressure acts, and it moves the surface sideways under the pin. Half of the compliance is
# needed.
# - Without coupling: pressure causes no sideways motion, so stuck and frictionless contacts are the same. A quarter
# is needed.

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

    contact: Nodes
    normal_force: Vector
    """N of every node, zero if free."""
    u: Vector
    v: Vector
    """w + approach."""
    approach: float
    converged: bool


def normal_contact(case: Case, compliance: Compliance, stuck: bool) -> NormalContact:
    """The contact at the case's load, its nodes stuck at u = 0 or free of friction. Raises SingularOperator, TooFarApart."""
    none = np.zeros(compliance.slab.nodes)
    start = pressed = NormalContact(guess_contact(case), none, none, none, 0.0, converged=False)
    try:
        for pressed in _iterates(case, compliance, start, stuck):
            if pressed.converged:
                break
    except SingularOperator:
        # A compliance is positive definite; less its product with slopes, beside which it may be rounding, it need not be.
        if stuck or not case.effects.coupling:
            raise
    return pressed


def _iterates(case: Case, compliance: Compliance, start: NormalContact, stuck: bool) -> Iterator[NormalContact]:
    """The contact sets that are tried after that of `start`, up to one that has no wrong nodes, or that came before.

    Wrong nodes are exchanged (Exchange) until no node is wrong. Similar contact sets share factors (ContactSystem);
    the forces of the last are solved with the factors of its set, unless only the set is requested.
    """
    contact, u, moved = start.contact, start.u, math.inf
    exchange = Exchange(surface_from_axis(case))
    system = _system(case, compliance, contact, u, stuck)
    for _ in range(MOST_ROUNDS):
        if not system.is_similar(contact):
            system = _system(case, compliance, contact, u, stuck)
        pressed = _press_nodes(case, compliance, system, contact, u, stuck)
        wrong = wrong_nodes(case, pressed)
        right = not wrong.any()
        if right and stuck:  # of a stuck contact only the set is used
            yield pressed
            return
        before, moved, u = moved, float(np.abs(pressed.u - u).max()), pressed.u
        if right:
            if system.matches_set(contact) and moved <= rounding_at_rest(case, pressed):
                yield pressed
                return
            # The set is right, u still moves: with fresh slopes the next step is Newton's, which converges at once.
            if not system.matches_set(contact) or moved > SLOW * before:
                system = _system(case, compliance, contact, u, stuck)
            yield pressed._replace(converged=False)
            continue
        following = exchange.exchange_wrong_nodes(contact, wrong)
        # Nodes stuck at u = 0 have no memory but their set: one that comes back comes back for ever.
        if following.again and (stuck or not case.effects.coupling):
            yield pressed._replace(converged=False)
            return
        # In another set u changes anew: the last change is no measure.
        contact, moved = following.contact, math.inf
        yield pressed._replace(contact=contact, converged=False)


def rounding_at_rest(case: Case, pressed: NormalContact) -> float:
    """Rounding error: distance that nodes at rest may move from round to round, in L_x."""
    xi = surface_from_axis(case, pressed.u)[pressed.contact]
    return RESTING * case.normal_load + make_pin(case).rounding(xi)


def wrong_nodes(case: Case, pressed: NormalContact) -> Nodes:
    """Nodes (n,) in contact that pull, and free nodes that lie inside the pin."""
    x, pin = surface_from_pin(case), make_pin(case)
    # A node beside a punch is never under it, even where it has moved there: see EDGE_REACHED.
    is_under = np.abs(x) <= pin.half_width
    gap = np.where(is_under, pin.height(x + pressed.u) - pressed.v, np.inf)
    return np.asarray(np.where(pressed.contact, -pressed.normal_force, -gap) > INSIDE * case.normal_load)


def _system(case: Case, compliance: Compliance, contact: Nodes, u: Vector, stuck: bool) -> ContactSystem:
    """The system of this contact set. Without friction the pin's height under a node depends on its u, here
    linearized at the given u."""
    coupled = case.effects.coupling
    slope = make_pin(case).slope(surface_from_pin(case) + u) if coupled and not stuck else None
    if slope is None and compliance.lasting and len(contact) <= FEW_NODES:  # no border changes what is kept
        return _previous_system(compliance, contact.tobytes(), coupled and stuck)
    if coupled and stuck and isinstance(case.slab.layout, Plane):
        disc = nearest_disc(contact, case.slab.n_x)
        if disc is not None and is_similar(disc.nodes, contact):
            return ContactSystem(compliance, disc.nodes, None, held=True, of_disc=disc.quarter.without_load())
    return ContactSystem(compliance, contact, slope, held=coupled and stuck)


@lru_cache(maxsize=KEPT)
def _previous_system(compliance: Compliance, contact: bytes, stuck: bool) -> ContactSystem:
    system = ContactSystem(compliance, np.frombuffer(contact, np.bool_), None, stuck)
    # Of a stuck contact the set alone counts, not the last bits. On larger grids it takes longer than it saves.
    return system.keep() if stuck and compliance.slab.nodes <= ANSWERED else system


def _press_nodes(
    case: Case, compliance: Compliance, system: ContactSystem, contact: Nodes, u: Vector, stuck: bool
) -> NormalContact:
    """The contact with just these nodes on the pin, one Newton step from the given u."""
    n, coupled = compliance.slab.nodes, case.effects.coupling
    heights = make_pin(case).unbounded_height(surface_from_pin(case) + (0.0 if stuck else u))
    # Newton: h(x + u') = h(x + u) + slope·(u' - u). The term with u' stands in the matrix (`_block`).
    if system.slope is not None:
        heights = heights - system.slope * u
    if system.answers is None:
        forces, approach = system.forces(contact, heights, case.normal_load)
        moved = compliance.displacements(forces.reshape(2, n), coupled).ravel()
    else:
        forces, approach, moved = system.look_up_answer(contact, heights, case.normal_load)
    u = np.where(contact, 0.0, moved[:n]) if stuck else moved[:n]
    return NormalContact(contact, -forces[n:], u, moved[n:] + approach, approach, converged=True)
