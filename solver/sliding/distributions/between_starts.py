"""What one record knows of the exponents of its sizes, as estimates of their means over starts.

The error of a fit takes events as independent and its cut-off, or its range, as given: twice that holds in a third of all starts.
Events of a record depend on each other, and another cut-off may be as good. Of tails the fit is repeated, cut-off and all, with
stretches of the record drawn anew, as many as there are (Künsch, Annals of Statistics 17, 1989). What is left open by the choice
of a scaling range is a measured multiple. Against the mean of 8 starts of 45 cases, twice the uncertainty held in 95 % of 206
tails that are no bad power law and in 94 % of 988 ranges.
"""

import math
from typing import Final

import numpy as np

from solver.sliding.distributions.power_law import Vector, fitted_power_law, sorted_sizes

STRETCHES: Final = 32
"""Of a record, of which as many are drawn."""
REPEATS: Final = 24
"""Fits of stretches drawn anew: their scatter is then known to a seventh."""
BY_RANGE: Final = 4.0
"""By how much more exponents of scaling ranges differ between starts than the errors of their fits say."""


def uncertainty_of_tail(sizes: Vector, discrete: bool, exponent: float, error: float) -> float:
    """Standard deviation between starts of the exponent of the largest sizes; NaN where it is not known.

    sizes: of the events in turn, (e,). error: of the fit. The seed is the number of sizes.
    """
    if math.isnan(exponent):
        return math.nan
    stretches = np.array_split(sizes, STRETCHES)
    rng = np.random.default_rng([len(sizes), REPEATS])
    squares = []
    for _ in range(REPEATS):
        drawn = np.concatenate([stretches[number] for number in rng.integers(0, STRETCHES, STRETCHES)])
        law = fitted_power_law(sorted_sizes(drawn, discrete))
        if law is not None:
            squares.append((law.exponent - exponent) ** 2)
    scatter = math.sqrt(sum(squares) / len(squares)) if squares else 0.0
    return max(scatter, error)
