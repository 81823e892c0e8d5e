"""Condense a stiffness to the surface (§2.1.4, Eq. 11): [u; w] = C [f_x; f_z] for nodal forces on the top row.

The scheme collects rows in groups that couple to neighbouring groups only, so the stiffness is block tridiagonal. The interior
is eliminated group by group from the bottom up, with dense blocks. Even and odd fields are condensed separately (parity.py).
"""

from collections.abc import Callable

import numpy as np
import scipy
from numpy.typing import NDArray

from solver.elasticity.parity import row_bases
from solver.elasticity.stiffness import Sparse, Stiffness
from solver.outcome import SingularOperator

Dense = NDArray[np.float64]
Solve = Callable[[Dense, Dense], Dense]


def condensed(k: Stiffness) -> Dense:
    """The compliance of the surface row, shape (2n, 2n), in 1/G: the sum over even and odd fields. Raises SingularOperator."""
    n = int(k.grid.counts[0])
    surface = np.concatenate((np.arange(n), k.grid.nodes + np.arange(n)))
    full, total = k.matrix, np.zeros((2 * n, 2 * n))
    solve = _solve_symmetric if k.symmetric else _solve
    for rows in row_bases(k):
        top = rows[0][surface]
        groups = [_joined(*(rows[row] for row in group)) for group in k.row_groups]
        total += top @ (top @ _surface_inverse(full, groups, top.shape[1], solve).T).T
    return (total + total.T) / 2 if k.symmetric else total


def _surface_inverse(full: Sparse, groups: list[Sparse], surface: int, solve: Solve) -> Dense:
    """Compliance of the surface's fields by block elimination from the bottom up: S_b = A_bb - A_b,b+1 S_(b+1)⁻¹ A_b+1,b.

    The surface's fields stand first in the first group.
    """
    below, *above = [group for group in reversed(groups) if group.shape[1]]  # a bonded row has nothing to eliminate
    schur = (below.T @ full @ below).toarray()
    for here in above:
        from_here = (below.T @ full @ here).toarray()
        schur = (here.T @ full @ here).toarray() - (here.T @ full @ below) @ solve(schur, from_here)
        below = here
    if surface < len(schur):
        inner = solve(schur[surface:, surface:], schur[surface:, :surface])
        schur = schur[:surface, :surface] - schur[:surface, surface:] @ inner
    return solve(schur, np.eye(surface))


def _joined(*rows: Sparse) -> Sparse:
    return scipy.sparse.csr_array(scipy.sparse.hstack(rows))


def _solve(matrix: Dense, right: Dense) -> Dense:
    """matrix⁻¹ right. Raises SingularOperator where the reciprocal condition number is below machine precision."""
    norm = np.abs(matrix).sum(axis=0).max(initial=0.0)
    factors, pivots, info = scipy.linalg.lapack.dgetrf(matrix)
    _check(0.0 if info else float(scipy.linalg.lapack.dgecon(factors, norm)[0]))
    solution, _ = scipy.linalg.lapack.dgetrs(factors, pivots, right)
    return np.asarray(solution)


def _solve_symmetric(matrix: Dense, right: Dense) -> Dense:
    """The same for a symmetric positive definite matrix, in half the time."""
    norm = np.abs(matrix).sum(axis=0).max(initial=0.0)
    factor, info = scipy.linalg.lapack.dpotrf(matrix)
    _check(0.0 if info else float(scipy.linalg.lapack.dpocon(factor, norm)[0]))
    solution, _ = scipy.linalg.lapack.dpotrs(factor, right)
    return np.asarray(solution)


def _check(reciprocal_condition: float) -> None:
    if reciprocal_condition < np.finfo(float).eps:
        raise SingularOperator(
            f"the slab's stiffness is singular (reciprocal condition {reciprocal_condition:.1e}): "
            "check that the support restrains it, and that poisson is not too close to 0.5"
        )
