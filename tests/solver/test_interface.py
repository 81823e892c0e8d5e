"""Contacts of one rigid slider: their sum is exact where it is read, bounded between, and what independent springs add up to."""

from dataclasses import dataclass, field, fields, replace

import numpy as np
import pytest

from nanoslip import (
    Case,
    Chain,
    Drive,
    Effects,
    Heterogeneity,
    Interface,
    InvalidInput,
    Slab,
    SlipRule,
    friction_record,
    plateau_of,
)
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.dynamics.duration import measure_motion
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.ensemble import Ensemble
from nanoslip.solver.outcome import Ending, SolverError
from nanoslip.solver.sliding.interface import PIECES, batches, chances, compressions, interface_contact
from nanoslip.solver.sliding.plateau import Teeth, teeth
from nanoslip.solver.sliding.slide import slide
from nanoslip.solver.sliding.slider import interface, portion, shares, slider
from nanoslip.solver.sliding.statistics import EventStatistics, collective, event_statistics

SLAB = Slab(n_x=33, scheme="strip")
COMPLIANCE = surface_compliance(SLAB)
CASE = Case(slab=SLAB, max_events=100_000, max_presliding=4.0)


def interface_of(contacts: int, case: Case = CASE, **more: object) -> Case:
    return replace(case, interface=Interface(contacts, **more))  # type: ignore[arg-type]


def test_as_many_equal_contacts_are_so_many_times_one() -> None:
    one = portion(interface_of(4), COMPLIANCE, 0, 1)
    found = slider(interface_of(4), [one] * 4)
    np.testing.assert_array_equal(found.record.force_before, 4.0 * one.force[1:])
    assert found.record.initial_stiffness == 4.0 * one.stiffness
    rises = found.record.stiffness * np.diff(found.record.displacement, append=found.record.displacement[-1])
    np.testing.assert_allclose((found.record.force_after + rises)[:-1], found.record.force_before[1:], rtol=1e-9)
    assert found.record.stiffness[-1] == 0.0  # nothing comes after it
    assert found.statistics.mean_drop == pytest.approx(
        slider(interface_of(1), [one]).statistics.mean_drop / 4.0, rel=1e-12
    )


def test_events_of_an_interface_of_one_contact_are_counted_as_those_of_its_record() -> None:
    """All numbers but the cycle, which a sum that is read at fixed distances does not show."""
    alone = slide(CASE, COMPLIANCE)
    own = event_statistics(alone)
    sum_of_one = slider(interface_of(1), [portion(interface_of(1), COMPLIANCE, 0, 1)])
    found = sum_of_one.statistics
    assert found.peak_friction <= own.peak_friction <= sum_of_one.bound / alone.normal_load * (1.0 + 1e-9)
    for item in fields(own):
        if item.name not in ("cycle_events", "cycle_spacings", "peak_friction"):
            expected = getattr(own, item.name)
            # The record of a sum ends after the last event: its mean step is longer by less than one of the steps.
            rounding = 1.0 / own.events if item.name == "mean_step" else 1e-9
            assert getattr(found, item.name) == pytest.approx(expected, rel=rounding), item.name


def test_a_new_number_of_events_is_an_error_until_it_is_decided_for_an_interface(monkeypatch) -> None:
    """Else it would count the pieces in which a sum is read."""

    @dataclass(frozen=True, slots=True, repr=False)
    class More(EventStatistics):
        largest_cascade: int = field()

    part = portion(interface_of(1), COMPLIANCE, 0, 1)
    monkeypatch.setattr("nanoslip.solver.sliding.slider.EventStatistics", More)
    with pytest.raises(TypeError, match="largest_cascade"):
        slider(interface_of(1), [part])


def test_a_slider_on_springs_moves_as_one_of_its_equal_contacts_on_one() -> None:
    """N times the friction on a spring N times as stiff, at the same mass: all times are sqrt(N) times shorter."""
    part, contacts = portion(interface_of(4), COMPLIANCE, 0, 1), 4
    found = {}
    for count in (1, contacts):
        record = slider(interface_of(count), [part] * count).record
        pace = np.sqrt(count)
        drive = Drive(0.05 * count, 0.1, 2e-6 * pace, duration=4e3 / pace)
        found[count] = measure_motion(record, plateau_of(record), drive)[1]
    assert found[1].outcome.ok
    assert found[contacts].static_friction == pytest.approx(found[1].static_friction, rel=1e-9)
    assert found[contacts].kinetic_friction == pytest.approx(found[1].kinetic_friction, rel=1e-6)


