"""A power law through means with known scatter: exponent, factor and their confidence intervals."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class PowerLaw:
    """y = factor · x^exponent, by least squares of the logarithms; each with half of its 95 % confidence interval."""

    exponent: float
    exponent_interval: float
    factor: float
    log_factor_interval: float
    residual: float
    """Root mean square of what is left of ln y."""

    def at(self, x: Floats) -> Floats:
        """The law's y (any shape)."""
        return np.asarray(self.factor * x**self.exponent)

    def __str__(self) -> str:
        return f"{self.exponent:.3f} ± {self.exponent_interval:.2g}"


def fit_power_law(x: Floats, y: Floats) -> PowerLaw:
    """Fit to points (n,) of positive numbers, n ≥ 3. Each point counts the same: scatter about the law exceeds that of a point.

    Student's distribution with n - 2 degrees of freedom gives the intervals. Raises ValueError for fewer than three points.
    """
    if len(x) < 3:
        raise ValueError(f"{len(x)} points: a power law and its confidence need 3")
    fit = stats.linregress(np.log(x), np.log(y))
    quantile = float(stats.t.ppf(0.975, len(x) - 2))
    left = np.log(y) - fit.intercept - fit.slope * np.log(x)
    return PowerLaw(
        float(fit.slope),
        quantile * float(fit.stderr),
        float(np.exp(fit.intercept)),
        quantile * float(fit.intercept_stderr),
        float(np.sqrt(np.mean(left**2))),
    )
