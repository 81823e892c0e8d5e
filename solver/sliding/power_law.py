"""Power laws of sizes by maximum likelihood: cut-off and goodness of fit (Clauset, Shalizi, Newman, SIAM Review 51, 2009).

Above the cut-off a continuous size has the density (τ-1)/x_min · (x/x_min)^-τ, a discrete one the probability k^-τ/ζ(τ, k_min).
"""

import math
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from nanoslip.solver.arrays import Floats, Vector

LEAST_TAIL = 50
"""Fewest sizes above a cut-off: below it, the error of an exponent exceeds a sixth of its distance from 1."""
CANDIDATES = 40
"""Cut-offs that are tried: evenly spaced in the logarithm of how many sizes lie above."""
PLACES = (4096, 512)
"""Largest number of points at which two distributions are compared. Continuous sizes: evenly spaced in their number, so
that a distance is accurate to 1/4096; whole numbers: evenly spaced in the logarithm of their number."""
EXPONENTS = (1.0 + 1e-6, 30.0)
"""Exponents that are looked for; outside there is no power law to speak of."""
SIGNIFICANT = 0.1
"""Goodness of fit below which a power law is refused."""


class SizeSample(NamedTuple):
    """A sample of sizes above 0, sorted."""

    values: Vector
    """(n,) increasing; whole numbers where they are discrete."""
    discrete: bool


class PowerLaw(NamedTuple):
    """A power law fitted to the sizes from a cut-off on."""

    exponent: float
    """τ"""
    cutoff: float
    """Smallest size that it holds for."""
    tail: int
    """Sizes from there on."""
    distance: float
    """Largest difference of the two cumulative distributions there (Kolmogorov, Smirnov)."""


def sort_sizes(sizes: Floats | NDArray[np.int64], discrete: bool) -> SizeSample:
    """The sizes that are finite and above 0, sorted."""
    values = np.asarray(sizes, np.float64)
    positive = np.isfinite(values) & (values > 0.0)
    return SizeSample(np.sort(values[positive]), discrete)


def find_power_law(sizes: SizeSample) -> PowerLaw | None:
    """The power law whose cut-off brings it nearest to the sizes; None for fewer than LEAST_TAIL sizes, or if all are
    equal."""
    firsts = _candidates(sizes.values)
    if not len(firsts):
        return None
    cutoffs, tails = sizes.values[firsts], len(sizes.values) - firsts
    logs = np.log(sizes.values)
    # Greatest likelihood (Clauset et al., Eq. 3.1): 1/(τ - 1) is the mean of ln(x/x_min).
    sums_from = np.cumsum(logs[::-1])[::-1]
    sums = sums_from[firsts] - tails * np.log(cutoffs)
    # Sizes that are equal but for rounding have an exponent beyond the bound, not 1/0.
    means = np.maximum(sums, 1e-300) / tails
    exponents = discrete_exponents(means, cutoffs) if sizes.discrete else 1.0 + 1.0 / means
    exponents = np.clip(exponents, *EXPONENTS)
    distances = _distances(sizes, firsts, exponents)
    best = int(np.argmin(distances))
    exponent, cutoff = float(exponents[best]), float(cutoffs[best])
    return PowerLaw(exponent, cutoff, int(tails[best]), float(distances[best]))


def discrete_exponents(means: Vector, cutoffs: Vector) -> Vector:
    """Find τ at which ln ζ(τ, k_min) falls as fast as the mean of ln(k/k_min), by Newton's method (ln ζ is convex)."""
    # Start (Clauset et al., Eq. 3.7): whole numbers as a continuous law from k_min - 1/2 on.
    continuous_means = means + np.log(cutoffs / (cutoffs - 0.5))
    exponents = np.minimum(1.0 + 1.0 / continuous_means, EXPONENTS[1])
    for _ in range(20):
        # The likelihood of whole numbers, -ln ζ(τ, k_min) - τ·mean(ln k), is greatest where its derivative is 0.
        slope, curvature = _log_zeta_slopes(exponents, cutoffs)
        step = (slope + means + np.log(cutoffs)) / curvature
        # Never more than half way to the pole of ζ at 1, beyond which there is no law.
        least = (exponents + 1.0) / 2.0
        most = np.minimum(2.0 * exponents, EXPONENTS[1])
        exponents = np.clip(exponents - step, least, most)
        if np.abs(step).max() < 1e-9:
            break
    return exponents


def _log_zeta_slopes(exponents: Vector, cutoffs: Vector) -> tuple[Vector, Vector]:
    """First and second derivative of ln ζ(τ, k_min) in τ, by differences over a share of its distance from the pole."""
    # There is no derivative of ζ in τ in scipy. Steps shrink towards the pole at 1, where ln ζ is about
    # -ln(τ - 1).
    h = 1e-3 * (exponents - 1.0)
    below = np.log(scipy.special.zeta(exponents - h, cutoffs))
    at = np.log(scipy.special.zeta(exponents, cutoffs))
    above = np.log(scipy.special.zeta(exponents + h, cutoffs))
    slope = (above - below) / (2.0 * h)
    curvature = (above - 2.0 * at + below) / h**2
    return slope, curvature


