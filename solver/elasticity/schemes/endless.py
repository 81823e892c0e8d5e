"""Compliance of surfaces without ends, equal everywhere: n numbers for each pair of directions in place of a matrix.

A node's force is a hat of traction about it, the end nodes' too, as the surface goes on beyond them; displacements are taken
at the nodes. All of it depends on distance alone: Toeplitz blocks, those along the force even and those across odd.
"""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import Any, ClassVar, Self

import numpy as np
import scipy
from numpy.typing import NDArray

from nanoslip.solver.arrays import Dense, Indices, Vector
from nanoslip.solver.slab import FEWEST_NODES, MOST_NODES, Scheme, Slab


class SurfaceConvolution(ABC):
    """Displacements of n surface nodes that are all alike, per nodal force, in 1/G per unit depth."""

    __slots__ = ()

    @property
    @abstractmethod
    def own_displacement(self) -> float:
        """w of a node per normal force on it."""

    @property
    @abstractmethod
    def most_across(self) -> float:
        """The largest |u| of a node per normal force on any."""

    @abstractmethod
    def w(self, forces: Vector) -> Vector:
        """w of all nodes, (n,), under normal forces f_z (n,)."""

    @abstractmethod
    def u(self, forces: Vector) -> Vector:
        """u of all nodes, (n,), under normal forces f_z (n,)."""

    @abstractmethod
    def forces_about(self, w: Vector) -> Vector:
        """Forces, (n,), that would cause these w on the circle: near the true forces, and found without a solve."""

    @abstractmethod
    def displacements(self, forces: Dense) -> Dense:
        """[u; w] of all nodes under nodal forces [f_x; f_z]; both (2, n)."""

    @abstractmethod
    def window(self, nodes: Indices) -> Dense:
        """Compliance [u; w] per [f_x; f_z] of these k nodes among each other, (2k, 2k); neighbours, if in a row."""

    @abstractmethod
    def entries(self, rows: Indices, columns: Indices) -> Dense:
        """Compliance in these rows and columns of [u; w] and [f_x; f_z]."""

    @abstractmethod
    def decouple(self) -> Self:
        """Drop the coupling: normal forces cause no u, and tangential forces no w."""


@dataclass(frozen=True, slots=True, eq=False)
class Convolution(SurfaceConvolution):
    """Displacements of n evenly spaced nodes per nodal force, at 0, 1 … n-1 nodes from it; each (n,), in 1/G per unit depth.

    along_x: u under f_x, either way. along_z: w under f_z, either way. across: u under f_z to its right, the opposite of w
    under f_x there; to its left both have the other sign.
    """

    along_x: Vector
    along_z: Vector
    across: Vector
    by_distance: Dense = field(init=False)
    """[[u per f_x, u per f_z], [w per f_x, w per f_z]] at -(n-1) … n-1 nodes to the right of the force, (2, 2, 2n-1)."""
    _symbol: Vector = field(init=False)
    _inverse: Vector = field(init=False)
    _across: NDArray[np.complex128] = field(init=False)

    def __post_init__(self) -> None:
        # On a circle of 2(n-1) nodes the way round the back is never shorter, and the even w meets itself at n-1.
        circle = np.concatenate((self.along_z, self.along_z[-2:0:-1]))
        symbol = scipy.fft.rfft(circle).real
        # Conjugate gradients need a preconditioner that is positive.
        inverse = 1.0 / np.abs(symbol)
        inverse[0] = inverse[1]  # the mean of a half-plane hangs on its datum, and may have any sign
        x = np.concatenate((self.along_x[:0:-1], self.along_x))
        z = np.concatenate((self.along_z[:0:-1], self.along_z))
        across = np.concatenate((-self.across[:0:-1], self.across))
        object.__setattr__(self, "by_distance", np.array([[x, across], [-across, z]]))
        object.__setattr__(self, "_symbol", symbol)
        object.__setattr__(self, "_inverse", inverse)
        # The odd u has another sign round the back, which begins behind n-1.
        around = scipy.fft.next_fast_len(len(across), real=True)
        room = np.zeros(around - len(across))
        mirrored = -self.across[:0:-1]
        on_circle = np.concatenate((self.across, room, mirrored))
        object.__setattr__(self, "_across", scipy.fft.rfft(on_circle))

    @property
    def own_displacement(self) -> float:
        return float(self.along_z[0])

    @property
    def most_across(self) -> float:
        return float(np.abs(self.across).max())

    def w(self, forces: Vector) -> Vector:
        return self._convolve(self._symbol, forces)

    def u(self, forces: Vector) -> Vector:
        around = scipy.fft.next_fast_len(2 * len(self.across) - 1, real=True)
        return _convolve_on_circle(self._across, forces, around)

    def window(self, nodes: Indices) -> Dense:
        n, k = len(self.along_x), len(nodes)
        near = self.by_distance[:, :, n - k : n + k - 1]
        blocks = np.lib.stride_tricks.sliding_window_view(near, k, axis=-1)
        by_rows = blocks[..., ::-1].transpose(0, 2, 1, 3)
        return np.array(by_rows, order="C").reshape(2 * k, 2 * k)

    def entries(self, rows: Indices, columns: Indices) -> Dense:
        n = len(self.along_x)
        moved, to = divmod(rows[:, None], n)
        pushed, at = divmod(columns, n)
        return np.asarray(self.by_distance[moved, pushed, n - 1 + to - at])

    def displacements(self, forces: Dense) -> Dense:
        f_x, f_z = forces
        # A layer that nothing holds sideways has no number for it.
        along = scipy.linalg.matmul_toeplitz(self.along_x, f_x) if f_x.any() else 0.0
        # First column and first row of the matrix: to the right of a force stands `across`, to its left the
        # opposite.
        sideways = scipy.linalg.matmul_toeplitz((self.across, -self.across), forces.T)
        return np.array([along + sideways[:, 1], self.w(f_z) - sideways[:, 0]])

    def decouple(self) -> "Convolution":
        return Convolution(self.along_x, self.along_z, np.zeros_like(self.across))

    def forces_about(self, w: Vector) -> Vector:
        return self._convolve(self._inverse, w)

    def _convolve(self, symbol: Vector, values: Vector) -> Vector:
        return _convolve_on_circle(symbol, values, 2 * (len(self.along_z) - 1))


