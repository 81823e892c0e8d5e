"""An elastic layer without ends on a rigid base, in closed form at every wavenumber k: any ν up to 0.5, and that, too.

A layer of height H under surface tractions that vary as exp(ikx): its displacements are sums of exp(±kz) and z exp(±kz), four
amplitudes that follow from two tractions above and two conditions below. With ξ = kH and κ = 3 - 4ν, in units of 1/G, the
surface moves per traction by

    bonded:       along x, z   (1-ν)/k (2κ sinh 2ξ ± 4ξ)/D,    across   ±i/k (κ(κ-1)/2 (cosh 2ξ - 1) - 2ξ²)/D,
                  D = 2κ cosh 2ξ + 4ξ² + 1 + κ²;
    frictionless: along z      (1-ν)/k (cosh 2ξ - 1)/D,        across   ±i/(2k) ((1-2ν) sinh 2ξ - 2ξ)/D,
                  D = sinh 2ξ + 2ξ; along x without bound as k -> 0, since nothing holds the layer there.

Less the half-plane's, (1-ν)/k along and ±i(1-2ν)/(2k) across, all of it decays as exp(-2ξ). Along, the half-plane's is taken
with the factor 1 - exp(-2ξ), the image of the force at the height 2H, as the transform without it has no bound: the
remainder is smooth and integrated over k by Gauss's rule, with the hat's transform (sin(kh/2)/(kh/2))² as its factor.
"""

import math
from dataclasses import dataclass

import numpy as np

from nanoslip.solver.arrays import Vector
from nanoslip.solver.elasticity.schemes.endless import Convolution, EndlessScheme, mean_log
from nanoslip.solver.parameter import require
from nanoslip.solver.slab import SCHEMES, Slab


@SCHEMES.register
@dataclass(frozen=True, slots=True)
class Strip(EndlessScheme):
    """The layer of height aspect_ratio·L_x, without settings."""

    name = "strip"

    def complete_settings(self, slab: Slab) -> "Strip":
        require("support", slab.support, slab.support != "right_side", "bonded or frictionless with scheme strip")
        return self

    def is_laterally_restrained(self, slab: Slab) -> bool:
        return slab.support == "bonded"

    def convolution(self, slab: Slab) -> Convolution:
        height, spacing, soft = slab.aspect_ratio, slab.spacing, 1.0 - slab.poisson
        nodes = min(slab.n_x, math.ceil(REACH * height / spacing) + 2)  # farther off the base holds all
        places = np.arange(nodes)
        below = mean_log(places + 2j * height / spacing)
        image = soft / math.pi * (below - mean_log(places + 0j))
        waves, weights = gauss(height, (nodes + 1) * spacing)
        # 1/2π ∫ over all k is 1/π ∫ over k > 0, and the remainders are k times the transforms, hence 1/(πk).
        # In np.sinc the argument has the factor π.
        weights *= np.sinc(waves * spacing / (2.0 * math.pi)) ** 2 / (math.pi * waves)
        transforms = weights * remainders(waves * height, slab)
        response = np.zeros((3, slab.n_x))
        response[:2, :nodes] = image
        response[2, :nodes] = (1.0 - 2.0 * slab.poisson) / 4.0 * np.sign(places)
        for some in np.array_split(np.arange(len(waves)), math.ceil(len(waves) * nodes / AT_ONCE)):
            turns = np.outer(waves[some], spacing * places)
            response[:2, :nodes] += transforms[:2, some] @ np.cos(turns)
            response[2, :nodes] += transforms[2, some] @ np.sin(turns)
        response[2, nodes:] = response[2, nodes - 1]  # squeezed by a push, a layer without friction below moves outward
        return Convolution(*response)


def remainders(xi: Vector, slab: Slab) -> Vector:
    """k times the remainder of the transforms along x, along z and across, without the half-plane and its image, (3, waves).

    From ξ = kH, with all exponentials as q = exp(-2ξ): none overflows, and nothing large cancels.
    """
    nu, q = slab.poisson, np.exp(-2.0 * xi)
    # The head's transforms less (1-ν)(1 - q) along and (1-2ν)/2 across, with sinh 2ξ = (1/q - q)/2 and
    # cosh 2ξ = (1/q + q)/2. Without friction `under` is q D and q² - q is taken out along z; across, the terms in
    # sinh cancel. Bonded, `under` is D, terms in 1/q cancel along, and 1-2ν is (κ-1)/2 across.
    if slab.support == "frictionless":
        under = (1.0 - q**2) / 2.0 + 2.0 * xi * q
        along_z = (1.0 - nu) * q * (q - 1.0) * ((1.0 - q) / 2.0 + 2.0 * xi) / under
        sideways = -2.0 * (1.0 - nu) * xi * q / under
        return np.array([np.full_like(xi, np.nan), along_z, sideways])
    kappa = 3.0 - 4.0 * nu
    square = 4.0 * xi**2 + 1.0 + kappa**2
    under = (kappa * (1.0 + q**2) + square * q) / q
    common = kappa - square + (square - 2.0 * kappa) * q + kappa * q**2
    along_x = (1.0 - nu) * (common + 4.0 * xi) / under
    along_z = (1.0 - nu) * (common - 4.0 * xi) / under
    coupling = (kappa - 1.0) * (2.0 * kappa + square) / 4.0 + 2.0 * xi**2
    return np.array([along_x, along_z, -coupling / under])


def gauss(height: float, farthest: float) -> tuple[Vector, Vector]:
    """Places and weights of a rule for smooth functions of kH times exp(-2kH) and waves up to `farthest` from the force."""
    panels = max(PANELS, math.ceil(LAST * farthest / height / TURN))
    places, weights = np.polynomial.legendre.leggauss(POINTS)
    width = LAST / height / panels
    in_panels = np.arange(panels)[:, None] + (places + 1.0) / 2.0
    return (in_panels * width).ravel(), np.tile(weights * width / 2.0, panels)


AT_ONCE = 200_000
"""Waves times nodes that are held at once: a megabyte or two."""
LAST = 18.0
"""Largest ξ of the integral: exp(-2ξ) is machine epsilon there."""
POINTS, PANELS, TURN = 16, 18, 8.0
"""Points of Gauss's rule in a panel; number of panels, a unit of ξ long; largest phase in a panel, in radians. The zeros of
D are at 0.74i or farther (ν = 1/2): the error in a panel is as small as (0.5/(0.74 + 0.9))^(2·16) of its values, that of
the phase smaller still."""
REACH = 42.0
"""Distance in heights where nothing is left: the slowest decay is exp(-0.739 x/H), at ν = 1/2 (cos b = b for the zero of D)."""
