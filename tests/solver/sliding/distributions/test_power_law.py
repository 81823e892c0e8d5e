"""Power laws of samples are found again, as `powerlaw` fits them; goodness and histograms keep what they promise."""

import math

import numpy as np
import powerlaw
import pytest

from nanoslip.solver.sliding.power_law import (
    LEAST_TAIL,
    PowerLaw,
    Sizes,
    density,
    discrete_exponents,
    fitted_power_law,
    goodness_of_fit,
    logarithmic_histogram,
    power_law_sizes,
    sorted_sizes,
    survival,
)

LAWS = [(False, 1.5, 1e-7), (False, 2.5, 3.0), (True, 1.5, 1.0), (True, 2.5, 1.0), (True, 2.0, 6.0)]


def sample(discrete: bool, exponent: float, cutoff: float, count: int, seed: int) -> Sizes:
    rng = np.random.default_rng(seed)
    return sorted_sizes(power_law_sizes(rng, count, exponent, cutoff, discrete), discrete)


def error_of(law: PowerLaw) -> float:
    """Standard error of the exponent of independent sizes from a given cut-off on; whole ones at 1 have a larger one."""
    return (law.exponent - 1.0) / math.sqrt(law.tail)


@pytest.mark.parametrize(("discrete", "exponent", "cutoff"), LAWS)
def test_the_exponent_of_the_sample_is_found(discrete: bool, exponent: float, cutoff: float) -> None:
    """Over 60 samples within the standard error of independent sizes; choosing the cut-off adds to it, a third was seen."""
    off = []
    for seed in range(60):
        law = fitted_power_law(sample(discrete, exponent, cutoff, 1000, seed))
        assert law is not None
        off.append((law.exponent - exponent) / error_of(law))
    assert (
        abs(np.mean(off)) < 0.6
    )  # 60 samples: 0.13 of chance; the chosen cut-off leans towards flatter or steeper tails
    assert 0.7 < np.std(off) < 2.0


@pytest.mark.parametrize("discrete", [False, True])
def test_the_cutoff_is_found_where_sizes_below_it_are_otherwise(discrete: bool) -> None:
    """Half of the sizes even below the cut-off, half a power law beyond: the break at 20 is found to a candidate."""
    rng = np.random.default_rng(3)
    low = rng.integers(1, 20, 3000).astype(float) if discrete else rng.uniform(1.0, 20.0, 3000)
    law = fitted_power_law(
        sorted_sizes(np.concatenate((low, power_law_sizes(rng, 3000, 2.2, 20.0, discrete))), discrete)
    )
    assert law is not None
    assert 17.0 < law.cutoff < 30.0
    assert abs(law.exponent - 2.2) < 3.0 * error_of(law)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(("discrete", "exponent", "cutoff"), LAWS)
def test_fits_agree_with_the_package_powerlaw(discrete: bool, exponent: float, cutoff: float) -> None:
    """The same tail: exponents to the tolerance of its optimizer, distances to one size (it compares at each size alone)."""
    sizes = sample(discrete, exponent, cutoff, 2000, 11)
    law = fitted_power_law(sizes)
    assert law is not None
    scale = 1.0 if discrete else law.cutoff
    other = powerlaw.Fit(sizes.values / scale, discrete=discrete, xmin=law.cutoff / scale, verbose=False).power_law
    assert law.exponent == pytest.approx(other.alpha, abs=2e-4)
    assert law.distance == pytest.approx(other.D, abs=1.0 / law.tail)


def test_the_discrete_exponent_is_the_likeliest() -> None:
    sizes = sample(True, 1.8, 2.0, 3000, 5)
    mean = np.log(sizes.values / 2.0).mean()
    found = float(discrete_exponents(np.array([mean]), np.array([2.0]))[0])

    def likelihood(exponent: float) -> float:
        share = survival(sizes.values, exponent, 2.0, True) - survival(sizes.values + 1.0, exponent, 2.0, True)
        return float(np.log(share).sum())

    best = likelihood(found)
    assert best > likelihood(found + 1e-3)
    assert best > likelihood(found - 1e-3)


def test_scale_does_not_matter() -> None:
    sizes = sample(False, 1.7, 1.0, 500, 2)
    one, other = fitted_power_law(sizes), fitted_power_law(Sizes(sizes.values * 1e-9, False))
    assert one is not None
    assert other is not None
    assert other.cutoff == pytest.approx(1e-9 * one.cutoff)
    assert (other.exponent, other.distance) == pytest.approx((one.exponent, one.distance), rel=1e-9)


def test_too_few_or_equal_sizes_have_no_power_law() -> None:
    assert fitted_power_law(sorted_sizes(np.arange(1.0, LEAST_TAIL), False)) is None
    assert fitted_power_law(sorted_sizes(np.full(1000, 3.0), True)) is None
    assert fitted_power_law(sorted_sizes(np.empty(0), True)) is None
    kept = sorted_sizes(np.array([0.0, 3.0, np.nan, -1.0, 2.0]), False)
    np.testing.assert_array_equal(kept.values, [2.0, 3.0])


