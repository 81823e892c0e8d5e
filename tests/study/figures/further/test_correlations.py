"""Correlations over the lag begin with those of the dataset, and are nothing where events are independent."""

import numpy as np
import pytest
from chain import LAGS, PAIRS, at_lags, names, numbers_of, spacing_apart, steady_sizes
from chain import claims_of_correlations as claims

from nanoslip.solver.sliding.sizes import EventSizes
from tests.study.figures.shipped_small import small


def test_at_lag_one_they_are_those_of_the_dataset() -> None:
    dataset = small("figures/chain")
    for number in names(dataset):
        sizes, scalars = steady_sizes(dataset, number), numbers_of(dataset, number)
        for variable, (earlier, later, _) in PAIRS.items():
            (found,) = at_lags(sizes, earlier, later, LAGS[:1])
            assert found == pytest.approx(float(scalars[variable]), abs=1e-12)


def test_a_size_that_returns_is_found_at_its_lag() -> None:
    """Steps that follow the fall three events before, and are independent of all others."""
    rng = np.random.default_rng(1)
    drop, nothing = rng.random(2000), np.ones(2000, np.int64)
    step = np.roll(drop, 2)  # the step behind an event is one event on already
    sizes = EventSizes(nothing, nothing.astype(np.int32), drop, drop, step)
    found = at_lags(sizes, "drop", "step", np.arange(1, 6))
    assert found[2] == pytest.approx(1.0, abs=1e-3)
    assert np.abs(np.delete(found, 2)).max() < 4.0 / np.sqrt(2000.0)


def test_what_repeats_with_the_node_spacing_is_found_one_spacing_on() -> None:
    x = np.sort(np.random.default_rng(2).random(4000)) * 4.0
    assert spacing_apart(x, np.sin(2.0 * np.pi * x), 1.0) > 0.95
    assert spacing_apart(x, np.sin(np.pi * x), 1.0) < -0.95
    assert np.isnan(spacing_apart(x, x, 3.0))


def test_every_case_has_every_pair() -> None:
    dataset = small("figures/chain")
    rows = tuple(claims(dataset))
    assert len(rows) == len(names(dataset)) * (len(PAIRS) + 2)
    assert len({row.meaning for row in rows}) == len(rows)