def test_one_contact_is_the_case_itself() -> None:
    """Read at fixed distances it has the record's force there, to the last bit, and its highest force is in the bound."""
    alone = slide(CASE, COMPLIANCE)
    found = slider(interface_of(1), [portion(interface_of(1), COMPLIANCE, 0, 1)])
    np.testing.assert_array_equal(found.record.force_after[:-1], teeth(alone).force(found.record.displacement[:-1]))
    assert found.record.final_force == alone.final_force
    assert found.bound == max(alone.force_before.max(), alone.force_after.max(), alone.initial_force)
    assert found.statistics.events == len(alone.displacement)
    assert found.record.slips.sum() == alone.slips.sum()
    assert plateau_of(found.record).mean == pytest.approx(
        plateau_of(alone).mean, rel=2e-4
    )  # read 2000 times in a length
    whole = collective(alone, plateau_of(alone))
    assert whole.static_excess == pytest.approx(found.bound / (plateau_of(alone).mean * CASE.normal_load) - 1.0)
    assert whole.unseen_force == 0.0


@pytest.mark.parametrize("loads", ["equal", "exponential", "heights"])
def test_sum_is_exact_where_it_is_read_and_bounded_between(loads: str) -> None:
    case = interface_of(5, replace(CASE, heterogeneity=Heterogeneity(spread=0.2)), loads=loads)
    found = interface(case, COMPLIANCE)
    end, each = found.record.final_displacement, shares(case, COMPLIANCE)
    records = [
        teeth(
            slide(replace(interface_contact(case, n, each[n]), max_presliding=None, max_displacement=end), COMPLIANCE)
        )
        for n in range(5)
    ]
    np.testing.assert_allclose(
        found.record.force_before[:-1], sum(one.force(found.record.displacement[:-1]) for one in records), rtol=1e-12
    )
    jumps = np.unique(np.concatenate([one.edges for one in records]))
    before = sum(_before(one, jumps[1:-1]) for one in records)
    exact = float(max(np.max(before), found.record.force_before.max()))
    assert found.record.force_before.max() <= exact <= found.bound * (1.0 + 1e-12)
    assert found.bound < 1.005 * exact  # a piece is a two thousandth of what it takes to slide
    plateau = plateau_of(found.record)
    unseen = collective(found.record, plateau, found.bound).unseen_force * plateau.mean * found.record.normal_load
    assert unseen == pytest.approx(found.bound - found.record.highest_force, abs=1e-12 * found.bound)
    assert found.record.normal_load == 5.0 * CASE.normal_load


def _before(one: Teeth, x: np.ndarray) -> np.ndarray:
    """The force just before each x."""
    return one.force(np.nextafter(x, 0.0))


def test_sum_does_not_depend_on_who_adds_it() -> None:
    """Batches in any number are the same contacts; the order of a sum matters to rounding alone, and is fixed by their number."""
    case = interface_of(7)
    whole = slider(case, [portion(case, COMPLIANCE, 0, 7)]).record
    parts = slider(case, [portion(case, COMPLIANCE, *each) for each in ((0, 2), (2, 3), (3, 7))]).record
    np.testing.assert_allclose(whole.force_before, parts.force_before, rtol=1e-13)
    again = friction_record(case)
    np.testing.assert_array_equal(again.force_before, interface(case, COMPLIANCE).record.force_before)
    for contacts in (2, 16, 17, 1000, 4096, 10**5):
        found = batches(contacts)
        assert len(found) <= 16
        assert [first for first, _ in found[1:]] == [beyond for _, beyond in found[:-1]]
        assert (found[0][0], found[-1][1]) == (0, contacts)


