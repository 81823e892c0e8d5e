"""The stick zone of a contact under growing load, computed without any of the solver.

A flat punch of half-width 1 is pressed into a half-plane, the load growing: |x| < c sticks, on c < |x| < 1 the surface
slides inwards under the shear q = μp sign(x). With β = (1 - 2ν)/(2(1 - ν)) (Spence 1973, in plane strain)

    1/π ⨍ p(s)/(x - s) ds = β q(x),  |x| < 1;        1/π ⨍ q(s)/(x - s) ds = -β p(x),  |x| < c,

and q is bounded at c. Other pins of a power-law shape grow their contact through such punches, all with the same c/a.
Solved in the integrated form by piecewise constant p and q, Galerkin, on panels graded towards c and 1.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import ellipk

Vector = NDArray[np.float64]

PANELS = 40
"""On the stick zone's half and on the slip zone: more of them change the ratio by 2e-5 or less."""


@dataclass(frozen=True)
class StickZone:
    """c/a, and the shear force of one half of the contact as a share of the whole load."""

    ratio: float
    half_shear: float


def stick_zone(friction: float, poisson: float, *, coupled: bool = True) -> StickZone:
    """The stick zone of a growing contact; not coupled: the shear leaves the pressure alone."""
    beta = (1 - 2 * poisson) / (2 * (1 - poisson))

    def singular(ratio: float) -> float:
        return _tractions(ratio, friction, beta, coupled)[0]

    ratio = float(brentq(singular, 0.02, 0.98, xtol=1e-9))
    return StickZone(ratio, _tractions(ratio, friction, beta, coupled)[1])


def uncoupled_ratio(friction: float, poisson: float) -> float:
    """K(k)/K(√(1 - k²)) = μ/β for k = c/a, if the shear leaves the pressure alone (Goodman's approximation).

    Bounded q needs ∫ (β p + H)/√(c² - x²) dx = 0 over |x| < c, H being the slip zones' part of the second equation; with
    p = W/(π√(a² - x²)) the two terms are complete elliptic integrals.
    """
    beta = (1 - 2 * poisson) / (2 * (1 - poisson))
    return float(brentq(lambda k: ellipk(k**2) / ellipk(1 - k**2) - friction / beta, 1e-9, 1 - 1e-12))


def _tractions(ratio: float, friction: float, beta: float, coupled: bool) -> tuple[float, float]:
    """Intensity of the excess of q beside c, and ∫q dx over x > 0 for a unit load."""
    edges = _edges(ratio)
    left, right = edges[:-1], edges[1:]
    width, count = right - left, len(left)
    # The mirrored sources: p is even, q odd.
    near, far = _log_kernel(left, right, left, right), _log_kernel(left, right, -right, -left)
    ahead, behind = _sign_kernel(left, right, left, right), _sign_kernel(left, right, -right, -left)
    w_p, w_q = (near + far) / np.pi, -beta / 2 * (ahead - behind) * coupled
    u_p, u_q = -beta / 2 * (ahead + behind), -(near - far) / np.pi
    stuck = count // 2
    slides = np.where(np.arange(count) < stuck, 0.0, friction)
    system, right_side = np.zeros((count + stuck + 1, count + stuck + 1)), np.zeros(count + stuck + 1)
    system[:count, :count] = w_p + w_q * slides
    system[:count, count:-1] = w_q[:, :stuck]
    system[:count, -1] = -width  # the approach
    system[count:-1, :count] = (u_p + u_q * slides)[:stuck]
    system[count:-1, count:-1] = u_q[:stuck, :stuck]
    system[-1, :count] = 2 * width
    right_side[-1] = 1.0
    solution = np.linalg.solve(system, right_side)
    p, q = solution[:count], slides * solution[:count]
    q[:stuck] = solution[count:-1]
    return float((q[stuck - 1] - friction * p[stuck - 1]) * np.sqrt(width[stuck - 1])), float(q @ width)


def _edges(ratio: float) -> Vector:
    """Panel edges from 0 to 1: cubically finer towards c from both sides, and towards 1."""
    t = np.linspace(0.0, 1.0, PANELS + 1)
    both = np.where(t < 0.5, 4 * t**3, 1 - 4 * (1 - t) ** 3)
    return np.concatenate((ratio * (1 - (1 - t) ** 3), ratio + (1 - ratio) * both[1:]))


def _log_kernel(left: Vector, right: Vector, start: Vector, stop: Vector) -> NDArray[np.float64]:
    """∬ ln|x - s| over every pair of panels."""

    def primitive(a: Vector, b: Vector) -> NDArray[np.float64]:
        t = np.abs(a[:, None] - b)
        return t**2 * (np.log(np.where(t > 0.0, t, 1.0)) / 2 - 0.75)

    return primitive(right, start) - primitive(left, start) - primitive(right, stop) + primitive(left, stop)


def _sign_kernel(left: Vector, right: Vector, start: Vector, stop: Vector) -> NDArray[np.float64]:
    """∬ sign(x - s) over every pair of panels, disjoint or the same."""
    return np.sign((left + right)[:, None] - (start + stop)) * np.outer(right - left, stop - start)
