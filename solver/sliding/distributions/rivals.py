"""Laws that may describe large sizes as well as a power law: exponential, log-normal, power law with an upper cut-off.

Each is fitted by maximum likelihood to the sizes from the power law's own cut-off on; a fit is its log-likelihood of each size.
Continuous sizes are taken over the cut-off, x/x_min ≥ 1. Discrete ones keep their numbers, and every law is summed over those.
Laws are compared by likelihood ratios, and by whether chance explains them (Vuong).
"""

import math
from collections.abc import Callable
from typing import Final, NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from nanoslip.solver.sliding.distributions.power_law import SIGNIFICANT, PowerLaw, Sizes

Vector = NDArray[np.float64]
Likelihood = Callable[[Vector], Vector]
"""Parameters of a law -> log-likelihood of each distinct size."""

PARAMETERS: Final = {"power_law": 1, "exponential": 1, "lognormal": 2, "truncated_power_law": 2}
"""Law -> parameters that are fitted."""


class Tail:
    """The distinct sizes from a cut-off on, and how often each occurs."""

    def __init__(self, sizes: Sizes, law: PowerLaw) -> None:
        self.discrete = sizes.discrete
        values = sizes.values[len(sizes.values) - law.tail :]
        if self.discrete:
            self.values, self.counts = np.unique(values, return_counts=True)
            self.cutoff = law.cutoff
        else:
            self.values, self.counts, self.cutoff = values / law.cutoff, np.ones(len(values), np.int64), 1.0
        self.logs = np.log(self.values)
        self.total = int(self.counts.sum())
        self.mean = float(self.counts @ self.values) / self.total


def log_likelihoods(sizes: Sizes, law: PowerLaw) -> tuple[dict[str, Vector], NDArray[np.int64]]:
    """Law -> log-likelihood of each distinct size of the tail, and how often each size occurs."""
    tail = Tail(sizes, law)
    found = {
        "power_law": -law.exponent * tail.logs - _log_sum_of_powers(tail, law.exponent),
        "exponential": _exponential(tail),
        "lognormal": _fitted(tail, _lognormal(tail), _start_of_lognormal(tail)),
        "truncated_power_law": _fitted(tail, _truncated(tail), np.array([law.exponent, np.log(0.1 / tail.mean)])),
    }
    return found, tail.counts


def _log_sum_of_powers(tail: Tail, exponent: float) -> float:
    """ln of what the sizes^-τ sum up to, discrete, or integrate to from 1 on."""
    return float(np.log(scipy.special.zeta(exponent, tail.cutoff))) if tail.discrete else -float(np.log(exponent - 1.0))


def _exponential(tail: Tail) -> Vector:
    above = max(tail.mean - tail.cutoff, 1e-300)
    rate = np.log1p(1.0 / above) if tail.discrete else 1.0 / above
    scale = np.log(-np.expm1(-rate)) if tail.discrete else np.log(rate)
    return np.asarray(scale - rate * (tail.values - tail.cutoff))


def _fitted(tail: Tail, likelihood: Likelihood, start: Vector) -> Vector:
    """The largest likelihood that parameters lead to from a start (simplex method of Nelder and Mead)."""

    def misfit(parameters: Vector) -> float:
        value = -float(tail.counts @ likelihood(parameters)) / tail.total
        return value if np.isfinite(value) else 1e300

    found = scipy.optimize.minimize(
        misfit, start, method="Nelder-Mead", options={"xatol": 1e-5, "fatol": 1e-9, "maxiter": 600}
    )
    return likelihood(found.x)


def _start_of_lognormal(tail: Tail) -> Vector:
    mean = float(tail.counts @ tail.logs) / tail.total
    spread = float(tail.counts @ (tail.logs - mean) ** 2) / tail.total
    return np.array([mean, 0.5 * np.log(max(spread, 1e-6))])


def _lognormal(tail: Tail) -> Likelihood:
    """Of ln x: mean, and logarithm of the standard deviation; a whole number k stands for k - 1/2 to k + 1/2."""
    whole = tail.values < DENSE if tail.discrete else np.zeros(len(tail.values), np.bool_)
    edges = np.log(tail.values[whole] + np.array([[-0.5], [0.5]]))
    lowest = np.log(tail.cutoff - 0.5) if tail.discrete else 0.0

    def likelihood(parameters: Vector) -> Vector:
        mean, width = parameters[0], np.exp(np.clip(parameters[1], -20.0, 20.0))
        above = scipy.special.log_ndtr((mean - lowest) / width)
        z = (tail.logs - mean) / width
        found = np.asarray(-0.5 * z**2 - 0.5 * np.log(2.0 * np.pi) - np.log(width) - tail.logs)
        low, high = scipy.special.log_ndtr((mean - edges) / width)  # of the shares above
        # Where both are one number the share between them is its density.
        apart = high < low
        found[np.flatnonzero(whole)[apart]] = (low + np.log(-np.expm1(np.where(apart, high - low, -1.0))))[apart]
        return np.asarray(found - above)

    return likelihood


