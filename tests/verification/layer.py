"""An elastic layer on a rigid base under waves of traction, solved by hand up to four equations or a matrix exponential.

Plane strain, shear modulus 1, -H ≤ z ≤ 0. Under tractions τ sin kx and σ cos kx on top, the fields u = U(z) sin kx and
w = V(z) cos kx satisfy Navier's equations where, for s = ±1 (Papkovich and Neuber),

    (U, V) = e^(skz) (1, -s)    or    (U, V) = e^(skz) (z, (3 - 4ν)/k - s z).

The first changes no volume, the second by s(2 - 4ν) e^(skz), so that σ = 2V' + 2ν/(1 - 2ν)·change is finite at ν = 1/2 too.

In a vertical plane where sin kx = 0 neither u nor the shear stress is there: that is a wall without friction.
"""

from typing import Any

import mpmath
import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.slab import Support


def wave_compliance(k: float, depth: float, poisson: float, support: Support) -> NDArray[np.float64]:
    """[U; V] on top per [τ; σ], shape (2, 2), of a layer of the given depth whose base is bonded or frictionless."""
    u_top, v_top, shear_top, normal_top = _fields(k, 0.0, depth, poisson)
    u_base, v_base, shear_base, _ = _fields(k, -depth, depth, poisson)
    held = u_base if support == "bonded" else shear_base
    amplitudes = np.linalg.solve(np.array([shear_top, normal_top, held, v_base]), np.eye(4)[:, :2])
    return np.array([u_top, v_top]) @ amplitudes


def through_layer(k: float, height: float, poisson: float) -> Any:
    """(U, V, τ/k, σ/k) on top per the same at the base, (4, 4), where u, τ go with sin kx and w, σ with cos kx: mpmath's digits.

    The layer as an initial value problem in z: u' = τ + kw, w' = bσ - kau, τ' = k²cu + kaσ, σ' = -kτ, with a = ν/(1-ν),
    b = (1-2ν)/(2-2ν), c = 2/(1-ν), which bears any ν up to 1/2, and kH as large as 100.
    """
    nu = mpmath.mpf(poisson)
    a, b, c = nu / (1 - nu), (1 - 2 * nu) / (2 - 2 * nu), 2 / (1 - nu)
    return mpmath.expm(mpmath.matrix([[0, 1, 1, 0], [-a, 0, 0, b], [c, 0, 0, a], [0, 0, -1, 0]]) * k * height)


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
