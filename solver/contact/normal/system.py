"""The linear system of a contact set: forces and approach from the heights of its nodes and the load.

[A 1; 1ᵀ 0] [f; approach] = [heights; -W], A being the compliance of the nodes in contact. It is factorized for one set. A set
that differs in a few nodes has the same system with a border: a node that has left adds the row f = 0, a node that has come
adds its own row and column. So a change of the set costs one solution with the existing factors.
"""

from collections.abc import Callable

import numpy as np
import scipy
from numpy.typing import NDArray

from nanoslip.solver.elasticity.compliance import SurfaceCompliance
from nanoslip.solver.outcome import SingularOperator, TooFarApart

Vector = NDArray[np.float64]
Dense = NDArray[np.float64]
Contact = NDArray[np.bool_]
Indices = NDArray[np.int64]

NEAR = 0.25
"""Share of a set's nodes that may change before its system is factorized anew: the border would take as long."""
FEW = 129
"""A set of so many nodes is factorized anew at every change: that takes no longer than a border."""
KEPT = 32
"""Sets of few nodes whose systems and tableaus are kept: members of a case, and other cases, have the same ones again. They take
at most 50 MB."""


class ContactSystem:
    """The system factorized for the set `base`, and solutions for sets near it.

    slope: of the pin's face under every node, (n,), where the nodes' u moves them along it; held: whether nodes are stuck at
    u = 0, so that forces f_x count too. Raises SingularOperator.
    """

    def __init__(self, compliance: SurfaceCompliance, base: Contact, slope: Vector | None, held: bool) -> None:
        self._matrix, self.slope, self._held = compliance.matrix, slope, held
        self._base, self._members = base, np.concatenate((base & held, base))
        self._entries = np.flatnonzero(self._members)
        self._with_load = np.append(self._entries, 2 * len(base))
        self._ones = (self._entries >= len(base)).astype(np.float64)
        symmetric = compliance.slab.scheme.reciprocal and slope is None
        self._solve = _factorized(self._block(self._entries, self._entries), symmetric, int(base.sum()))
        self._alone = self._solve(self._ones[None])[0]
        self._share = float(self._ones @ self._alone)
        # The border so far: a row for every entry that has changed, its column solved for, and the products of the two.
        self._places = np.full(2 * len(base), -1)
        self._rows = self._columns = np.empty((0, len(self._entries) + 1))
        self._products = np.empty((0, 0))
        self.answers: Dense | None = None
        """What to multiply right sides by, where it is kept: [heights of its entries; -W] to forces, approach and [u; w]."""

    def keep(self) -> "ContactSystem":
        """The same with answers to all right sides: worth while for a set that is met again and again."""
        solved = self._solved(np.eye(len(self._with_load)))
        self.answers = np.hstack((solved, solved[:, :-1] @ self._matrix.take(self._entries, 1).T))
        return self

    def is_of(self, contact: Contact) -> bool:
        """Whether the system was factorized for just this set."""
        return np.array_equal(contact, self._base)

    def is_near(self, contact: Contact) -> bool:
        """Whether a set (n,) differs so little that a border is worth while."""
        changes, nodes = np.count_nonzero(contact ^ self._base), np.count_nonzero(self._base)
        return bool(changes == 0 or (nodes > FEW and changes <= NEAR * nodes))

    def forces(self, contact: Contact, heights: Vector, normal_load: float) -> tuple[Vector, float]:
        """Forces (2n,) on the nodes of a set (n,) and the approach, where its nodes are to have these heights (n,).

        Raises SingularOperator, TooFarApart.
        """
        n, members = len(contact), np.concatenate((contact & self._held, contact))
        # From the lowest node up: where the load is small, forces are small differences of what higher ones would ask for.
        lowest = float(heights[contact].min())
        right = np.zeros(2 * n + 1)
        right[n:-1][contact] = heights[contact] - lowest
        right[-1] = -normal_load
        answer = self._solved(right[self._with_load][None])[0]
        changed = (members ^ self._members).nonzero()[0]
        forces = np.zeros(2 * n)
        if len(changed):
            border = self._border(changed, members[changed], answer, right[changed])
            answer -= border @ self._columns
        forces[self._entries] = answer[:-1]
        if len(changed):
            forces[changed] = np.where(members[changed], border[self._places[changed]], 0.0)
        return _finite(forces), float(answer[-1]) + lowest

    def answered(self, contact: Contact, heights: Vector, normal_load: float) -> tuple[Vector, float, Vector]:
        """Forces and approach of the set that it is kept for, and the displacements [u; w] (2n,) under them."""
        assert self.answers is not None
        entries, pressed = len(self._entries), heights[contact]
        lowest = float(pressed.min())
        right, forces = np.zeros(entries + 1), np.zeros(2 * len(contact))
        right[-1 - len(pressed) : -1] = pressed - lowest
        right[-1] = -normal_load
        answer = right @ self.answers
        forces[self._entries] = answer[:entries]
        return _finite(forces), float(answer[entries]) + lowest, answer[entries + 1 :]

    def _solved(self, rows: Dense) -> Dense:
        """Forces and approach (any, size + 1) for right sides that are rows, the load's last."""
        forces = self._solve(rows[:, :-1])
        found = np.empty_like(rows)
        found[:, -1] = approach = (forces @ self._ones - rows[:, -1]) / self._share
        found[:, :-1] = forces - approach[:, None] * self._alone
        return found

    def _border(self, changed: Indices, come: Contact, answer: Vector, right: Vector) -> Vector:
        """Forces on entries that have come, and what takes those of the gone away, by their rows of the border so far."""
        self._extend(changed[self._places[changed] < 0])
        at = self._places[changed]
        corner = -self._products[at[:, None], at]
        corner[come[:, None] & come] += self._block(changed[come], changed[come]).ravel()
        border = np.zeros(len(self._rows))
        try:
            border[at] = np.linalg.solve(corner, right - (self._rows @ answer)[at])
        except np.linalg.LinAlgError as error:
            raise _singular(int(self._base.sum())) from error
        return border

    def _extend(self, entries: Indices) -> None:
        """Give these entries, which have changed for the first time, a row and a column in the border."""
        gone, size = self._members[entries], (len(entries), len(self._entries) + 1)
        come = entries[~gone]
        rows, columns = np.zeros(size), np.zeros(size)
        rows[gone, np.searchsorted(self._entries, entries[gone])] = 1.0
        columns[gone] = rows[gone]
        rows[~gone, :-1], columns[~gone, :-1] = self._block(come, self._entries), self._block(self._entries, come).T
        rows[~gone, -1] = columns[~gone, -1] = come >= len(self._base)
        columns = self._solved(columns)
        self._products = np.block(
            [[self._products, self._rows @ columns.T], [rows @ self._columns.T, rows @ columns.T]]
        )
        self._places[entries] = np.arange(len(self._rows), len(self._rows) + len(entries))
        self._rows, self._columns = np.concatenate((self._rows, rows)), np.concatenate((self._columns, columns))

    def _block(self, rows: Indices, columns: Indices) -> Dense:
        """What the displacements [u; w] of these entries owe to forces on those, w less what u does along the pin."""
        found = _gathered(self._matrix, rows, columns)
        if self.slope is None:
            return found
        nodes = rows - len(self._base)
        return found - self.slope[nodes, None] * _gathered(self._matrix, nodes, columns)


