"""The law that drew a sample is preferred; likelihood ratios are those of `powerlaw`, and laws are normalized."""

import math

import numpy as np
import powerlaw
import pytest

from nanoslip.solver.sliding.power_law import (
    LAWS,
    Comparison,
    PowerLaw,
    Sizes,
    comparisons,
    fitted_power_law,
    log_likelihoods,
    power_law_sizes,
    preferred,
    sorted_sizes,
    vuong,
)


def drawn(name: str, discrete: bool, count: int = 4000, seed: int = 1) -> Sizes:
    """A sample of a law from 1 on; whole numbers are rounded from continuous ones."""
    rng = np.random.default_rng(seed)
    if name == "power_law":
        return sorted_sizes(power_law_sizes(rng, count, 1.8, 1.0, discrete), discrete)
    values = {
        "exponential": lambda: 1.0 + rng.exponential(12.0, count),
        "lognormal": lambda: np.exp(2.0 + 0.5 * rng.standard_normal(count)),
        "truncated_power_law": lambda: _truncated(rng, count),
    }[name]()
    return sorted_sizes(np.maximum(np.round(values), 1.0) if discrete else values, discrete)


def _truncated(rng: np.random.Generator, count: int) -> np.ndarray:
    values = power_law_sizes(rng, 40 * count, 1.5, 1.0, False)
    return values[rng.random(len(values)) < np.exp(-values / 50.0)][:count]


def law_from(sizes: Sizes, cutoff: float) -> PowerLaw:
    """The power law of all sizes from a given cut-off on."""
    tail = sizes.values[sizes.values >= cutoff]
    exponent = 1.0 + len(tail) / np.log(tail / (cutoff - 0.5 * sizes.discrete)).sum()
    return PowerLaw(float(exponent), cutoff, len(tail), 0.0)


@pytest.mark.parametrize("discrete", [False, True])
@pytest.mark.parametrize("name", LAWS)
def test_the_law_that_drew_the_sizes_is_preferred(name: str, discrete: bool) -> None:
    """From a given cut-off on, where all of the law is seen. A cut power law is nearly a log-normal one of great width."""
    sizes = drawn(name, discrete)
    law = fitted_power_law(sizes) if name == "power_law" else law_from(sizes, 2.0)
    assert law is not None
    found, chance = preferred(comparisons(sizes, law))
    assert found == name
    assert (chance > 0.1) == (name == "power_law")


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("discrete", [False, True])
def test_ratios_agree_with_the_package_powerlaw(discrete: bool) -> None:
    """The same tail, thin enough for its densities not to underflow; to what its optimizers leave."""
    sizes = sorted_sizes(power_law_sizes(np.random.default_rng(2), 1500, 3.0, 1.0, discrete), discrete)
    law = fitted_power_law(sizes)
    assert law is not None
    scale = 1.0 if discrete else law.cutoff
    fit = powerlaw.Fit(sizes.values / scale, discrete=discrete, xmin=law.cutoff / scale, verbose=False)
    for rival in comparisons(sizes, law):
        ratio, chance = fit.distribution_compare("power_law", rival.name, normalized_ratio=False)
        assert rival.ratio == pytest.approx(ratio, abs=0.1)  # of a log-likelihood: chance moves by a few percent
        assert rival.chance == pytest.approx(chance, abs=0.1)


@pytest.mark.parametrize("cutoff", [1.0, 5.0])
@pytest.mark.parametrize("name", LAWS)
def test_laws_of_whole_numbers_sum_up_to_one(name: str, cutoff: float) -> None:
    """Over all numbers from the cut-off on. Fitted to one sample, the likelihoods are then summed over many numbers."""
    sizes = drawn("truncated_power_law", True)
    law = fitted_power_law(Sizes(sizes.values[sizes.values >= cutoff], True))
    assert law is not None
    numbers = np.arange(cutoff, 300.0)
    every = Sizes(np.sort(np.concatenate((sizes.values[sizes.values >= cutoff], numbers))), True)
    logs, _ = log_likelihoods(every, law._replace(cutoff=cutoff, tail=len(every.values)))
    present = np.unique(every.values) < 300.0
    total = np.exp(logs[name][present]).sum()
    beyond = {"power_law": (300.0 / cutoff) ** (1.0 - law.exponent)}.get(name, 0.02)
    assert 1.0 - 1.5 * beyond - 0.01 < total <= 1.0 + 1e-3


def test_without_a_better_rival_the_power_law_stays() -> None:
    near = (Comparison("exponential", 50.0, 1e-9), Comparison("lognormal", -0.4, 0.3))
    assert preferred(near) == ("power_law", 0.3)
    better = (*near, Comparison("truncated_power_law", -9.0, 1e-4))
    assert preferred(better) == ("truncated_power_law", 1e-4)


def test_vuong_of_a_few_differences() -> None:
    """1, 1 and -1: their sum is 1, their squared deviations from 1/3 sum up to 8/3."""
    ratio, chance = vuong(np.array([1.0, -1.0]), np.array([2, 1]))
    assert ratio == pytest.approx(1.0)
    assert chance == pytest.approx(math.erfc(1.0 / math.sqrt(16.0 / 3.0)))
    assert vuong(np.zeros(3), np.ones(3, int)) == (0.0, 1.0)
