"""Sizes of events are what a record's columns say; power laws of samples are found again, as `powerlaw` fits them; the
numbers of a record are those of its sizes."""

import math
from dataclasses import asdict, fields, replace

import numpy as np
import powerlaw
import pytest
from scipy.stats import spearmanr

from nanoslip.solver.case import Case
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.ensemble import LEVEL
from nanoslip.solver.parameter import quantities
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding import power_law, sizes
from nanoslip.solver.sliding.plateau import plateau_of
from nanoslip.solver.sliding.power_law import find_power_law, power_law_sizes, sort_sizes
from nanoslip.solver.sliding.sizes import (
    event_distributions,
    event_sizes,
    pool_events,
    rank_correlation,
    size_distribution,
)
from nanoslip.solver.sliding.slide import slide
from tests.synthetic import LOAD, noisy_record, record_from

LAWS = [(False, 1.5, 1e-7), (False, 2.5, 3.0), (True, 1.5, 1.0), (True, 2.5, 1.0), (True, 2.0, 6.0)]
EVERY_LAW = pytest.mark.parametrize(("discrete", "exponent", "cutoff"), LAWS)
BOTH = pytest.mark.parametrize("discrete", [False, True])


def sample(discrete, exponent, cutoff, count, seed):
    return sort_sizes(power_law_sizes(np.random.default_rng(seed), count, exponent, cutoff, discrete), discrete)


def error_of(law):
    """Standard error of the exponent of independent sizes from a given cut-off on; whole ones at 1 have a larger one."""
    return (law.exponent - 1.0) / math.sqrt(law.tail)


def test_sizes_are_read_off_the_columns_and_what_rounding_or_a_rise_leaves_is_none():
    record = record_from([1e-6, 2e-6, 4e-6], [1e-8, 3e-8, 1e-20], initial_force=1e-7)
    found = event_sizes(record)
    np.testing.assert_allclose(found.drop, [1e-5, 3e-5, 0.0])
    np.testing.assert_allclose(found.step[:2], [2e-6, 4e-6])
    assert math.isnan(found.step[2])
    np.testing.assert_array_equal(found.slips, record.slips)
    np.testing.assert_allclose(found.energy, [*record.dissipated[:2] / LOAD, 0.0])
    rising = record_from([1e-6, 1e-6], [-1e-8, 1e-8], initial_force=1e-7)
    assert event_sizes(replace(rising, dissipated=np.array([-1e-20, 1e-14]))).drop[0] == 0.0


def test_events_before_a_place_are_left_out_and_records_put_together_are_one_behind_the_other():
    record = noisy_record(events=300)
    part, whole = event_sizes(record, float(record.displacement[100])), event_sizes(record)
    both = pool_events([part, whole])
    for name in sizes.DISCRETE:
        np.testing.assert_array_equal(getattr(part, name), getattr(whole, name)[100:])
        np.testing.assert_array_equal(getattr(both, name)[200:], getattr(whole, name))
    assert np.isnan(both.step).sum() == 2  # no step leads from one record to the next


def test_correlations_are_spearmans():
    rng = np.random.default_rng(1)
    x = rng.integers(0, 5, 200).astype(float)
    y = x + rng.standard_normal(200)
    assert rank_correlation(x, y) == pytest.approx(spearmanr(x, y).statistic)
    assert rank_correlation(np.arange(20.0), np.arange(20.0) ** 3) == pytest.approx(1.0)
    # As a record repeats itself from spacing to spacing, but for rounding.
    repeated, after = np.tile(x, 3), np.tile(y, 3)
    rounded = repeated * (1.0 + 1e-13 * np.random.default_rng(1).standard_normal(repeated.size))
    assert rank_correlation(rounded, after) == pytest.approx(rank_correlation(repeated, after), abs=1e-12)
    assert rank_correlation(np.append(x, np.nan), np.append(y, 7.0)) == rank_correlation(x, y)
    assert np.isnan([rank_correlation(np.ones(50), np.arange(50.0)), rank_correlation(x[:5], y[:5])]).all()


@EVERY_LAW
def test_the_exponent_of_the_sample_is_found(discrete, exponent, cutoff):
    """Over 60 samples within the standard error of independent sizes; choosing the cut-off adds to it, a third was seen."""
    laws = [find_power_law(sample(discrete, exponent, cutoff, 1000, seed)) for seed in range(60)]
    off = [(law.exponent - exponent) / error_of(law) for law in laws]
    assert abs(np.mean(off)) < 0.6  # 60 samples: 0.13 of chance; the chosen cut-off leans to flatter or steeper tails
    assert 0.7 < np.std(off) < 2.0


