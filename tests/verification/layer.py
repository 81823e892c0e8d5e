"""An elastic layer on a rigid base under waves of traction, solved by hand up to four equations.

Plane strain, shear modulus 1, -H ≤ z ≤ 0. Under tractions τ sin kx and σ cos kx on top, the fields u = U(z) sin kx and
w = V(z) cos kx satisfy Navier's equations where, for s = ±1 (Papkovich and Neuber),

    (U, V) = e^(skz) (1, -s)    or    (U, V) = e^(skz) (z, (3 - 4ν)/k - s z).

The first changes no volume, the second by s(2 - 4ν) e^(skz), so that σ = 2V' + 2ν/(1 - 2ν)·change is finite at ν = 1/2 too.

In a vertical plane where sin kx = 0 neither u nor the shear stress is there: that is a wall without friction.
"""

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.slab import Support


def wave_compliance(k: float, depth: float, poisson: float, support: Support) -> NDArray[np.float64]:
    """[U; V] on top per [τ; σ], shape (2, 2), of a layer of the given depth whose base is bonded or frictionless."""
    return wave_response(k, depth, poisson, support)[0]


def wave_response(k: float, depth: float, poisson: float, support: Support) -> tuple[NDArray[np.float64], ...]:
    """The same, and [τ; σ] at the base per [τ; σ] on top, (2, 2)."""
    u_top, v_top, shear_top, normal_top = _fields(k, 0.0, depth, poisson)
    u_base, v_base, shear_base, normal_base = _fields(k, -depth, depth, poisson)
    held = u_base if support == "bonded" else shear_base
    amplitudes = np.linalg.solve(np.array([shear_top, normal_top, held, v_base]), np.eye(4)[:, :2])
    return np.array([u_top, v_top]) @ amplitudes, np.array([shear_base, normal_base]) @ amplitudes


def _fields(k: float, z: float, depth: float, poisson: float) -> tuple[NDArray[np.float64], ...]:
    """U, V, shear stress over sin kx and normal stress σ_zz over cos kx at z of the four solutions, each scaled to 1."""
    u, v, du, normal = np.empty((4, 4))
    for column, (s, harmonic) in enumerate(((1, True), (1, False), (-1, True), (-1, False))):
        decay = np.exp(k * z) if s == 1 else np.exp(-k * (z + depth))
        shape = np.array([1.0, -s, 0.0, 0.0] if harmonic else [z, (3 - 4 * poisson) / k - s * z, 1.0, -s])
        u[column], v[column] = decay * shape[:2]
        du[column], dv = decay * (s * k * shape[:2] + shape[2:])
        normal[column] = 2 * dv + (0.0 if harmonic else 4 * poisson * s * decay)
    return u, v, du - k * v, normal
