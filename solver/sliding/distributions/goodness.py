"""Goodness of fit of a power law: how often chance alone leaves a sample as far from its fit (Clauset et al. 2009, §4.1)."""

import math

import numpy as np
from numpy.typing import NDArray

from solver.sliding.distributions.power_law import PowerLaw, Sizes, fitted_power_law, survival

Vector = NDArray[np.float64]

DRAWS = 100
"""Samples that are drawn: a share of 0.1 is then known to 0.03."""


def goodness_of_fit(sizes: Sizes, law: PowerLaw, draws: int = DRAWS) -> float:
    """Share of drawn samples that are further from their own fit than the sizes are from theirs: below 0.1 it is no power law.

    Each sample has as many sizes, from the cut-off on drawn from the law, below it from the sizes themselves; its cut-off is
    looked for again. The seed is the number of sizes: the same sizes have the same goodness, whoever asks. NaN of no draws.
    """
    if not draws:
        return math.nan
    rng = np.random.default_rng([len(sizes.values), draws])
    further = 0
    for _ in range(draws):
        drawn = fitted_power_law(_drawn(sizes, law, rng))
        further += drawn is not None and drawn.distance >= law.distance
    return further / draws


def _drawn(sizes: Sizes, law: PowerLaw, rng: np.random.Generator) -> Sizes:
    """As many sizes, of the law from its cut-off on."""
    total = len(sizes.values)
    below = sizes.values[: total - law.tail]
    tail = int(rng.binomial(total, law.tail / total)) if len(below) else total
    chosen = rng.choice(below, total - tail) if tail < total else below[:0]
    values = np.concatenate((chosen, power_law_sizes(rng, tail, law.exponent, law.cutoff, sizes.discrete)))
    return Sizes(np.sort(values), sizes.discrete)


def power_law_sizes(rng: np.random.Generator, count: int, exponent: float, cutoff: float, discrete: bool) -> Vector:
    """So many sizes of a power law, by inversion of its cumulative distribution."""
    uniform = 1.0 - rng.random(count)  # above 0
    if not discrete:
        # A law as flat as 1/x has sizes beyond all numbers.
        with np.errstate(over="ignore"):
            return np.minimum(cutoff * uniform ** (-1.0 / (exponent - 1.0)), np.finfo(float).max)
    return _whole_sizes(uniform, exponent, cutoff)


TABLED = 1000
"""Whole numbers from the cut-off on whose probabilities are summed; beyond, the law is as good as continuous."""


def _whole_sizes(uniform: Vector, exponent: float, cutoff: float) -> Vector:
    """The largest whole number that at least such a share of the law reaches."""
    numbers = cutoff + np.arange(TABLED + 1.0)
    shares = survival(numbers, exponent, cutoff, True)
    found = cutoff + np.searchsorted(-shares, -uniform, side="right") - 1.0
    beyond = uniform <= shares[-1]
    last = numbers[-1]
    # ζ(τ, k) is k^(1-τ) about half a number lower, to 1e-6 out there; beyond 1e15 numbers are not whole any more.
    with np.errstate(over="ignore"):
        ratio = np.minimum((uniform[beyond] / shares[-1]) ** (-1.0 / (exponent - 1.0)), 1e15)
    found[beyond] = np.floor((last - 0.5) * ratio + 0.5)
    return np.asarray(found)
