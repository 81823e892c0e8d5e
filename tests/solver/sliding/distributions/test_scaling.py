"""The scaling range is where sizes were drawn from a power law, and next to nothing of what is none."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from solver.sliding.distributions.bounded import BoundedLaw, likeliest
from solver.sliding.distributions.goodness import power_law_sizes
from solver.sliding.distributions.power_law import fitted_power_law, sorted_sizes
from solver.sliding.distributions.scaling import ENDS, FEWEST, MOST_BINS, NOWHERE, ScalingRange, scaling_range

Draw = Callable[[np.random.Generator], NDArray[np.float64]]
DRAWS = 40


def found_in(sizes: NDArray[np.float64], discrete: bool) -> ScalingRange:
    return scaling_range(sorted_sizes(sizes, discrete), DRAWS) or NOWHERE


def bounded(rng: np.random.Generator, count: int, exponent: float, last: float, discrete: bool) -> NDArray[np.float64]:
    """So many sizes of a power law from 1 to `last`."""
    drawn = power_law_sizes(rng, 40 * count, exponent, 1.0, discrete)
    return drawn[drawn <= last][:count]


@pytest.mark.parametrize("discrete", [False, True])
def test_bounds_and_exponent_of_a_bounded_law_are_found(discrete: bool) -> None:
    """Of 12 samples from 1 to 300: the errors are the standard error's size, and the range is two decades at the median."""
    ranges = [
        found_in(bounded(np.random.default_rng(seed), 2000, 1.6, 300.0, discrete), discrete) for seed in range(12)
    ]
    off = np.array([(found.exponent - 1.6) / found.exponent_uncertainty for found in ranges])
    assert np.median([found.decades for found in ranges]) > 2.0
    assert max(found.last for found in ranges) < 310.0
    assert abs(off.mean()) < 1.0
    assert np.sqrt(np.mean(off**2)) < 2.0  # choosing the range adds to the error of one that is given


@pytest.mark.parametrize("discrete", [False, True])
def test_a_hump_beyond_is_left_out(discrete: bool) -> None:
    """Every fourth size from a hump at 300: the range ends below it, where the one-sided fit has no exponent of the law."""
    rng = np.random.default_rng(5)
    hump = 300.0 * np.exp(0.15 * rng.standard_normal(1000))
    sizes = np.concatenate((bounded(rng, 3000, 1.6, 150.0, discrete), np.round(hump) if discrete else hump))
    found, tail = found_in(sizes, discrete), fitted_power_law(sorted_sizes(sizes, discrete))
    assert found.decades > 1.5
    assert 50.0 < found.last < 250.0
    assert abs(found.exponent - 1.6) < 2.5 * found.exponent_uncertainty
    assert tail is not None
    assert abs(tail.exponent - 1.6) > 10.0 * tail.uncertainty


NONE: dict[str, tuple[bool, Draw]] = {
    "exponential": (False, lambda rng: rng.exponential(1.0, 2000)),
    "geometric": (True, lambda rng: rng.geometric(0.05, 2000).astype(float)),
    "log-normal": (False, lambda rng: np.exp(rng.standard_normal(2000))),
    "narrow log-normal": (False, lambda rng: np.exp(0.5 * rng.standard_normal(2000))),
    "whole log-normal": (True, lambda rng: np.round(np.exp(3.0 + rng.standard_normal(2000)))),
}


def longest_of(name: str, seeds: range) -> float:
    """Decades of the longest range of some samples."""
    discrete, draw = NONE[name]
    return max(found_in(draw(np.random.default_rng(seed)), discrete).decades for seed in seeds)


@pytest.mark.parametrize("name", NONE)
def test_what_is_no_power_law_has_no_decade_of_one(name: str) -> None:
    assert longest_of(name, range(2)) < 1.0


@pytest.mark.slow
@pytest.mark.parametrize("name", NONE)
def test_it_has_none_by_chance_either(name: str) -> None:
    assert longest_of(name, range(2, 22)) < 1.1  # a log-normal this broad is straight to chance over 0.9 of a decade


@pytest.mark.parametrize("discrete", [False, True])
def test_a_law_without_bounds_has_no_end(discrete: bool) -> None:
    """Half of the decades of its sizes at least: the larger half of a range needs FEWEST of them."""
    sizes = power_law_sizes(np.random.default_rng(9), 3000, 1.5, 1.0, discrete)
    found = found_in(sizes, discrete)
    assert found.decades > 0.5 * np.log10(sizes.max())
    assert abs(found.exponent - 1.5) < 3.0 * found.exponent_uncertainty
    assert found.goodness >= 0.1


def test_a_density_that_rises_is_none() -> None:
    """Density 2x: a power law of τ = -1 in all its decades."""
    assert found_in(np.sqrt(np.random.default_rng(2).random(2000)), False).events == 0


def test_the_unit_does_not_matter() -> None:
    sizes = bounded(np.random.default_rng(4), 1500, 1.8, 200.0, False)
    one, other = found_in(sizes, False), found_in(1e-9 * sizes, False)
    assert one.decades > 1.0
    assert other.exponent == pytest.approx(one.exponent, abs=one.exponent_uncertainty)
    assert other.first == pytest.approx(1e-9 * one.first, rel=0.3)


def test_the_same_sizes_have_the_same_range_and_few_have_none() -> None:
    sizes = bounded(np.random.default_rng(4), 500, 1.8, 200.0, True)
    assert found_in(sizes, True) == found_in(sizes[::-1], True) != NOWHERE
    assert scaling_range(sorted_sizes(sizes, True), 0) is None
    assert scaling_range(sorted_sizes(sizes[: 2 * FEWEST - 1], True), DRAWS) is None
    assert scaling_range(sorted_sizes(np.full(500, 3.0), True), DRAWS) is None
    assert scaling_range(sorted_sizes(np.full(500, 3.0), False), DRAWS) is None


@pytest.mark.parametrize("decades", [6, 60, 600])
def test_the_work_is_bounded_however_much_sizes_span(decades: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Sizes that bend all the way: every interval is looked at, in a bounded number of bins."""
    bins: list[int] = []

    def counting(statistic: NDArray[np.float64], *rest: NDArray[np.float64]) -> BoundedLaw | None:
        bins.append(len(statistic))
        return likeliest(statistic, *rest)

    monkeypatch.setattr("solver.sliding.distributions.scaling.likeliest", counting)
    place = np.random.default_rng(3).beta(2.0, 2.0, 4000) - 0.5
    found_in(10.0 ** (decades * place), False)
    assert len(bins) <= ENDS * (ENDS - 1)  # two laws for each interval
    assert max(bins) <= MOST_BINS + 2


def test_a_power_law_over_all_numbers_there_are_is_found_without_complaint() -> None:
    sizes = 10.0 ** np.random.default_rng(1).uniform(-320.0, 308.0, 3000)
    found = found_in(sizes, False)
    assert found.exponent == pytest.approx(1.0, abs=1e-3)
    assert 300.0 < found.decades < 632.0
