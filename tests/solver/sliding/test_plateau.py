"""The plateau is found from the record alone, refused where there is none, and its moments are exact integrals."""

from dataclasses import replace

import numpy as np
import pytest

from solver.dynamics.friction_limit import linear, sawtooth
from solver.outcome import Ending
from solver.sliding.plateau import BINS, BLOCKS, mean_uncertainty, plateau_of, sampling_of, teeth, truncation
from solver.sliding.record import FrictionRecord
from tests.synthetic import LOAD, SPACING, STIFFNESS, modulated_record, noisy_record, record_from


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
    assert plateau.mean == pytest.approx(0.27, rel=0.01)  # a change that still counts as steady


def test_too_few_events_are_no_plateau():
    plateau = plateau_of(record_from(np.full(10, 1e-5), np.zeros(10)))
    assert plateau.outcome.ending is Ending.NO_PLATEAU
    assert plateau.outcome.message.startswith("10 events")


@pytest.mark.parametrize(("tail", "limit"), [(0.0, "limits.events"), (1e-7, "limits.spacings or limits.displacement")])
def test_a_record_without_a_plateau_is_to_be_longer_by_the_limit_that_ended_it(tail: float, limit: str) -> None:
    """One of displacement is met between two events: after the last one the pin has moved on."""
    few, rising = (record_from([1e-6] * count, [1e-9] * count, tail=tail) for count in (10, 400))
    nothing = replace(few, **{name: getattr(few, name)[:0] for name in ("displacement", "force_before", "force_after")})
    for record in (few, rising) if not tail else (few, rising, nothing):
        message = plateau_of(record).outcome.message
        assert f"; raise {limit}" in message
        assert message.count("limits.") == limit.count("limits.")


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


LEVEL, AMPLITUDE = 0.27, 0.05
"""Mean F/W of `modulated_record`, and how much the modulation is of it."""
PHASES = np.arange(8) / 8.0


def truncated(record: FrictionRecord) -> tuple[float, float]:
    """Where truncation alone begins the steady part (L_x), and F/W from there on: what was said before spacings counted."""
    whole = teeth(record)
    bins = whole.block_means(0.0, record.final_displacement, BINS)
    first = truncation(bins)
    return record.final_displacement * first / BINS, float(bins[first:].mean()) / record.normal_load


@pytest.mark.parametrize(("spacings", "whole"), [(1.3, 1), (1.5, 1), (2.4, 2), (3.7, 3)])
def test_over_whole_spacings_a_modulation_averages_out(spacings: float, whole: int) -> None:
    """An event of 3000 to a spacing may be missing at the ends: a sixth of a permille of the amplitude, seen is a quarter."""
    errors = []
    for phase in PHASES:
        record = modulated_record(spacings, phase)
        plateau = plateau_of(record)
        assert plateau.outcome.ok
        assert plateau.spacings == whole
        assert plateau.end - plateau.start == pytest.approx(whole * SPACING, abs=1.01 * record.displacement[0])
        assert plateau.mean == pytest.approx(LEVEL, abs=1e-3 * AMPLITUDE * LEVEL)
        assert abs(plateau.mean - LEVEL) < plateau.uncertainty
        errors.append(abs(truncated(record)[1] - LEVEL) / (AMPLITUDE * LEVEL))
    # Truncation on the same records ends up in the middle of a wave.
    assert np.median(errors) > 0.02


@pytest.mark.parametrize("spacings", [0.3, 0.45])
def test_below_a_spacing_the_uncertainty_covers_what_was_not_seen(spacings: float) -> None:
    """The waves are what the model expects of 9 nodes: at the worst phase they are √2 of their standard deviation off."""
    found = [plateau_of(modulated_record(spacings, phase)) for phase in PHASES]
    stated = [each for each in found if each.outcome.ok]
    assert len(stated) >= 2  # at the other phases it rises or falls, and is refused
    for each in stated:
        assert abs(each.mean - LEVEL) < 1.6 * each.uncertainty