@BOTH
def test_the_cutoff_is_found_where_sizes_below_it_are_otherwise(discrete):
    """Half of the sizes even below the cut-off, half a power law beyond: the break at 20 is found to a candidate."""
    rng = np.random.default_rng(3)
    low = rng.integers(1, 20, 3000).astype(float) if discrete else rng.uniform(1.0, 20.0, 3000)
    drawn = np.concatenate((low, power_law_sizes(rng, 3000, 2.2, 20.0, discrete)))
    law = find_power_law(sort_sizes(drawn, discrete))
    assert 17.0 < law.cutoff < 30.0
    assert abs(law.exponent - 2.2) < 3.0 * error_of(law)


def peer(values, law):
    """The same tail as the package `powerlaw` fits it."""
    scale = 1.0 if values.discrete else law.cutoff
    return powerlaw.Fit(values.values / scale, discrete=values.discrete, xmin=law.cutoff / scale, verbose=False)


@pytest.mark.filterwarnings("ignore")
@EVERY_LAW
def test_fits_agree_with_the_package_powerlaw(discrete, exponent, cutoff):
    """Exponents to the tolerance of its optimizer, distances to one size (it compares at each size alone)."""
    drawn = sample(discrete, exponent, cutoff, 2000, 11)
    law = find_power_law(drawn)
    other = peer(drawn, law).power_law
    assert law.exponent == pytest.approx(other.alpha, abs=2e-4)
    assert law.distance == pytest.approx(other.D, abs=1.0 / law.tail)


@pytest.mark.parametrize("exponent", [1.2, 2.0, 3.5])
@pytest.mark.parametrize("cutoff", [1.0, 7.0])
def test_drawn_whole_sizes_have_the_laws_shares(exponent, cutoff):
    """Also beyond the numbers whose shares are tabled: of 2e5 sizes, shares to four standard deviations."""
    drawn = power_law_sizes(np.random.default_rng(8), 200_000, exponent, cutoff, True)
    at = cutoff + np.array([1.0, 2.0, 10.0, 900.0, 5000.0, 1e5])
    expected = power_law.survival(at, exponent, cutoff, True)
    off = (drawn >= at[:, None]).mean(axis=1) - expected
    assert (np.abs(off) <= 4.0 * np.sqrt(expected / len(drawn)) + 1e-5).all()
    assert drawn.min() == cutoff
    np.testing.assert_array_equal(drawn, np.floor(drawn))


def goodness(drawn, draws=40):
    return power_law.goodness_of_fit(drawn, find_power_law(drawn), draws)


@pytest.mark.slow
@BOTH
def test_power_laws_are_not_refused_more_often_than_chance_does(discrete):
    """One in ten of 24 samples is below 0.1: more than 8 of them come by chance once in 2000 times."""
    found = np.array([goodness(sample(discrete, 1.8, 2.0, 400, seed)) for seed in range(24)])
    assert (found < 0.1).sum() <= 8
    assert 0.3 < found.mean() < 0.8  # a half; the cut-off is chosen among few and leans up


def test_exponential_sizes_are_refused_where_no_cutoff_hides_them():
    drawn = sort_sizes(1.0 + np.random.default_rng(4).exponential(1.0, 5000), False)
    assert goodness(drawn) < 0.1 or find_power_law(drawn).tail < 500  # a tail of a few hundred may pass


@BOTH
@pytest.mark.parametrize("cutoff", [1.0, 4.0])
def test_every_size_is_in_one_bin_and_densities_are_the_laws(discrete, cutoff):
    drawn = power_law_sizes(np.random.default_rng(7), 50_000, 2.0, cutoff, discrete)
    found = power_law.logarithmic_histogram(np.append(drawn, [0.0, np.nan]), discrete=discrete)
    assert found.counts.sum() == len(drawn)
    assert found.density @ np.diff(found.edges) == pytest.approx(1.0)
    ends = np.maximum(np.ceil(found.edges) if discrete else found.edges, cutoff)
    expected = -len(drawn) * np.diff(power_law.survival(ends, 2.0, cutoff, discrete))
    assert (
        np.abs(found.counts - expected) < 5.0 * np.sqrt(expected) + 5.0
    ).all()  # five standard deviations of a count


