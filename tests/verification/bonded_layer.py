"""A rigid pin pressed without friction into an elastic layer bonded to a rigid base, by the contact's integral equation.

None of the solver. Plane strain, shear modulus 1. Harmonic pressure moves the surface by (1-ν)/k·L(kh), found from the four
equations of layer.py. Under a pin in |x| ≤ a that presses the surface down by d(x), with x = at,

    (1-ν)/π · a ∫ K(a(t - σ)/h) p(aσ) dσ = d(at),    K(y) = ∫ L(w)/w cos(wy) dw over w > 0.

L = tanh(w) has K = -ln tanh(π|y|/4): singular as the half-plane's, L = 1, and nothing far off. What L - tanh(w) adds is smooth in
w, even, and decays as w² exp(-2w): the trapezoidal rule leaves next to nothing. With p = φ(t)/√(1 - t²) and φ a sum of Chebyshev
polynomials, -ln|t - σ| is exact (T_n gives π/n·T_n, T_0 gives π ln 2), and for all that is smooth Gauss's rule is spectral.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tests.verification.layer import wave_compliance

Vector = NDArray[np.float64]
Dense = NDArray[np.float64]

LAST_WAVE = 20.0
"""w where exp(-2w) is less than rounding."""
REACH = 50.0
"""Heights between the images of the contact that the trapezoidal rule adds: exp(-0.74·50) is left; L has a pole at 0.74i."""


@dataclass(frozen=True)
class LayerContact:
    """A contact without friction: lengths in any unit, stresses in G. amplitudes: of T_n in φ, (nodes,)."""

    half_width: float
    approach: float
    amplitudes: Vector

    @property
    def load(self) -> float:
        """Integral of the pressure, per depth."""
        return float(np.pi * self.half_width * self.amplitudes[0])

    @property
    def second_moment(self) -> float:
        """Mean of x² under the pressure."""
        mean, second = self.amplitudes[[0, 2]]
        return float(self.half_width**2 * (mean / 2 + second / 4) / mean)

    def pressure(self, x: Vector) -> Vector:
        """At |x| < a, any shape."""
        t = x / self.half_width
        return np.asarray(np.polynomial.chebyshev.chebval(t, self.amplitudes) / np.sqrt(1 - t**2))


def pressed(
    pin: Literal["parabola", "flat_punch"], half_width: float, height: float, poisson: float, nodes: int = 40
) -> LayerContact:
    """Under a parabola of radius 1, whose approach follows from p = 0 at its edges; or a flat punch with approach 1."""
    theta = (np.arange(nodes) + 0.5) * np.pi / nodes
    t, polynomials = np.cos(theta), np.cos(np.outer(theta, np.arange(nodes)))
    kernel = polynomials * np.concatenate([[np.log(2)], 2 / np.arange(1, nodes)]) @ polynomials.T
    kernel += _smooth(t, half_width / height, poisson)
    depths = np.stack([np.ones(nodes), (half_width * t) ** 2 / 2], axis=1)
    roots = np.linalg.solve((1 - poisson) * half_width / nodes * kernel, depths)
    flat, curved = (np.concatenate([[1.0], np.full(nodes - 1, 2.0)])[:, None] / nodes * (polynomials.T @ roots)).T
    if pin == "flat_punch":
        return LayerContact(half_width, 1.0, flat)
    approach = float(curved.sum() / flat.sum())
    return LayerContact(half_width, approach, approach * flat - curved)


def _smooth(t: Vector, slimness: float, poisson: float) -> Dense:
    """K + ln|t - σ| between these places, (nodes, nodes); slimness: a/h."""
    step = 2 * np.pi / (2 * slimness + REACH)
    waves = step * np.arange(1, int(LAST_WAVE / step))
    transform = [wave_compliance(w, 1.0, poisson, "bonded")[1, 1] * w / (1 - poisson) for w in waves]
    weights = step * (transform - np.tanh(waves)) / waves
    # Half a step at w = 0: uniform pressure presses the layer flat by its height over λ + 2G.
    start = step / 2 * ((1 - 2 * poisson) / (2 * (1 - poisson) ** 2) - 1)
    turns = np.exp(1j * slimness * np.outer(t, waves))
    distance = np.abs(t[:, None] - t)
    np.fill_diagonal(distance, 1e-9)  # where tanh is its argument
    closed = -np.log(np.tanh(np.pi * slimness * distance / 4) / distance)
    return np.asarray(closed + start + ((turns * weights) @ turns.conj().T).real)