@pytest.mark.parametrize("spacings", [0.3, 0.45])
def test_blocks_alone_would_not_have_covered_it(spacings: float) -> None:
    """They agree with each other: at every phase with a plateau they are wrong by ten times what they say or more."""
    for phase in PHASES:
        record = modulated_record(spacings, phase)
        plateau = plateau_of(record)
        if plateau.outcome.ok:
            within = mean_uncertainty(teeth(record).block_means(plateau.start, plateau.end, BLOCKS)) / LOAD
            assert abs(plateau.mean - LEVEL) > 10.0 * within


@pytest.mark.parametrize("phase", PHASES)
def test_below_half_a_spacing_truncation_decides_as_ever(phase: float) -> None:
    record = modulated_record(0.45, phase)
    assert (record.displacement[-1] - 3.0 * record.final_force / STIFFNESS) / SPACING < 0.5
    plateau = plateau_of(record)
    if plateau.outcome.ok:
        start, _ = truncated(record)
        assert plateau.first_event == int(np.searchsorted(record.displacement, start))


def test_from_half_a_spacing_on_all_is_kept_that_first_touch_does_not_reach() -> None:
    """Three times the stretch of the contact, F/K, are left out: here 1.7 times the length of the ramp."""
    record = modulated_record(1.0, 0.0)
    settled = 3.0 * record.final_force / STIFFNESS
    plateau = plateau_of(record)
    assert plateau.start == record.displacement[np.searchsorted(record.displacement, settled)]
    assert 0.5 < plateau.spacings < 1.0
    assert plateau.spacings == pytest.approx((plateau.end - plateau.start) / SPACING, rel=1e-12)


def test_a_contact_without_stiffness_has_no_stretch_to_forget() -> None:
    """Then there is no telling what initial contact reaches, and truncation decides."""
    record = replace(modulated_record(2.4, 0.2), initial_stiffness=0.0)
    start, _ = truncated(record)
    assert plateau_of(record).first_event == int(np.searchsorted(record.displacement, start))


@pytest.mark.parametrize("shape", [sawtooth, linear])
def test_a_profile_repeats_whole_spacings(shape) -> None:
    """A pin that goes on for ever keeps in step with the nodes: within the step between two events."""
    record = modulated_record(2.4, 0.3)
    profile = shape(record, plateau_of(record))
    assert profile.period == pytest.approx(2.0 * SPACING, abs=1.01 * record.displacement[0])
    # Half a spacing out of step the limit would be off by twice the modulation.
    x = np.linspace(0.0, profile.period, 1001)[:-1] + record.displacement[-1]
    wave = LEVEL * AMPLITUDE * LOAD * np.sin(2.0 * np.pi * (x / SPACING + 0.3))
    off = profile.limit(x + 3.0 * profile.period) - LEVEL * LOAD - wave
    assert np.abs(off).max() < 0.1 * LEVEL * AMPLITUDE * LOAD


def test_a_stretch_made_to_be_whole_spacings_is() -> None:
    """Events miss a whole number by less than a fiftieth of a spacing; more is counted as what it is."""
    record = modulated_record(2.4, 0.0)
    for length, spacings in ((1.985, 2.0), (2.015, 2.0), (2.03, 2.03), (1.97, 1.97), (0.99, 1.0), (0.5, 0.5)):
        assert sampling_of(record, 0, length * SPACING).spacings == pytest.approx(spacings, rel=1e-12)
    assert sampling_of(record, 0, SPACING).nodes == 9.0


@pytest.mark.parametrize("spacings", [1e-6, 0.004, 0.017])
def test_a_short_stretch_is_not_none(spacings: float) -> None:
    assert sampling_of(modulated_record(1.0, 0.0), 0, spacings * SPACING).spacings == pytest.approx(spacings, rel=1e-12)
