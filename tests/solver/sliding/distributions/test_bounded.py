"""Laws between two bounds: hand-derived fits, their errors, and the limits in which others know the answer."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import brentq

from solver.sliding.distributions.bounded import BoundedLaw, likeliest
from solver.sliding.distributions.goodness import power_law_sizes
from solver.sliding.distributions.histogram import logarithmic_histogram
from solver.sliding.distributions.power_law import discrete_exponents
from solver.sliding.distributions.scaling import FARTHEST

K = np.arange(1.0, 41.0)
"""Whole numbers, each in a bin of its own."""


def fitted(counts: NDArray[np.int64], middles: NDArray[np.float64] = K) -> BoundedLaw:
    law = likeliest(np.log(middles), np.ones(len(middles)), counts)
    assert law is not None
    return law


def shares(exponent: float) -> NDArray[np.float64]:
    return np.asarray(K**-exponent / (K**-exponent).sum())


def test_of_the_numbers_one_and_two() -> None:
    """n_1/n_2 = 2^τ; the variance of ln k is p(1-p) ln²2."""
    law = fitted(np.array([300, 100]), np.array([1.0, 2.0]))
    assert law.rate == pytest.approx(math.log2(3.0), abs=1e-8)
    assert law.uncertainty == pytest.approx(1.0 / (math.log(2.0) * math.sqrt(400 * 0.75 * 0.25)), abs=1e-8)
    assert law.distance == pytest.approx(0.0, abs=1e-8)
    assert fitted(np.array([50, 50]), np.array([1.0, 2.0])).rate == pytest.approx(0.0, abs=1e-8)


def test_an_exponential_of_three_numbers() -> None:
    """Counts 16, 4, 1 fall by a factor of 4 from number to number."""
    law = likeliest(np.array([1.0, 2.0, 3.0]), np.ones(3), np.array([16, 4, 1]))
    assert law is not None
    assert law.rate == pytest.approx(math.log(4.0), abs=1e-8)


@pytest.mark.parametrize("exponent", [0.4, 1.0, 1.7, 3.5])
def test_continuous_sizes_solve_the_equation_of_the_truncated_pareto_law(exponent: float) -> None:
    """Mean of ln(x/a) = 1/s - L/(exp(sL) - 1) with s = τ - 1, L = ln(b/a): its root of sizes that are not binned."""
    rng, length = np.random.default_rng(3), math.log(1000.0)
    slope = exponent - 1.0 or 1e-12
    logs = -np.log1p(rng.random(5000) * np.expm1(-slope * length)) / slope
    found = logarithmic_histogram(np.exp(logs), discrete=False, per_decade=50)
    law = likeliest(np.log(found.middles), np.diff(found.edges), found.counts)
    assert law is not None
    bound = math.log(found.edges[-1] / found.edges[0])  # bins end beyond the largest size

    def off(s: float) -> float:
        return float(1.0 / s - bound / np.expm1(s * bound) - (logs - math.log(found.edges[0])).mean())

    exact = 1.0 + brentq(off, slope - 0.5001, slope + 0.5)
    assert abs(law.rate - exact) < 0.1 * law.uncertainty  # a size is known to its bin, 0.05 of the error was seen


def test_without_an_upper_bound_it_is_the_one_sided_fit() -> None:
    """Nothing of k^-2.5 lies beyond 10^9: the exponent of ζ(τ, k_min), to the width of bins."""
    sizes = power_law_sizes(np.random.default_rng(5), 4000, 2.5, 1.0, True)
    found = logarithmic_histogram(np.append(sizes, 1e9), discrete=True, per_decade=50)
    law = likeliest(np.log(found.middles), np.diff(found.edges), found.counts)
    assert law is not None
    one_sided = discrete_exponents(np.array([np.log(np.append(sizes, 1e9)).mean()]), np.ones(1))
    assert law.rate == pytest.approx(float(one_sided[0]), abs=2e-3)  # 0.08 of the standard error


@pytest.mark.parametrize("exponent", [-0.5, 0.5, 1.0, 2.5])
def test_errors_cover_the_exponent(exponent: float) -> None:
    """Of 400 samples 95 % within 1.96 standard errors: 3.5 standard deviations of that share are 0.04."""
    rng = np.random.default_rng(17)
    laws = [fitted(rng.multinomial(500, shares(exponent))) for _ in range(400)]
    off = np.array([(law.rate - exponent) / law.uncertainty for law in laws])
    assert abs(np.mean(np.abs(off) < 1.96) - 0.95) < 0.04
    assert abs(off.mean()) < 0.2


def test_chances_are_even_where_the_law_holds_and_none_where_it_bends() -> None:
    rng = np.random.default_rng(19)
    straight = [fitted(rng.multinomial(2000, shares(1.5))) for _ in range(100)]
    curvature = np.array([law.chance_of_curvature() for law in straight])
    goodness = np.array([law.goodness_of_fit(rng, 50) for law in straight])
    for chances in (curvature, goodness):
        assert 0.35 < chances.mean() < 0.65  # 5 standard deviations of a mean of 100
        assert 1 <= np.sum(chances < 0.1) <= 22
    bent = np.exp(-0.5 * (np.log(K) - 1.0) ** 2) / K
    law = fitted(rng.multinomial(2000, bent / bent.sum()))
    assert law.chance_of_curvature() < 1e-6
    assert law.goodness_of_fit(rng, 50) == 0.0


@pytest.mark.parametrize("steepness", [0.01, 1.0, 10.0, 100.0])
def test_no_more_than_a_tenth_of_samples_is_far(steepness: float) -> None:
    """√n times the distance of even bins in ln x, whatever the rate: within FARTHEST for nine of ten."""
    rng, statistic = np.random.default_rng(23), np.linspace(0.0, 1.0, 501)
    expected = np.exp(-steepness * statistic)
    far = 0
    for counts in rng.multinomial(2000, expected / expected.sum(), 300):
        law = likeliest(statistic, np.ones(501), counts)
        assert law is not None
        far += math.sqrt(2000) * law.distance > FARTHEST
    assert far <= 30


def test_sizes_in_one_bin_have_no_law() -> None:
    assert likeliest(np.log(K[:3]), np.ones(3), np.array([9, 0, 0])) is None
    assert likeliest(np.log(K[:3]), np.ones(3), np.array([0, 0, 9])) is None
