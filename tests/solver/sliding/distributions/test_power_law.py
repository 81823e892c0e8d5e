"""Power laws are recovered from samples of known exponent and cut-off, to their standard error; and as `powerlaw` fits them."""

import numpy as np
import powerlaw
import pytest

from solver.sliding.distributions.goodness import power_law_sizes
from solver.sliding.distributions.power_law import (
    LEAST_TAIL,
    Sizes,
    discrete_exponents,
    fitted_power_law,
    sorted_sizes,
    survival,
)

LAWS = [(False, 1.5, 1e-7), (False, 2.5, 3.0), (True, 1.5, 1.0), (True, 2.5, 1.0), (True, 2.0, 6.0)]


def sample(discrete: bool, exponent: float, cutoff: float, count: int, seed: int) -> Sizes:
    rng = np.random.default_rng(seed)
    return sorted_sizes(power_law_sizes(rng, count, exponent, cutoff, discrete), discrete)


@pytest.mark.parametrize(("discrete", "exponent", "cutoff"), LAWS)
def test_the_exponent_is_found_within_its_standard_error(discrete: bool, exponent: float, cutoff: float) -> None:
    """Over 60 samples the errors are the standard error's size: choosing the cut-off adds to them, a third was seen."""
    off = []
    for seed in range(60):
        law = fitted_power_law(sample(discrete, exponent, cutoff, 1000, seed))
        assert law is not None
        off.append((law.exponent - exponent) / law.uncertainty)
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
    assert abs(law.exponent - 2.2) < 3.0 * law.uncertainty


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