def survival(values: Vector, exponent: float, cutoff: float, discrete: bool) -> Vector:
    """Share of the power law's sizes that are at least as large as each of these values from the cut-off on."""
    if discrete:
        beyond = scipy.special.zeta(exponent, values)
        return np.asarray(beyond / scipy.special.zeta(exponent, cutoff))
    return np.asarray((values / cutoff) ** (1.0 - exponent))


def density(values: Vector, exponent: float, cutoff: float, discrete: bool) -> Vector:
    """Density of the power law at these values from the cut-off on; of whole numbers, their probabilities."""
    if discrete:
        return np.asarray(values**-exponent / scipy.special.zeta(exponent, cutoff))
    return np.asarray((exponent - 1.0) / cutoff * (values / cutoff) ** -exponent)


def _candidates(values: Vector) -> NDArray[np.int64]:
    """Positions in the sorted sizes at which a tail may begin: the first of equal ones, and not the last value that there is."""
    most = len(values)
    if most < LEAST_TAIL or values[0] == values[-1]:
        return np.empty(0, np.int64)
    tails = np.unique(np.geomspace(LEAST_TAIL, most, CANDIDATES).astype(np.int64))
    firsts = np.unique(np.searchsorted(values, values[most - tails], side="left"))
    # Sizes that are all equal have no exponent.
    return np.asarray(firsts[values[firsts] < values[-1]])


