"""An elastic half-plane in closed form: the limit of a slab that is wide and deep beside its contact.

A line force on the surface of a half-plane moves the surface at distance x by (Flamant, in units of 1/G)

    along itself    (1-ν)/π ln(D/|x|) + datum,    datum = 1/(2π) for a tangential force, -1/(2π) for a normal one,
    across itself   ±(1-2ν)/4 sign(x)             (a drag dents the surface ahead; a push draws it together).

A half-plane has no place at rest, so displacements are relative to the point of the interior at the depth D below the
force. With Flamant's interior field the displacement along the force at distance D is, less a common rigid motion,
-(1-ν)/π ln D under a normal force (θ = 0) and -(1-ν)/π ln D - 1/(2π) under a tangential one (θ = π/2), and that of the
surface -(1-ν)/π ln|x| - 1/(2π) and -(1-ν)/π ln|x|: hence the data. D is the slab's height; it decides the approach, and
nothing that the motion of a pin decides.

A node's force is a hat of traction about it, the end nodes' too, as the half-plane goes on beyond them; displacements are
taken at the nodes. All of it depends on distance alone: Toeplitz blocks, those along the force even and those across odd.
"""

import math
from abc import abstractmethod
from dataclasses import dataclass, field

import numpy as np
import scipy
from numpy.typing import NDArray

from nanoslip.solver.outcome import InvalidInput
from nanoslip.solver.parameter import require
from nanoslip.solver.slab import FEWEST_NODES, MOST_NODES, SCHEMES, Scheme, Slab

# The compliance of a surface that is the same everywhere: displacements under pressure are a convolution, by FFT.
#
# Displacements depend on the distance from a force alone, so n numbers hold what a matrix of (2n)² entries would.

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


# Schemes of a surface that continues beyond its end nodes and is the same everywhere: their compliance is a convolution.


class EndlessScheme(Scheme):
    """A scheme without sides and bottom, hence without rows of nodes to be halved: its surface takes any odd n_x."""

    endless = True
    equal_widths = True
    sizes = f"an odd number from {FEWEST_NODES} to {MOST_NODES}"

    @classmethod
    def takes(cls, n_x: int) -> bool:
        return FEWEST_NODES <= n_x <= MOST_NODES and n_x % 2 == 1

    @abstractmethod
    def convolution(self, slab: Slab) -> Convolution:
        """Displacements under normal forces, those of `matrix`. Raises InvalidInput."""


def convolution_of(slab: Slab) -> Convolution:
    """The slab's compliance under normal forces. Raises InvalidInput where its surface has ends."""
    if isinstance(slab.scheme, EndlessScheme):
        return slab.scheme.convolution(slab)
    having = ", ".join(name for name, kind in SCHEMES.items() if issubclass(kind, EndlessScheme))
    raise InvalidInput(f"scheme = {slab.scheme.name!r}: needs one whose surface has no ends: {having}")


Dense = NDArray[np.float64]


@SCHEMES.register()
@dataclass(frozen=True, slots=True)
class HalfPlane(EndlessScheme):
    """The half-plane in closed form, without settings. It takes no support; aspect_ratio is the depth D of the datum."""

    name = "half_plane"

    def completed(self, slab: Slab) -> "HalfPlane":
        require("support", slab.support, slab.support == "bonded", 'scheme = "galerkin" or "biquadratic"')
        return self

    def matrix(self, slab: Slab) -> Dense:
        return half_plane(slab)

    def convolution(self, slab: Slab) -> Convolution:
        _require_depth(slab)
        return Convolution(_decay(slab) + NORMAL_DATUM, (1 - 2 * slab.poisson) / 4)


TANGENTIAL_DATUM, NORMAL_DATUM = 1 / (2 * np.pi), -1 / (2 * np.pi)


def half_plane(slab: Slab) -> Dense:
    """The surface compliance of the half-plane, (2n, 2n), exactly symmetric and positive definite.

    In 1/G per unit depth. Raises InvalidInput where the aspect ratio, the depth of the datum, is too small.
    """
    _require_depth(slab)
    nu, signs, decay = slab.poisson, np.sign(np.arange(slab.n_x)), _decay(slab)
    across = scipy.linalg.toeplitz((1 - 2 * nu) / 4 * signs, -(1 - 2 * nu) / 4 * signs)
    along_x, along_z = (scipy.linalg.toeplitz(decay + datum) for datum in (TANGENTIAL_DATUM, NORMAL_DATUM))
    return np.asarray(np.block([[along_x, across], [across.T, along_z]]))


def _decay(slab: Slab) -> Dense:
    """Displacement along a node's force at node distances 0, 1 …, (n,), but for the datum of its direction."""
    log_distance = math.log(slab.spacing) + _mean_log(slab.n_x)
    return np.asarray((1 - slab.poisson) / np.pi * (math.log(slab.aspect_ratio) - log_distance))


def _require_depth(slab: Slab) -> None:
    """Raise InvalidInput where displacements far from the load have the opposite sign, so that smooth forces do negative work.

    The forces that give way most to a load are those of an adhering punch over the whole surface (Muskhelishvili),
    (a + x)^(iε - 1/2) (a - x)^(-iε - 1/2), tanh πε = (1 - 2ν)/(2 - 2ν). With ψ, the digamma function, they lower it by
    (1-ν)/π (ln(D/2a) - γ - Re ψ(1/2 + iε)) - 1/(2π), which has to be positive.
    """
    nu = slab.poisson
    oscillation = math.atanh((1 - 2 * nu) / (2 - 2 * nu)) / math.pi
    digamma = float(scipy.special.digamma(0.5 + 1j * oscillation).real)
    wide = 1.0 + BEYOND_THE_END * slab.spacing
    if slab.aspect_ratio <= wide * math.exp(np.euler_gamma + digamma + 1 / (2 * (1 - nu))):
        raise InvalidInput(
            f"aspect_ratio = {slab.aspect_ratio!r}: needs a deeper datum with scheme half_plane (1 suffices for all ν ≥ 0)"
        )


BEYOND_THE_END = 0.78
"""By how much the forces of n nodes reach further than the nodes, in spacings: 0.66 to 0.7794, the most at ν = 1/2 and n = 5,
found from the least D at which the matrix is positive definite."""


def _mean_log(nodes: int) -> Dense:
    """Mean of ln|k + s| over s in [-1, 1] weighted by the hat 1 - |s|, for k = 0, 1 … below `nodes`, (nodes,).

    It is the second difference of k² ln k/2 - 3k²/4, here without its large terms; far away a series in 1/k².
    """
    k = np.arange(1.0, nodes)
    near, far = k[: FAR - 1], k[FAR - 1 :]
    rest = ((near + 1) ** 2 * np.log1p(1 / near) + (near - 1) ** 2 * _log_before(near)) / 2 - 1.5
    series = -sum(2 / (m * (m + 1) * (m + 2)) / far**m for m in (2, 4, 6, 8))
    return np.concatenate(([-1.5], np.log(k) + np.concatenate((rest, series))))


def _log_before(k: Dense) -> Dense:
    """ln(1 - 1/k), and 0 for k = 1, where its factor is 0."""
    return np.log1p(np.where(k == 1.0, 0.0, -1 / k))


FAR = 32
"""Distance from which four terms of the series are exact to rounding."""
