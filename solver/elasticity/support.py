"""Supports of the slab (Figure 1): the nodal displacements that are zero under each.

Under all of them the bottom row rests on a flat rigid plane (w = 0). They differ in the nodes with u = 0.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from solver.elasticity.grid import Grid
from solver.slab import Support


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
