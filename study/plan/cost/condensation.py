"""What a surface compliance costs: rough seconds and bytes, from the rows of nodes of its slab's grid alone."""

from functools import lru_cache

from solver.elasticity.grid_scheme import GridScheme, grid_scheme
from solver.elasticity.schemes.column import trunk
from solver.slab import Slab

# Seconds on one core of an ordinary machine.
_ONCE = 1.5e-3
_PER_NODE = 1.9e-5  # of the grid: its share of the stiffness, and of pieces that are eliminated
_PER_SQUARE = 6e-8  # times n_x²: products of low rank, added to the compliance
_PER_STENCIL = 2e-3  # for each row of a stencil that is integrated node by node
_PER_HALF_PLANE = 6e-9  # closed form, times n_x²: its blocks, written and put together
_PER_CHAIN = 1.7e-8  # of blocks on springs, times n_x²: a band is solved for every block
# Bytes.
_NODE = 4000.0  # of the sparse stiffness, its copies and products
_SQUARE = 75.0  # times n_x²: the compliance, and those of even and odd fields
_CLOSED_FORM = 128.0  # times n_x²: the half-plane's compliance and three more of its size


def condensation_seconds(slab: Slab) -> float:
    """Seconds of `surface_compliance`, to a factor of two on a machine like that of the constants."""
    if not slab.scheme.continuum:
        return _PER_CHAIN * slab.n_x**2
    if not isinstance(slab.scheme, GridScheme):
        return _PER_HALF_PLANE * slab.n_x**2
    counts = _counts(slab)
    stencils = 0.0 if slab.scheme.reciprocal else _PER_STENCIL * len(counts)
    return _ONCE + stencils + _PER_NODE * sum(counts) + _PER_SQUARE * slab.n_x**2


def condensation_bytes(slab: Slab) -> float:
    """Bytes of arrays that `surface_compliance` holds at most at once, its result included, to a factor of two or three."""
    if not isinstance(slab.scheme, GridScheme):
        return _CLOSED_FORM * slab.n_x**2
    return _NODE * sum(_counts(slab)) + _SQUARE * slab.n_x**2


@lru_cache(maxsize=256)  # asked for time and memory
def _counts(slab: Slab) -> tuple[int, ...]:
    """Nodes of every row of the slab's grid."""
    return tuple(map(int, grid_scheme(slab).grid(trunk(slab)).counts))
