"""The surface compliance of a slab (Eq. 11): displacements of the surface nodes per nodal force, by the slab's scheme."""

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from solver.elasticity.schemes.convolution import Convolution
from solver.elasticity.schemes.endless import convolution_of
from solver.slab import Slab, surface_x
from solver.view import OneLine

Dense = NDArray[np.float64]


class Compliance(OneLine, ABC):
    """Displacements of a slab's surface per nodal force, stored as a matrix or, where all nodes are alike, as a convolution."""

    __slots__ = ()
    slab: Slab

    @abstractmethod
    def under_itself(self) -> NDArray[np.float64]:
        """w of every surface node per normal force on it, (n,), in 1/G per unit depth."""

    @abstractmethod
    def as_matrix(self) -> "SurfaceCompliance":
        """The same as a matrix, which takes 32 n² bytes. Raises InvalidInput."""

    @property
    def x(self) -> NDArray[np.float64]:
        """Positions of the surface nodes in L_x, centred on the slab's middle, shape (n,), read-only."""
        return surface_x(self.slab.n_x)

    @property
    def widths(self) -> NDArray[np.float64]:
        """Length of surface that belongs to each node, in L_x, shape (n,), read-only: nodal force = traction × width.

        It is the width of a node's control volume, which equals the integral of its hat function. The end nodes have half
        of it, except on a half-plane, whose surface continues beyond them, and on a chain, whose blocks are all alike.
        """
        return _widths(self.slab.n_x, self.slab.scheme.equal_widths)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class SurfaceCompliance(Compliance):
    """Surface compliance of a slab: displacements of the surface nodes per nodal force.

    matrix: shape (2n, 2n), in 1/G per unit depth, read-only; [u; w] = matrix @ [f_x; f_z], nodes left to right,
    x to the right, z upwards (out of the slab).
    """

    matrix: Dense
    slab: Slab

    def __post_init__(self) -> None:
        shape = (2 * self.slab.n_x, 2 * self.slab.n_x)
        if self.matrix.shape != shape:
            raise ValueError(f"matrix.shape = {self.matrix.shape}: a slab of n_x = {self.slab.n_x} needs {shape}")

    @property
    def lasting(self) -> bool:
        """Whether what is computed of it may be kept with it: nobody changes a matrix that is read-only."""
        return not self.matrix.flags.writeable

    def under_itself(self) -> NDArray[np.float64]:
        return self.matrix.diagonal()[self.slab.n_x :]

    def as_matrix(self) -> "SurfaceCompliance":
        return self

    def _facts(self) -> Iterator[str]:
        yield f"{self.slab.n_x} surface nodes"
        yield f"scheme {self.slab.scheme.name}"
        yield f"u under a force at the middle {self.matrix[self.slab.n_x // 2, self.slab.n_x // 2]:.4g}"


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class NormalCompliance(Compliance):
    """The compliance under normal forces alone of a surface without ends, as a convolution: n numbers, no matrix."""

    convolution: Convolution
    slab: Slab

    def under_itself(self) -> NDArray[np.float64]:
        return np.full(self.slab.n_x, self.convolution.along[0])

    def as_matrix(self) -> SurfaceCompliance:
        return surface_compliance(self.slab)

    def _facts(self) -> Iterator[str]:
        yield f"{self.slab.n_x} surface nodes"
        yield f"scheme {self.slab.scheme.name}"
        yield f"w under a force {self.convolution.along[0]:.4g}"


@lru_cache(maxsize=4)  # asked for every contact, and few campaigns have more grids at a time
def _widths(n_x: int, equal: bool) -> NDArray[np.float64]:
    widths = np.full(n_x, 1.0 / (n_x - 1))
    if not equal:
        widths[[0, -1]] /= 2
    widths.setflags(write=False)
    return widths


def uncoupled(compliance: SurfaceCompliance) -> SurfaceCompliance:
    """The same compliance with zero coupling blocks (Goodman's approximation).

    Normal forces then cause no u, and tangential forces no w.
    """
    n = compliance.slab.n_x
    matrix = np.zeros_like(compliance.matrix, subok=False)
    matrix[:n, :n], matrix[n:, n:] = compliance.matrix[:n, :n], compliance.matrix[n:, n:]
    matrix.setflags(write=False)
    return SurfaceCompliance(matrix, compliance.slab)


def surface_compliance(slab: Slab) -> SurfaceCompliance:
    """The surface compliance of `slab`, exactly symmetric where its scheme is reciprocal.

    Raises SingularOperator where a block cannot be inverted, InvalidInput where the scheme does not fit the slab.
    """
    matrix = slab.scheme.matrix(slab)
    matrix.setflags(write=False)
    return SurfaceCompliance(matrix, slab)


def normal_compliance(slab: Slab) -> NormalCompliance:
    """The compliance of a slab whose surface has no ends, under normal forces. Raises InvalidInput for others."""
    return NormalCompliance(convolution_of(slab), slab)
