"""Sizes of events are what a record's columns say, rounding is none, and correlations are Spearman's."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import spearmanr

from nanoslip.solver.sliding.sizes import DISCRETE, event_sizes, pooled, rank_correlation
from tests.synthetic import LOAD, noisy_record, record_from


def test_sizes_are_read_off_the_columns() -> None:
    record = record_from([1e-6, 2e-6, 4e-6], [1e-8, 3e-8, 1e-20], initial_force=1e-7)
    found = event_sizes(record)
    np.testing.assert_allclose(found.drop, [1e-5, 3e-5, 0.0])  # the last is rounding
    assert found.drop[2] == 0.0
    np.testing.assert_allclose(found.step[:2], [2e-6, 4e-6])
    assert math.isnan(found.step[2])
    np.testing.assert_array_equal(found.slips, record.slips)
    np.testing.assert_allclose(found.energy[:2], record.dissipated[:2] / LOAD)
    assert found.energy[2] == 0.0


def test_a_force_that_rises_is_no_size() -> None:
    record = record_from([1e-6, 1e-6], [-1e-8, 1e-8], initial_force=1e-7)
    assert event_sizes(replace(record, dissipated=np.array([-1e-20, 1e-14]))).drop[0] == 0.0


def test_events_before_a_place_are_left_out() -> None:
    record = noisy_record(events=300)
    middle = float(record.displacement[100])
    part, whole = event_sizes(record, middle), event_sizes(record)
    for name in DISCRETE:
        np.testing.assert_array_equal(getattr(part, name), getattr(whole, name)[100:])


def test_records_put_together_are_one_behind_the_other() -> None:
    first, second = event_sizes(noisy_record(100, seed=1)), event_sizes(noisy_record(50, seed=2))
    both = pooled([first, second])
    assert len(both.slips) == 150
    assert np.isnan(both.step).sum() == 2  # no step leads from one record to the next
    np.testing.assert_array_equal(both.drop[100:], second.drop)


def test_correlations_are_spearmans() -> None:
    rng = np.random.default_rng(1)
    x = rng.integers(0, 5, 200).astype(float)
    y = x + rng.standard_normal(200)
    assert rank_correlation(x, y) == pytest.approx(spearmanr(x, y).statistic)
    assert rank_correlation(np.arange(20.0), np.arange(20.0) ** 3) == pytest.approx(1.0)
    repeated, after = (
        np.tile(x, 3),
        np.tile(y, 3),
    )  # as a record repeats itself from spacing to spacing, but for rounding
    rounded = repeated * (1.0 + 1e-13 * np.random.default_rng(1).standard_normal(repeated.size))
    assert rank_correlation(rounded, after) == pytest.approx(rank_correlation(repeated, after), abs=1e-12)
    assert rank_correlation(np.append(x, np.nan), np.append(y, 7.0)) == rank_correlation(x, y)
    assert math.isnan(rank_correlation(np.ones(50), np.arange(50.0)))
    assert math.isnan(rank_correlation(np.arange(5.0), np.arange(5.0)))
