"""A power law is found again; its interval holds the true exponent as often as it says."""

import numpy as np
import pytest

from study.figures.shared.power_law import fit_power_law


def test_an_exact_law_is_found_exactly() -> None:
    x = np.array([32.0, 64.0, 128.0, 256.0])
    law = fit_power_law(x, 3.0 * x**-1.2)
    assert law.exponent == pytest.approx(-1.2, rel=1e-12)
    assert law.factor == pytest.approx(3.0, rel=1e-10)
    assert law.exponent_interval < 1e-6  # rounding of a perfect fit
    assert law.at(x) == pytest.approx(3.0 * x**-1.2, rel=1e-10)


def test_nineteen_of_twenty_intervals_hold_the_exponent() -> None:
    """2000 tries of five points: 95 % within three standard errors of a binomial, 0.5 %."""
    random, x = np.random.default_rng(7), 2.0 ** np.arange(5, 10)
    held = 0
    for _ in range(2000):
        law = fit_power_law(x, x**-1.1 * np.exp(0.1 * random.standard_normal(len(x))))
        held += abs(law.exponent + 1.1) <= law.exponent_interval
    assert 0.935 < held / 2000 < 0.965


def test_two_points_say_nothing_of_confidence() -> None:
    with pytest.raises(ValueError, match="2 points"):
        fit_power_law(np.array([1.0, 2.0]), np.array([1.0, 2.0]))
