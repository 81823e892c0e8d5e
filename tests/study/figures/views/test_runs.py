"""Thinned lines look as they did: extremes stay."""

import numpy as np

from nanoslip.study.figures.view import thinned


def test_a_thinned_line_keeps_ends_extremes_and_order() -> None:
    x = np.linspace(0.0, 1.0, 20_001)
    y = np.sin(40.0 * x)
    y[12_345] = 7.0
    kept = thinned(x, y)
    assert len(kept) <= 602
    assert np.all(np.diff(kept) > 0)
    assert {0, 12_345, 20_000} <= set(kept.tolist())
    fine = np.interp(x, x[kept], y[kept])
    assert np.abs(fine - y)[:12_000].max() < 40.0 / 300  # the slope over the width of a bin


def test_a_short_line_stays_whole_and_a_drop_keeps_both_sides() -> None:
    assert thinned(np.array([0.0, 0.5, 0.5, 1.0]), np.array([0.0, 1.0, 0.2, 0.7])).tolist() == [0, 1, 2, 3]
    assert thinned(np.zeros(1000), np.arange(1000.0)).tolist()[::1][-1] == 999
