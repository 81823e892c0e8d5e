"""The plateau is what follows run-in, refused where a record ends before; its moments are exact integrals."""

from dataclasses import replace

import numpy as np
import pytest

from nanoslip.solver.dynamics.friction_limit import linear, sawtooth
from nanoslip.solver.outcome import Ending
from nanoslip.solver.sliding.plateau import FEWEST_EVENTS, RUN_IN, plateau_of, teeth
from tests.synthetic import FRICTION, LOAD, SPACING, STIFFNESS, modulated_record, noisy_record, record_from

PRESLIDING = FRICTION * LOAD / STIFFNESS
LEVEL, AMPLITUDE = 0.27, 0.05
"""Mean F/W of `modulated_record`, and how much the modulation is of it."""


def test_the_steady_part_begins_where_the_pin_has_slid_the_run_in() -> None:
    record = noisy_record()
    plateau = plateau_of(record)
    assert plateau.outcome.ok
    before, start = record.displacement[plateau.first_event - 1 : plateau.first_event + 1]
    assert before < RUN_IN * PRESLIDING <= start == plateau.start
    assert plateau.end == record.displacement[plateau.last_event] == record.displacement[-1]
    assert plateau.mean == pytest.approx(0.27 * (1.0 - 0.005), rel=2e-3)  # drops of 0 to 1 %: 500 of them know 0.03 %


def test_no_plateau_is_found_on_the_loading_ramp() -> None:
    """However steady a stretch of it looks, a record that ends within run-in has none."""
    flat = np.full(300, RUN_IN * PRESLIDING / 301)
    plateau = plateau_of(record_from(flat, STIFFNESS * flat))
    assert plateau.outcome.ending is Ending.NO_PLATEAU
    assert np.isnan(plateau.mean)
    assert "1.5 presliding lengths, run-in takes 1.5" in plateau.outcome.message


def test_a_contact_without_stiffness_never_forgets() -> None:
    assert plateau_of(replace(noisy_record(), presliding_length=np.inf)).outcome.ending is Ending.NO_PLATEAU


def test_without_friction_there_is_no_run_in() -> None:
    record = replace(record_from([1e-6] * 20, [STIFFNESS * 1e-6] * 20), presliding_length=0.0)
    assert plateau_of(record).first_event == 0


def test_moments_are_integrals_over_the_sawtooth():
    """One tooth repeated: uniform distribution between its two forces, so mean and std are known."""
    ramp = np.full(50, 6e-4 / 50)
    step = np.full(600, 4e-6)
    record = record_from(np.append(ramp, step), np.append(np.zeros(50), np.full(600, STIFFNESS * 4e-6)))
    plateau = plateau_of(record)
    low, high = STIFFNESS * 6e-4 / LOAD, STIFFNESS * 6.04e-4 / LOAD
    assert plateau.mean == pytest.approx((low + high) / 2, rel=1e-12)  # rounding of 650 sums
    assert plateau.std == pytest.approx((high - low) / np.sqrt(12.0), rel=1e-8)  # a difference of nearly equal forces
    assert plateau.peak == pytest.approx(high, rel=1e-12)


def test_too_few_events_are_no_plateau() -> None:
    steps = [1.01 * RUN_IN * PRESLIDING, *([1e-6] * FEWEST_EVENTS)]
    drops = [STIFFNESS * step for step in steps]
    assert plateau_of(record_from(steps, drops)).outcome.ok
    refused = plateau_of(record_from(steps[:-1], drops[:-1])).outcome
    assert refused.ending is Ending.NO_PLATEAU
    assert refused.message.startswith("7 events after run-in: needs 8; raise limits.events")


@pytest.mark.parametrize(("tail", "limit"), [(0.0, "limits.events"), (1e-7, "limits.presliding")])
def test_a_record_without_a_plateau_is_to_be_longer_by_the_limit_that_ended_it(tail: float, limit: str) -> None:
    """One of displacement is met between two events: after the last one the pin has moved on."""
    assert f"; raise {limit}" in plateau_of(record_from([1e-6] * 400, [1e-9] * 400, tail=tail)).outcome.message


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


@pytest.mark.parametrize(("spacings", "whole"), [(1.4, 1), (1.6, 1), (2.4, 2), (3.7, 3)])
def test_over_whole_spacings_a_modulation_averages_out(spacings: float, whole: int) -> None:
    """An event of 3000 to a spacing may be missing at the ends: a sixth of a permille of the amplitude."""
    for phase in np.arange(8) / 8.0:
        record = modulated_record(spacings, phase)
        plateau = plateau_of(record)
        assert plateau.spacings == pytest.approx(whole, abs=1.01 * record.displacement[0] / SPACING)
        assert plateau.mean == pytest.approx(LEVEL, abs=1e-3 * AMPLITUDE * LEVEL)


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
