"""Counts are of triggers and of whole cascades; μ_s and μ_k come with uncertainties, or with the reason why not."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from solver.case import Drive
from solver.dynamics import DynamicsResult, integrate
from solver.observables import event_statistics, friction_coefficients
from solver.outcome import Ending
from solver.plateau import Plateau, plateau_of
from solver.profile import sawtooth
from solver.sliding import FrictionRecord
from tests.synthetic import LOAD, STIFFNESS, noisy_record, record_from

TIME_UNIT = math.sqrt(0.5 / 1e8)  # s: the paper's pin of 0.5 kg, G = 10 GPa, L_y = 1 cm
PAPER = Drive(2e-3, 0.1, 2.0 * TIME_UNIT, 0.2 / TIME_UNIT)


def driven(drive: Drive = PAPER) -> tuple[DynamicsResult, FrictionRecord, Plateau]:
    record = noisy_record()
    plateau = plateau_of(record)
    return integrate(sawtooth(record, plateau), drive, STIFFNESS), record, plateau


def test_events_are_counted_by_trigger_and_cascades_by_what_they_did():
    record = replace(
        record_from([1e-6, 2e-6, 3e-6, 2e-6], [1e-7, 4e-7, 2e-7, 1e-7]),
        kind=np.array([0, 0, 1, 2], np.int8),
        slips=np.array([5, 70, 0, 2]),
        releases=np.array([0, 1, 1, 0], np.int32),
        touches=np.array([0, 0, 0, 3], np.int32),
    )
    found = event_statistics(record)
    assert (found.events, found.slips, found.releases, found.touches) == (4, 2, 1, 1)
    assert (found.cascade_slips, found.cascade_releases, found.cascade_touches) == (77, 2, 3)
    assert found.mean_step == pytest.approx(2e-6, rel=1e-12)
    assert found.mean_slips == 77 / 4
    assert found.mean_drop == pytest.approx(2e-7 / LOAD, rel=1e-9)  # differences of forces ten times as large
    assert found.peak_friction == record.force_before.max() / LOAD
    assert found.dissipated == record.dissipated.sum()


def test_a_record_without_events_has_no_means():
    record = replace(
        record_from([1e-6], [0.0]),
        **{name: np.empty(0) for name in ("displacement", "force_before", "force_after", "stiffness", "dissipated")},
        **{name: np.empty(0, np.int64) for name in ("kind", "node", "slips", "releases", "touches", "contact_size")},
    )
    found = event_statistics(record)
    assert found.events == 0
    assert np.isnan([found.mean_step, found.mean_slips, found.mean_drop]).all()
    assert found.peak_friction == record.final_force / LOAD


def test_means_over_events_scatter_as_their_uncertainties_say():
    """640 independent steps and drops: 1/√640 of their standard deviation, known itself to 1/√(2·7) and taken at its largest."""
    rng = np.random.default_rng(7)
    steps, drops = rng.uniform(1e-6, 3e-6, 640), rng.uniform(1e-7, 3e-7, 640)
    found = event_statistics(record_from(steps, drops))
    scatter = 1.0 / math.sqrt(12.0 * 640)  # of a uniform distribution's mean, over its range
    assert 0.5 < found.mean_step_uncertainty / (2e-6 * scatter) < 2.0
    assert 0.5 < found.mean_drop_uncertainty / (2e-7 / LOAD * scatter) < 2.0


def test_fewer_than_two_events_a_block_say_nothing_of_their_scatter():
    found = event_statistics(record_from([1e-6] * 63, [1e-7] * 63))
    assert np.isnan([found.mean_step_uncertainty, found.mean_drop_uncertainty]).all()


def test_kinetic_friction_is_the_plateaus_mean_and_static_friction_one_of_its_peaks():
    """§3.3: the paper's explanation of the two coefficients."""
    result, record, plateau = driven()
    found = friction_coefficients(result, record, plateau)
    assert found.outcome.ok
    assert abs(found.kinetic_friction - plateau.mean) < 3.0 * found.kinetic_friction_uncertainty
    assert found.kinetic_friction_uncertainty >= plateau.uncertainty
    # The driving force overshoots the limit while the pin gathers speed, by less than k V²/(2a), a of 1 % of F.
    assert plateau.mean < found.static_friction < 1.05 * plateau.peak
    assert found.static_friction == result.slip_force[0] / LOAD
    assert 0.0 < found.static_friction_uncertainty < 0.01 * plateau.peak  # 1 % noise, and its maxima scatter less


def test_scatter_of_peaks_is_that_of_block_maxima():
    result, record, plateau = driven()
    found = friction_coefficients(result, record, plateau)
    inside = slice(plateau.first_event + 1, plateau.last_event + 1)
    edges = np.linspace(plateau.start, plateau.end, 9)
    x, force = record.displacement[inside], record.force_before[inside] / LOAD
    highest = [force[(x >= low) & (x <= high)].max() for low, high in pairwise(edges)]
    assert found.static_friction_uncertainty == pytest.approx(np.std(highest, ddof=1), rel=1e-9)


def test_scalars_do_not_depend_on_how_many_samples_are_kept():
    found = [friction_coefficients(*driven(replace(PAPER, samples=samples))) for samples in (10, 3000)]
    for name in ("static_friction", "kinetic_friction", "kinetic_friction_uncertainty"):
        assert getattr(found[0], name) == getattr(found[1], name)


def test_a_drive_too_short_to_slip_says_so():
    found = friction_coefficients(*driven(replace(PAPER, duration=0.02 / TIME_UNIT)))
    assert found.outcome.ending is Ending.NO_SLIP
    assert "duration" in found.outcome.message
    assert np.isnan([found.static_friction, found.kinetic_friction]).all()


def test_a_drive_that_stops_amid_the_first_oscillations_has_static_friction_only():
    found = friction_coefficients(*driven(replace(PAPER, duration=0.075 / TIME_UNIT)))
    assert found.outcome.ending is Ending.NO_PLATEAU
    assert found.static_friction > 0.27
    assert math.isnan(found.kinetic_friction)


def test_a_failed_run_passes_its_outcome_on():
    result, record, plateau = driven(replace(PAPER, integrator="rk4", time_step=100.0))
    found = friction_coefficients(result, record, plateau)
    assert found.outcome.ending is Ending.UNSTABLE_STEP
    assert math.isnan(found.static_friction)
