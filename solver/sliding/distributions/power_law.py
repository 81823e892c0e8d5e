"""Power laws by maximum likelihood, their lower cut-off by the distance of Kolmogorov and Smirnov.

The method is that of Clauset, Shalizi and Newman (SIAM Review 51, 2009).

Above the cut-off a continuous size has the density (τ-1)/x_min · (x/x_min)^-τ, a discrete one the probability k^-τ/ζ(τ, k_min).
"""

import math
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

Vector = NDArray[np.float64]

LEAST_TAIL = 50
"""Sizes above a cut-off at least: below, an exponent is not known to better than a sixth of what it is above 1."""
CANDIDATES = 40
"""Cut-offs that are tried: evenly spaced in the logarithm of how many sizes lie above."""
PLACES = (4096, 512)
"""Places at most where two distributions are compared: of continuous sizes evenly spaced in their number, so that a distance is
known to 1/4096; of whole ones evenly spaced in the logarithm of their number."""
EXPONENTS = (1.0 + 1e-6, 30.0)
"""Exponents that are looked for; outside there is no power law to speak of."""


class Sizes(NamedTuple):
    """A sample of sizes above 0, sorted."""

    values: Vector
    """(n,) increasing; whole numbers where they are discrete."""
    discrete: bool


class PowerLaw(NamedTuple):
    """A power law fitted to the sizes from a cut-off on."""

    exponent: float
    """τ"""
    uncertainty: float
    """Standard error of τ with the cut-off given, of independent sizes."""
    cutoff: float
    """Smallest size that it holds for."""
    tail: int
    """Sizes from there on."""
    distance: float
    """Largest difference of the two cumulative distributions there (Kolmogorov, Smirnov)."""


def sorted_sizes(sizes: NDArray[np.float64] | NDArray[np.int64], discrete: bool) -> Sizes:
    """The sizes that are finite and above 0, sorted."""
    values = np.asarray(sizes, np.float64)
    return Sizes(np.sort(values[np.isfinite(values) & (values > 0.0)]), discrete)


def fitted_power_law(sizes: Sizes) -> PowerLaw | None:
    """The power law whose cut-off brings it nearest to the sizes; None of fewer than LEAST_TAIL, or of equal ones."""
    firsts = _candidates(sizes.values)
    if not len(firsts):
        return None
    cutoffs, tails = sizes.values[firsts], len(sizes.values) - firsts
    logs = np.log(sizes.values)
    sums = np.cumsum(logs[::-1])[::-1][firsts] - tails * np.log(cutoffs)
    means = np.maximum(sums, 1e-300) / tails
    exponents = discrete_exponents(means, cutoffs) if sizes.discrete else 1.0 + 1.0 / means
    exponents = np.clip(exponents, *EXPONENTS)
    distances = _distances(sizes, firsts, exponents)
    best = int(np.argmin(distances))
    exponent, cutoff, tail = float(exponents[best]), float(cutoffs[best]), int(tails[best])
    return PowerLaw(
        exponent, _standard_error(exponent, cutoff, tail, sizes.discrete), cutoff, tail, float(distances[best])
    )


def discrete_exponents(means: Vector, cutoffs: Vector) -> Vector:
    """τ at which ln ζ(τ, k_min) falls as fast as the mean of ln(k/k_min) says; Newton's method on its convex logarithm."""
    exponents = np.minimum(1.0 + 1.0 / (means + np.log(cutoffs / (cutoffs - 0.5))), EXPONENTS[1])
    for _ in range(20):
        slope, curvature = _log_zeta_slopes(exponents, cutoffs)
        step = (slope + means + np.log(cutoffs)) / curvature
        exponents = np.clip(exponents - step, (exponents + 1.0) / 2.0, np.minimum(2.0 * exponents, EXPONENTS[1]))
        if np.abs(step).max() < 1e-9:
            break
    return exponents


def _log_zeta_slopes(exponents: Vector, cutoffs: Vector) -> tuple[Vector, Vector]:
    """First and second derivative of ln ζ(τ, k_min) in τ, by differences over a share of its distance from the pole."""
    h = 1e-3 * (exponents - 1.0)
    below, at, above = (np.log(scipy.special.zeta(exponents + way * h, cutoffs)) for way in (-1, 0, 1))
    return (above - below) / (2.0 * h), (above - 2.0 * at + below) / h**2


def _standard_error(exponent: float, cutoff: float, tail: int, discrete: bool) -> float:
    if not discrete:
        return (exponent - 1.0) / math.sqrt(tail)
    _, curvature = _log_zeta_slopes(np.array([exponent]), np.array([cutoff]))
    return float(1.0 / np.sqrt(tail * curvature[0]))


def survival(values: Vector, exponent: float, cutoff: float, discrete: bool) -> Vector:
    """Share of the power law's sizes that are at least as large as each of these values from the cut-off on."""
    if discrete:
        return np.asarray(scipy.special.zeta(exponent, values) / scipy.special.zeta(exponent, cutoff))
    return np.asarray((values / cutoff) ** (1.0 - exponent))


def _candidates(values: Vector) -> NDArray[np.int64]:
    """Positions in the sorted sizes at which a tail may begin: the first of equal ones, and not the last value that there is."""
    most = len(values)
    if most < LEAST_TAIL or values[0] == values[-1]:
        return np.empty(0, np.int64)
    tails = np.unique(np.geomspace(LEAST_TAIL, most, CANDIDATES).astype(np.int64))
    firsts = np.unique(np.searchsorted(values, values[most - tails], side="left"))
    return np.asarray(firsts[values[firsts] < values[-1]])


def _distances(sizes: Sizes, firsts: NDArray[np.int64], exponents: Vector) -> Vector:
    """Distance of Kolmogorov and Smirnov for each tail."""
    if sizes.discrete:
        return _discrete_distances(sizes.values, firsts, exponents)
    logs, found = np.log(sizes.values), np.empty(len(firsts))
    for place, (first, exponent) in enumerate(zip(firsts, exponents, strict=True)):
        count = len(logs) - first
        every = -(-count // PLACES[0])
        model = -np.expm1((1.0 - exponent) * (logs[first::every] - logs[first]))
        below = np.arange(0, count, every) / count
        found[place] = max((below + 1.0 / count - model).max(), (model - below).max())
    return found


def _discrete_distances(values: Vector, firsts: NDArray[np.int64], exponents: Vector) -> Vector:
    """The same of whole numbers: the distributions are compared at each number that occurs, and just below it."""
    numbers, starts = np.unique(values, return_index=True)
    places = np.searchsorted(numbers, values[firsts])
    found = np.empty(len(firsts))
    for row, (place, first, exponent) in enumerate(zip(places, firsts, exponents, strict=True)):
        seen = (len(values) - starts[place:]) / (len(values) - first)
        beyond = np.append(seen[1:], 0.0)
        chosen = _places(len(seen))
        here = numbers[place + chosen]
        at_least = survival(here, exponent, here[0], True)
        above = at_least - here**-exponent / scipy.special.zeta(exponent, here[0])
        found[row] = max(np.abs(seen[chosen] - at_least).max(), np.abs(beyond[chosen] - above).max())
    return found


def _places(count: int) -> NDArray[np.int64]:
    """Places among so many distinct numbers: all of few, else denser among the smaller ones, which are the more frequent."""
    if count <= PLACES[1]:
        return np.arange(count)
    return np.asarray(np.unique(np.geomspace(1.0, count, PLACES[1]).astype(np.int64)) - 1)
