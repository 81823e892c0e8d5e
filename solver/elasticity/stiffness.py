"""The stiffness of a discretized slab (Eq. 11), and its supports: which displacements are zero (Figure 1)."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from nanoslip.solver.elasticity.grid import Grid
from nanoslip.solver.slab import Support

# Supports of the slab (Figure 1): the nodal displacements that are zero under each.
#
# Under all of them the bottom row rests on a flat rigid plane (w = 0). They differ in the nodes with u = 0.


def restrained(grid: Grid, support: Support) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Nodes with u = 0 and nodes with w = 0, two masks of shape (nodes,).

    `bonded`: u = 0 along the bottom. `frictionless`: u = 0 at the bottom's middle node only, a point restraint: under a
    tangential load, displacements grow as the logarithm of the refinement there. `right_side`: u = 0 along the right side
    below the surface; the surface corner stays free because the pin may hold it.
    """
    fixed_u = np.zeros(grid.nodes, dtype=np.bool_)
    fixed_w = np.zeros(grid.nodes, dtype=np.bool_)
    fixed_u[HELD[support](grid)] = True
    fixed_w[_bottom(grid)] = True
    return fixed_u, fixed_w


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


def confined_modulus(poisson: float) -> float:
    """Stiffness in compression where nothing can give way sideways, (λ+2G)/G."""
    return lame(poisson) + 2


def in_blocks(k_u: Sparse, c_uw: Sparse, c_wu: Sparse, k_w: Sparse) -> Sparse:
    """The four matrices of Eq. 11, (nodes, nodes), as one."""
    return scipy.sparse.csr_array(scipy.sparse.block_array([[k_u, c_uw], [c_wu, k_w]]))


@dataclass(frozen=True, slots=True, eq=False)
class Stiffness:
    """{f_x; f_z} = matrix {u; w} for every node, no support applied (Eq. 11).

    matrix: sparse, (2·nodes, 2·nodes), in G. fixed_u, fixed_w: masks of the displacements held at zero, (nodes,).
    symmetric: whether the scheme promises a symmetric positive definite matrix. per_row: forces per translation of each row of
    nodes, (2·nodes, 2·rows), along x, then along z, where a scheme's cells may be so high and narrow that too few digits are
    left where its matrix is summed.
    """

    grid: Grid
    matrix: Sparse
    fixed_u: NDArray[np.bool_]
    fixed_w: NDArray[np.bool_]
    symmetric: bool
    per_row: NDArray[np.float64] | None = None

    @property
    def fixed(self) -> NDArray[np.bool_]:
        """Mask of the restrained entries of [u; w], shape (2·nodes,)."""
        return np.concatenate((self.fixed_u, self.fixed_w))
