"""The plateau is what follows run-in, its moments exact integrals; counts are of triggers and whole cascades, cycles found."""

import math
import time
from dataclasses import replace

import numpy as np
import pytest

from nanoslip.solver.case import Case
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.elasticity.compliance import stiffness_of_node, surface_compliance
from nanoslip.solver.ensemble import Ensemble, mean_of, student
from nanoslip.solver.outcome import Ending
from nanoslip.solver.simulate import friction_record
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.plateau import (
    FEWEST_EVENTS,
    RUN_IN,
    Plateau,
    event_drift_error,
    plateau_error,
    plateau_of,
    stress_error,
    teeth,
)
from nanoslip.solver.sliding.slide import slide
from nanoslip.solver.sliding.statistics import LONGEST_CYCLE, event_statistics, node_error, repeat_length
from tests.synthetic import FRICTION, LOAD, SPACING, STIFFNESS, modulated_record, noisy_record, record_from

PRESLIDING = FRICTION * LOAD / STIFFNESS
LEVEL, AMPLITUDE = 0.27, 0.05
"""Mean F/W of `modulated_record`, and how much the modulation is of it."""


def test_the_steady_part_begins_where_the_pin_has_slid_the_run_in():
    record = noisy_record()
    plateau = plateau_of(record)
    assert plateau.outcome.ok
    before, start = record.displacement[plateau.first_event - 1 : plateau.first_event + 1]
    assert before < RUN_IN * PRESLIDING <= start == plateau.start
    assert plateau.end == record.displacement[plateau.last_event] == record.displacement[-1]
    assert plateau.mean == pytest.approx(0.27 * (1.0 - 0.005), rel=2e-3)  # drops of 0 to 1 %: 500 of them know 0.03 %


def test_no_plateau_is_found_on_the_loading_ramp():
    """However steady a stretch of it looks, a record that ends within run-in has none."""
    flat = np.full(300, RUN_IN * PRESLIDING / 301)
    plateau = plateau_of(record_from(flat, STIFFNESS * flat))
    assert plateau.outcome.ending is Ending.NO_PLATEAU
    assert np.isnan(plateau.mean)
    assert "1.5 presliding lengths" in plateau.outcome.message


def test_a_contact_without_stiffness_never_forgets_and_without_friction_there_is_no_run_in():
    assert plateau_of(replace(noisy_record(), presliding_length=np.inf)).outcome.ending is Ending.NO_PLATEAU
    record = record_from([1e-6] * 20, [STIFFNESS * 1e-6] * 20)
    assert plateau_of(replace(record, presliding_length=0.0)).first_event == 0


def test_moments_are_integrals_over_the_sawtooth():
    """One tooth repeated: uniform distribution between its two forces, so mean and std are known."""
    steps, drops = np.repeat([6e-4 / 50, 4e-6], [50, 600]), np.repeat([0.0, STIFFNESS * 4e-6], [50, 600])
    plateau = plateau_of(record_from(steps, drops))
    low, high = STIFFNESS * 6e-4 / LOAD, STIFFNESS * 6.04e-4 / LOAD
    assert plateau.mean == pytest.approx((low + high) / 2, rel=1e-12)  # rounding of 650 sums
    assert plateau.std == pytest.approx((high - low) / np.sqrt(12.0), rel=1e-8)  # a difference of nearly equal forces
    assert plateau.peak == pytest.approx(high, rel=1e-12)


def test_too_few_events_are_no_plateau():
    steps = np.array([1.01 * RUN_IN * PRESLIDING, *([1e-6] * FEWEST_EVENTS)])
    assert plateau_of(record_from(steps, STIFFNESS * steps)).outcome.ok
    refused = plateau_of(record_from(steps[:-1], STIFFNESS * steps[:-1])).outcome
    assert refused.ending is Ending.NO_PLATEAU
    assert refused.message.endswith("needs 8; raise limits.events")


@pytest.mark.parametrize(("tail", "limit"), [(0.0, "limits.events"), (1e-7, "limits.presliding")])
def test_a_record_without_a_plateau_is_to_be_longer_by_the_limit_that_ended_it(tail, limit):
    """One of displacement is met between two events: after the last one the pin has moved on."""
    assert f"; raise {limit}" in plateau_of(record_from([1e-6] * 400, [1e-9] * 400, tail=tail)).outcome.message


