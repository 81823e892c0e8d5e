"""Logarithmic histograms: every size is counted once, and densities are those of the law that was drawn."""

import numpy as np
import pytest

from solver.sliding.distributions.goodness import power_law_sizes
from solver.sliding.distributions.histogram import logarithmic_histogram
from solver.sliding.distributions.power_law import survival


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
