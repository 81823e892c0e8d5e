"""An elastic half-space in closed form, in three dimensions (Boussinesq, Cerruti; Love for a uniformly loaded square).

Nodes are the centres of squares with the side h, and a node's force is spread evenly over its square. A unit force at the origin
moves the surface at (x, y), at the distance r, in units of 1/G, by

    along x under f_x   ((1-ν)/r + ν x²/r³)/2π,    along z under f_z   (1-ν)/2πr,    across   ±(1-2ν) x/4πr².

The integral of each over the square is a difference of a primitive at its four corners. With L(a, b) = ln(a + r), r = √(a² + b²),

    x²/r³: y L(x, y),    y²/r³: x L(y, x),    1/r: their sum,    x/r²: (y/2) ln r² + x arctan(y/x).

Shear acts along x alone, and the surface is free to move along y. A half-space has a place at rest, so there is no datum.
"""

from dataclasses import dataclass

import numpy as np

from nanoslip.solver.arrays import Dense
from nanoslip.solver.elasticity.schemes.planar import PlanarScheme, PlaneConvolution
from nanoslip.solver.slab import SCHEMES, Slab


@SCHEMES.register
@dataclass(frozen=True, slots=True)
class HalfSpace(PlanarScheme):
    """The half-space in closed form, without settings. It takes no support, and aspect_ratio has no effect."""

    name = "half_space"
    has_height = False
    bottomless = True
    IN_PLANE_STRAIN = "half_plane"

    def convolution(self, slab: Slab) -> PlaneConvolution:
        return PlaneConvolution(half_space(slab) / slab.spacing)


def half_space(slab: Slab) -> Dense:
    """Displacements per force at all offsets, (2, 2, 2n-1, 2n-1), in 1/G over the side of a square; see `PlaneConvolution`."""
    # Corners of squares lie between nodes: no corner is at a force, where the primitives are singular.
    corners: Dense = np.arange(2.0 * slab.n_x) - (slab.n_x - 0.5)
    x, y, nu = corners[:, None], corners, slab.poisson
    along_x, along_y = y * _log(x, y), x * _log(y, x)
    coupling = y * np.log(np.hypot(x, y)) + x * np.arctan(y / x)
    across = (1.0 - 2.0 * nu) / 2.0 * coupling
    # (1-ν)/r + ν x²/r³ = x²/r³ + (1-ν) y²/r³.
    u = along_x + (1.0 - nu) * along_y
    w = (1.0 - nu) * (along_x + along_y)
    # The integral over a square is the primitives' second difference over its corners.
    between_columns = np.diff([u, w, across], axis=-2)
    u, w, across = np.diff(between_columns, axis=-1) / (2.0 * np.pi)
    # Corners on both sides round differently; Cholesky's factor needs a symmetric matrix to the last bit.
    u = even(even(u, 0), 1)
    w = even(even(w, 0), 1)
    across = odd(even(across, 1))
    return np.array([[u, across], [-across, w]])


def even(table: Dense, axis: int) -> Dense:
    """The part of a table that is even along an axis, to the last bit."""
    return (table + np.flip(table, axis)) / 2.0


def odd(table: Dense) -> Dense:
    """The part of a table that is odd along x, to the last bit."""
    return (table - table[::-1]) / 2.0


def _log(a: Dense, b: Dense) -> Dense:
    """ln(a + √(a² + b²)), without cancellation if a < 0."""
    size = np.log(np.abs(a) + np.hypot(a, b))
    # (√(a² + b²) + a)(√(a² + b²) - a) = b².
    mirrored = 2.0 * np.log(np.abs(b)) - size
    return np.asarray(np.where(a > 0.0, size, mirrored))