def test_the_integral_of_the_teeth_is_additive_and_includes_what_follows_the_last_event():
    record = record_from([1e-5, 2e-5, 1e-5], [1e-6, 2e-6, 3e-6], initial_force=1e-6, tail=5e-6)
    whole, far = teeth(record), record.final_displacement
    by_hand = 0.5 * float(np.diff(whole.edges) @ (whole.start + whole.end))
    assert whole.integral(np.array([far]))[0] == pytest.approx(by_hand, rel=1e-14)
    assert whole.block_means(0.0, far, 7).mean() == pytest.approx(by_hand / far, rel=1e-13)


@pytest.mark.parametrize(("spacings", "whole"), [(1.4, 1), (1.6, 1), (2.4, 2), (3.7, 3)])
def test_over_whole_spacings_a_modulation_averages_out(spacings, whole):
    """An event of 3000 to a spacing may be missing at the ends: a sixth of a permille of the amplitude."""
    for phase in np.arange(8) / 8.0:
        record = modulated_record(spacings, phase)
        plateau = plateau_of(record)
        assert plateau.spacings == pytest.approx(whole, abs=1.01 * record.displacement[0] / SPACING)
        assert plateau.mean == pytest.approx(LEVEL, abs=1e-3 * AMPLITUDE * LEVEL)


def test_drift_compares_whole_spacings_where_there_are_two():
    """A modulation of a spacing is no drift over two of them; over one its halves differ by 4/π of the amplitude."""
    two, one = (plateau_of(modulated_record(spacings, 0.25 if spacings < 2 else 0.0)) for spacings in (2.4, 1.4))
    assert two.drift == pytest.approx(0.0, abs=1e-3 * AMPLITUDE * LEVEL)
    assert abs(one.drift) > 0.1 * AMPLITUDE * LEVEL


def test_starts_share_a_drift():
    drifting = [replace(plateau_of(noisy_record()), drift=0.02)] * 4
    assert plateau_error(drifting) == pytest.approx(0.01 * student(2), rel=1e-12)
    assert (
        plateau_error([replace(each, drift=drift) for each, drift in zip(drifting, (1, -1, 1, -1), strict=True)]) == 0.0
    )
    assert math.isnan(plateau_error(drifting[:1]))


def test_starts_share_the_drift_of_the_area_that_a_stress_is_over():
    """A tenth of the nodes leaves halfway, under one force: the stress of its halves differs by 10 %, the force by nothing."""
    record = replace(noisy_record(), node_area=1e-3)
    places = np.arange(len(record.displacement))
    steady = plateau_of(record)
    middle = np.searchsorted(record.displacement, 0.5 * (steady.start + steady.end))
    found = plateau_of(replace(record, contact_size=np.where(places < middle, 100, 90)))
    assert found.drift == steady.drift
    early, late = steady.mean / 100.0, steady.mean / 90.0
    change = (late - early) / record.node_area
    noise = abs(steady.drift) / 90.0 / record.node_area
    assert found.stress_drift == pytest.approx(change, abs=noise + 0.02 * change)
    assert stress_error([found] * 4) == pytest.approx(0.5 * found.stress_drift * student(2), rel=1e-12)


@pytest.mark.parametrize(
    ("spacings", "known"), [(0.01, False), (1.0, False), (2.0, True), (0.0, True), (math.nan, False)]
)
def test_means_over_events_have_an_error_if_records_have_met_all_bursts(spacings, known):
    """Half of the events come in a tenth of a node spacing; with constant pressures, 0 spacings, nothing else is ever met."""
    found = [replace(plateau_of(noisy_record()), spacings=each) for each in (2.0, spacings)]
    assert math.isfinite(event_drift_error(found)) == known


def test_starts_share_a_drift_of_their_events():
    """In a slab with sides all starts meet fewer events near them: ± of mean_step held none of eight ensembles."""
    slower = np.concatenate([[PRESLIDING * RUN_IN], np.full(900, SPACING / 900), np.full(1101, SPACING / 1100)])
    found = plateau_of(record_from(slower, STIFFNESS * slower))
    assert found.spacings == pytest.approx(2.0, abs=2.0 / 900)
    assert found.event_drift == pytest.approx(0.2, abs=4.0 / 1000)
    assert event_drift_error([found] * 4) == pytest.approx(0.5 * found.event_drift * student(2), rel=1e-12)
    assert event_drift_error([found, replace(found, event_drift=-found.event_drift)] * 2) == 0.0
    assert math.isnan(event_drift_error([found]))


