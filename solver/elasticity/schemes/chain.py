"""A chain of blocks in place of the slab: Burridge and Knopoff's model, Olami, Feder and Christensen's automaton.

Every surface node is a block. Leaf springs k_l sideways and k_v upwards hold it to the rigid plane, k_c to either neighbour:

    f_x,i = k_l u_i + k_c (2 u_i - u_(i-1) - u_(i+1)),    f_z,i = k_v w_i.

Pressure does not spread. A push on one block of a long chain moves that at distance j by

    C_ij = exp(-κ|j|) / (2 k_c sinh κ),    2 sinh(κ/2) = sqrt(k_l/k_c):

it decays over 1/κ spacings, about sqrt(k_c/k_l); on an elastic body as a power. The end blocks are free, as the slab's sides.

A block that slips until its force f is gone, all others held, hands α f to each neighbour, and the rest to its leaf spring:

    α = k_c / (k_l + 2 k_c),    at the ends k_c / (k_l + k_c).

With full stress drop (residual_shear 0), constant pressures and simultaneous slips that is the automaton, in one dimension
with α < 1/2 and thresholds μ_i times pressure.
"""

from dataclasses import dataclass

import numpy as np
import scipy

from nanoslip.solver.arrays import Dense
from nanoslip.solver.parameter import parameter, validate
from nanoslip.solver.slab import SCHEMES, Scheme, Slab


@SCHEMES.register
@dataclass(frozen=True, slots=True)
class Chain(Scheme):
    """Blocks on springs. It has no height, no Poisson's ratio and no other support: aspect_ratio and poisson do not matter.

    leaf_stiffness, foundation_stiffness: per length of surface, in G/L_x; 1 is a layer of height L_x in simple shear.
    coupling_stiffness: k_c/k_l. With the defaults, K and the paper's contact width are about as on the paper's slab.
    """

    name = "chain"
    continuum = False
    bottomless = True
    incompressible = True
    end_share = 1.0
    leaf_stiffness: float = parameter(
        0.8,
        meaning="leaf springs of a chain",
        comment="stiffness per length of surface",
        least=1e-6,
        most=1e6,
        measure="G/L_x",
    )
    coupling_stiffness: float = parameter(
        30.0,
        meaning="coupling springs of a chain",
        symbol="k_c/k_l",
        comment="stiffness of the spring between two blocks over that of a leaf spring",
        least=0.0,
        most=1e6,
    )
    foundation_stiffness: float = parameter(
        12.0,
        meaning="foundation springs of a chain",
        comment="stiffness per length of surface of the springs under the blocks",
        least=1e-6,
        most=1e6,
        measure="G/L_x",
    )

    def __post_init__(self) -> None:
        validate(self)

    @property
    def bed_stiffness(self) -> float:
        return self.foundation_stiffness

    def matrix(self, slab: Slab) -> Dense:
        one = np.eye(slab.n_x)
        none = np.zeros_like(one)
        leaf, coupling = spring_stiffness(self, slab)
        # u per f_x is the inverse of a tridiagonal stiffness, here exactly symmetric.
        bands = np.full((2, slab.n_x), -coupling)
        bands[1] = leaf + 2.0 * coupling
        # End blocks have one neighbour.
        bands[1, [0, -1]] -= coupling
        lateral = scipy.linalg.solveh_banded(bands, one)
        upright = one / (self.foundation_stiffness * slab.spacing)
        symmetric = (lateral + lateral.T) / 2
        return np.block([[symmetric, none], [none, upright]])

    def lateral_stiffness(self, slab: Slab, nodes: float) -> float:
        """Stiffness K, in G, of neighbouring blocks moving together far from the ends, with the blocks that they drag along."""
        leaf, coupling = spring_stiffness(self, slab)
        # The chain to one side has a stiffness s: a coupling spring in series with a block's leaf spring and, again, s.
        # s = k_c (k_l + s)/(k_c + k_l + s) gives 2 s = √(k_l² + 4 k_l k_c) - k_l for both sides together.
        return leaf * nodes + float(np.sqrt(leaf**2 + 4.0 * leaf * coupling)) - leaf


def spring_stiffness(chain: Chain, slab: Slab) -> tuple[float, float]:
    """(k_l, k_c) of every block, in G per unit depth."""
    leaf = chain.leaf_stiffness * slab.spacing
    return leaf, leaf * chain.coupling_stiffness
