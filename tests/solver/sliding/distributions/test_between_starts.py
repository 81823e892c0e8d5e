"""The ± of an exponent of a record's events is to hold from start to start; where there is no power law none is stated."""

import math
from itertools import pairwise

import numpy as np
import pytest

from solver.sliding.distributions.between_starts import STRETCHES, uncertainty_of_tail
from solver.sliding.distributions.goodness import power_law_sizes
from solver.sliding.distributions.power_law import PowerLaw, fitted_power_law, sorted_sizes
from solver.sliding.distributions.record import event_distributions
from solver.sliding.plateau import plateau_of
from tests.synthetic import noisy_record


def fit(sizes: np.ndarray, discrete: bool = False) -> PowerLaw:
    law = fitted_power_law(sorted_sizes(sizes, discrete))
    assert law is not None
    return law


def test_of_one_power_law_it_is_hardly_more_than_the_fits_own() -> None:
    sizes = power_law_sizes(np.random.default_rng(2), 3000, 1.8, 1.0, False)
    law = fit(sizes)
    found = uncertainty_of_tail(sizes, False, law.exponent, law.uncertainty)
    assert law.uncertainty <= found < 5.0 * law.uncertainty  # a cut-off that wanders costs three


@pytest.mark.parametrize("discrete", [True, False])
def test_twice_it_reaches_from_one_stretch_of_a_wandering_record_to_another(discrete: bool) -> None:
    """An exponent that wanders from 1.6 to 2.4 from stretch to stretch: four times as many events are four records."""
    rng = np.random.default_rng(7)
    found = []
    for _ in range(12):
        parts = [power_law_sizes(rng, 50, tau, 1.0, discrete) for tau in rng.uniform(1.6, 2.4, STRETCHES)]
        sizes = np.concatenate(parts)
        law = fit(sizes, discrete)
        found.append((law.exponent, uncertainty_of_tail(sizes, discrete, law.exponent, law.uncertainty)))
    held = [abs(one[0] - other[0]) <= 2.0 * math.hypot(one[1], other[1]) for one, other in pairwise(found)]
    assert sum(held) >= 10  # of eleven


def test_the_same_sizes_have_the_same_and_a_bound_has_none() -> None:
    sizes = power_law_sizes(np.random.default_rng(2), 400, 1.8, 1.0, False)
    assert uncertainty_of_tail(sizes, False, 1.8, 0.1) == uncertainty_of_tail(sizes, False, 1.8, 0.1)
    assert math.isnan(uncertainty_of_tail(sizes, False, math.nan, math.nan))


def test_where_the_goodness_refuses_a_power_law_its_exponent_has_no_uncertainty() -> None:
    """Steps of an exponential distribution."""
    record = noisy_record(events=3000)
    found = event_distributions(record, plateau_of(record), draws=20)
    for size in ("step", "drop", "slips"):
        exponent, error, goodness = (
            getattr(found, f"{size}_{name}") for name in ("exponent", "exponent_uncertainty", "goodness")
        )
        assert math.isnan(error) == (math.isnan(exponent) or goodness < 0.1)
