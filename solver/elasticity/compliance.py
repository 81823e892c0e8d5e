"""Condense the slab to its surface (§2.1.4, Eq. 11): [u; w] = C [f_x; f_z] for nodal forces on the top row.

A group of rows, as the scheme names them, couples to its neighbours only: the stiffness is block tridiagonal and the
interior is eliminated group by group, from the bottom up, with dense blocks, even and odd fields apart (parity.py). Of a
slab that is a column only the two ends are condensed (column.py). The half-plane is in closed form and needs none of this.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
from numpy.typing import NDArray

from solver.case import FirstSpacing, Scheme, Slab, Support
from solver.elasticity.column import lengthening, resultants, trunk
from solver.elasticity.parity import row_bases
from solver.elasticity.schemes import Stiffness, half_plane, stiffness
from solver.elasticity.schemes.stiffness import Sparse
from solver.outcome import SingularOperator

Dense = NDArray[np.float64]
Solve = Callable[[Dense, Dense], Dense]


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceCompliance:
    """Displacements of the surface nodes per nodal force: all that contact needs to know of the slab.

    matrix: shape (2n, 2n), in 1/G per unit depth, read-only; [u; w] = matrix @ [f_x; f_z], nodes left to right,
    x to the right, z upwards (out of the slab).
    """

    matrix: Dense
    slab: Slab

    def __post_init__(self) -> None:
        shape = (2 * self.slab.n_x, 2 * self.slab.n_x)
        if self.matrix.shape != shape:
            raise ValueError(f"matrix.shape = {self.matrix.shape}: a slab of n_x = {self.slab.n_x} needs {shape}")

    @property
    def x(self) -> NDArray[np.float64]:
        """Positions of the surface nodes in L_x, centred on the slab's middle, shape (n,)."""
        return np.linspace(-0.5, 0.5, self.slab.n_x)

    @property
    def widths(self) -> NDArray[np.float64]:
        """Length of surface that belongs to each node, in L_x, shape (n,): nodal force = traction × width.

        The scheme's own weights: the width of a control volume, or the integral of a node's hat, which is the same. The
        half-plane goes on beyond its end nodes, whose hats are whole.
        """
        widths = np.full(self.slab.n_x, self.slab.spacing)
        if self.slab.scheme != "half_plane":
            widths[[0, -1]] /= 2
        return widths


def uncoupled(compliance: SurfaceCompliance) -> SurfaceCompliance:
    """The same without the response of u to normal and of w to tangential forces (Goodman's approximation)."""
    n = compliance.slab.n_x
    matrix = np.zeros_like(compliance.matrix, subok=False)
    matrix[:n, :n], matrix[n:, n:] = compliance.matrix[:n, :n], compliance.matrix[n:, n:]
    matrix.setflags(write=False)
    return SurfaceCompliance(matrix, compliance.slab)


def surface_compliance(
    *,
    n_x: int = 129,
    aspect_ratio: float = 1.0,
    poisson: float = 1.0 / 3.0,
    support: Support = "bonded",
    scheme: Scheme = "galerkin",
    first_spacing: FirstSpacing | None = None,
    rows: int | None = None,
    rows_per_level: int | None = None,
    coarsest_row: int | None = None,
    bottom_row: int | None = None,
) -> SurfaceCompliance:
    """The surface compliance of a slab given by its dimensionless numbers (see `Slab`).

    Raises InvalidInput for a value out of range, SingularOperator where the slab can move freely.
    """
    given = (first_spacing, rows, rows_per_level, coarsest_row, bottom_row)
    return slab_compliance(Slab(n_x, aspect_ratio, poisson, support, scheme, *given))


def slab_compliance(slab: Slab) -> SurfaceCompliance:
    """The surface compliance of `slab`, exactly symmetric where its scheme is reciprocal.

    Raises SingularOperator where a block cannot be inverted, InvalidInput where the half-plane's datum is too near.
    """
    matrix = half_plane(slab) if slab.scheme == "half_plane" else _condense(stiffness(trunk(slab)))
    if trunk(slab) != slab:
        acting = resultants(slab.n_x)
        longer = acting.T @ lengthening(slab) @ acting
        matrix += (longer + longer.T) / 2
    matrix.setflags(write=False)
    return SurfaceCompliance(matrix, slab)


def _condense(k: Stiffness) -> Dense:
    """The compliance of the surface row, (2n, 2n): the sum of what the families of fields contribute."""
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
    """Eliminate every group but the first, from the bottom up, S_b ← A_bb - A_b,b+1 S_(b+1)⁻¹ A_b+1,b; invert what is left.

    The surface's are the first so many fields of the first group.
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
    return sp.csr_array(sp.hstack(rows))


def _solve(matrix: Dense, right: Dense) -> Dense:
    """matrix⁻¹ right, refused where the reciprocal condition number is below machine precision."""
    norm = np.abs(matrix).sum(axis=0).max(initial=0.0)
    factors, pivots, info = la.lapack.dgetrf(matrix)
    _check(0.0 if info else float(la.lapack.dgecon(factors, norm)[0]))
    solution, _ = la.lapack.dgetrs(factors, pivots, right)
    return np.asarray(solution)


def _solve_symmetric(matrix: Dense, right: Dense) -> Dense:
    """The same for a symmetric positive definite matrix, in half the time."""
    norm = np.abs(matrix).sum(axis=0).max(initial=0.0)
    factor, info = la.lapack.dpotrf(matrix)
    _check(0.0 if info else float(la.lapack.dpocon(factor, norm)[0]))
    solution, _ = la.lapack.dpotrs(factor, right)
    return np.asarray(solution)


def _check(reciprocal_condition: float) -> None:
    if reciprocal_condition < np.finfo(float).eps:
        raise SingularOperator(
            f"the slab's stiffness is singular (reciprocal condition {reciprocal_condition:.1e}): "
            "check that the support restrains it, and that poisson is not too close to 0.5"
        )
