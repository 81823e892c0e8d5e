"""The stiffness of a discretized slab (Eq. 11), and the restrained displacements."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from solver.elasticity.grid import Grid

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
