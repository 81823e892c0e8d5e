"""Counts are of triggers and of whole cascades; μ_s and μ_k come with the reason where they are missing."""

import math
import re
import time
from dataclasses import replace

import numpy as np
import pytest

from nanoslip.solver.drive import Drive
from nanoslip.solver.dynamics.coefficients import friction_coefficients
from nanoslip.solver.dynamics.friction_limit import sawtooth
from nanoslip.solver.dynamics.integrators import RK4, integrate
from nanoslip.solver.dynamics.result import DynamicsResult
from nanoslip.solver.outcome import Ending
from nanoslip.solver.sliding.plateau import Plateau, plateau_of
from nanoslip.solver.sliding.record import FrictionRecord
from nanoslip.solver.sliding.statistics import LONGEST_CYCLE, cycle_of, event_statistics
from tests.synthetic import LOAD, SPACING, STIFFNESS, noisy_record, record_from

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
    assert np.isnan(event_statistics(replace(record, final_displacement=0.0)).peak_friction)  # the pin has not moved


def test_kinetic_friction_is_the_plateaus_mean_and_static_friction_one_of_its_peaks():
    """§3.3: the paper's explanation of the two coefficients."""
    result, record, plateau = driven()
    found = friction_coefficients(result, record, plateau)
    assert found.outcome.ok
    # The record repeats its steady part: over many repetitions its mean is met to the part of one that is missing.
    assert found.kinetic_friction == pytest.approx(plateau.mean, rel=2e-3)
    # The driving force overshoots the limit while the pin gathers speed, by less than k V²/(2a), a of 1 % of F.
    assert plateau.mean < found.static_friction < 1.05 * plateau.peak
    assert found.static_friction == result.slip_force[0] / LOAD


def test_scalars_do_not_depend_on_how_many_samples_are_kept():
    found = [friction_coefficients(*driven(replace(PAPER, samples=samples))) for samples in (10, 3000)]
    for name in ("static_friction", "kinetic_friction"):
        assert getattr(found[0], name) == getattr(found[1], name)


@pytest.mark.parametrize("spring_stiffness", [1e-5, 2e-3])
def test_a_pin_that_is_pulled_too_little_says_so_and_slips_once_pulled_as_said(spring_stiffness):
    """By a drive too short, or a spring too weak for its time: a harder pull by what is missing, and a tenth more, is enough."""
    duration = 0.15 * LOAD / (spring_stiffness * PAPER.stage_velocity)
    little = replace(PAPER, spring_stiffness=spring_stiffness, duration=duration)
    found = friction_coefficients(*driven(little))
    assert found.outcome.ending is Ending.NO_SLIP
    assert np.isnan([found.static_friction, found.kinetic_friction]).all()
    told, advice = found.outcome.message.split(": raise ")
    reached, least, most = map(float, re.findall(r"0\.\d+", told))
    assert 0.1 < reached < least < most
    assert advice == "the drive's duration, stage_velocity or spring_stiffness"
    for name in ("duration", "stage_velocity", "spring_stiffness"):
        more = replace(little, **{name: getattr(little, name) * 1.1 * most / reached})
        assert len(driven(more)[0].slip_time), name


def test_a_stage_at_rest_is_told_from_a_spring_too_weak():
    found = friction_coefficients(*driven(replace(PAPER, stage_velocity=0.0)))
    assert found.outcome.message == "the stage is at rest: raise stage_velocity"


def test_a_pin_that_follows_in_slips_too_short_is_to_have_a_softer_spring_or_a_faster_stage():
    stiff = replace(
        PAPER, spring_stiffness=10.0, stage_velocity=0.02 * PAPER.stage_velocity, duration=50 * PAPER.duration
    )
    result, record, plateau = driven(stiff)
    found = friction_coefficients(result, record, plateau)
    assert found.outcome.ending is Ending.NO_SLIP
    assert result.micro_slips > 100
    assert found.outcome.message.endswith(": lower spring_stiffness, or raise stage_velocity")
    softer, faster = {"spring_stiffness": PAPER.spring_stiffness}, {"stage_velocity": PAPER.stage_velocity}
    for change in (softer, faster | {"duration": PAPER.duration}):  # as far as before
        assert len(driven(replace(stiff, **change))[0].slip_time)


def test_a_drive_that_stops_amid_the_first_oscillations_has_static_friction_only():
    found = friction_coefficients(*driven(replace(PAPER, duration=0.075 / TIME_UNIT)))
    assert found.outcome.ending is Ending.NO_PLATEAU
    assert found.static_friction > 0.27
    assert math.isnan(found.kinetic_friction)