@pytest.mark.slow
def test_means_over_events_hold_in_a_slab_with_sides():
    """Sixteen ensembles against starts with records four times as long; by their scatter alone ± held in none."""
    case = Case(slab=Slab(n_x=33, scheme="galerkin"), radius=50.0, intrinsic_friction=0.7, max_events=300_000)
    case, compliance, starts = replace(case, max_spacings=2.2), surface_compliance(case.slab), Ensemble(72)

    def means(number: int, **limits: float) -> tuple[Plateau, float]:
        record = friction_record(replace(starts.case(case, number), **limits), compliance)
        return plateau_of(record), event_statistics(record).mean_step

    truth = np.mean([means(64 + number, max_spacings=8.8)[1] for number in range(8)])
    held = []
    for group in range(16):
        plateaus, steps = zip(*(means(4 * group + number) for number in range(4)), strict=True)
        found = mean_of(np.array(steps), event_drift_error(plateaus) * float(np.mean(steps)))
        held.append(abs(found.mean - truth) <= found.uncertainty)
    assert sum(held) >= 8  # 68 % of 16 are 11


def test_a_record_goes_on_to_two_spacings_if_its_events_allow():
    case = Case(slab=Slab(n_x=17, scheme="half_plane"), radius=20.0, max_events=10_000, max_presliding=8.0)
    compliance = surface_compliance(case.slab)
    short, kept = (slide(replace(case, spacing_events=most), compliance) for most in (None, 1))
    assert short.presliding_lengths == pytest.approx(8.0, rel=1e-12)
    np.testing.assert_array_equal(kept.force_after, short.force_after)
    long = slide(replace(case, spacing_events=10_000), compliance)
    count = len(short.displacement)
    np.testing.assert_array_equal(long.force_after[:count], short.force_after)
    assert plateau_of(short).spacings < plateau_of(long).spacings == pytest.approx(2.0, abs=0.05)


def test_a_node_more_changes_the_stiffness_as_computed_anew():
    compliance = surface_compliance(Slab(n_x=33, scheme="strip"))
    contact = (np.arange(33) >= 10) & (np.arange(33) <= 20)

    def stiffness(nodes):
        return np.linalg.solve(compliance.entries(nodes, nodes), np.ones(len(nodes))).sum()

    ends = [stiffness(np.arange(*nodes)) - stiffness(np.arange(10, 21)) for nodes in ((9, 21), (10, 22))]
    assert stiffness_of_node(compliance, contact) == pytest.approx(np.mean(ends), rel=1e-9)
    assert stiffness_of_node(compliance, np.ones(33, bool)) == 0.0


def test_stiffnesses_of_as_many_nodes_are_uncertain_by_a_node_in_one_start():
    alike = np.full(8, 0.42)
    floor = student(8) * 0.01 / 8
    assert node_error(alike, 0.01) == pytest.approx(floor, rel=1e-12)
    one = alike + 0.01 * (np.arange(8) == 3)
    assert mean_of(one, node_error(one, 0.01)).uncertainty == pytest.approx(floor, rel=1e-9)


@pytest.mark.slow
def test_the_stiffness_of_eight_starts_contains_that_of_64():
    """48 groups of 8 starts of four contacts, unlike in how often they have a node more: 2 ± holds in 95 of 100 by Student's t,
    in fewer than 85 by chance of 1 in 1000."""
    held = []
    for scheme, radius in (("half_plane", 60.0), ("half_plane", 75.0), ("strip", 90.0), ("strip", 110.0)):
        case = Case(slab=Slab(n_x=65, scheme=scheme), radius=radius, normal_load=4e-4, max_events=1)
        compliance, places = surface_compliance(case.slab), Ensemble(160)
        starts = [places.case(case, member) for member in range(160)]
        each = np.array([slide(start, compliance).initial_stiffness for start in starts])
        nodes = [stiffness_of_node(compliance, initial_contact(start, compliance).contact) for start in starts[:96]]
        truth = each[96:].mean()
        for group in np.arange(96).reshape(12, 8):
            found = mean_of(each[group], node_error(each[group], float(np.take(nodes, group).mean())))
            held.append(abs(found.mean - truth) / found.uncertainty)
    assert np.mean(np.array(held) <= 2.0) >= 0.85
    assert max(held) < 5.0


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
    far = record_from(np.full(100, 1e-4), np.full(100, 1e-7), tail=2e-4)
    assert event_statistics(far).spacings == pytest.approx(1.02e-2 / SPACING, rel=1e-12)  # of the whole record


def first_events(record, count):
    columns = ("displacement", "force_before", "force_after", "stiffness", "dissipated", "kind", "node", "slips")
    columns += ("releases", "touches", "contact_size")
    return replace(record, **{name: getattr(record, name)[:count] for name in columns})


def test_a_record_without_events_has_no_means():
    record = first_events(record_from([1e-6], [0.0]), 0)
    found = event_statistics(record)
    assert found.events == 0
    assert np.isnan([found.mean_step, found.mean_slips, found.mean_drop]).all()
    assert found.peak_friction == record.final_force / LOAD
    assert np.isnan(event_statistics(replace(record, final_displacement=0.0)).peak_friction)  # the pin has not moved


