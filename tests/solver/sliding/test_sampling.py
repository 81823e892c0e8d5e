"""What a stretch of a record can know: nothing of the phases that it did not see, all of them from one node spacing on."""

import math
from dataclasses import replace

import numpy as np
import pytest
import scipy.stats

from solver.sliding.sampling import (
    BETWEEN,
    CYCLES,
    DISORDER,
    EVENLY,
    EVENT_ALONE,
    EVENT_DISORDER,
    EVENT_LEFT_OVER,
    KNOWN,
    LEFT_OVER,
    MODULATION,
    OVERSHOOT,
    SHARED,
    WANDER,
    Members,
    Sampling,
    ensemble_uncertainty,
    expected_of_ensemble,
    scatter,
    scatter_uncertainty,
    uncertainty_of_members,
)

BLOCKS = 1.0 + 0.01 * np.sin(np.arange(32) * 1.7)
SEEN = float(np.std(BLOCKS, ddof=1))
LENGTHS = np.linspace(0.01, 0.99, 99)


@pytest.mark.parametrize("spacings", [0.0, 0.1, 0.5, 0.73, 0.999])
def test_what_is_unseen_is_the_mean_of_a_wave_over_the_stretch(spacings: float) -> None:
    """The largest mean that cos 2πx can have over a stretch of length s, by quadrature: |sin πs|/πs."""
    x = (np.arange(10_000) + 0.5) / 10_000
    largest = abs(float(np.cos(2 * np.pi * spacings * (x - 0.5)).mean()))
    assert Sampling(spacings, 9.0).unseen == pytest.approx(largest, rel=1e-6, abs=1e-9)  # midpoint rule: (π s/10⁴)²/6


@pytest.mark.parametrize("spacings", [1, 1.0, 1.3, 1.5, 4.0])
def test_nothing_is_unseen_from_one_spacing_on(spacings: float) -> None:
    assert Sampling(spacings, 9.0).unseen == 0.0


