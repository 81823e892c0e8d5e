"""A bonded elastic layer in three dimensions: a half-space, and a Hankel integral for the effect of a base at the
depth H.

Under tractions that vary along x as exp(ikx) the layer moves as the strip does along x, along z and across. Along y
it moves by tanh(kH)/k per unit traction, in 1/G, where a half-space moves by 1/k. Less the half-space's, all four
transforms over 1/k,

    A_x(kH), A_z(kH), A_c(kH) of the strip,    A_y = tanh(kH) - 1,

decay as exp(-2kH). With J_n, Bessel's functions, a unit force moves the surface at (r, θ) by, in addition to the
half-space's,

    along x under f_x   1/2π ∫ [(A_x + A_y)/2 J_0(kr) - (A_x - A_y)/2 J_2(kr) cos 2θ] dk,
    along z under f_z   1/2π ∫ A_z J_0(kr) dk,    across   ±1/2π ∫ A_c J_1(kr) cos θ dk,

smooth at all r. Its mean over a node's square is taken by Gauss's rule, two points each way.
"""

import math
from dataclasses import dataclass

import numpy as np
import scipy

from nanoslip.solver.elasticity.schemes.half_space import even, half_space, odd
from nanoslip.solver.elasticity.schemes.planar import PlanarScheme, PlaneConvolution
from nanoslip.solver.elasticity.schemes.strip import gauss, remainders
from nanoslip.solver.parameter import require
from nanoslip.solver.slab import SCHEMES, Slab


@SCHEMES.register
@dataclass(frozen=True, slots=True)
class Layer(PlanarScheme):
    """The layer of height aspect_ratio·L_x on a rigid base, in three dimensions, without settings."""

    name = "layer"
    IN_PLANE_STRAIN = "strip"

    def complete_settings(self, slab: Slab) -> "Layer":
        require("support", slab.support, slab.support == "bonded", "bonded with scheme layer")
        thick = slab.aspect_ratio >= slab.spacing
        require("aspect_ratio", slab.aspect_ratio, thick, "at least the node spacing, 1/(n_x - 1), with scheme layer")
        return self

    def lateral_stiffness(self, slab: Slab, nodes: float) -> float:
        width = nodes * slab.spacing
        # A film shears alone under the contact: π a² G/height.
        film = math.pi / 4.0 * width**2 / slab.aspect_ratio
        return max(PlanarScheme.lateral_stiffness(self, slab, nodes), film)

    def convolution(self, slab: Slab) -> PlaneConvolution:
        of_half_space = half_space(slab) / slab.spacing
        offsets = (np.arange(2 * slab.n_x - 1) - (slab.n_x - 1.0)) * slab.spacing
        # Gauss's two points of a side: h/(2√3) from its middle.
        inside = slab.spacing / math.sqrt(12.0)
        splines = _splines(slab, slab.spacing * math.sqrt(2.0) * slab.n_x)
        u, w, across = np.zeros((3, len(offsets), len(offsets)))
        # Two points each way: each stands for a quarter of the square. cos 2θ is 2 cos² θ - 1.
        for x in (offsets - inside, offsets + inside):
            for y in (offsets - inside, offsets + inside):
                r = np.hypot(x[:, None], y)
                cosine = x[:, None] / r
                mean, turning, normal, mixed = splines(r)
                u += (mean - turning * (2.0 * cosine**2 - 1.0)) / 4.0
                w += normal / 4.0
                across += mixed * cosine / 4.0
        u = even(even(u, 0), 1)
        w = even(even(w, 0), 1)
        across = odd(even(across, 1))
        return PlaneConvolution(of_half_space + np.array([[u, across], [-across, w]]))


def _splines(slab: Slab, farthest: float) -> "scipy.interpolate.CubicSpline":
    """The four integrals over r up to `farthest`, along the first axis, as splines."""
    height = slab.aspect_ratio
    waves, weights = gauss(height, farthest)
    xi = waves * height
    q = np.exp(-2.0 * xi)
    along_x, along_z, mixed = remainders(xi, slab)
    along_x, along_z = (
        transform_of_bulk - (1.0 - slab.poisson) * q for transform_of_bulk in (along_x, along_z)
    )  # the strip's without its image
    # tanh ξ - 1 with tanh ξ = (1 - q)/(1 + q).
    along_y = -2.0 * q / (1.0 + q)
    r = np.linspace(0.0, farthest, max(FEWEST_PLACES, math.ceil(PLACES * farthest / height)))
    table = np.empty((4, len(r)))
    for some in np.array_split(np.arange(len(r)), math.ceil(len(r) * len(waves) / AT_ONCE)):
        turns = np.outer(r[some], waves)
        zeroth, first = scipy.special.j0(turns), scipy.special.j1(turns)
        # J_2(x) = 2 J_1(x)/x - J_0(x), whose terms cancel for small x: there it is x²/8.
        recurrence = 2.0 * first / np.maximum(turns, SMALL) - zeroth
        second = np.where(turns > SMALL, recurrence, turns**2 / 8.0)
        for row, (bessel, transform) in enumerate(
            ((zeroth, (along_x + along_y) / 2), (second, (along_x - along_y) / 2), (zeroth, along_z), (first, mixed))
        ):
            table[row, some] = bessel @ (weights * transform)
    return scipy.interpolate.CubicSpline(r, table / (2.0 * math.pi), axis=1)


FEWEST_PLACES, PLACES = 400, 40
"""Places of a spline: at least, and in a height; its error is 1e-9 of the integrals."""
AT_ONCE = 2_000_000
"""Waves times places that are held at once."""
SMALL = 1e-3
"""Argument below which J_2 is x²/8, to 1e-7 of itself: without cancellation."""
