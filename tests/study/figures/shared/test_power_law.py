"""A power law is found again; its interval holds the true exponent as often as it says, whatever makes points scatter."""

import numpy as np
import pytest
from power_law import PowerLaw, fit_power_law
from scipy import stats

TRIES = 400
HELD = (0.917, 0.983)
"""95 % within three standard errors of a binomial of `TRIES`, 1.1 %."""
X = 2.0 ** np.arange(5, 12)


def test_an_exact_law_is_found_exactly() -> None:
    x = np.array([32.0, 64.0, 128.0, 256.0])
    law = fit_power_law(x, 3.0 * x**-1.2)
    assert law.exponent == pytest.approx(-1.2, rel=1e-12)
    assert law.factor == pytest.approx(3.0, rel=1e-10)
    assert law.exponent_interval < 1e-6  # rounding of a perfect fit
    assert law.at(x) == pytest.approx(3.0 * x**-1.2, rel=1e-10)


def test_without_errors_it_is_ordinary_least_squares() -> None:
    y = X**-0.5 * np.exp(0.1 * np.random.default_rng(3).standard_normal(len(X)))
    law, ordinary = fit_power_law(X, y), stats.linregress(np.log(X), np.log(y))
    assert law.exponent == pytest.approx(ordinary.slope, rel=1e-9)
    assert law.exponent_error == pytest.approx(ordinary.stderr, rel=1e-9)


def test_with_errors_beyond_the_scatter_each_point_has_the_weight_of_its_own() -> None:
    """What is left is zero, so only the stated errors count: 1/√Σ w (ln x - mean)²."""
    errors = np.linspace(0.02, 0.2, len(X))
    law, (slope, covariance) = fit_power_law(X, X**-0.5, errors * X**-0.5), _polyfit(errors)
    assert law.exponent == pytest.approx(slope, rel=1e-9)
    assert law.exponent_error == pytest.approx(covariance, rel=1e-6)
    assert law.misfit < 1e-9


def _polyfit(errors: np.ndarray) -> tuple[float, float]:
    """Slope and its standard error as numpy's weighted fit has them."""
    line, covariance = np.polyfit(np.log(X), -0.5 * np.log(X), 1, w=1.0 / errors, cov="unscaled")
    return float(line[0]), float(covariance[0, 0] ** 0.5)


@pytest.mark.parametrize(("between", "misfit"), [(0.0, 0.1), (0.2, 0.1)])
def test_nineteen_of_twenty_intervals_hold_the_exponent(between: float, misfit: float) -> None:
    """Scatter of the law, or of eight members and of the law; members' errors are read off the members."""
    found = [_tried(seed, between, misfit) for seed in range(TRIES)]
    held = np.mean([abs(law.exponent + 1.1) <= law.exponent_interval for law in found])
    assert HELD[0] < held < HELD[1]


def test_intervals_hold_the_exponent_where_only_members_scatter() -> None:
    """Misfit is never negative, so intervals are a little wider than they need to be."""
    laws = [_tried(seed, between=0.2, misfit=0.0) for seed in range(TRIES)]
    assert HELD[0] < np.mean([abs(law.exponent + 1.1) <= law.exponent_interval for law in laws]) < 0.995


def _tried(seed: int, between: float, misfit: float) -> PowerLaw:
    """A fit to means of eight members with this standard deviation of ln y between them, about a law with this misfit."""
    random = np.random.default_rng(seed)
    law = X**-1.1 * np.exp(misfit * random.standard_normal(len(X)))
    members = law * np.exp(between * random.standard_normal((8, len(X))))
    return fit_power_law(X, members.mean(axis=0), stats.sem(members))


def test_confidence_of_a_fall_is_that_of_one_side() -> None:
    law = PowerLaw(-0.1, 0.1 / stats.t.ppf(0.975, 5), 5, 1.0, 0.0)
    assert law.exponent_interval == pytest.approx(0.1)
    assert law.confidence_of_fall() == pytest.approx(0.975)
    assert PowerLaw(0.0, 0.1, 5, 1.0, 0.0).confidence_of_fall() == pytest.approx(0.5)


def test_two_points_say_nothing_of_confidence() -> None:
    with pytest.raises(ValueError, match="2 points"):
        fit_power_law(np.array([1.0, 2.0]), np.array([1.0, 2.0]))