def test_bins_of_equal_ratio_are_the_same_for_all_samples():
    one, other = (
        power_law.logarithmic_histogram(np.array(each), discrete=False) for each in ([1.1, 80.0], [12.0, 13.0])
    )
    assert {round(edge, 9) for edge in other.edges} <= {round(edge, 9) for edge in one.edges}
    np.testing.assert_allclose(one.middles**2, one.edges[1:] * one.edges[:-1])


def test_middles_of_whole_numbers_lie_among_them_and_without_sizes_there_are_no_bins():
    """A bin of one number has its middle there, one of 10 to 12 at √120."""
    found = power_law.logarithmic_histogram(np.array([1, 2, 3, 11]), discrete=True)
    np.testing.assert_allclose(found.middles[:3], [1.0, 2.0, 3.0])
    last = int(np.searchsorted(found.edges, 11.0)) - 1
    assert found.middles[last] == pytest.approx(np.sqrt((found.edges[last] + 0.5) * (found.edges[last + 1] - 0.5)))
    assert len(power_law.logarithmic_histogram(np.zeros(5), discrete=True).counts) == 0


LEAST, MOST = 5e-324, np.finfo(float).max
EXTREME = [
    [LEAST],
    [LEAST, 1e-310, 1.0],
    [1e-320, 1.5e-320, 2e-320],
    [1.0, MOST],
    [MOST],
    [LEAST, MOST],
    [0.5 * MOST, MOST],
]


@pytest.mark.parametrize("per_decade", [8, 50])
@pytest.mark.parametrize("values", EXTREME)
def test_the_smallest_and_the_largest_numbers_are_counted_without_complaint(values, per_decade):
    for discrete in (False, True) if min(values) >= 1.0 else (False,):
        found = power_law.logarithmic_histogram(np.array(values), discrete=discrete, per_decade=per_decade)
        assert found.counts.sum() == len(values)
        assert (np.diff(found.edges) > 0.0).all()
        assert (found.edges > 0.0).all()
        assert np.isfinite([found.density, found.middles]).all()


def branching(rng, offspring):
    """Nodes of a family tree in which each node has a Poisson number of children: a mean-field avalanche."""
    size, alive = 0, 1
    while alive and size < 10**8:
        size += alive
        alive = int(rng.poisson(offspring * alive))
    return size


def test_mean_field_avalanches_have_the_exponent_three_halves():
    """Critical branching: P(s) falls as s^-3/2; its first sizes lie off the power law, so the cut-off is above 1."""
    rng = np.random.default_rng(12)
    found = size_distribution(np.array([branching(rng, 1.0) for _ in range(5000)]), discrete=True)
    assert (1.5, pytest.approx(1.0 + 2.0 / 3.0)) == (sizes.MEAN_FIELD, sizes.GUTENBERG_RICHTER)
    assert abs(found.exponent - sizes.MEAN_FIELD) < 0.1  # 0.03: standard error of half of 5000 independent sizes
    assert found.goodness > 0.05


def test_order_and_missing_sizes_do_not_matter():
    drawn = power_law_sizes(np.random.default_rng(3), 400, 1.7, 1e-6, False)
    one = size_distribution(drawn, discrete=False, draws=20)
    other = size_distribution(np.concatenate((drawn[::-1], [0.0, -1.0, math.nan])), discrete=False, draws=20)
    np.testing.assert_equal(asdict(other), asdict(one))
    assert (one.count, one.largest, one.mean) == (400, drawn.max(), pytest.approx(drawn.mean()))
    assert one.tail <= 400


@pytest.mark.parametrize(
    "values", [[], [1.0] * 100, list(range(1, power_law.LEAST_TAIL))], ids=["none", "equal", "few"]
)
def test_what_cannot_be_known_is_nan(values):
    found = size_distribution(np.array(values), discrete=True)
    assert (found.count, found.tail) == (len(values), 0)
    assert np.isnan([found.exponent, found.goodness]).all()


@BOTH
def test_an_exponent_at_a_bound_is_none(discrete):
    """Sizes that fall like x^-60 from 100 on, steeper than any that are looked for."""
    drawn = 100.0 * (1.0 - np.random.default_rng(4).random(400)) ** (-1.0 / 59.0)
    found = size_distribution(np.floor(drawn) if discrete else drawn, discrete=discrete, draws=5)
    assert np.isnan([found.exponent, found.exponent_uncertainty]).all()
    assert found.exponent_members == 1
    assert found.tail >= 50
    assert "at a bound" in str(found)


