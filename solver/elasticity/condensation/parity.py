"""Even and odd displacement fields. A slab that is symmetric about its middle does not couple them: each is solved alone.

Reflection x → -x leaves w of an even field as it is and changes the sign of u; for an odd field it is the other way round.
Two problems of half the size cost half of one.
"""

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from solver.elasticity.grid import Grid
from solver.elasticity.stiffness import Sparse, Stiffness


@dataclass(frozen=True, slots=True, eq=False)
class Fields:
    """Orthonormal displacement fields: every entry of [u; w] belongs to one of them, or to none. Arrays (2·nodes,).

    number: of the entry's field, -1 for none. weight: its displacement in that field.
    """

    number: NDArray[np.int64]
    weight: NDArray[np.float64]

    @property
    def count(self) -> int:
        """Number of fields."""
        return int(self.number.max()) + 1

    @property
    def first_entries(self) -> NDArray[np.int64]:
        """The first entry of [u; w] that belongs to each field, (count,): the left one of a pair."""
        return np.unique(self.number, return_index=True)[1][-self.count :]


def families(k: Stiffness) -> list[Fields]:
    """Families of displacement fields that the stiffness does not couple, without restrained displacements.

    There are two, even and odd, where the support is symmetric; otherwise one of all displacements.
    """
    if not _mirrored(k):
        return [_numbered(np.arange(2 * k.grid.nodes), np.where(k.fixed, 0.0, 1.0))]
    return [_of_parity(k, sign) for sign in (1.0, -1.0)]


def projected(matrix: Sparse, fields: Fields) -> Sparse:
    """The stiffness between fields, (count, count), of one between displacements, (2·nodes, 2·nodes)."""
    entries = scipy.sparse.coo_array(matrix)
    rows, columns = entries.coords
    values = fields.weight[rows] * entries.data * fields.weight[columns]
    kept = values != 0.0
    places = (fields.number[rows[kept]], fields.number[columns[kept]])
    return scipy.sparse.csr_array((values[kept], places), shape=(fields.count, fields.count))


def _mirrored(k: Stiffness) -> bool:
    mirror = _mirror(k.grid)
    return bool(np.array_equal(k.fixed_u, k.fixed_u[mirror]) and np.array_equal(k.fixed_w, k.fixed_w[mirror]))


def _mirror(grid: Grid) -> NDArray[np.int64]:
    """Number of the node that is each node's mirror image about the slab's middle, shape (nodes,)."""
    return np.concatenate([grid.row_nodes(row)[::-1] for row in range(grid.rows)])


def _of_parity(k: Stiffness, sign: float) -> Fields:
    """Fields of which reflection multiplies w by `sign` and u by -`sign`."""
    nodes, mirror = np.arange(k.grid.nodes), _mirror(k.grid)
    left = np.minimum(nodes, mirror)
    weights = [
        np.where(nodes == mirror, max(parity, 0.0), np.sqrt(0.5) * np.where(nodes > mirror, parity, 1.0))
        for parity in (-sign, sign)
    ]
    return _numbered(np.concatenate((left, left + k.grid.nodes)), np.where(k.fixed, 0.0, np.concatenate(weights)))


def _numbered(group: NDArray[np.int64], weight: NDArray[np.float64]) -> Fields:
    """Fields of the entries of each group that have a weight, in the order of the groups."""
    number, free = np.full(len(group), -1), weight != 0.0
    number[free] = np.unique(group[free], return_inverse=True)[1]
    return Fields(number, weight)