SEVEN = np.array([3, 1, 4, 1, 5, 9, 2])
"""A cycle of seven events: their nodes, and how large their drops are; two of them are of one node."""


def cyclic(turns, before=300):
    """Events at random nodes, then so many turns of SEVEN."""
    rng, turned = np.random.default_rng(7), np.resize(SEVEN, round(7 * turns))
    drops = np.concatenate((rng.random(before) * 1e-6, turned * 1e-7))
    steps = np.concatenate((drops[:before], np.roll(turned, 2) * 1e-7)) / STIFFNESS
    nodes = np.concatenate((rng.integers(10, 60, before), turned))
    return replace(record_from(steps, drops), node=nodes.astype(np.int32))


@pytest.mark.parametrize("turns", [0, 1, 2, 2.9, 3, 3.5, 10, 1200])
def test_a_cycle_at_the_end_of_a_record_is_found_from_the_third_turn_on(turns):
    """1200 of them are more events than are searched."""
    found = event_statistics(cyclic(turns))
    assert found.cycle_events == (7 if turns >= 3 else 0)
    # One turn is Σ SEVEN·1e-7 / STIFFNESS long, to rounding of displacements that many turns add up to.
    long = 25e-7 / STIFFNESS / SPACING if turns >= 3 else 0.0
    assert found.cycle_spacings == pytest.approx(long, rel=1e-9)


def test_of_all_cycles_the_shortest_is_taken():
    """The definition gives the same on events at few nodes whose forces nearly repeat, as their last two turns do."""
    rng, found = np.random.default_rng(1), set()
    for _ in range(300):
        turn, count = int(rng.integers(1, 9)), int(rng.integers(8, 40))
        node, drop = (np.resize(each, count) for each in (rng.integers(0, 2, turn), rng.random(turn)))
        after = np.resize(rng.random(turn), count) + 10.0 ** rng.uniform(-5, -2) * rng.random(count)
        record = replace(
            record_from(np.ones(count), drop), node=node.astype(np.int32), force_before=after + drop, force_after=after
        )
        off = {
            period: np.abs(after[-2 * period :] - after[-3 * period : -period]) for period in range(1, count // 3 + 1)
        }
        fits = [
            period
            for period in off
            if (node[-2 * period :] == node[-3 * period : -period]).all()
            and off[period].max() <= 1e-3 * np.abs(record.force_before - after)[-period:].max()
        ]
        found.add(repeat_length(record))
        assert repeat_length(record) == min(fits, default=0)
    assert len(found) > 4


def test_what_ended_is_noise_or_chatters_is_no_cycle():
    """Little events after large ones: a node chatters while the force creeps on, every drop a hundred thousandth of those
    before, every force another."""
    record, noisy, rng = cyclic(10), noisy_record(), np.random.default_rng(3)
    ended = replace(record, node=np.append(record.node[:-1], 60).astype(np.int32))
    anywhere = replace(noisy, node=rng.integers(0, 9, len(noisy.node)).astype(np.int32))
    steps = np.concatenate((np.full(50, 1.1e-6), np.full(5, 5e-11))) / STIFFNESS
    creeping = record_from(steps, np.concatenate((np.full(50, 1e-6), np.full(5, 1e-11))))
    assert np.abs(np.diff(creeping.force_after[-5:])).min() > 0.9e-11
    assert [repeat_length(each) for each in (ended, noisy, anywhere, creeping)] == [0, 0, 0, 0]


@pytest.mark.parametrize(("events", "cycle"), [(0, 0), (1, 0), (2, 0), (3, 1)])
def test_three_times_the_same_event_is_a_cycle_of_one_and_fewer_are_none(events, cycle):
    assert repeat_length(first_events(record_from(np.full(3, 1e-6), np.full(3, STIFFNESS * 1e-6)), events)) == cycle


def test_searching_for_a_cycle_takes_no_time():
    """Force that is equal after every event, and nodes among which every second is a candidate: nearly 1000 periods are tried,
    each of up to 4000 events. 15 ms where it was written; what grew with the cube would take minutes."""
    events = 2 * LONGEST_CYCLE
    record = record_from(np.full(events, 1e-6), np.full(events, STIFFNESS * 1e-6))
    record = replace(record, node=np.random.default_rng(5).integers(0, 2, events).astype(np.int32))
    started = time.perf_counter()
    assert repeat_length(record) == 0
    assert time.perf_counter() - started < 2.0