def _distances(sizes: SizeSample, firsts: NDArray[np.int64], exponents: Vector) -> Vector:
    """Distance of Kolmogorov and Smirnov for each tail."""
    if sizes.discrete:
        return _discrete_distances(sizes.values, firsts, exponents)
    logs, distances = np.log(sizes.values), np.empty(len(firsts))
    for place, (first, exponent) in enumerate(zip(firsts, exponents, strict=True)):
        count = len(logs) - first
        every = -(-count // PLACES[0])
        over_cutoff = logs[first::every] - logs[first]
        model = -np.expm1((1.0 - exponent) * over_cutoff)
        below = np.arange(0, count, every) / count
        # The distribution of the sizes jumps at each: both ends of the jump count.
        at_and_below = below + 1.0 / count
        distances[place] = max((at_and_below - model).max(), (model - below).max())
    return distances


def _discrete_distances(values: Vector, firsts: NDArray[np.int64], exponents: Vector) -> Vector:
    """Distances for whole numbers: the distributions are compared at each number that occurs, and just below it."""
    numbers, starts = np.unique(values, return_index=True)
    places = np.searchsorted(numbers, values[firsts])
    distances = np.empty(len(firsts))
    for row, (place, first, exponent) in enumerate(zip(places, firsts, exponents, strict=True)):
        seen = (len(values) - starts[place:]) / (len(values) - first)
        beyond = np.append(seen[1:], 0.0)
        chosen = _places(len(seen))
        here = numbers[place + chosen]
        at_least = survival(here, exponent, here[0], True)
        above = at_least - density(here, exponent, here[0], True)
        differences = np.abs(seen[chosen] - at_least)
        differences_beyond = np.abs(beyond[chosen] - above)
        distances[row] = max(differences.max(), differences_beyond.max())
    return distances


def _places(count: int) -> NDArray[np.int64]:
    """Positions among distinct numbers for a comparison: all if few, else denser among small numbers, which are more
    frequent."""
    if count <= PLACES[1]:
        return np.arange(count)
    places = np.geomspace(1.0, count, PLACES[1]).astype(np.int64)
    return np.asarray(np.unique(places) - 1)


def exponent_in_range(exponent: float) -> float:
    """The exponent of a fit; NaN at the bounds of the search, which are no measurement."""
    return exponent if EXPONENTS[0] < exponent < EXPONENTS[1] else math.nan


DRAWS = 100
"""Number of samples drawn: a share of 0.1 then has an error of 0.03."""


def goodness_of_fit(sizes: SizeSample, law: PowerLaw, draws: int = DRAWS) -> float:
    """Share of drawn samples that are further from their own fit than the sizes are from theirs: below 0.1 it is no power law.

    Each sample has as many sizes, from the cut-off on drawn from the law, below it from the sizes themselves; its cut-off is
    fitted again. The seed follows from the number of sizes, so the result is reproducible. NaN without draws.
    """
    if not draws:
        return math.nan
    rng = np.random.default_rng([len(sizes.values), draws])
    further = 0
    for _ in range(draws):
        drawn = find_power_law(_draw_sizes(sizes, law, rng))
        # From a fit of its own, cut-off included, as the sizes' law is: what it was drawn from is farther.
        further += drawn is not None and drawn.distance >= law.distance
    return further / draws


def _draw_sizes(sizes: SizeSample, law: PowerLaw, rng: np.random.Generator) -> SizeSample:
    """Draw the same number of sizes, following the law from its cut-off on."""
    total = len(sizes.values)
    below = sizes.values[: total - law.tail]
    # As many above the cut-off as chance would put there (Clauset et al., §4).
    tail = int(rng.binomial(total, law.tail / total)) if len(below) else total
    chosen = rng.choice(below, total - tail) if tail < total else below[:0]
    beyond = power_law_sizes(rng, tail, law.exponent, law.cutoff, sizes.discrete)
    return SizeSample(np.sort(np.concatenate((chosen, beyond))), sizes.discrete)


def power_law_sizes(rng: np.random.Generator, count: int, exponent: float, cutoff: float, discrete: bool) -> Vector:
    """Draw sizes of a power law, by inversion of its cumulative distribution."""
    uniform = 1.0 - rng.random(count)  # above 0
    if not discrete:
        # A law as flat as 1/x has sizes beyond all numbers.
        with np.errstate(over="ignore"):
            # A share (x/x_min)^(1-τ) of sizes is larger than x.
            values = cutoff * uniform ** (-1.0 / (exponent - 1.0))
            return np.minimum(values, LARGEST_FLOAT)
    return _whole_sizes(uniform, exponent, cutoff)


TABLED = 1000
"""Whole numbers from the cut-off on whose probabilities are summed; beyond, the law is as good as continuous."""


def _whole_sizes(uniform: Vector, exponent: float, cutoff: float) -> Vector:
    """The largest whole number that at least this share of the law reaches."""
    numbers = cutoff + np.arange(TABLED + 1.0)
    shares = survival(numbers, exponent, cutoff, True)
    # Shares fall as numbers grow: with the minus they rise, as the search needs.
    sizes = cutoff + np.searchsorted(-shares, -uniform, side="right") - 1.0
    beyond = uniform <= shares[-1]
    last = numbers[-1]
    # ζ(τ, k) is k^(1-τ) about half a number lower, to 1e-6 out there; beyond 1e15 numbers are not whole any more.
    with np.errstate(over="ignore"):
        share = uniform[beyond] / shares[-1]
        ratio = np.minimum(share ** (-1.0 / (exponent - 1.0)), 1e15)
    sizes[beyond] = np.floor((last - 0.5) * ratio + 0.5)
    return np.asarray(sizes)


PER_DECADE = 8
"""Bins in a decade."""
LARGEST_FLOAT = np.finfo(np.float64).max


class Histogram(NamedTuple):
    """Sizes counted in bins of equal ratio."""

    edges: Vector
    """(b + 1,) ends of the bins."""
    counts: NDArray[np.int64]
    """(b,) sizes in each; an upper end belongs to the next bin, but for the last one."""
    density: Vector
    """(b,) share of all sizes per unit of size, at most the largest number there is; of whole numbers, per number in the bin."""
    middles: Vector
    """(b,) geometric means of the ends; of whole numbers, of the first and the last number in the bin."""

    def __repr__(self) -> str:
        return f"Histogram({self.counts.sum()} sizes in {len(self.counts)} bins)"


def logarithmic_histogram(
    sizes: Floats | NDArray[np.int64], *, discrete: bool, per_decade: int = PER_DECADE
) -> Histogram:
    """The histogram of the sizes above 0; without any it has no bins.

    Ends of bins are powers of 10^(1/per_decade), the same for all samples; of whole numbers they are rounded up to one half
    below a number, and bins without a number are left out.
    """
    values = sort_sizes(sizes, discrete).values
    if not len(values):
        none = np.empty(0)
        return Histogram(none, np.empty(0, np.int64), none, none)
    edges = _edges(values, per_decade, discrete)
    below = np.searchsorted(values, edges, side="left")
    below[-1] = len(values)
    counts, inwards = np.diff(below), 0.5 * discrete
    # Root by root, as the product of both ends may overflow.
    middles = np.sqrt(edges[:-1] + inwards) * np.sqrt(edges[1:] - inwards)
    with np.errstate(over="ignore"):  # bins among the smallest numbers are narrower than one over the largest
        density = np.minimum(counts / len(values) / np.diff(edges), LARGEST_FLOAT)
    return Histogram(edges, counts, density, middles)


def _edges(values: Vector, per_decade: int, discrete: bool) -> Vector:
    """Ends of bins, rising and above 0, also where sizes are the smallest or the largest numbers there are."""
    ends = np.log10(values[[0, -1]]) * per_decade
    first, last = np.floor(ends).astype(int)
    with np.errstate(over="ignore"):
        powers = 10.0 ** (np.arange(first, last + 2) / per_decade)
    edges = np.minimum(powers, LARGEST_FLOAT)
    if not discrete:
        # Powers are rounded: the outermost bins still hold the smallest and the largest size.
        edges[0] = min(edges[0], values[0])
        edges[-1] = max(edges[-1], np.nextafter(values[-1], LARGEST_FLOAT))
        edges = np.unique(edges)
        if edges[0] > 0.0:
            return edges
        return np.unique(np.append(edges[1:], values[0]))
    edges = np.unique(np.ceil(edges - 1e-9) - 0.5)
    if edges[-1] >= values[-1]:
        return edges
    return np.append(edges, values[-1] + 0.5)
