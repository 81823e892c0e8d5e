"""An elastic half-plane in closed form: the limit of a slab that is wide and deep beside its contact.

A line force on the surface of a half-plane moves the surface at distance x by (Flamant, in units of 1/G)

    along itself    (1-ν)/π ln(D/|x|) + datum,    datum = 1/(2π) for a tangential force, -1/(2π) for a normal one,
    across itself   ±(1-2ν)/4 sign(x)             (a drag dents the surface ahead; a push draws it together).

A half-plane has no place at rest, so displacements are relative to the point of the interior at the depth D below the
force. With Flamant's interior field the displacement along the force at distance D is, less a common rigid motion,
-(1-ν)/π ln D under a normal force (θ = 0) and -(1-ν)/π ln D - 1/(2π) under a tangential one (θ = π/2), and that of the
surface -(1-ν)/π ln|x| - 1/(2π) and -(1-ν)/π ln|x|: hence the data. D is the slab's height; it decides the approach, and
nothing that the motion of a pin decides.
"""

import math
from dataclasses import dataclass

import numpy as np
import scipy

from nanoslip.solver.elasticity.schemes.endless import Convolution, EndlessScheme, mean_log
from nanoslip.solver.outcome import InvalidInput
from nanoslip.solver.slab import SCHEMES, Slab


@SCHEMES.register
@dataclass(frozen=True, slots=True)
class HalfPlane(EndlessScheme):
    """The half-plane in closed form, without settings. It takes no support; aspect_ratio is the depth D of the datum."""

    name = "half_plane"
    bottomless = True

    def convolution(self, slab: Slab) -> Convolution:
        _require_depth(slab)
        soft, places = (1 - slab.poisson) / np.pi, np.arange(slab.n_x)
        # Distances in `mean_log` are in spacings h: ln(D/|x|) = ln(D/h) - ln(|x|/h).
        decay = soft * (math.log(slab.aspect_ratio / slab.spacing) - mean_log(places + 0j))
        return Convolution(decay + TANGENTIAL_DATUM, decay + NORMAL_DATUM, (1 - 2 * slab.poisson) / 4 * np.sign(places))


TANGENTIAL_DATUM, NORMAL_DATUM = 1 / (2 * np.pi), -1 / (2 * np.pi)


def _require_depth(slab: Slab) -> None:
    """Raise InvalidInput if displacements far from the load have the opposite sign, so that smooth forces do negative work.

    Of all forces that bear a given load, the forces under an adhering punch over the whole surface do the least work
    (Muskhelishvili), (a + x)^(iε - 1/2) (a - x)^(-iε - 1/2), tanh πε = (1 - 2ν)/(2 - 2ν). With ψ, the digamma
    function, a unit load lowers the punch by (1-ν)/π (ln(D/2a) - γ - Re ψ(1/2 + iε)) - 1/(2π), which has to be
    positive.
    """
    nu = slab.poisson
    oscillation = math.atanh((1 - 2 * nu) / (2 - 2 * nu)) / math.pi
    digamma = float(scipy.special.digamma(0.5 + 1j * oscillation).real)
    # The punch's sinking is positive if ln(D/2a) > γ + Re ψ + 1/(2(1-ν)), with 2a the forces' whole width.
    wide = 1.0 + BEYOND_THE_END * slab.spacing
    if slab.aspect_ratio <= wide * math.exp(np.euler_gamma + digamma + 1 / (2 * (1 - nu))):
        need = "a deeper datum with scheme half_plane (1 suffices for all ν ≥ 0)"
        raise InvalidInput("aspect_ratio", slab.aspect_ratio, need)


BEYOND_THE_END = 0.78
"""Distance that the forces of n nodes reach beyond the nodes, in spacings: 0.66 to 0.7794, the largest at ν = 1/2 and n =
5. Found from the least D at which the matrix is positive definite."""
