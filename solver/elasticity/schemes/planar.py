"""Compliance of planes without ends, equal everywhere: a number for each offset of two nodes, n × n, and pair of directions.

Node number column·n + row: columns along x, rows along y. Shear acts along x alone.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from nanoslip.solver.arrays import Dense, Indices, Vector
from nanoslip.solver.elasticity.schemes.endless import EndlessScheme, SurfaceConvolution
from nanoslip.solver.layout import Plane
from nanoslip.solver.slab import FEWEST_NODES, Slab

MOST_ACROSS = 513
"""Nodes along a side: 263,169 in all, of which only nodes near the contact are followed."""


@dataclass(frozen=True, slots=True, eq=False)
class PlaneConvolution(SurfaceConvolution):
    """Displacements of n by n evenly spaced nodes per nodal force, in 1/(G·L_x).

    by_offset: [[u per f_x, u per f_z], [w per f_x, w per f_z]] at -(n-1) … n-1 nodes along x, and along y, from the force,
    (2, 2, 2n-1, 2n-1).
    """

    by_offset: Dense
    _spectrum: NDArray[np.complex128] = field(init=False)
    _inverse: Vector = field(init=False)

    def __post_init__(self) -> None:
        offsets = np.arange(-(self._n - 1), self._n)
        # On a circle of 2n - 1 places or more the offsets -(n-1) … n-1 keep apart. The transform expects the
        # negative ones at its end, where an array's negative indices lead.
        around = scipy.fft.next_fast_len(len(offsets), real=True)
        circle = np.zeros((2, 2, around, around))
        circle[:, :, offsets[:, None], offsets] = self.by_offset
        self.by_offset.setflags(write=False)
        object.__setattr__(self, "_spectrum", scipy.fft.rfft2(circle))
        # Conjugate gradients need a preconditioner that is positive.
        object.__setattr__(self, "_inverse", 1.0 / np.abs(self._spectrum[1, 1]))

    @property
    def _n(self) -> int:
        return int(self.by_offset.shape[-1] + 1) // 2

    @property
    def own_displacement(self) -> float:
        return float(self.by_offset[1, 1, self._n - 1, self._n - 1])

    @property
    def most_across(self) -> float:
        return float(np.abs(self.by_offset[0, 1]).max())

    def w(self, forces: Vector) -> Vector:
        return self._convolve(self._spectrum[1, 1], forces)

    def u(self, forces: Vector) -> Vector:
        return self._convolve(self._spectrum[0, 1], forces)

    def forces_about(self, w: Vector) -> Vector:
        return self._convolve(self._inverse, w)

    def displacements(self, forces: Dense) -> Dense:
        return self._inverse_transform((self._spectrum * self._forward_transform(forces)).sum(axis=1))

    def window(self, nodes: Indices) -> Dense:
        both = np.concatenate((nodes, nodes + self._n**2))
        return self.entries(both, both)

    def entries(self, rows: Indices, columns: Indices) -> Dense:
        n, offsets = self._n, self.by_offset.shape[-1]
        # The place of an entry among all is a sum of a number for its row and one for its column.
        (moved, to), (pushed, at) = divmod(rows, n * n), divmod(columns, n * n)
        along_x, along_y = to // n + n - 1, to % n + n - 1
        row = (2 * moved * offsets + along_x) * offsets + along_y
        column = (pushed * offsets - at // n) * offsets - at % n
        block, table = np.empty((len(rows), len(columns))), self.by_offset.ravel()
        for line, at in zip(block, row, strict=True):  # all places at once would take as much memory again
            table.take(at + column, out=line, mode="clip")  # "raise" buffers
        return block

    def runs(self, nodes: Indices) -> tuple[Indices, Indices, Indices]:
        """Column and row of each of these k rising nodes; and the first of each run of neighbours in a column, then k."""
        columns, rows = divmod(nodes, self._n)
        # The last row of a column and the first of the next are neighbours in number alone.
        begins = (np.diff(nodes) != 1) | (rows[1:] == 0)
        firsts = 1 + begins.nonzero()[0]
        return columns, rows, np.concatenate(([0], firsts, [len(nodes)]))

    def decouple(self) -> "PlaneConvolution":
        table = self.by_offset.copy()
        table[0, 1] = table[1, 0] = 0.0
        return PlaneConvolution(table)

    def _convolve(self, symbol: NDArray[Any], values: Vector) -> Vector:
        return self._inverse_transform(symbol * self._forward_transform(values))

    def _forward_transform(self, values: Dense) -> NDArray[np.complex128]:
        """Transform on the circle of values (…, n²)."""
        around = self._spectrum.shape[-2]
        planes = values.reshape(*values.shape[:-1], self._n, self._n)
        return np.asarray(scipy.fft.rfft2(planes, (around, around)))

    def _inverse_transform(self, transform: NDArray[np.complex128]) -> Dense:
        """Values at the nodes, (…, n²), that have this transform."""
        n, around = self._n, self._spectrum.shape[-2]
        fields = scipy.fft.irfft2(transform, (around, around))[..., :n, :n]
        return np.ascontiguousarray(fields).reshape(*fields.shape[:-2], n * n)


class PlanarScheme(EndlessScheme):
    """A body in three dimensions with n_x by n_x surface nodes, as far apart along y as along x."""

    LAYOUT = Plane
    most_nodes = MOST_ACROSS
    sizes = f"an odd number from {FEWEST_NODES} to {MOST_ACROSS}"

    def lateral_stiffness(self, slab: Slab, nodes: float) -> float:
        # Mindlin's 8 G a/(2-ν), with 2a the contact's width.
        width = nodes * slab.spacing
        return 4.0 * width / (2.0 - slab.poisson)