def test_contacts_are_drawn_independently() -> None:
    """Starts are uniform, of one interface and from one interface to another; nodes are the contact's own."""
    case = replace(CASE, heterogeneity=Heterogeneity(spread=0.1))
    members = [Ensemble(members=2).case(interface_of(500, case), member) for member in range(2)]
    starts = [np.array([interface_contact(member, n).start for n in range(500)]) for member in members]
    for each in starts:
        counts = np.histogram(each, 10, (0.0, 1.0))[0]
        assert ((counts - 50.0) ** 2 / 50.0).sum() < 27.9  # chi squared of 9 degrees of freedom: one in a thousand
    shifted = (starts[0] - starts[1]) % 1.0
    assert ((np.histogram(shifted, 10, (0.0, 1.0))[0] - 50.0) ** 2 / 50.0).sum() < 27.9
    assert len({interface_contact(member, n).heterogeneity.seed for member in members for n in range(500)}) == 1000
    assert interface_contact(members[0], 0) == replace(members[0], interface=Interface())


def test_loads_are_exponential_and_their_mean_is_the_load() -> None:
    each = shares(interface_of(20_000, loads="exponential"), COMPLIANCE)
    assert each.mean() == pytest.approx(1.0, rel=1e-12)
    assert np.sort(each)[10_000] == pytest.approx(np.log(2.0), rel=0.03)  # four standard errors of a median of so many
    assert each.std() == pytest.approx(1.0, rel=0.04)


@pytest.mark.parametrize("residual", [0.0, 0.6])
@pytest.mark.parametrize(("contacts", "friction"), [(1, 0.05), (1, 0.5), (8, 0.05), (8, 0.5)])
def test_static_over_kinetic_friction_is_from_one_to_two(contacts: int, friction: float, residual: float) -> None:
    """No node carries more than μ_i times its pressure, and on the plateau they carry (1 + r)/2 of it or more."""
    rule = SlipRule(residual_shear=residual)
    found = interface(interface_of(contacts, replace(CASE, intrinsic_friction=friction, slip_rule=rule)), COMPLIANCE)
    ratio = 1.0 + collective(found.record, plateau_of(found.record), found.bound).static_excess
    assert 1.0 <= ratio <= 2.0 / (1.0 + residual)


def test_measured_loads_are_drawn_as_often_as_they_were_seen() -> None:
    seen = (3.0, 1.0, 1.0, 5.0)
    each = shares(interface_of(20_000, measured_loads=seen), COMPLIANCE)
    assert each.mean() == pytest.approx(1.0, rel=1e-12)
    drawn, counts = np.unique(each, return_counts=True)
    np.testing.assert_allclose(drawn / drawn[0], [1.0, 3.0, 5.0], rtol=1e-12)
    np.testing.assert_allclose(counts, [10_000, 5_000, 5_000], atol=4 * 71)  # four standard deviations of a count
    with pytest.raises(InvalidInput, match="loads = 'heights' with measured_loads"):
        Interface(2, "heights", seen)


def test_a_rigid_plane_presses_all_asperities_to_one_depth() -> None:
    """Each contact alone, without friction, goes down as far as its height asks, to what a table of loads by twos leaves."""
    case = interface_of(40, replace(CASE, slab=Slab(n_x=257, scheme="strip")), loads="heights")
    compliance = surface_compliance(case.slab)
    loads, heights = case.normal_load * shares(case, compliance), compressions(chances(case))
    heaviest = np.argsort(loads)[-30:]  # of the lightest two or three nodes touch
    alone = [replace(CASE, slab=case.slab, normal_load=loads[n], effects=Effects(friction=False)) for n in heaviest]
    depth = np.array([initial_contact(each, compliance).approach for each in alone]) / heights[heaviest]
    assert loads.mean() == pytest.approx(case.normal_load, rel=1e-9)
    np.testing.assert_allclose(depth, depth.mean(), rtol=0.01)
    assert np.argsort(loads).tolist() == np.argsort(heights).tolist()


def test_loads_that_no_contact_tells_are_an_outcome() -> None:
    with pytest.raises(SolverError, match='loads = "heights"'):
        interface(interface_of(2, replace(CASE, normal_load=0.9), loads="heights"), COMPLIANCE)