def _convolve_on_circle(symbol: NDArray[Any], values: Vector, around: int) -> Vector:
    """Multiply the transform of values on a circle of `around` nodes by a symbol; returns the values' own nodes."""
    # The transform pads the values with zeros up to the circle: nothing comes round to the nodes that are
    # read.
    transform = symbol * scipy.fft.rfft(values, around)
    return np.asarray(scipy.fft.irfft(transform, around)[: len(values)])


class EndlessScheme(Scheme):
    """A scheme without sides, hence without rows of nodes to be halved: its surface takes any odd n_x."""

    endless = True
    length = math.inf
    incompressible = True
    end_share = 1.0
    most_nodes: ClassVar[int] = MOST_NODES
    """Largest n_x."""
    sizes = f"an odd number from {FEWEST_NODES} to {MOST_NODES}"

    @classmethod
    def takes(cls, n_x: int) -> bool:
        return FEWEST_NODES <= n_x <= cls.most_nodes and n_x % 2 == 1

    @abstractmethod
    def convolution(self, slab: Slab) -> SurfaceConvolution:
        """Displacements per force by distance. Raises InvalidInput."""

    def count_stored_numbers(self, slab: Slab) -> int:
        return 0

    def lateral_stiffness(self, slab: Slab, nodes: float) -> float:
        # Flamant's displacement is (1-ν)/π ln(D/|x|) per force. Forces that move all of a contact of the width 2a alike,
        # as 1/√(a² - x²), move it by (1-ν)/π ln(2D/a).
        width = nodes * slab.spacing
        spread = max(math.log(4.0 * slab.aspect_ratio / width), 1.0)
        return math.pi / ((1.0 - slab.poisson) * spread)

    def matrix(self, slab: Slab) -> Dense:
        return self.convolution(slab).window(np.arange(slab.nodes))


def mean_log(distance: NDArray[Any]) -> Vector:
    """Mean of ln|z + s| over s in [-1, 1] weighted by the hat 1 - |s|, at complex distances z from the force, in spacings.

    It is the second difference of z² ln z/2 - 3z²/4, here without its large terms; far away a series in 1/z².
    """
    means = np.empty(distance.shape)
    far = np.abs(distance) >= FAR
    z = distance[far]
    # The closed form is a small difference of terms that grow as z² ln z.
    # ln(z + s) = ln z + Σ ±(s/z)^m/m: odd powers vanish in the mean, that of an even s^m is 2/((m + 1)(m + 2)).
    series = sum(2 / (m * (m + 1) * (m + 2)) / z**m for m in range(2, 17, 2))
    means[far] = (np.log(z) - series).real
    z = distance[~far]
    neighbours = (_square_log(z + 1) + _square_log(z - 1)) / 2
    means[~far] = (neighbours - _square_log(z)).real - 1.5
    return means


FAR = 8
"""Distance in spacings from which eight terms of the series are exact to rounding."""


def _square_log(z: NDArray[Any]) -> NDArray[Any]:
    """z² ln z, 0 at 0."""
    return np.asarray(z**2 * np.log(np.where(z == 0, 1.0, z)))
