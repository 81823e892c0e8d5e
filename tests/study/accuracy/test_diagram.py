"""Diagrams: settings that no other one beats in both time and error."""

import math

import numpy as np

from nanoslip.study.accuracy.diagram import pareto_front


def test_equal_points_count_once_and_unknown_ones_never():
    assert pareto_front([1.0, 1.0, 0.5, math.nan], [0.1, 0.1, math.nan, 0.0]).tolist() == [True, False, False, False]
    assert pareto_front([], []).tolist() == []


def test_along_the_front_error_falls_with_time_and_every_other_point_is_beaten():
    rng = np.random.default_rng(5)
    time, error = rng.uniform(size=(2, 200))
    on_front = pareto_front(time, error)
    order = np.argsort(time[on_front])
    assert np.all(np.diff(error[on_front][order]) < 0.0)
    for t, e in zip(time[~on_front], error[~on_front], strict=True):
        assert np.any((time[on_front] <= t) & (error[on_front] <= e))
