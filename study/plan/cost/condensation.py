"""What a surface compliance costs: rough seconds and bytes, from the rows of nodes of its slab's grid alone."""

from functools import lru_cache
from typing import NamedTuple

from solver.elasticity.grid_scheme import GridScheme, grid_scheme
from solver.elasticity.schemes.column import trunk
from solver.slab import Slab

# Seconds on one core of an ordinary machine.
_ONCE = 2e-3
_PER_ROW = 1.6e-3  # a few sparse products and a small dense solve, for even and odd fields
_PER_PLACE = 1e-6  # times nodes and rows: each row's products run over all nodes
_PER_CUBE = 1.2e-10  # times the cubes of the nodes in each group of rows: dense solves
_GENERAL = 2.0  # LU over Cholesky, and no symmetry to save a product
_WHOLE = 4.0  # dense solves of all fields at once over even and odd ones apart; all else is then done once, not twice
_PER_HALF_PLANE = 1e-10  # closed form, times n_x³: one look whether it is positive definite
_PER_CHAIN = 1.7e-8  # of blocks on springs, times n_x²: a band is solved for every block
# Bytes.
_NODE = 5500.0  # of the sparse stiffness, its copies and products
_SQUARE = 100.0  # times n_x²: a few dense blocks of the surface's size, and the compliance
_CLOSED_FORM = 128.0  # times n_x²: the half-plane's compliance and three more of its size


class _Layout(NamedTuple):
    """Of a grid: rows, nodes, and the sum of the cubes of the nodes of every group that is eliminated at once."""

    rows: int
    nodes: int
    cubes: float


def condensation_seconds(slab: Slab) -> float:
    """Seconds of `surface_compliance`, to a factor of two on a machine like that of the constants."""
    if not slab.scheme.continuum:
        return _PER_CHAIN * slab.n_x**2
    if not isinstance(slab.scheme, GridScheme):
        return _PER_HALF_PLANE * slab.n_x**3
    layout = _layout(slab)
    sparse = _ONCE + _PER_ROW * layout.rows + _PER_PLACE * layout.nodes * layout.rows
    dense = _PER_CUBE * layout.cubes
    seconds = sparse / 2 + _WHOLE * dense if slab.support == "right_side" else sparse + dense
    return seconds if slab.scheme.reciprocal else _GENERAL * seconds


def condensation_bytes(slab: Slab) -> float:
    """Bytes of arrays that `surface_compliance` holds at most at once, its result included, to a factor of two or three."""
    if not isinstance(slab.scheme, GridScheme):
        return _CLOSED_FORM * slab.n_x**2
    return _NODE * _layout(slab).nodes + _SQUARE * slab.n_x**2


@lru_cache(maxsize=256)  # asked for time and memory
def _layout(slab: Slab) -> _Layout:
    counts = grid_scheme(slab).grid(trunk(slab)).counts
    groups = [int(counts[0]), *(int(counts[row : row + 2].sum()) for row in range(1, len(counts), 2))]
    return _Layout(len(counts), int(counts.sum()), float(sum(float(group) ** 3 for group in groups)))