def _truncated(tail: Tail) -> Likelihood:
    """x^-τ exp(-λx): τ, and the logarithm of λ."""

    def likelihood(parameters: Vector) -> Vector:
        exponent, rate = float(np.clip(parameters[0], -5.0, 30.0)), float(np.exp(np.clip(parameters[1], -40.0, 5.0)))
        total = (_sum_over_numbers if tail.discrete else _integral)(exponent, rate, tail.cutoff)
        return np.asarray(-exponent * tail.logs - rate * (tail.values - tail.cutoff) - np.log(total))

    return likelihood


DENSE = 1e5
"""Whole numbers from which on a share between k - 1/2 and k + 1/2 is the density at k."""
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(96)
SUMMED = 64
"""Whole numbers that are summed one by one; the rest is an integral with the first terms of Euler and Maclaurin."""


def _integral(exponent: float, rate: float, first: float) -> float:
    """∫ x^-τ exp(-λ(x - cutoff)) dx from `first` = cutoff on, over the logarithm of x, up to where nothing is left."""
    length = np.log1p(700.0 / (rate * first))
    if exponent > 1.0:
        length = min(length, 700.0 / (exponent - 1.0))
    # In two halves: the integrand falls fast at either end.
    total = 0.0
    for begin, end in ((0.0, 0.2 * length), (0.2 * length, length)):
        t = begin + (end - begin) * (_NODES + 1.0) / 2.0
        x = first * np.exp(t)
        total += float(_WEIGHTS @ (x ** (1.0 - exponent) * np.exp(-rate * (x - first)))) * (end - begin) / 2.0
    return total


def _sum_over_numbers(exponent: float, rate: float, cutoff: float) -> float:
    """Σ k^-τ exp(-λ(k - cutoff)) from the cut-off on."""
    k = cutoff + np.arange(SUMMED)
    last = cutoff + SUMMED
    term = last**-exponent
    beyond = _integral(exponent, rate, last) + term / 2.0 + term * (exponent / last + rate) / 12.0
    return float((k**-exponent * np.exp(-rate * (k - cutoff))).sum() + np.exp(-rate * SUMMED) * beyond)


LAWS: Final = tuple(PARAMETERS)
"""The power law, then its rivals."""


class Comparison(NamedTuple):
    """A rival of the power law on the same tail."""

    name: str
    ratio: float
    """Logarithm of the likelihood ratio: above 0 the power law fits better, below 0 the rival."""
    chance: float
    """Probability of a ratio as far from 0 if both described the sizes equally well."""


def comparisons(sizes: Sizes, law: PowerLaw) -> tuple[Comparison, ...]:
    """Every rival against the power law, on the tail that this was fitted to."""
    found, counts = log_likelihoods(sizes, law)
    own = found["power_law"]
    return tuple(_compared(name, own - found[name], counts) for name in LAWS[1:])


def _compared(name: str, differences: NDArray[np.float64], counts: NDArray[np.int64]) -> Comparison:
    """Vuong's test; the truncated power law holds the plain one in it, and twice its gain is χ² of one degree (Wilks)."""
    if name == "truncated_power_law":
        ratio = min(float(counts @ differences), 0.0)  # the simplex may stop a rounding short of no truncation
        return Comparison(name, ratio, float(scipy.special.erfc(math.sqrt(-ratio))))
    return Comparison(name, *vuong(differences, counts))


def vuong(differences: NDArray[np.float64], counts: NDArray[np.int64]) -> tuple[float, float]:
    """Vuong's test of two laws, neither a case of the other: logarithm of the likelihood ratio, and chance of one so far from 0.

    differences: (b,) of the log-likelihoods of one size; counts: (b,) how often each occurs.
    """
    ratio = float(counts @ differences)
    spread = float(counts @ (differences - ratio / counts.sum()) ** 2)
    return ratio, float(scipy.special.erfc(abs(ratio) / math.sqrt(2.0 * spread))) if spread > 0.0 else 1.0


def preferred(rivals: tuple[Comparison, ...]) -> tuple[str, float]:
    """The law to prefer, and the chance that decides it.

    Of the rivals that fit better than chance allows (SIGNIFICANT) the one of the largest likelihood, less its parameters
    (Akaike); without any, the power law. The chance is that rival's; of the power law that of the rival nearest to beating it.
    """
    better = [rival for rival in rivals if rival.ratio < 0.0 and rival.chance < SIGNIFICANT]
    if better:
        best = min(better, key=lambda rival: rival.ratio + PARAMETERS[rival.name])
        return best.name, best.chance
    nearest = min(rivals, key=lambda rival: rival.ratio)
    return "power_law", nearest.chance