def test_a_pin_too_heavy_to_swing_twice_has_no_mean_driving_force():
    """Its driving force is inertia: in a fifth of a period it looked steady, at twice the friction."""
    period = 2.0 * math.pi / math.sqrt(PAPER.spring_stiffness)
    found = friction_coefficients(*driven(PAPER))
    assert found.outcome.ok  # slides for a dozen periods
    slow = replace(PAPER, stage_velocity=20.0 * PAPER.stage_velocity, duration=1.5 * period)
    result, record, plateau = driven(slow)
    assert len(result.slip_time)
    assert result.settling_time == pytest.approx(period)
    found = friction_coefficients(result, record, plateau)
    assert found.outcome.ending is Ending.NO_PLATEAU
    assert "periods" in found.outcome.message
    assert math.isnan(found.kinetic_friction)


def test_what_inertia_adds_to_static_friction_is_said_beside_it():
    result, record, plateau = driven(replace(PAPER, stage_velocity=50.0 * PAPER.stage_velocity))
    found = friction_coefficients(result, record, plateau)
    beyond = found.static_friction - record.force_before.max() / LOAD
    assert beyond > 0.1
    assert found.static_friction_excess == pytest.approx(beyond, rel=1e-12)


def test_a_driving_force_that_is_mostly_inertia_is_no_static_friction():
    """More than twice of all that the contact ever holds: the outcome says so, also of a drive that was given up amid it."""
    fast = replace(PAPER, stage_velocity=150.0 * PAPER.stage_velocity, duration=PAPER.duration / 8.0, damping_ratio=0.5)
    result, record, plateau = driven(fast)
    assert result.slip_force[0] > 2.0 * record.force_before.max()
    found = friction_coefficients(result, record, plateau)
    assert math.isnan(found.static_friction)
    assert found.every_static_friction[0] == result.slip_force[0] / LOAD
    assert "is inertia and damper" in found.outcome.message
    given_up, _, _ = driven(replace(fast, step_limit=result.steps // 2))
    found = friction_coefficients(given_up, record, plateau)
    assert found.outcome.ending is Ending.STEP_LIMIT
    assert math.isnan(found.static_friction)
    assert "% of the duration" in found.outcome.message
    assert "is inertia and damper" in found.outcome.message


def test_a_drive_given_up_after_its_first_slip_ran_off_has_its_static_friction():
    whole, record, plateau = driven()
    given_up, _, _ = driven(replace(PAPER, step_limit=whole.steps - 1))
    assert given_up.outcome.ending is Ending.STEP_LIMIT
    found, known = (friction_coefficients(result, record, plateau) for result in (given_up, whole))
    assert found.static_friction == known.static_friction
    assert math.isnan(found.kinetic_friction)


def test_a_failed_run_passes_its_outcome_on():
    result, record, plateau = driven(replace(PAPER, integrator=RK4(100.0)))
    found = friction_coefficients(result, record, plateau)
    assert found.outcome.ending is Ending.UNSTABLE_STEP
    assert math.isnan(found.static_friction)


SEVEN = np.array([3, 1, 4, 1, 5, 9, 2])
"""A cycle of seven events: their nodes, and how large their drops are; two of them are of one node."""


def cyclic(turns: float, noise: float = 0.0, before: int = 300) -> FrictionRecord:
    """Events at random nodes, then so many turns of SEVEN; the forces between are off by noise of a drop."""
    rng = np.random.default_rng(7)
    count = round(7 * turns)
    drops = np.concatenate((rng.random(before) * 1e-6, np.resize(SEVEN, count) * 1e-7))
    steps = np.concatenate((drops[:before], np.roll(np.resize(SEVEN, count), 2) * 1e-7)) / STIFFNESS
    drops[before:] += noise * 9e-7 * np.diff(rng.random(count), prepend=0.0)
    nodes = np.concatenate((rng.integers(10, 60, before), np.resize(SEVEN, count)))
    return replace(record_from(steps, drops), node=nodes.astype(np.int32))


@pytest.mark.parametrize("turns", [3, 3.5, 10, 1200])
def test_a_cycle_at_the_end_of_a_record_is_found(turns: float) -> None:
    """From the third turn on; 1200 of them are more events than are searched."""
    record = cyclic(turns)
    found = event_statistics(record)
    assert found.cycle_events == 7
    # One turn is Σ SEVEN·1e-7 / STIFFNESS long, to rounding of displacements that many turns add up to.
    assert found.cycle_spacings == pytest.approx(25e-7 / STIFFNESS / SPACING, rel=1e-9)


def test_a_cycle_is_one_to_a_thousandth_of_its_drops() -> None:
    assert cycle_of(cyclic(10, noise=1e-4)) == 7
    assert cycle_of(cyclic(10, noise=1e-2)) == 0


def test_of_all_cycles_the_shortest_is_taken() -> None:
    """By the definition, on events at few nodes whose forces nearly repeat: the last two turns are what came a turn before."""
    rng, found = np.random.default_rng(1), set[int]()
    for _ in range(300):
        turn, count = int(rng.integers(1, 9)), int(rng.integers(8, 40))
        node, drop = (np.resize(each, count) for each in (rng.integers(0, 2, turn), rng.random(turn)))
        after = np.resize(rng.random(turn), count) + 10.0 ** rng.uniform(-5, -2) * rng.random(count)
        record = record_from(np.ones(count), drop)
        record = replace(record, node=node.astype(np.int32), force_before=after + drop, force_after=after)
        fits = [
            period
            for period in range(1, count // 3 + 1)
            if (node[-2 * period :] == node[-3 * period : -period]).all()
            and (
                np.abs(after[-2 * period :] - after[-3 * period : -period])
                <= 1e-3 * np.abs(record.force_before - after)[-period:].max()
            ).all()
        ]
        found.add(cycle_of(record))
        assert cycle_of(record) == min(fits, default=0)
    assert len(found) > 4


@pytest.mark.parametrize("turns", [0, 1, 2, 2.9])
def test_what_was_not_seen_three_times_is_no_cycle(turns: float) -> None:
    record = cyclic(turns)
    found = event_statistics(record)
    assert (found.cycle_events, found.cycle_spacings) == (0, 0.0)


def test_a_cycle_that_ended_is_none() -> None:
    record = cyclic(10)
    node = record.node.copy()
    node[-1] = 60
    assert cycle_of(replace(record, node=node)) == 0


def test_a_noisy_record_has_no_cycle() -> None:
    record = noisy_record()
    assert cycle_of(record) == 0
    rng = np.random.default_rng(3)
    assert cycle_of(replace(record, node=rng.integers(0, 9, len(record.node)).astype(np.int32))) == 0


def test_little_events_after_large_ones_are_no_cycle() -> None:
    """A node that chatters while the force creeps on: every drop a hundred thousandth of those before, every force another."""
    drops = np.concatenate((np.full(50, 1e-6), np.full(5, 1e-11)))
    steps = np.concatenate((np.full(50, 1.1e-6), np.full(5, 5e-11))) / STIFFNESS
    record = record_from(steps, drops)
    assert np.abs(np.diff(record.force_after[-5:])).min() > 0.9 * drops[-1] > 0.0
    assert cycle_of(record) == 0


@pytest.mark.parametrize("events", [0, 1, 2])
def test_a_tiny_record_has_no_cycle(events: int) -> None:
    whole = record_from([1e-6, 1e-6, 1e-6], [1e-7, 1e-7, 1e-7])
    names = ("displacement", "force_before", "force_after", "node")
    assert cycle_of(replace(whole, **{name: getattr(whole, name)[:events] for name in names})) == 0


def test_three_times_the_same_event_is_a_cycle_of_one() -> None:
    assert cycle_of(record_from(np.full(3, 1e-6), np.full(3, STIFFNESS * 1e-6))) == 1


def test_searching_for_a_cycle_takes_no_time() -> None:
    """The same force after every event, and nodes among which every second is a candidate: nearly 1000 periods are tried,
    each of up to 4000 events. 15 ms where it was written; what grew with the cube would take minutes."""
    events = 2 * LONGEST_CYCLE
    record = record_from(np.full(events, 1e-6), np.full(events, STIFFNESS * 1e-6))
    rng = np.random.default_rng(5)
    record = replace(record, node=rng.integers(0, 2, events).astype(np.int32))
    started = time.perf_counter()
    assert cycle_of(record) == 0
    assert time.perf_counter() - started < 2.0


def test_spacings_are_those_of_the_whole_record() -> None:
    record = record_from(np.full(100, 1e-4), np.full(100, 1e-7), tail=2e-4)
    assert event_statistics(record).spacings == pytest.approx(1.02e-2 / SPACING, rel=1e-12)
