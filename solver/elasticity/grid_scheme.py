"""Schemes with a grid: their stiffness is condensed to the surface compliance."""

from abc import abstractmethod
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from solver.elasticity.condensation.condensed import condensed
from solver.elasticity.grid import Grid
from solver.elasticity.stiffness import Stiffness, confined_modulus
from solver.outcome import InvalidInput
from solver.slab import SCHEMES, Scheme, Slab


class GridScheme(Scheme):
    """A scheme that discretizes the whole slab by rows of nodes."""

    columns: ClassVar[bool] = False
    """Whether a slab taller than a few widths is condensed as a column (see schemes.column)."""

    @abstractmethod
    def grid(self, slab: Slab) -> Grid:
        """The grid of nodes of a slab."""

    @abstractmethod
    def stiffness(self, slab: Slab) -> Stiffness:
        """The matrices of Eq. 11."""

    def confinement(self, slab: Slab) -> float:
        # The uppermost elements resist dilatation more than their displacements can obey. So a node that gives way hands its
        # neighbours more than it held, and the next but one less than nothing: of its shear each neighbour takes 0.47, 0.56,
        # 0.63, 0.66 at ν = 1/3, 0.45, 0.48, 0.49 on any grid, on a half-plane 0.44.
        return confined_modulus(slab.poisson)

    def matrix(self, slab: Slab) -> NDArray[np.float64]:
        return condensed(self.stiffness(slab))


def grid_scheme(slab: Slab) -> GridScheme:
    """The slab's scheme. Raises InvalidInput where that has no grid."""
    if isinstance(slab.scheme, GridScheme):
        return slab.scheme
    having = ", ".join(name for name, kind in SCHEMES.items() if issubclass(kind, GridScheme))
    raise InvalidInput(f"scheme = {slab.scheme.name!r}: needs one that has a grid: {having}")


def stiffness(slab: Slab) -> Stiffness:
    """The matrices of Eq. 11 for a slab, by its scheme. Raises InvalidInput where its scheme has no grid."""
    return grid_scheme(slab).stiffness(slab)
