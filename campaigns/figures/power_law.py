"""A power law through means that are known to their standard errors: exponent, factor and what is left."""

from dataclasses import dataclass
from typing import Final

import numpy as np
import scipy

from nanoslip.solver.arrays import Floats
from nanoslip.solver.view import with_error

_ROUNDING: Final = float(np.finfo(float).eps) ** 2


@dataclass(frozen=True, slots=True)
class PowerLaw:
    """y = factor · x^exponent, by weighted least squares of the logarithms."""

    exponent: float
    exponent_error: float
    """Standard error."""
    freedom: int
    """Points less 2: degrees of freedom of Student's distribution, which the exponent's error follows."""
    factor: float
    misfit: float
    """Standard deviation of ln y about the law beyond the points' own errors; next to 0 where these explain all."""

    @property
    def exponent_interval(self) -> float:
        """Half of the 95 % confidence interval of the exponent."""
        return float(scipy.stats.t.ppf(0.975, self.freedom)) * self.exponent_error

    def confidence_of_fall(self) -> float:
        """Confidence that the exponent is negative, of one side: 0.5 where it is 0 ± anything."""
        return float(scipy.stats.t.cdf(-self.exponent / self.exponent_error, self.freedom))

    def at(self, x: Floats) -> Floats:
        """The law's y (any shape)."""
        return np.asarray(self.factor * x**self.exponent)

    def __str__(self) -> str:
        return with_error(self.exponent, self.exponent_interval)


def fit_power_law(x: Floats, y: Floats, errors: Floats | float = 0.0) -> PowerLaw:
    """Fit to points (n,) of positive numbers, n ≥ 3, with the standard errors of y (n,), or 0 where they are not known.

    A point's ln y varies by its relative error and by the law's misfit τ, so its weight is 1/(error² + τ²). τ² is as large as
    χ² = n - 2 needs it to be, and not negative (Paule and Mandel 1982). Without errors that is ordinary least squares.
    Raises ValueError for fewer than three points.
    """
    if len(x) < 3:
        raise ValueError(f"{len(x)} points: a power law and its confidence need 3")
    points = np.log(x), np.log(y)
    variances = (np.broadcast_to(errors, np.shape(y)) / y) ** 2
    misfit = _misfit(*points, variances)
    weights = 1.0 / (variances + misfit)
    intercept, slope = _line(*points, weights)
    spread = np.sum(weights * (points[0] - np.average(points[0], weights=weights)) ** 2)
    return PowerLaw(slope, float(spread**-0.5), len(x) - 2, float(np.exp(intercept)), float(np.sqrt(misfit)))


def _misfit(x: Floats, y: Floats, variances: Floats) -> float:
    """τ² from χ²(τ²) = n - 2. χ² falls with τ², and that of equal weights bounds the root from above."""
    freedom = len(x) - 2

    def excess(misfit: float) -> float:
        weights = 1.0 / (variances + misfit)
        return float(np.sum(weights * _left(x, y, weights) ** 2)) - freedom

    most = float(np.sum(_left(x, y, np.ones_like(x)) ** 2)) / freedom + _ROUNDING
    least = 1e-9 * most
    return float(scipy.optimize.brentq(excess, least, 2.0 * most, rtol=1e-12)) if excess(least) > 0.0 else least


def _line(x: Floats, y: Floats, weights: Floats) -> tuple[float, float]:
    """Intercept and slope of the weighted least squares."""
    middle, height = np.average(x, weights=weights), np.average(y, weights=weights)
    slope = np.sum(weights * (x - middle) * (y - height)) / np.sum(weights * (x - middle) ** 2)
    return float(height - slope * middle), float(slope)


def _left(x: Floats, y: Floats, weights: Floats) -> Floats:
    intercept, slope = _line(x, y, weights)
    return np.asarray(y - intercept - slope * x)
