"""Laws of sizes between two bounds, of one rate each: the share of a bin falls as exp(-rate · statistic).

A power law has the statistic ln x, and its rate is the exponent τ; an exponential has x. The likeliest rate is the one whose mean
of the statistic is that of the sizes; its standard error is 1/√(n · variance of the statistic).

Sizes are counted in bins of equal ratio (Virkar and Clauset, Annals of Applied Statistics 8, 2014). The shares of a continuous
power law are exact in such bins. Small whole numbers have a bin each; in bins of several a share is off by less than τ²/10⁴.
"""

import math
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

Vector = NDArray[np.float64]

_TABLE = np.linspace(8.0, -8.0, 65)
"""Standard errors off the likeliest rate at which means are tabled, to read the rates of drawn samples off."""


@dataclass(frozen=True, slots=True, eq=False)
class BoundedLaw:
    """The likeliest law of counts (b,) in bins."""

    statistic: Vector
    """(b,) at the middles of the bins, increasing."""
    log_widths: Vector
    counts: NDArray[np.int64]
    rate: float
    log_shares: Vector
    """(b,) logarithms of the shares of the bins."""

    @property
    def shares(self) -> Vector:
        """(b,) shares of the bins; they sum up to 1."""
        return np.asarray(np.exp(self.log_shares))

    @property
    def total(self) -> int:
        """How many sizes there are."""
        return int(self.counts.sum())

    @property
    def uncertainty(self) -> float:
        """Standard error of the rate, of independent sizes."""
        mean = self.shares @ self.statistic
        return 1.0 / math.sqrt(self.total * float(self.shares @ (self.statistic - mean) ** 2))

    @property
    def distance(self) -> float:
        """Largest difference between law and sizes of the shares below an end of a bin (Kolmogorov, Smirnov)."""
        return float(_distances(self.counts, self.shares))

    def chance_of_curvature(self) -> float:
        """Probability that chance alone bends sizes of this law so far: Rao's score test of a rate that changes evenly.

        Of a power law the alternative is the log-normal, whose ln(density) is a parabola of ln x.
        """
        off = self.statistic - self.shares @ self.statistic
        square = off**2 - self.shares @ off**2
        spread = self.shares @ square**2 - (self.shares @ (off * square)) ** 2 / (self.shares @ off**2)
        if not spread > 0.0:
            return 1.0
        return float(scipy.special.erfc(abs(self.counts @ square) / math.sqrt(2.0 * self.total * spread)))

    def goodness_of_fit(self, rng: np.random.Generator, draws: int) -> float:
        """Share of drawn samples, of as many sizes each, that are at least as far from their own fit as the sizes from theirs."""
        drawn = rng.multinomial(self.total, self.shares, draws)
        rates = self.rate + self.uncertainty * _TABLE
        means = np.exp(_log_shares(rates, self.statistic, self.log_widths)) @ self.statistic
        fitted = np.interp(drawn @ self.statistic / self.total, means, rates)
        shares = np.exp(_log_shares(fitted, self.statistic, self.log_widths))
        return float((_distances(drawn, shares) >= self.distance).mean())


def likeliest(statistic: Vector, widths: Vector, counts: NDArray[np.int64]) -> BoundedLaw | None:
    """The law of largest likelihood; None where all sizes are in the first or all in the last bin.

    statistic: (b,) at the middles of the bins, increasing; widths: (b,) lengths of the bins, or numbers in them.
    """
    place = (statistic - statistic[0]) / (statistic[-1] - statistic[0])
    mean, log_widths = float(counts @ place / counts.sum()), np.log(widths)
    if not 0.0 < mean < 1.0:
        return None

    def excess(steepness: float) -> float:
        """Of the law's mean place over that of the sizes: it falls as the law gets steeper."""
        logs = log_widths - steepness * place
        shares = np.exp(logs - logs.max())
        return float(shares @ place / shares.sum()) - mean

    low, high = -1.0, 1.0
    while excess(low) < 0.0:
        low *= 2.0
    while excess(high) > 0.0:
        high *= 2.0
    rate = float(scipy.optimize.brentq(excess, low, high, xtol=1e-9, rtol=1e-9)) / (statistic[-1] - statistic[0])
    return BoundedLaw(statistic, log_widths, counts, rate, _log_shares(np.array(rate), statistic, log_widths))


def _log_shares(rates: Vector, statistic: Vector, log_widths: Vector) -> Vector:
    """(..., b) logarithms of the shares of the bins, for rates of shape (...)."""
    logs = log_widths - rates[..., None] * statistic
    logs -= logs.max(axis=-1, keepdims=True)
    return np.asarray(logs - np.log(np.exp(logs).sum(axis=-1, keepdims=True)))


def _distances(counts: NDArray[np.int64], shares: Vector) -> Vector:
    """(...,) largest differences of the two cumulative distributions, both (..., b)."""
    seen = counts / counts.sum(axis=-1, keepdims=True)
    return np.asarray(np.abs(np.cumsum(seen - shares, axis=-1)).max(axis=-1))
