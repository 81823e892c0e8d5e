"""Logarithmic histograms of event sizes: densities that cover decades."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solver.sliding.distributions.power_law import sorted_sizes

Vector = NDArray[np.float64]

PER_DECADE = 8
"""Bins in a decade."""
LARGEST = np.finfo(np.float64).max


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
    sizes: NDArray[np.float64] | NDArray[np.int64], *, discrete: bool, per_decade: int = PER_DECADE
) -> Histogram:
    """The histogram of the sizes above 0; without any it has no bins.

    Ends of bins are powers of 10^(1/per_decade), the same for all samples; of whole numbers they are rounded up to one half
    below a number, and bins without a number are left out.
    """
    values = sorted_sizes(sizes, discrete).values
    if not len(values):
        return Histogram(np.empty(0), np.empty(0, np.int64), np.empty(0), np.empty(0))
    edges = _edges(values, per_decade, discrete)
    below = np.searchsorted(values, edges, side="left")
    below[-1] = len(values)
    counts, inwards = np.diff(below), 0.5 * discrete
    middles = np.sqrt(edges[:-1] + inwards) * np.sqrt(edges[1:] - inwards)
    with np.errstate(over="ignore"):  # bins among the smallest numbers are narrower than one over the largest
        density = np.minimum(counts / len(values) / np.diff(edges), LARGEST)
    return Histogram(edges, counts, density, middles)


def _edges(values: Vector, per_decade: int, discrete: bool) -> Vector:
    """Ends of bins, rising and above 0, also where sizes are the smallest or the largest numbers there are."""
    first, last = np.floor(np.log10(values[[0, -1]]) * per_decade).astype(int)
    with np.errstate(over="ignore"):
        edges = np.minimum(10.0 ** (np.arange(first, last + 2) / per_decade), LARGEST)
    if not discrete:
        edges[0], edges[-1] = min(edges[0], values[0]), max(edges[-1], np.nextafter(values[-1], LARGEST))
        edges = np.unique(edges)
        return edges if edges[0] > 0.0 else np.unique(np.append(edges[1:], values[0]))
    edges = np.unique(np.ceil(edges - 1e-9) - 0.5)
    return edges if edges[-1] >= values[-1] else np.append(edges, values[-1] + 0.5)
