"""The effective number of independent numbers is n where none knows of another, and 1 where all say the same."""

import math

import numpy as np
import pytest
from choices import effective_number

DRAWN = np.random.default_rng(5).standard_normal((4000, 3))


def test_independent_numbers_all_count() -> None:
    """A correlation of 4000 samples is 0 ± 0.016."""
    assert effective_number(DRAWN) == pytest.approx(3.0, abs=0.01)


def test_numbers_that_rank_alike_count_as_one() -> None:
    """Whatever function of one number the others are, falling ones included."""
    one = DRAWN[:, 0]
    assert effective_number(np.column_stack((one, np.exp(one), -(one**3)))) == pytest.approx(1.0)


def test_two_pairs_count_as_two() -> None:
    assert effective_number(DRAWN[:, [0, 0, 1, 1]]) == pytest.approx(2.0, abs=0.01)


def test_what_is_missing_or_never_varies_does_not_count() -> None:
    samples = np.column_stack((DRAWN, np.full(len(DRAWN), 7.0)))
    samples[::2, 0] = np.nan
    assert effective_number(samples) == pytest.approx(3.0, abs=0.02)
    assert math.isnan(effective_number(samples[:, 3:]))
    assert math.isnan(effective_number(samples[:1]))