def _finite(forces: Vector) -> Vector:
    if not np.isfinite(forces).all():
        # Every comparison with a NaN is false: nothing would seem to be wrong.
        raise TooFarApart("the forces of the contact are no numbers: use a load, a radius and heights nearer 1")
    return forces


def _gathered(matrix: Dense, rows: Indices, columns: Indices) -> Dense:
    """The entries in these rows and columns: much faster by `take`, along the shorter list first, than by both at once."""
    if len(rows) <= len(columns):
        return matrix.take(rows, 0).take(columns, 1)
    return matrix.take(columns, 1).take(rows, 0)


def _factorized(matrix: Dense, symmetric: bool, nodes: int) -> Callable[[Dense], Dense]:
    """Solve for right sides that are rows, (any, size). Overwrites the matrix; raises SingularOperator."""
    if symmetric:
        factor, failed = scipy.linalg.lapack.dpotrf(matrix.T, clean=0)
        if not failed:
            return lambda rows: np.asarray(scipy.linalg.lapack.dpotrs(factor, rows.T)[0].T)
    factors, pivots, failed = scipy.linalg.lapack.dgetrf(matrix.T, overwrite_a=1)
    if failed:
        raise _singular(nodes)
    return lambda rows: np.asarray(scipy.linalg.lapack.dgetrs(factors, pivots, rows.T, trans=1)[0].T)


def _singular(nodes: int) -> SingularOperator:
    return SingularOperator(
        f"the compliance of {nodes} nodes in contact is singular: use another scheme, or an aspect_ratio nearer 1"
    )