def test_what_cannot_be_computed_is_counted_and_said() -> None:
    """Large loads need more events to the common end. The others carry on; without half of them there is no interface."""
    case = interface_of(8, replace(CASE, max_events=10), loads="equal")
    with pytest.raises(SolverError, match=r"raise limits\.events") as caught:
        interface(case, COMPLIANCE)
    assert caught.value.outcome.ending is Ending.INVALID
    good = [portion(interface_of(8), COMPLIANCE, n, n + 1) for n in range(5)]
    carried = sum(one.force for one in good)
    for lost in (1, 3):
        some = slider(interface_of(8), [*good, portion(case, COMPLIANCE, 5, 5 + lost)])
        assert some.lost == lost
        assert some.record.outcome.ok
        assert some.record.outcome.message.startswith(f"{lost} of 8 contacts invalid")
        np.testing.assert_allclose(some.record.force_before, carried[1:] * 8.0 / 5.0, rtol=1e-13)


def test_contacts_of_one_slider_need_a_common_end() -> None:
    with pytest.raises(InvalidInput, match=r"contacts = 2: .*presliding, displacement"):
        Case(interface=Interface(2))


# Independent springs. Blocks of a chain without coupling under a flat punch are springs of one stiffness k, each with a threshold
# μ_i·p that is its own and stays: spring j carries k·(δ mod x_j) with x_j = μ_j·p/k, so the slider N·k·E[δ mod x]. Before any
# spring slips for the second time that is the master equation of springs whose thresholds are drawn anew at each slip, too
# (Farkas, Dahmen and Wolf, cond-mat/0502644; Braun and Peyrard, arXiv 0802.2144): F = N·k·(δ·P(x > δ) + E[δ - x; x < δ]).


SPRINGS = Case(
    pin="flat_punch",
    half_width=0.25,
    slab=Slab(n_x=65, scheme=Chain(coupling_stiffness=0.0)),
    effects=Effects(coupling=False, pin_translation=False),
    heterogeneity=Heterogeneity(distribution="uniform", spread=0.2),
    max_events=None,
    max_presliding=6.0,
)


@pytest.mark.slow
def test_springs_follow_the_master_equation() -> None:
    contacts = 600
    found = interface(interface_of(contacts, SPRINGS), surface_compliance(SPRINGS.slab))
    record = found.record
    mean = (
        SPRINGS.intrinsic_friction * SPRINGS.normal_load / (record.initial_stiffness / contacts)
    )  # k x = μ p, node by node
    low, high = mean * (1.0 - 0.2 * np.sqrt(3.0)), mean * (1.0 + 0.2 * np.sqrt(3.0))
    thresholds = np.linspace(low, high, 20_001)
    x = record.displacement[:: PIECES // 256]
    expected = record.initial_stiffness * np.array([np.mean(one % thresholds) for one in x])
    # 20,000 springs, whose shear scatters by 0.3 of its mean: 0.2 %, four times over
    np.testing.assert_allclose(record.force_after[:: PIECES // 256], expected, atol=0.008 * expected.max())
    once = x < 2.0 * low  # no spring has slipped twice
    slipped = np.clip((x - low) / (high - low), 0.0, 1.0)
    rest = np.where(slipped < 1.0, 0.5 * (x - low) * slipped, x - mean)
    redrawn = record.initial_stiffness * (x * (1.0 - slipped) + np.where(x > low, rest, 0.0))
    np.testing.assert_allclose(expected[once], redrawn[once], rtol=1e-3)
    together = collective(record, plateau_of(record), found.bound)
    assert 1.0 < 1.0 + together.static_excess < 2.0  # a slider of equal springs would reach twice its mean


@pytest.mark.slow
def test_fluctuations_of_independent_contacts_fall_as_the_root_of_their_number() -> None:
    """± over 6 interfaces; the exponent of 4 to 64 contacts within four of its standard errors, about 0.05 each."""
    case = replace(CASE, heterogeneity=Heterogeneity(spread=0.2))
    found = {}
    for contacts in (4, 64):
        ensemble = Ensemble(members=6)
        sums = (interface(ensemble.case(interface_of(contacts, case), number), COMPLIANCE) for number in range(6))
        found[contacts] = np.mean([collective(one.record, plateau_of(one.record)).fluctuation for one in sums])
    assert np.log(found[64] / found[4]) / np.log(16.0) == pytest.approx(-0.5, abs=0.1)