@pytest.mark.everyday(1)
@pytest.mark.parametrize("repeated", [1, 9])
@BOTH
@pytest.mark.parametrize("members", [2, pytest.param(8, marks=pytest.mark.slow)])
def test_the_uncertainty_of_an_exponent_holds_in_68_of_100(members, discrete, repeated):
    """Members have 200 independent sizes each from τ = 1.8, also where each occurs nine times: members alone are independent.

    Of 200 ensembles the share is binomial, three standard deviations are 0.1. Up to 0.06 more is no fault: of 8 members or more
    the cut-off that each replicate looks for makes ± too large rather than too small.
    """
    held = 0
    for seed in range(200):
        rng = np.random.default_rng([seed, members])
        drawn = [np.repeat(power_law_sizes(rng, 200, 1.8, 1.0, discrete), repeated) for _ in range(members)]
        law = find_power_law(sort_sizes(np.concatenate(drawn), discrete))
        exponent, uncertainty, _ = sizes.exponent_over_members(drawn, law.exponent, discrete)
        held += abs(exponent - 1.8) <= uncertainty
    assert LEVEL - 0.1 < held / 200 < LEVEL + 0.16


def test_members_are_fitted_together_and_their_order_does_not_matter():
    """The exponent of their events behind each other; what is no size, as the step of the last event, is left out."""
    records = [event_sizes(noisy_record(400, seed=seed)) for seed in range(3)]
    steps = [each.step for each in records]
    found, whole, back = (
        size_distribution(*each, discrete=False, draws=0) for each in (steps, [pool_events(records).step], steps[::-1])
    )
    assert (found.exponent, found.cutoff, found.tail) == (whole.exponent, whole.cutoff, whole.tail)
    assert (found.exponent_members, whole.exponent_members) == (3, 1)
    assert np.isnan([whole.exponent_uncertainty, whole.goodness]).all()
    assert back.exponent_uncertainty == pytest.approx(found.exponent_uncertainty)
    assert f"exponent {found.exponent:.1f}" in str(found)
    assert "± ? from" in str(whole)


@BOTH
def test_members_that_are_alike_have_no_uncertainty(discrete):
    drawn = power_law_sizes(np.random.default_rng(1), 300, 2.0, 1.0, discrete)
    assert size_distribution(*[drawn] * 5, discrete=discrete, draws=0).exponent_uncertainty == 0.0


def test_an_exponent_that_hangs_on_one_member_has_no_uncertainty():
    """Without the large sizes of the first there are too few for a power law."""
    large = power_law_sizes(np.random.default_rng(1), 300, 2.0, 1.0, False)
    few = size_distribution(large, *[large[:9]] * 3, discrete=False, draws=0)
    assert (few.exponent_members, math.isfinite(few.exponent)) == (4, True)
    assert math.isnan(few.exponent_uncertainty)


NASTY = {
    "two numbers": (True, lambda rng: 1.0 + (rng.random(300) < 0.02)),
    "one giant": (True, lambda rng: np.append(np.ones(299), 1e7)),
    "large and alike": (True, lambda rng: 1e6 + rng.integers(0, 3, 300)),
    "beyond whole numbers": (True, lambda rng: np.floor(rng.pareto(0.05, 300) + 1.0)),
    "alike to rounding": (False, lambda rng: 1.0 + 1e-12 * rng.random(300)),
    "at the least of numbers": (False, lambda rng: 1e-300 * rng.random(300)),
    "at the most of numbers": (False, lambda rng: 1e300 * rng.random(300)),
    "flatter than any power law": (False, lambda rng: rng.pareto(0.01, 300) + 1.0),
    "many ties": (False, lambda rng: np.repeat(rng.random(60), 5)),
}


@pytest.mark.parametrize("name", NASTY)
def test_what_is_no_power_law_leaves_numbers_or_none(name):
    discrete, draw = NASTY[name]
    found = size_distribution(draw(np.random.default_rng(6)), discrete=discrete, draws=5)
    assert 0.0 <= found.goodness <= 1.0 if found.tail else math.isnan(found.exponent)


def test_every_number_is_declared_and_exponents_have_an_uncertainty_between_starts():
    known = quantities(sizes.EventDistributions)
    beside = [each.name for quantity in known.values() for each in quantity.beside]
    assert [item.name for item in fields(sizes.EventDistributions) if item.name not in known] == beside
    assert all(known[f"{size}_exponent"].ensemble for size in sizes.DISCRETE)
    assert not known["sized_events"].ensemble