@pytest.mark.parametrize("exponent", [1.2, 2.0, 3.5])
@pytest.mark.parametrize("cutoff", [1.0, 7.0])
def test_drawn_whole_sizes_have_the_laws_shares(exponent: float, cutoff: float) -> None:
    """Also beyond the numbers whose shares are tabled: of 2e5 sizes, shares to four standard deviations."""
    drawn = power_law_sizes(np.random.default_rng(8), 200_000, exponent, cutoff, True)
    at = cutoff + np.array([1.0, 2.0, 10.0, 900.0, 5000.0, 1e5])
    expected = survival(at, exponent, cutoff, True)
    seen = np.array([(drawn >= number).mean() for number in at])
    assert (np.abs(seen - expected) <= 4.0 * np.sqrt(expected / len(drawn)) + 1e-5).all()
    assert drawn.min() == cutoff
    np.testing.assert_array_equal(drawn, np.floor(drawn))


@pytest.mark.parametrize("discrete", [False, True])
def test_densities_are_what_the_shares_above_fall_by(discrete: bool) -> None:
    """Of whole numbers from one to the next; of continuous ones over a ten-thousandth, to its square."""
    values = np.array([3.0, 4.0, 9.0, 200.0])
    wide = np.ones(4) if discrete else 1e-4 * values
    low, high = (values, values + 1.0) if discrete else (values - wide / 2.0, values + wide / 2.0)
    fallen = survival(low, 1.7, 3.0, discrete) - survival(high, 1.7, 3.0, discrete)
    np.testing.assert_allclose(density(values, 1.7, 3.0, discrete), fallen / wide, rtol=1e-7)


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


@pytest.mark.parametrize("discrete", [False, True])
@pytest.mark.parametrize("cutoff", [1.0, 4.0])
def test_every_size_is_in_one_bin_and_densities_are_the_laws(discrete: bool, cutoff: float) -> None:
    sizes = power_law_sizes(np.random.default_rng(7), 50_000, 2.0, cutoff, discrete)
    found = logarithmic_histogram(np.append(sizes, [0.0, np.nan]), discrete=discrete)
    assert found.counts.sum() == len(sizes)
    assert found.density @ np.diff(found.edges) == pytest.approx(1.0)
    assert (np.diff(found.edges) > 0.0).all()
    ends = np.maximum(np.ceil(found.edges) if discrete else found.edges, cutoff)
    shares = -np.diff(survival(ends, 2.0, cutoff, discrete))
    # Five standard deviations of a count.
    assert (np.abs(found.counts - len(sizes) * shares) < 5.0 * np.sqrt(len(sizes) * shares) + 5.0).all()


def test_bins_of_equal_ratio_are_the_same_for_all_samples() -> None:
    one = logarithmic_histogram(np.array([1.1, 80.0]), discrete=False)
    other = logarithmic_histogram(np.array([12.0, 13.0]), discrete=False)
    assert {round(edge, 9) for edge in other.edges} <= {round(edge, 9) for edge in one.edges}
    np.testing.assert_allclose(one.middles**2, one.edges[1:] * one.edges[:-1])


def test_middles_of_whole_numbers_lie_among_them() -> None:
    """A bin of one number has its middle there, one of 10 to 12 at √120."""
    found = logarithmic_histogram(np.array([1, 2, 3, 11]), discrete=True)
    np.testing.assert_allclose(found.middles[:3], [1.0, 2.0, 3.0])
    last = int(np.searchsorted(found.edges, 11.0)) - 1
    numbers = found.edges[last] + 0.5, found.edges[last + 1] - 0.5
    assert found.middles[last] == pytest.approx(np.sqrt(numbers[0] * numbers[1]))


def test_without_sizes_there_are_no_bins() -> None:
    assert len(logarithmic_histogram(np.zeros(5), discrete=True).counts) == 0


LEAST, MOST = 5e-324, np.finfo(float).max


@pytest.mark.parametrize("per_decade", [8, 50])
@pytest.mark.parametrize(
    "sizes",
    [[LEAST], [LEAST, 1e-310, 1.0], [1e-320, 1.5e-320, 2e-320], [1.0, MOST], [MOST], [LEAST, MOST], [0.5 * MOST, MOST]],
)
def test_the_smallest_and_the_largest_numbers_are_counted_without_complaint(
    sizes: list[float], per_decade: int
) -> None:
    for discrete in (False, True) if min(sizes) >= 1.0 else (False,):
        found = logarithmic_histogram(np.array(sizes), discrete=discrete, per_decade=per_decade)
        assert found.counts.sum() == len(sizes)
        assert (np.diff(found.edges) > 0.0).all()
        assert (found.edges > 0.0).all()
        assert np.isfinite([found.density, found.middles]).all()
