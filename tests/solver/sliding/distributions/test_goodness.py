"""Goodness of fit: even over [0, 1] for power laws, near 0 for what is none, and the same whenever it is asked for."""

import numpy as np

from solver.sliding.distributions.goodness import goodness_of_fit, power_law_sizes
from solver.sliding.distributions.power_law import Sizes, fitted_power_law, sorted_sizes


def goodness(sizes: Sizes, draws: int = 40) -> float:
    law = fitted_power_law(sizes)
    assert law is not None
    return goodness_of_fit(sizes, law, draws)


def test_power_laws_are_not_refused_more_often_than_chance_does() -> None:
    """Of 24 samples one in ten is below 0.1: more than 8 of them come by chance once in 2000 times."""
    for discrete in (False, True):
        found = [
            goodness(sorted_sizes(power_law_sizes(np.random.default_rng(seed), 400, 1.8, 2.0, discrete), discrete))
            for seed in range(24)
        ]
        assert sum(value < 0.1 for value in found) <= 8
        assert 0.3 < np.mean(found) < 0.8  # a half; the cut-off is chosen among few and leans up


def test_exponential_sizes_are_refused_where_no_cutoff_hides_them() -> None:
    rng = np.random.default_rng(4)
    sizes = sorted_sizes(1.0 + rng.exponential(1.0, 5000), False)
    law = fitted_power_law(sizes)
    assert law is not None
    assert goodness(sizes) < 0.1 or law.tail < 500  # a tail of a few hundred may pass


def test_the_same_sizes_have_the_same_goodness() -> None:
    sizes = sorted_sizes(power_law_sizes(np.random.default_rng(1), 500, 2.0, 1.0, False), False)
    assert goodness(sizes) == goodness(Sizes(sizes.values.copy(), False))
    assert np.isnan(goodness(sizes, draws=0))
