"""Which law describes large sizes best: likelihood ratios against the power law, and whether chance explains them (Vuong)."""

import math
from typing import Final, NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from solver.sliding.distributions.power_law import PowerLaw, Sizes
from solver.sliding.distributions.rivals import PARAMETERS, log_likelihoods

LAWS: Final = tuple(PARAMETERS)
"""The power law, then its rivals."""
SIGNIFICANT: Final = 0.1
"""Chance below which a rival that fits better is taken to be better."""


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
