"""What counts as the same: bits, rounding, the uncertainty that two means state. And what never does."""

import numpy as np
import pytest

from nanoslip.study.dataset.compare import (
    ROUNDING,
    STANDARD_ERRORS,
    Difference,
    Verdict,
    compared,
    identical,
    within_uncertainty,
    worst,
)

VALUES = np.array([1.0, -2.0, np.nan, np.inf, 0.0])


def with_value(place: int, value: float) -> np.ndarray:
    changed = VALUES.copy()
    changed[place] = value
    return changed


def test_equal_values_have_the_same_bits_and_nan_is_nan():
    assert compared("x", VALUES, VALUES.copy()).verdict is Verdict.IDENTICAL
    assert identical(np.array(-np.nan), np.array(np.nan))
    assert identical(np.array(["a"], object), np.array(["a"], object))
    assert compared("none", np.array([]), np.array([])).verdict is Verdict.IDENTICAL


@pytest.mark.parametrize(("place", "value"), [(0, np.nextafter(1.0, 2.0)), (4, -0.0), (1, -2.0 - 0.9 * 2 * ROUNDING)])
def test_rounding_is_within_tolerance_and_is_not_the_same_bits(place, value):
    found = compared("x", VALUES, with_value(place, value))
    assert found.verdict is Verdict.WITHIN
    assert found.size <= ROUNDING


@pytest.mark.parametrize(
    ("place", "value"),
    [(0, 1.0 + 2.1 * ROUNDING), (2, 1.0), (0, np.nan), (3, -np.inf), (3, 1.0), (0, np.inf), (4, 1e-8)],
)
def test_more_than_rounding_is_different_and_named(place, value):
    found = compared("x", VALUES, with_value(place, value))
    assert found.verdict is Verdict.DIFFERENT
    assert str(found).startswith("x")


@pytest.mark.parametrize(
    ("kept", "again"),
    [
        (np.array([1, 2]), np.array([1, 3])),
        (np.array(10**15), np.array(10**15 + 1)),
        (np.array(["completed"], object), np.array(["crashed"], object)),
        (np.array([1.0]), np.array([1.0, 2.0])),
        (np.array([1.0]), np.array(["a"], object)),
    ],
)
def test_whole_numbers_texts_and_shapes_have_no_rounding(kept, again):
    assert compared("x", kept, again).verdict is Verdict.DIFFERENT


def test_the_scale_is_the_variables_and_zero_has_none():
    kept, again = np.array([1e-12]), np.array([2e-12])
    assert compared("x", kept, again).verdict is Verdict.DIFFERENT
    assert compared("x", kept, again, scale=1.0).verdict is Verdict.WITHIN
    assert compared("x", kept, np.array([0.0])).verdict is Verdict.DIFFERENT


def test_means_agree_within_their_combined_errors_and_missing_ones_agree():
    three, four = np.array([3.0]), np.array([4.0])
    zero, nan = np.array([0.0]), np.array([np.nan])
    assert within_uncertainty(zero, np.array([0.99 * 5.0 * STANDARD_ERRORS]), (three, four))
    assert not within_uncertainty(zero, np.array([1.01 * 5.0 * STANDARD_ERRORS]), (three, four))
    assert within_uncertainty(nan, nan, (nan, nan))
    assert not within_uncertainty(zero, nan, (three, four))


def test_the_verdict_on_several_is_the_worst():
    assert worst([]) is Verdict.IDENTICAL
    assert (
        worst([Difference("a", verdict, 0.0) for verdict in (Verdict.WITHIN, Verdict.DIFFERENT, Verdict.IDENTICAL)])
        == 2
    )
