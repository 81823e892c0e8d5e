"""Logarithmic histograms of event sizes: densities that cover decades."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solver.sliding.distributions.power_law import sorted_sizes

Vector = NDArray[np.float64]

PER_DECADE = 8
"""Bins in a decade."""


class Histogram(NamedTuple):
    """Sizes counted in bins of equal ratio."""

    edges: Vector
    """(b + 1,) ends of the bins."""
    counts: NDArray[np.int64]
    """(b,) sizes in each; an upper end belongs to the next bin."""
    density: Vector
    """(b,) share of all sizes per unit of size; of whole numbers, per number in the bin."""
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
    first, last = np.floor(np.log10(values[[0, -1]]) * per_decade).astype(int)
    edges = 10.0 ** (np.arange(first, last + 2) / per_decade)
    if discrete:
        edges = np.unique(np.ceil(edges - 1e-9) - 0.5)
    else:
        edges[0], edges[-1] = min(edges[0], values[0]), max(edges[-1], np.nextafter(values[-1], np.inf))
    if discrete and edges[-1] < values[-1]:
        edges = np.append(edges, values[-1] + 0.5)
    counts = np.diff(np.searchsorted(values, edges, side="left"))
    inwards = 0.5 * discrete
    middles = np.sqrt(edges[:-1] + inwards) * np.sqrt(edges[1:] - inwards)
    return Histogram(edges, counts, counts / (len(values) * np.diff(edges)), middles)
