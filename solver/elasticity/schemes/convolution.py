"""The compliance of a surface that is the same everywhere: displacements under pressure are a convolution, by FFT.

Displacements depend on the distance from a force alone, so n numbers hold what a matrix of (2n)² entries would.
"""

from dataclasses import dataclass, field

import numpy as np
import scipy
from numpy.typing import NDArray

Vector = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Convolution:
    """Displacements of n evenly spaced nodes under normal forces on them, f_z; in 1/G per unit depth.

    along: w at 0, 1 … n-1 nodes from a unit force, either way, (n,). across: u of every node to its right; to its left -across.
    """

    along: Vector
    across: float
    _symbol: Vector = field(init=False)
    _inverse: Vector = field(init=False)

    def __post_init__(self) -> None:
        # On a circle of 2(n-1) nodes the way round the back is never shorter, and the even w meets itself at n-1.
        symbol = scipy.fft.rfft(np.concatenate((self.along, self.along[-2:0:-1]))).real
        inverse = 1.0 / symbol
        inverse[0] = inverse[1]  # a datum, which may have any sign
        object.__setattr__(self, "_symbol", symbol)
        object.__setattr__(self, "_inverse", inverse)

    def w(self, forces: Vector) -> Vector:
        """w of all nodes, (n,), under normal forces f_z (n,)."""
        return self._on_the_circle(self._symbol, forces)

    def u(self, forces: Vector) -> Vector:
        """u of all nodes, (n,), under normal forces f_z (n,): the forces to the left less those to the right."""
        up_to = np.cumsum(forces)
        return np.asarray(self.across * (2.0 * up_to - forces - up_to[-1]))

    def forces_about(self, w: Vector) -> Vector:
        """Forces, (n,), that would cause these w on the circle: near those that cause them, and found without a solve."""
        return self._on_the_circle(self._inverse, w)

    def _on_the_circle(self, symbol: Vector, values: Vector) -> Vector:
        around = 2 * (len(self.along) - 1)
        return np.asarray(scipy.fft.irfft(symbol * scipy.fft.rfft(values, around), around)[: len(values)])
