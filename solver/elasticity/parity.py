"""Even and odd displacement fields. A slab that is symmetric about its middle does not couple them: each is solved alone.

Reflection x → -x leaves w of an even field as it is and changes the sign of u; for an odd field it is the other way round.
Two problems of half the size cost a quarter.
"""

import numpy as np
import scipy
from numpy.typing import NDArray

from solver.elasticity.grid import Grid
from solver.elasticity.stiffness import Sparse, Stiffness


def row_bases(k: Stiffness) -> list[list[Sparse]]:
    """Families of displacement fields that the stiffness does not couple, each as one orthonormal basis per grid row.

    A basis is sparse, shape (2·nodes, fields of that row), without the restrained displacements. There are two families, even
    and odd, where the support is symmetric; otherwise one family of all displacements.
    """
    rows = range(k.grid.rows)
    if not _mirrored(k):
        return [[_basis(k, np.concatenate((nodes, nodes + k.grid.nodes))) for nodes in map(k.grid.row_nodes, rows)]]
    return [[_parity_basis(k, row, sign) for row in rows] for sign in (1.0, -1.0)]


def _mirrored(k: Stiffness) -> bool:
    mirror = _mirror(k.grid)
    return bool(np.array_equal(k.fixed_u, k.fixed_u[mirror]) and np.array_equal(k.fixed_w, k.fixed_w[mirror]))


def _mirror(grid: Grid) -> NDArray[np.int64]:
    """Number of the node that is each node's mirror image about the slab's middle, shape (nodes,)."""
    return np.concatenate([grid.row_nodes(row)[::-1] for row in range(grid.rows)])


def _basis(k: Stiffness, entries: NDArray[np.int64]) -> Sparse:
    free = entries[~k.fixed[entries]]
    columns = np.arange(len(free))
    return scipy.sparse.csr_array((np.ones(len(free)), (free, columns)), shape=(2 * k.grid.nodes, len(free)))


def _parity_basis(k: Stiffness, row: int, sign: float) -> Sparse:
    """Orthonormal basis of one row's fields of a parity: reflection multiplies w by `sign` and u by -`sign`."""
    nodes = k.grid.row_nodes(row)
    half = len(nodes) // 2
    left, right, middle = nodes[:half], nodes[:half:-1], nodes[half : half + 1]
    blocks = []
    for first, parity in ((0, -sign), (k.grid.nodes, sign)):
        pairs = _basis(k, first + left) + parity * _basis(k, first + right)
        blocks.append(pairs * np.sqrt(0.5))
        if parity > 0.0:
            blocks.append(_basis(k, first + middle))
    return scipy.sparse.csr_array(scipy.sparse.hstack(blocks))
