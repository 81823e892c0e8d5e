"""The scaling range: the longest interval of sizes that a power law describes, and its exponent there.

Sizes of a finite contact are a power law between two bounds at best: the node below, the contact above. The bounds are chosen as
Deluca and Corral do (Acta Geophysica 61, 2013): of all intervals in which the law is not refused, the longest in ln x.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from solver.sliding.distributions.bounded import BoundedLaw, likeliest
from solver.sliding.distributions.comparison import SIGNIFICANT, vuong
from solver.sliding.distributions.histogram import Histogram, logarithmic_histogram
from solver.sliding.distributions.power_law import Sizes

FEWEST = 50
"""Sizes at least in either half (in ln x) of an interval: a half that is all but empty supports nothing."""
CLEAR = 0.01
"""Chance below which an exponential is taken to be worse: at 0.1 one of hundreds of intervals passes by chance alone."""
PER_DECADE = 50
"""Bins in a decade in which sizes are counted, fewer where they would be more than MOST_BINS."""
MOST_BINS = 2000
"""Bins at most: forty decades of PER_DECADE. The time for an interval grows as its bins."""
ENDS = 40
"""Places at most, of equal ratio, at which an interval may end."""
FARTHEST = 1.05
"""√n times the distance beyond which a tenth of all samples never is: that tenth begins at 0.82 to 0.99, as the rate may be."""


class ScalingRange(NamedTuple):
    """A power law between two bounds."""

    exponent: float
    """τ of the density x^-τ."""
    exponent_uncertainty: float
    """Standard error of τ with the bounds given, of independent sizes."""
    first: float
    """Lower bound; of whole numbers the smallest."""
    last: float
    """Upper bound; of whole numbers the largest."""
    decades: float
    """log10(last/first)."""
    events: int
    """Sizes between the bounds."""
    goodness: float
    """Share of samples of the law that are at least as far from their fit: 0.1 or more."""


NOWHERE = ScalingRange(math.nan, math.nan, math.nan, math.nan, 0.0, 0, math.nan)
"""Where there is no scaling range."""


def scaling_range(sizes: Sizes, draws: int) -> ScalingRange | None:
    """The longest interval in which nothing speaks against a falling power law; None where there is none, or of no draws.

    τ > 0, the goodness of fit is 0.1 or more, ln(density) is no parabola of ln x (`BoundedLaw.chance_of_curvature`), and an
    exponential fits worse by more than chance (Vuong). The same sizes have the same range, whoever asks.
    """
    if not draws or len(sizes.values) < 2 * FEWEST:
        return None
    binned = logarithmic_histogram(sizes.values, discrete=sizes.discrete, per_decade=_per_decade(sizes))
    inwards = 0.5 * sizes.discrete
    rng = np.random.default_rng([len(sizes.values), draws])
    for first, last in _intervals(binned, sizes.discrete):
        law = _candidate(binned, slice(first, last))
        goodness = law.goodness_of_fit(rng, draws) if law else 0.0
        if law and goodness >= SIGNIFICANT:
            bounds = float(binned.edges[first] + inwards), float(binned.edges[last] - inwards)
            ratio = bounds[1] / bounds[0]
            decades = math.log10(ratio) if math.isfinite(ratio) else math.log10(bounds[1]) - math.log10(bounds[0])
            return ScalingRange(law.rate, law.uncertainty, *bounds, decades, law.total, goodness)
    return None


def _per_decade(sizes: Sizes) -> int:
    """Bins in a decade: as fine as the decades that the sizes span allow."""
    decades = math.log10(sizes.values[-1]) - math.log10(sizes.values[0])
    return min(PER_DECADE, int(MOST_BINS / max(decades, 1.0)))


def _intervals(binned: Histogram, discrete: bool) -> Iterator[tuple[int, int]]:
    """Positions among the edges of bins of all intervals with sizes enough, the longest first."""
    logs, below = np.log(binned.edges), np.concatenate(([0], np.cumsum(binned.counts)))
    # Of continuous sizes the smallest and the largest fill their bins in part.
    outermost = (0, len(logs) - 1) if discrete else (1, len(logs) - 2)
    places = np.linspace(logs[outermost[0]], logs[outermost[1]], ENDS)
    ends = np.unique(np.searchsorted(logs, places).clip(*outermost))
    pairs = [(logs[last] - logs[first], first, last) for first in ends for last in ends if last > first + 2]
    for _, first, last in sorted(pairs, reverse=True):
        middle = below[np.searchsorted(logs, 0.5 * (logs[first] + logs[last]))]
        if min(middle - below[first], below[last] - middle) >= FEWEST:
            yield first, last


def _candidate(binned: Histogram, chosen: slice) -> BoundedLaw | None:
    """The likeliest power law of some bins, unless something speaks against it that needs no draws."""
    middles, counts = binned.middles[chosen], binned.counts[chosen]
    widths = np.diff(binned.edges)[chosen]
    law = likeliest(np.log(middles), widths, counts)
    if law is None or law.rate <= 0.0 or math.sqrt(law.total) * law.distance > FARTHEST:
        return None
    exponential = None if law.chance_of_curvature() < SIGNIFICANT else likeliest(middles / middles[-1], widths, counts)
    if exponential is None:
        return None
    ratio, chance = vuong(law.log_shares - exponential.log_shares, counts)
    return law if ratio > 0.0 and chance < CLEAR else None