def test_distributions_of_a_record_are_those_of_its_steady_part():
    case = Case(slab=Slab(33), radius=50.0, max_events=1500)
    record = slide(case, surface_compliance(case.slab))
    plateau = plateau_of(record)
    assert plateau.outcome.ok
    found, bins = event_distributions([(record, plateau)], draws=5)
    steady = event_sizes(record, plateau.start)
    assert 100 < found.sized_events == len(steady.slips) < 1500
    slips = size_distribution(steady.slips, discrete=True, draws=5)
    drop = size_distribution(steady.drop, discrete=False, draws=5)
    assert (found.slips_exponent, found.slips_cutoff) == (slips.exponent, slips.cutoff)
    assert (found.drop_exponent, found.drop_goodness) == (drop.exponent, drop.goodness)
    assert found.drop_step_correlation == rank_correlation(steady.drop, steady.step)
    for number, size in enumerate(sizes.SIZES):
        values, there = getattr(steady, size), bins.bin_of == number
        assert bins.bin_events[there].sum() == np.count_nonzero(values > 0)
        assert values[values > 0].min() <= bins.bin_middle[there].max() <= np.nanmax(values) * 10.0 ** (1.0 / 16.0)


def test_drops_of_a_power_law_have_its_exponent():
    """Falls from 1e-8 on, over the load of 1e-3, with τ = 1.8; their energies go as their squares: τ = 1.4."""
    rng = np.random.default_rng(11)
    drops = power_law_sizes(rng, 800, 1.8, 1e-8, False)
    record = record_from(rng.exponential(1e-5, len(drops)), drops, initial_force=1e-4)
    found, _ = event_distributions([(record, plateau_of(record))], draws=20)
    # Three standard errors of independent sizes from the cut-off on.
    assert abs(found.drop_exponent - 1.8) < 3.0 * 0.8 / math.sqrt(found.drop_tail)
    assert abs(found.energy_exponent - 1.4) < 3.0 * 0.4 / math.sqrt(found.energy_tail)
    assert found.drop_goodness >= 0.1
    assert found.drop_cutoff >= 1e-5


@pytest.mark.parametrize(
    ("there", "members", "stated"),
    [
        *((0, 1, False), (1, 1, True), (1, 2, False), (2, 2, True), (2, 3, False), (3, 3, True), (2, 4, False)),
        *((0, 8, False), (1, 8, False), (3, 8, False), (4, 8, True)),
    ],
)
def test_only_what_half_of_the_members_and_three_have_a_steady_part_of_is_stated_of_all(there, members, stated):
    """No exponent, goodness, histogram or mean of fewer; how many they are of is known in either case."""
    record = noisy_record(1400)
    steady = plateau_of(record)
    plateaus = [steady] * there + [replace(steady, start=math.nan)] * (members - there)
    found, bins = event_distributions([(record, plateau) for plateau in plateaus], draws=1)
    events = np.count_nonzero(record.displacement >= steady.start)
    assert found.sized_events == (there * events if stated else 0)
    assert found.drop_exponent_members == found.step_exponent_members == found.step_variation_members == there
    for size in ("drop", "step"):
        numbers = [getattr(found, f"{size}_{name}") for name in ("exponent", "cutoff", "goodness")]
        assert set(np.isfinite(numbers)) == {stated}
        assert (getattr(found, f"{size}_tail") > 0) is stated
    assert math.isfinite(found.drop_step_correlation) is (found.step_variation > 0.0) is stated
    assert bool(bins.bin_events.any()) is stated


def test_members_without_a_size_are_too_few_for_its_power_law_alone():
    """Steady parts whose events lose no force have no drops; they have steps all the same."""
    dropping = noisy_record(1400)
    holding = replace(dropping, force_after=dropping.force_before)
    members = [(record, plateau_of(dropping)) for record in (dropping, *[holding] * 3)]
    found, bins = event_distributions(members, draws=0)
    assert (found.drop_exponent_members, found.step_exponent_members) == (1, 4)
    assert (math.isnan(found.drop_exponent), math.isfinite(found.step_exponent)) == (True, True)
    assert list(sizes.SIZES).index("drop") not in bins.bin_of


def test_equal_steps_vary_by_nothing_and_few_events_say_nothing():
    record = record_from([1e-4] * 30, [1e-8] * 30, initial_force=1e-6)
    found, _ = event_distributions([(record, plateau_of(record))], draws=0)
    assert found.step_variation == pytest.approx(0.0, abs=1e-9)
    assert np.isnan([found.step_correlation, found.slips_exponent, found.slips_exponent_uncertainty]).all()