def test_what_single_spacings_differ_by_falls_as_the_root_of_their_number() -> None:
    """Four spacings whose means scatter like those of sixteen are known half as well."""
    flat, mean = np.full(32, 10.0), 10.0
    for spread in (0.05, 0.5):
        of = {}
        for count in (4, 16, 64):
            means = mean + spread * np.tile([-1.0, 1.0], count // 2) * math.sqrt((count - 1) / count)
            of[count] = Sampling(float(count), 9.0).of_mean_force(flat, 0.0, means)
            # One of them counts as it is to be expected, not as it was seen.
            expected = math.hypot(spread * math.sqrt(count - 1), BETWEEN / 9.0 * mean) / count
            assert of[count] == pytest.approx(expected, rel=1e-12)
        assert of[4] > of[16] > of[64]


@pytest.mark.parametrize("count", range(3, 20))
def test_twice_the_uncertainty_of_a_drift_reaches_where_the_force_is_at_last(count: int) -> None:
    """The mean of a force that goes on rising is off by half of the rise by the plateau's end."""
    rise = 10.0 + 0.1 * np.arange(count)
    stated = Sampling(float(count), 9.0).of_mean_force(np.full(32, 10.0), 0.0, rise)
    assert 2.0 * stated >= (rise[-1] - rise.mean()) * (1.0 - 1e-12)  # two halves of an odd number of spacings just do


def test_spacings_whose_neighbours_are_alike_are_known_less_well() -> None:
    flat, wave = np.full(32, 10.0), 10.0 + 0.1 * np.repeat([1.0, -1.0], 8)
    slow, fast = (Sampling(16.0, 9.0).of_mean_force(flat, 0.0, means) for means in (wave, np.tile([10.1, 9.9], 8)))
    assert slow == pytest.approx(0.1, rel=1e-12)  # of two independent numbers
    assert fast < 0.03


def test_spacings_that_are_alike_by_chance_are_not_taken_for_certain() -> None:
    means = np.array([10.0, 10.0 + 1e-2])
    assert Sampling(2.0, 9.0).of_mean_force(np.full(32, 10.0), 0.0, means) > 0.5 * BETWEEN / 9.0 * 10.0


def test_more_of_the_same_cycle_says_nothing_of_others() -> None:
    flat = np.full(32, 10.0)
    known = [Sampling(float(count), 9.0).of_mean_force(flat, 0.0, np.full(count, 10.0)) for count in (2, 8, 64)]
    assert known == pytest.approx([CYCLES / 9.0 * 10.0] * 3, rel=1e-12)


@pytest.mark.parametrize("spacings", [0.01, 0.5, 0.99, 1.0, 1.9])
def test_fewer_than_two_spacings_do_not_say_how_much_they_differ(spacings: float) -> None:
    """However smooth what was seen: the next spacing has another mean."""
    stretch = Sampling(spacings, 9.0)
    known = stretch.of_length(np.full(32, 10.0), 0.0)
    least = BETWEEN / 9.0 * (1.0 - 1e-12)
    assert known >= 10.0 * least
    assert stretch.expected_of_mean_force >= least


@pytest.mark.parametrize("spacings", [0.5, 1.0, 2.0, 8.0])
def test_over_nodes_that_differ_the_mean_force_wanders_as_they_come_and_go(spacings: float) -> None:
    """One of m nodes is another one after each spacing: more of the record is less alike, and that is its length's error."""
    means = None if spacings < 2.0 else np.full(int(spacings), 10.0)
    smooth, drawn = Sampling(spacings, 20.0), Sampling(spacings, 20.0, spread=0.2)
    flat = np.full(32, 10.0)
    wandering = WANDER * math.sqrt(0.2) / 20.0 * 10.0
    expected = math.hypot(smooth.of_length(flat, 0.0, means), wandering)
    assert drawn.of_length(flat, 0.0, means) == pytest.approx(expected, rel=1e-14)
    assert replace(drawn, spacings=0.0).of_length(flat, 0.0) == replace(smooth, spacings=0.0).of_length(flat, 0.0)


def test_what_is_to_be_expected_falls_with_length_nodes_and_residual() -> None:
    lengths = [
        Sampling(spacings, 9.0).expected_of_mean_force for spacings in (0.0, 0.1, 0.3, 0.5, 0.7, 1.0, 2.0, 4.0, 64.0)
    ]
    assert np.all(np.diff(lengths) < 0.0)
    assert lengths[0] == pytest.approx(math.hypot(MODULATION, BETWEEN) / 9.0, rel=1e-12)
    assert Sampling(0.3, 40.0).expected_of_mean_force < Sampling(0.3, 9.0).expected_of_mean_force
    assert Sampling(0.3, 9.0, 1.0).expected_of_mean_force == 0.0


@pytest.mark.parametrize("spacings", [0.0, 0.3, 1.0, 1.7, 4.0])
def test_nodes_that_give_way_as_one_make_a_contact_one_of_fewer_nodes(spacings: float) -> None:
    """Forty of them in fours know a mean like ten, a peak and events like half as many as there are: groups of four drop."""
    means = None if spacings < 2.0 else np.full(4, 10.0)
    together, few = Sampling(spacings, 40.0, nodes_as_one=4.0), Sampling(spacings, 10.0)
    for name in ("discreteness", "expected_of_mean_force"):
        assert getattr(together, name) == pytest.approx(getattr(few, name), rel=1e-14)
    flat = np.full(32, 10.0)
    assert together.of_length(flat, 0.0, means) == pytest.approx(few.of_length(flat, 0.0, means), rel=1e-14)
    assert together.of_peak() == pytest.approx(Sampling(spacings, 20.0).of_peak(), rel=1e-14)
    if spacings in (1.0, 4.0):
        assert together.of_events() == pytest.approx(2.0 * few.of_events(), rel=1e-14)


def test_no_more_nodes_give_way_than_there_are() -> None:
    assert Sampling(0.3, 9.0, nodes_as_one=50.0).discreteness == 1.0
    assert Sampling(0.3, 9.0, 0.5, nodes_as_one=50.0).discreteness == 0.5


def test_the_modulation_of_whole_spacings_falls_as_one_over_their_number() -> None:
    one, between = LEFT_OVER * SEEN / math.sqrt(32), BETWEEN / 9.0 * BLOCKS.mean()
    assert Sampling(1.0, 9.0).of_mean_force(BLOCKS, 1.0) == pytest.approx(math.hypot(one, between), rel=1e-14)
    for count in range(2, 9):
        alike = np.full(count, BLOCKS.mean())  # a cycle
        known = math.hypot(one / count, CYCLES / 9.0 * BLOCKS.mean())
        assert Sampling(float(count), 9.0).of_mean_force(BLOCKS, 1.0, alike) == pytest.approx(known, rel=1e-14)


def test_over_a_vanishing_stretch_the_whole_modulation_is_open() -> None:
    """Nothing of it was seen, so its size is the model's, whatever the blocks say of themselves."""
    short = Sampling(1e-6, 9.0)
    whole = math.hypot(MODULATION, BETWEEN) / 9.0
    assert short.of_mean_force(np.ones(32), 0.0) == pytest.approx(whole, rel=1e-9)
    assert short.of_mean_force(BLOCKS, 0.0) == pytest.approx(whole * BLOCKS.mean(), rel=1e-9)


def test_it_falls_with_length_with_nodes_with_residual() -> None:
    def of(spacings: float, nodes: float = 9.0, residual_shear: float = 0.0) -> float:
        return Sampling(spacings, nodes, residual_shear).of_mean_force(BLOCKS, SEEN / math.sqrt(32))

    assert np.all(np.diff([of(spacings) for spacings in LENGTHS]) < 0.0)
    assert np.all(np.diff([of(0.3, nodes) for nodes in (1.0, 3.0, 9.0, 40.0)]) < 0.0)
    assert np.all(np.diff([of(0.3, residual_shear=residual_shear) for residual_shear in (0.0, 0.3, 0.9, 1.0)]) < 0.0)
    # Just before one spacing all of it was seen too: the two rules differ by LEFT_OVER alone.
    between = BETWEEN / 9.0 * BLOCKS.mean()
    assert math.sqrt((of(1.0) ** 2 - between**2) / (of(1.0 - 1e-6) ** 2 - between**2)) == pytest.approx(
        LEFT_OVER, rel=1e-5
    )


def test_it_is_never_less_than_what_the_blocks_say_below_one_spacing() -> None:
    for spacings in LENGTHS:
        assert Sampling(spacings, 9.0).of_mean_force(BLOCKS, 0.02) >= 0.02


def test_without_drops_nothing_is_modulated() -> None:
    """At residual_shear 1 slips drop nothing: what is left is what the blocks say, which see little of a short stretch."""
    smooth = Sampling(1e-3, 9.0, residual_shear=1.0)
    assert smooth.discreteness == 0.0
    assert smooth.of_peak() == 0.0
    assert smooth.of_mean_force(np.ones(32), 2e-3) == 2e-3
    assert smooth.of_mean_force(BLOCKS, 2e-3) == pytest.approx(2e-3, rel=1e-4)


def test_a_first_slip_above_the_plateau_is_known_the_less_whatever_the_nodes() -> None:
    """But for so few that their modulation is more, and for slips that drop nothing."""
    for nodes in (30.0, 300.0):
        assert Sampling(2.0, nodes).of_peak(1e-3) == OVERSHOOT > Sampling(2.0, nodes).of_peak()
        assert Sampling(2.0, nodes).of_peak(0.3) == 0.15  # back to the plateau
        assert Sampling(2.0, nodes).of_peak(-0.3) == Sampling(2.0, nodes).of_peak()
    assert Sampling(2.0, 5.0).of_peak(1e-3) == Sampling(2.0, 5.0).of_peak() > OVERSHOOT
    assert Sampling(2.0, 30.0, residual_shear=1.0).of_peak(0.3) == 0.0
    both = math.hypot(OVERSHOOT, DISORDER * 0.2 / math.sqrt(30.0))
    assert Sampling(2.0, 30.0, spread=0.2).of_peak(1e-3) == pytest.approx(both, rel=1e-14)


def test_fewer_than_one_node_counts_as_one() -> None:
    assert Sampling(0.3, 0.0).discreteness == Sampling(0.3, 1.0).discreteness == 1.0
    assert Sampling(0.3, 0.0, spread=0.2).of_peak() == Sampling(0.3, 1.0, spread=0.2).of_peak()


def test_disorder_falls_as_the_root_of_the_nodes_that_were_met() -> None:
    """Over s spacings a contact of n nodes meets n + s of them."""
    drawn = Sampling(4.0, 12.0, spread=0.2)
    assert drawn.disorder == pytest.approx(DISORDER * 0.2 / 4.0)
    assert replace(drawn, spacings=52.0).disorder == pytest.approx(drawn.disorder / 2.0)
    assert replace(drawn, spread=0.4).disorder == pytest.approx(2.0 * drawn.disorder)
    assert replace(drawn, spread=0.0).disorder == 0.0


@pytest.mark.parametrize("spacings", [0.3, 1.0, 4.0])
def test_disorder_is_in_everything_that_is_stated(spacings: float) -> None:
    """Other nodes would have had other μ_i, however long the record: in squares, since it is of another cause."""
    plain, drawn = Sampling(spacings, 9.0), Sampling(spacings, 9.0, spread=0.3)
    force = math.hypot(drawn.of_length(BLOCKS, 1e-3), drawn.disorder * BLOCKS.mean())
    assert drawn.of_length(BLOCKS, 1e-3) > plain.of_length(BLOCKS, 1e-3) == plain.of_mean_force(BLOCKS, 1e-3)
    assert drawn.of_mean_force(BLOCKS, 1e-3) == pytest.approx(force, rel=1e-14)
    assert drawn.of_events() == pytest.approx(math.hypot(plain.of_events(), EVENT_DISORDER * drawn.disorder), rel=1e-14)
    assert drawn.of_peak() > plain.of_peak()


def test_of_events_nothing_is_known_before_first_touch_is_forgotten() -> None:
    assert math.isnan(Sampling(0.999 * KNOWN, 9.0).of_events())
    known = [Sampling(spacings, 9.0).of_events() for spacings in np.linspace(KNOWN, 0.99, 50)]
    assert np.isfinite(known).all()
    assert np.all(np.diff(known) < 0.0)
    assert Sampling(1.0, 9.0).of_events() == EVENT_LEFT_OVER < EVENT_ALONE
    assert Sampling(5.0, 9.0).of_events() == EVENT_LEFT_OVER / 5.0
    # A record of events is not cut to whole spacings: what is more than those is of some phases only.
    assert Sampling(1.5, 9.0).of_events() > 2.0 * Sampling(1.0, 9.0).of_events()


def test_events_that_drop_nothing_are_known_from_the_first() -> None:
    assert Sampling(0.01, 9.0, residual_shear=1.0).of_events() == 0.0
    assert Sampling(0.01, 9.0, residual_shear=1.0, spread=0.2).of_events() > 0.0


def student(members: int) -> float:
    """Half of the distance in standard errors, of so many Gaussian values, that 95 of 100 means keep to."""
    return float(scipy.stats.t.ppf(0.975, members - 1)) / 2.0


@pytest.mark.parametrize("members", [2, 4, 8, 64])
def test_twice_the_error_of_few_independent_members_holds_in_95_of_100(members: int) -> None:
    """A share of 4000 is known to 0.0035. Twice the plain standard error of four holds in 0.86."""
    draws = np.random.default_rng(3).normal(size=(4000, members))
    held = [abs(each.mean()) <= 2.0 * scatter_uncertainty(each) for each in draws]
    assert np.mean(held) == pytest.approx(0.95, abs=0.0125)


VALUES = np.array([1.0, 1.02, 0.99, 1.01])
STATED = np.array([0.1, 0.3, 0.2, 0.2])


@pytest.mark.parametrize(
    ("spacings", "shared"), [(0.3, SHARED[0]), (0.49, SHARED[0]), (0.5, SHARED[1]), (2.0, SHARED[1])]
)
def test_evenly_spread_members_know_more_than_as_many_by_chance(spacings: float, shared: float) -> None:
    chance = student(4) * float(np.std(VALUES, ddof=1)) / 2.0
    assert ensemble_uncertainty(VALUES, STATED, spacings) == pytest.approx(
        math.hypot(EVENLY * chance, shared * 0.2), rel=1e-14
    )


def test_members_have_nothing_of_the_draw_of_their_nodes_in_common() -> None:
    """Each has a seed of its own. It counted as shared: 128 members with a spread of 0.5 stated 10 %, and knew 1 %."""
    values = 0.35 * (1.0 + 0.1 * np.random.default_rng(4).normal(size=64))
    drawn = np.full(64, 0.08)
    assert ensemble_uncertainty(values, 0.08 * values, 1.0, drawn) == pytest.approx(scatter_uncertainty(values))
    both = ensemble_uncertainty(values, np.hypot(0.08 * values, 0.01), 1.0, drawn)
    assert both == pytest.approx(math.hypot(scatter_uncertainty(values), SHARED[1] * 0.01))
    assert expected_of_ensemble(0.15, 1.0, 4096, 0.15) == pytest.approx(0.15 / 64.0, rel=0.03)


def test_members_whose_nodes_agree_by_chance_know_no_more_than_each_states_of_the_draw() -> None:
    """Four of them ended an ensemble at 1.7 % whose members differ by 9 %."""
    stated = 0.1 * VALUES
    found = ensemble_uncertainty(VALUES, stated, 1.0, np.full(4, 0.1))
    assert found == pytest.approx(0.1 * float(np.median(VALUES)) / 2.0)


def test_a_missing_member_is_a_missing_phase() -> None:
    """What three members of four know, they know by chance."""
    values = np.array([1.0, np.nan, 0.99, 1.01])
    chance = student(3) * 0.01 / math.sqrt(3.0)  # of 1.00, 0.99, 1.01
    assert ensemble_uncertainty(values, STATED, 1.0) == pytest.approx(math.hypot(chance, SHARED[1] * 0.2), rel=1e-14)


@pytest.mark.parametrize("without", [1, 2, 4])
def test_a_mean_over_members_of_which_one_states_no_uncertainty_has_none(without: int) -> None:
    stated = np.array([*[np.nan] * without, *[0.2] * (4 - without)])
    assert math.isnan(ensemble_uncertainty(VALUES, stated, 1.0))


def test_what_a_member_without_a_value_states_does_not_matter() -> None:
    values = np.array([np.nan, 1.0, 0.99, 1.01])
    stated = [ensemble_uncertainty(values, np.array([first, 0.2, 0.2, 0.2]), 1.0) for first in (np.nan, 9.0, 0.2)]
    assert stated[0] == stated[1] == stated[2] > 0.0


@pytest.mark.parametrize("values", [[], [1.0], [np.nan, 1.0], [np.nan, np.nan, np.nan]])
def test_fewer_than_two_members_know_nothing_of_their_scatter(values: list[float]) -> None:
    assert math.isnan(ensemble_uncertainty(np.array(values), np.full(len(values), 0.1), 1.0))


COMMON = np.array([0.1, 0.1, 0.2, 0.2])
MEMBERS = Members(VALUES, STATED, COMMON, np.full(4, 2.0), np.zeros(4))


@pytest.mark.parametrize(
    ("kind", "apart"),
    [
        ("mean", ensemble_uncertainty(VALUES, np.sqrt(STATED**2 - COMMON**2), 2.0)),
        ("event", scatter_uncertainty(VALUES)),
        ("independent", scatter_uncertainty(VALUES)),
        ("fitted", scatter_uncertainty(VALUES)),
    ],
)
def test_what_members_have_in_common_counts_in_full_and_once(kind: str, apart: float) -> None:
    found = uncertainty_of_members(kind, MEMBERS)
    assert found == pytest.approx(math.hypot(apart, 0.15), rel=1e-14)
    nothing = uncertainty_of_members(kind, MEMBERS._replace(values=np.full(4, np.nan)))
    assert math.isnan(nothing)


@pytest.mark.parametrize("kind", ["mean", "independent", "fitted"])
@pytest.mark.parametrize("common", [0.0, 0.5, np.nan])
def test_what_a_member_without_a_value_has_in_common_does_not_matter(kind: str, common: float) -> None:
    values, own = np.array([*VALUES[:3], np.nan]), np.array([*COMMON[:3], common])
    found = uncertainty_of_members(kind, MEMBERS._replace(values=values, common=own))
    assert found == uncertainty_of_members(kind, MEMBERS._replace(values=values)) > 0.4 / 3.0


def test_the_order_of_members_does_not_matter() -> None:
    turned = np.array([2, 0, 3, 1])
    assert ensemble_uncertainty(VALUES[turned], STATED[turned], 0.3) == pytest.approx(
        ensemble_uncertainty(VALUES, STATED, 0.3)
    )


@pytest.mark.parametrize("spacings", [0.3, 2.0])
def test_what_is_expected_of_an_ensemble_is_what_one_that_scatters_as_expected_states(spacings: float) -> None:
    """Members of standard deviation 0.2 that each state 0.2."""
    values = 1.0 + 0.2 * math.sqrt(3.0 / 4.0) * np.array([1.0, -1.0, 1.0, -1.0])
    expected = expected_of_ensemble(0.2, spacings, 4)
    assert expected == pytest.approx(ensemble_uncertainty(values, np.full(4, 0.2), spacings), rel=1e-12)


def test_members_have_part_of_what_they_do_not_know_in_common() -> None:
    assert expected_of_ensemble(0.2, 0.3, 10**12) == pytest.approx(SHARED[0] * 0.2, rel=1e-6)


@pytest.mark.parametrize("count", [2, 7, 8, 32, 1000])
def test_scatter_has_the_bits_of_numpy(count: int) -> None:
    values = np.random.default_rng(count).lognormal(size=count)
    assert scatter(values) == np.std(values, ddof=1)


@pytest.mark.parametrize("spacings", [0.0, 1e-9, 0.3, 0.999, 1.0, 7.5, math.inf])
def test_what_is_unseen_has_the_bits_of_numpy(spacings: float) -> None:
    assert Sampling(spacings, 9.0).unseen == (abs(np.sinc(spacings)) if spacings < 1.0 else 0.0)
