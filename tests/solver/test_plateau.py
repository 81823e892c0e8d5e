"""The plateau is found from the record alone, refused where there is none, and its moments are exact integrals."""

import numpy as np
import pytest

from solver.outcome import Ending
from solver.plateau import plateau_of, teeth, truncation
from tests.synthetic import LOAD, STIFFNESS, noisy_record, record_from


def rising(scale, events=1000, noise=0.0):
    """1 - exp(-x/scale) over a record of length 1e-3, with drops that keep the force on the curve."""
    rng = np.random.default_rng(1)
    steps = np.full(events, 1e-3 / events)
    after = 2.7e-4 * (1.0 - np.exp(-np.cumsum(steps) / (scale * 1e-3))) * (1.0 - noise * rng.random(events))
    return record_from(steps, np.concatenate(([0.0], after[:-1])) + STIFFNESS * steps - after)


def test_the_plateau_starts_where_the_ramp_ends():
    record = noisy_record()
    plateau = plateau_of(record)
    assert plateau.outcome.ok
    ramp_end = record.displacement[399]
    one_bin = record.final_displacement / 512
    # It may keep a bin or two that 1 % of noise hides, and drop some that happen to be extreme.
    assert ramp_end - 2 * one_bin < plateau.start < ramp_end + 25 * one_bin
    assert plateau.start == record.displacement[plateau.first_event]
    assert plateau.end == record.displacement[plateau.last_event]


def test_the_uncertainty_covers_the_mean_of_longer_records():
    """The true mean lies within three standard errors (here in all of 20 records; one in 400 may miss)."""
    truth = plateau_of(noisy_record(events=60_000)).mean
    for seed in range(20):
        plateau = plateau_of(noisy_record(seed=seed))
        assert abs(plateau.mean - truth) < 3.0 * plateau.uncertainty
        assert plateau.uncertainty < 1e-3 * plateau.mean  # 1 % noise over 1600 independent teeth


def test_moments_are_integrals_over_the_sawtooth():
    """One tooth repeated: uniform distribution between its two forces, so mean and std are known."""
    ramp = np.full(50, 6e-4 / 50)
    step = np.full(400, 4e-6)
    record = record_from(np.append(ramp, step), np.append(np.zeros(50), np.full(400, STIFFNESS * 4e-6)))
    plateau = plateau_of(record)
    low, high = STIFFNESS * 6e-4 / LOAD, STIFFNESS * 6.04e-4 / LOAD
    assert plateau.mean == pytest.approx((low + high) / 2, rel=1e-12)  # rounding of 450 sums
    assert plateau.std == pytest.approx((high - low) / np.sqrt(12.0), rel=1e-8)  # a difference of nearly equal forces
    assert plateau.peak == pytest.approx(high, rel=1e-12)


@pytest.mark.parametrize(("scale", "noise"), [(0.25, 0.0), (0.5, 0.0), (2.0, 0.0), (0.5, 0.01), (2.0, 0.01)])
def test_a_record_that_still_rises_has_no_plateau(scale, noise):
    plateau = plateau_of(rising(scale, noise=noise))
    assert plateau.outcome.ending is Ending.NO_PLATEAU
    assert "rises by" in plateau.outcome.message
    assert "limits.events" in plateau.outcome.message
    assert np.isnan([plateau.mean, plateau.uncertainty, plateau.start]).all()


def test_a_record_that_has_saturated_has_a_plateau_even_without_noise():
    plateau = plateau_of(rising(0.05))
    assert plateau.outcome.ok
    assert plateau.mean == pytest.approx(0.27, rel=0.01)  # the drift that is never called one


def test_too_few_events_are_no_plateau():
    plateau = plateau_of(record_from(np.full(10, 1e-5), np.zeros(10)))
    assert plateau.outcome.ending is Ending.NO_PLATEAU
    assert plateau.outcome.message.startswith("10 events")


def test_the_integral_of_the_teeth_is_additive_and_includes_what_follows_the_last_event():
    record = record_from([1e-5, 2e-5, 1e-5], [1e-6, 2e-6, 3e-6], initial_force=1e-6, tail=5e-6)
    whole = teeth(record)
    by_hand = sum(
        0.5 * width * (start + end)
        for width, start, end in zip(np.diff(whole.edges), whole.start, whole.end, strict=True)
    )
    assert whole.integral(np.array([record.final_displacement]))[0] == pytest.approx(by_hand, rel=1e-14)
    assert whole.block_means(0.0, record.final_displacement, 7).mean() == pytest.approx(
        by_hand / record.final_displacement, rel=1e-13
    )


def test_truncation_minimises_the_marginal_standard_error():
    """Against the definition, term by term."""
    bins = np.concatenate((np.linspace(0.0, 1.0, 13), 1.0 + 0.1 * np.sin(np.arange(35) * 1.7)))
    score = [np.sum((bins[d:] - bins[d:].mean()) ** 2) / (len(bins) - d) ** 2 for d in range(37)]
    assert truncation(bins) == int(np.argmin(score))
