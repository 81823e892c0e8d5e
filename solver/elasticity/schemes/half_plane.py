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
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from solver.outcome import InvalidInput
from solver.parameter import require
from solver.slab import SCHEMES, Scheme, Slab

Dense = NDArray[np.float64]


@SCHEMES.register()
@dataclass(frozen=True, slots=True)
class HalfPlane(Scheme):
    """The half-plane in closed form, without settings. It takes no support; aspect_ratio is the depth D of the datum."""

    name = "half_plane"
    endless = True
    equal_widths = True

    def completed(self, slab: Slab) -> "HalfPlane":
        require("support", slab.support, slab.support == "bonded", 'scheme = "galerkin" or "biquadratic"')
        return self

    def matrix(self, slab: Slab) -> Dense:
        return half_plane(slab)


def half_plane(slab: Slab) -> Dense:
    """The surface compliance of the half-plane, (2n, 2n), exactly symmetric.

    In 1/G per unit depth. Raises InvalidInput where the aspect ratio, the depth of the datum, is too small: displacements far
    from the load then have the opposite sign, so that smooth forces would do negative work.
    """
    nu, nodes = slab.poisson, np.arange(slab.n_x)
    log_distance = math.log(slab.spacing) + _mean_under_hat(_log_primitive, nodes)
    decay = (1 - nu) / np.pi * (math.log(slab.aspect_ratio) - log_distance)
    across = scipy.linalg.toeplitz((1 - 2 * nu) / 4 * np.sign(nodes), -(1 - 2 * nu) / 4 * np.sign(nodes))
    along_x, along_z = (scipy.linalg.toeplitz(decay + datum / (2 * np.pi)) for datum in (1.0, -1.0))
    matrix = np.block([[along_x, across], [across.T, along_z]])
    if scipy.linalg.lapack.dpotrf(matrix)[1]:
        raise InvalidInput(
            f"aspect_ratio = {slab.aspect_ratio!r}: needs a deeper datum with scheme half_plane (1 suffices for all ν ≥ 0)"
        )
    return np.asarray(matrix)


def _mean_under_hat(primitive: Callable[[Dense], Dense], nodes: NDArray[np.int64]) -> Dense:
    """Mean of a function weighted by the hat function at node distances `nodes`, from its second antiderivative; unit spacing."""
    x = nodes.astype(np.float64)
    return primitive(x + 1) - 2 * primitive(x) + primitive(x - 1)


def _log_primitive(x: Dense) -> Dense:
    """Second antiderivative of ln|x|."""
    return x**2 * (np.log(np.where(x == 0.0, 1.0, np.abs(x))) / 2 - 0.75)
