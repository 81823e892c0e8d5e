"""The distribution of event sizes in one value: the power law of its tail, the law to prefer there, and its scaling range."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solver.sliding.distributions.comparison import SIGNIFICANT, Comparison, comparisons, preferred
from solver.sliding.distributions.goodness import DRAWS, goodness_of_fit
from solver.sliding.distributions.power_law import EXPONENTS, fitted_power_law, sorted_sizes
from solver.sliding.distributions.scaling import ScalingRange, scaling_range
from solver.view import OneLine, with_error

MEAN_FIELD = 1.5
"""Exponent of avalanche sizes where every node loads all others alike (mean field, a critical branching process)."""
GUTENBERG_RICHTER = 5.0 / 3.0
"""Exponent of the released moment, or energy, where magnitudes follow Gutenberg and Richter's law with b = 1: 1 + 2b/3."""


@dataclass(frozen=True, slots=True, repr=False)
class SizeDistribution(OneLine):
    """How sizes are distributed; what too few sizes cannot say is NaN, and `preferred` and `scaling` None.

    Reference lines: MEAN_FIELD for slips, GUTENBERG_RICHTER for energies.
    """

    count: int
    """Sizes above 0."""
    mean: float
    largest: float
    exponent: float
    """τ of the density x^-τ from the cut-off on; NaN at the bounds of what is looked for, EXPONENTS."""
    exponent_uncertainty: float
    """Standard error of τ with the cut-off given, of independent sizes."""
    cutoff: float
    """Size from which on the power law is nearest to the sizes."""
    tail: int
    """Sizes from the cut-off on."""
    distance: float
    """Of Kolmogorov and Smirnov, between sizes and power law from the cut-off on."""
    goodness: float
    """Share of samples of the power law that are further from their fit: below 0.1 it is no power law."""
    preferred: str | None
    """One of comparison.LAWS."""
    preferred_chance: float
    """Probability that chance decides that preference; see comparison.preferred."""
    comparisons: tuple[Comparison, ...]
    """Every rival against the power law."""
    scaling: ScalingRange | None
    """The longest interval that a power law describes; None where there is none."""

    def _facts(self) -> Iterator[str]:
        yield f"{self.count} sizes to {self.largest:.4g}"
        if self.tail:
            found = with_error(self.exponent, self.exponent_uncertainty)
            yield f"exponent {found if math.isfinite(self.exponent) else 'at a bound'} from {self.cutoff:.4g} on"
            yield f"goodness {self.goodness:.2g}{', no power law' if self.goodness < SIGNIFICANT else ''}"
        yield f"preferred: {self.preferred or 'none'}"


def size_distribution(
    sizes: NDArray[np.float64] | NDArray[np.int64], *, discrete: bool, draws: int = DRAWS
) -> SizeDistribution:
    """The distribution of sizes, of one record or of many put together, in any order; those not above 0 are left out.

    discrete: whole numbers, such as slips. draws: samples for the goodness of fit; of 0 it is NaN, and no scaling range is found.
    """
    sample = sorted_sizes(sizes, discrete)
    count, law = len(sample.values), fitted_power_law(sample)
    mean = float(sample.values.mean()) if count else math.nan
    largest = float(sample.values[-1]) if count else math.nan
    if law is None:
        nothing = (math.nan, math.nan, math.nan, 0, math.nan, math.nan, None, math.nan, (), None)
        return SizeDistribution(count, mean, largest, *nothing)
    rivals = comparisons(sample, law)
    goodness = goodness_of_fit(sample, law, draws)
    scaling = scaling_range(sample, draws)
    if not EXPONENTS[0] < law.exponent < EXPONENTS[1]:  # a bound is no measurement
        law = law._replace(exponent=math.nan, uncertainty=math.nan)
    return SizeDistribution(count, mean, largest, *law, goodness, *preferred(rivals), rivals, scaling)
