"""Rows of nodes, the paper's binary hierarchy of rows (§2.1.2), interpolants on them (Eq. 8-10), and a slab's stiffness.

The two uppermost rows have equal node spacing; each row below has half the intervals of the row above. In L_x, x is
from 0 to 1, z from 0 at the surface to -L_z/L_x. Nodes are numbered row by row from the surface down, left to right.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import scipy
from numpy.polynomial import polynomial
from numpy.typing import NDArray

from nanoslip.solver.arrays import Floats
from nanoslip.solver.slab import Support

FirstSpacing = Literal["equal", "doubling"]


@dataclass(frozen=True, slots=True, eq=False)
class Grid:
    """Rows of nodes and the control volumes around them.

    counts: nodes of each row, shape (rows,). depths: z ≤ 0 of each row, shape (rows,), decreasing.
    """

    counts: NDArray[np.int64]
    depths: Floats

    @property
    def rows(self) -> int:
        """Number of rows of nodes."""
        return len(self.counts)

    @property
    def nodes(self) -> int:
        """Number of nodes in all rows."""
        return int(self.counts.sum())

    def row_x(self, row: int) -> Floats:
        """x of the nodes of `row` in L_x, from 0 to 1, shape (counts[row],)."""
        return np.linspace(0.0, 1.0, int(self.counts[row]))

    def spacing(self, row: int) -> float:
        """Distance between neighbouring nodes of `row`, in L_x."""
        return 1.0 / (int(self.counts[row]) - 1)

    def row_nodes(self, row: int) -> NDArray[np.int64]:
        """Numbers of the nodes of `row`, shape (counts[row],)."""
        first = int(self.counts[:row].sum())
        return np.arange(first, first + int(self.counts[row]))

    def volume_z(self, row: int) -> tuple[float, float]:
        """Lower and upper z of the row's control volumes, in L_x: half-way to the neighbouring rows, or the slab's boundary."""
        z = self.depths
        upper = z[0] if row == 0 else (z[row - 1] + z[row]) / 2
        lower = z[-1] if row == self.rows - 1 else (z[row] + z[row + 1]) / 2
        return float(lower), float(upper)

    def coordinates(self) -> Floats:
        """(x, z) of every node in L_x, shape (nodes, 2)."""
        x = np.concatenate([self.row_x(row) for row in range(self.rows)])
        return np.column_stack((x, np.repeat(self.depths, self.counts)))


def binary_hierarchy(n_x: int, aspect_ratio: float, rows: int, first_spacing: FirstSpacing) -> Grid:
    """The paper's grid: row spacings as 1, 1, 2, 4, … (`equal`) or 1, 2, 4, 8, … (`doubling`)."""
    intervals = [(n_x - 1) // 2 ** max(row - 1, 0) for row in range(rows)]
    doublings = [2.0**row for row in range(rows - 1)]
    if first_spacing == "equal":
        doublings = [1.0, *doublings[:-1]]
    steps = np.array(doublings)
    # Only ratios of the steps are given: the last row lies at the bottom.
    depths = np.concatenate(([0.0], np.cumsum(steps))) * (-aspect_ratio / steps.sum())
    return Grid(counts=np.array(intervals) + 1, depths=depths)


# Lagrange polynomials of the bi-quadratic interpolation (Eq. 8-10), built from the positions of the nodes used.
#
# A set of m polynomials is an array (m, m). Row k holds the ascending coefficients of the polynomial that is 1 at point k.

Basis = Floats


def lagrange(points: Sequence[float]) -> Basis:
    """The m Lagrange polynomials through m distinct points, shape (m, m)."""
    basis = np.empty((len(points), len(points)))
    for k, here in enumerate(points):
        others = [point for point in points if point != here]
        own_value = np.prod([here - point for point in others])
        basis[k] = polynomial.polyfromroots(others) / own_value
    return basis


def value(basis: Basis, t: float) -> Floats:
    """Each polynomial at t, shape (m,)."""
    return np.asarray(polynomial.polyval(t, basis.T))


def integral(basis: Basis, lower: float, upper: float) -> Floats:
    """Integral of each polynomial from lower to upper, shape (m,)."""
    primitive = polynomial.polyint(basis.T)
    return np.asarray(polynomial.polyval(upper, primitive) - polynomial.polyval(lower, primitive))


def slopes(basis: Basis) -> Basis:
    """Derivatives of the polynomials, as polynomials of their own, shape (m, m - 1)."""
    return np.asarray(polynomial.polyder(basis.T), np.float64).T


def gram(first: Basis, second: Basis, lower: float, upper: float) -> Floats:
    """Integrals from lower to upper of the products of two sets of polynomials, shape (polynomials, polynomials)."""
    products = np.array([np.convolve(one, other) for one in first for other in second])
    return integral(products, lower, upper).reshape(len(first), len(second))


def across(grid: Grid, row: int) -> tuple[NDArray[np.int64], Basis]:
    """The three rows nearest to `row`, and the polynomials through them, of z above the row itself."""
    used = np.clip(row, 1, grid.rows - 2) + np.array([-1, 0, 1])
    return used, lagrange([float(grid.depths[q] - grid.depths[row]) for q in used])


# The stiffness of a discretized slab (Eq. 11), and its supports: which displacements are zero (Figure 1).
#
# Under all supports the bottom row rests on a flat rigid plane (w = 0). They differ in the nodes with u = 0.


def support_mask(grid: Grid, support: Support) -> NDArray[np.bool_]:
    """Masks of the nodes with u = 0 and of the nodes with w = 0, shape (2, nodes). `bonded`: u = 0 along the bottom.

    `frictionless`: u = 0 at the bottom's middle node only; there displacements grow as the logarithm of the
    refinement. `right_side`: u = 0 along the right side, without its surface corner, which the pin may hold.
    """
    fixed = np.zeros((2, grid.nodes), dtype=np.bool_)
    fixed[0, HELD[support](grid)] = True
    fixed[1, _bottom(grid)] = True
    return fixed


def _bottom(grid: Grid) -> NDArray[np.int64]:
    return np.asarray(grid.row_nodes(grid.rows - 1))


HELD: dict[Support, Callable[[Grid], NDArray[np.int64]]] = {
    "bonded": _bottom,
    "frictionless": lambda grid: _bottom(grid)[[len(_bottom(grid)) // 2]],
    "right_side": lambda grid: np.array([grid.row_nodes(row)[-1] for row in range(1, grid.rows)]),
}
"""Support -> numbers of the nodes with u = 0."""


Sparse = Any  # scipy.sparse.csr_array; its type parameters differ between stub versions


def lame(poisson: float) -> float:
    """Lamé's first constant over the shear modulus, λ/G."""
    return 2 * poisson / (1 - 2 * poisson)


def assemble_blocks(k_u: Sparse, c_uw: Sparse, c_wu: Sparse, k_w: Sparse) -> Sparse:
    """The four matrices of Eq. 11, (nodes, nodes), as one."""
    return scipy.sparse.csr_array(scipy.sparse.block_array([[k_u, c_uw], [c_wu, k_w]]))


@dataclass(frozen=True, slots=True, eq=False)
class Stiffness:
    """{f_x; f_z} = matrix {u; w} for every node, no support applied (Eq. 11).

    matrix: sparse, (2·nodes, 2·nodes), in G. fixed: mask of the displacements u and w held at zero, (2, nodes).
    symmetric: whether the scheme promises a symmetric positive definite matrix.
    """

    grid: Grid
    matrix: Sparse
    fixed: NDArray[np.bool_]
    symmetric: bool
