"""The set of parameters that agrees holds the truth as often as it states; what is out of reach, or cannot be told, is named."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import nanoslip
from nanoslip.solver.ensemble import student
from nanoslip.study.api import read_campaign
from nanoslip.study.figures.points import points_named
from nanoslip.study.inference.campaign import make_question
from nanoslip.study.inference.fit import (
    LEVELS,
    ComputedPoint,
    Fit,
    Range,
    Target,
    filling,
    search_parameters,
    sentences,
)
from nanoslip.study.inference.pictures import contours
from nanoslip.study.inference.sensitivity import point_errors, spread_of_members
from nanoslip.study.inference.surrogate import TooFewError, regress

Floats = NDArray[np.float64]
RANGES = (Range("mu_i", 0.1, 0.8, False), Range("radius", 20.0, 400.0, True))
ERROR = 0.002
"""Relative ± of a computed number."""


def friction(x: Floats) -> Floats:
    """Static and kinetic friction (n, 2) of a pin whose static excess falls with the square root of its radius."""
    intrinsic, radius = (each.at(x[:, axis]) for axis, each in enumerate(RANGES))
    kinetic = 0.53 * intrinsic
    return np.column_stack([kinetic * (1.04 + 0.12 * np.sqrt(20.0 / radius)), kinetic])


def point_of(x: Floats, values: Floats, errors: Floats | float) -> ComputedPoint:
    """Points with independent errors, of no known scatter and without flags."""
    errors, none = np.broadcast_to(errors, values.shape), np.zeros_like(values)
    points, count = values.shape
    unknown = np.full((points, count, count), np.nan)
    return ComputedPoint(x, values, errors, unknown, np.zeros(points), none, np.zeros(points, np.int64))


def point_of_starts(
    x: Floats, truth: Floats, correlation: Floats, members: int, seed: int, share: float = 0.03
) -> ComputedPoint:
    """Points with numbers (n, targets) whose starts scatter by a share of them, at other places in each point."""
    draw, (points, count) = np.random.default_rng(seed), truth.shape
    chance = draw.multivariate_normal(np.zeros(count), correlation, (points, members), method="cholesky")
    starts = truth[:, None] * (1.0 + share * chance)
    off = starts - starts.mean(axis=1, keepdims=True)
    covariances = np.swapaxes(off, 1, 2) @ off / (members - 1.0)
    deviations = np.sqrt(np.diagonal(covariances, axis1=1, axis2=2))
    errors = student(members) * deviations / members**0.5
    freedom, flags = np.full(points, members - 1.0), np.zeros(points, np.int64)
    return ComputedPoint(x, starts.mean(axis=1), errors, covariances, freedom, np.zeros_like(errors), flags)


def alike(count: int, correlation: float) -> Floats:
    """Correlation matrix of so many numbers, all correlated alike."""
    return np.full((count, count), correlation) + (1.0 - correlation) * np.eye(count)


class Laboratory:
    """Computes points with an error of their own each, the same each time, and counts them."""

    def __init__(self) -> None:
        self.calls: list[Floats] = []

    def __call__(self, x: Floats) -> ComputedPoint:
        self.calls.append(x)
        values = friction(x)
        chance = [np.random.default_rng(int(1e9 * point.sum())).standard_normal(2) for point in x]
        return point_of(x, values * (1.0 + ERROR * np.array(chance)), ERROR * values)


def measured(static: float, kinetic: float, error: float) -> tuple[Target, Target]:
    return Target("mu_s", static, error), Target("mu_k", kinetic, error)


@pytest.mark.slow
def test_the_set_holds_the_truth_as_often_as_it_states():
    """200 truths with noise: 68 ± 7 % and 95 ± 4 % are two standard deviations of such a count."""
    draw = np.random.default_rng(1)
    found = search_parameters(measured(0.29, 0.26, 0.003), RANGES, Laboratory())
    held = []
    for _ in range(200):
        truth = draw.random((1, 2))
        values = friction(truth)[0]
        errors = np.array([0.01, 0.005])
        targets = map(Target, ("mu_s", "mu_k"), values + errors * draw.standard_normal(2), errors)
        held.append(replace(found, targets=tuple(targets)).misfit(truth)[0])
    shares = [np.mean(np.array(held) <= found.limit(level)) for level in (0.68, 0.95)]
    assert shares == pytest.approx([0.68, 0.95], abs=0.07)


def numbers_of(x: Floats, count: int) -> Floats:
    """Numbers (n, targets) that are all proportional to the first parameter, as friction is to μ_i."""
    sizes = np.arange(1.0, count + 1.0)
    return RANGES[0].at(x[:, :1]) * sizes


@pytest.mark.parametrize("error", [1e-4, 3e-2])
def test_one_number_twice_tells_no_more_than_once(error: float):
    """Of one recording, whose start scatters by 1 % (the smaller ±) or by less than its ± (the larger one)."""
    x = filling(1)[:16]
    once = point_of_starts(x, numbers_of(x, 1), np.eye(1), 8, 1, share=0.01)
    twice = [np.hstack([each, each]) for each in (once.values, once.errors, once.common)]
    starts = np.tile(once.starts, (1, 2, 2))
    both = once._replace(values=twice[0], errors=twice[1], starts=starts, common=twice[2])
    surrogate = regress(x, once.values[:, 0], once.errors[:, 0])
    target = Target("a", 0.4, error * 0.4, one_start=True)
    targets = (target, target._replace(name="b"))
    widths = []
    for found in (
        Fit(targets[:1], RANGES[:1], once, (surrogate,)),
        Fit(targets, RANGES[:1], both, (surrogate, surrogate)),
    ):
        low, high = found.intervals(0, 0.95)[0] or (0.0, 0.0)
        widths.append(high - low)
    assert widths[0] > 0.0
    # 2.45 times the standard error in place of 1.96, and √2 where nothing is known of the correlation.
    assert 1.0 <= widths[1] / widths[0] < 1.9


def fit_of_starts(x: Floats, correlation: Floats, members: int, seed: int, share: float) -> Fit:
    """Numbers that scatter as starts do, for a parameter that all are proportional to; their means have no error."""
    truth = numbers_of(x, len(correlation))
    computed = point_of_starts(x, truth, correlation, members, seed, share)._replace(values=truth)
    surrogates = tuple(regress(x, values, np.full(len(x), 1e-6)) for values in truth.T)
    targets = tuple(Target(name, 0.5, 1e-4, one_start=True) for name in "abc"[: len(correlation)])
    return Fit(targets, RANGES[:1], computed, surrogates)


def recordings(
    found: Fit, correlation: Floats, errors: Floats, count: int
) -> Iterator[tuple[Floats, tuple[Target, ...]]]:
    """True points (1, d), and numbers measured there that are off by so correlated errors, as shares of them."""
    draw, targets = np.random.default_rng(2), len(found.targets)
    for _ in range(count):
        truth = draw.uniform(0.1, 0.9, (1, 1))
        chance = draw.multivariate_normal(np.zeros(targets), correlation, method="cholesky")
        values = numbers_of(truth, targets)[0] * (1.0 + errors * chance)
        yield truth, tuple(each._replace(value=value) for each, value in zip(found.targets, values, strict=True))


@pytest.mark.slow
@pytest.mark.parametrize(("correlation", "members", "middle"), [(-0.45, 3, 0.73), (0.98, 2, 0.78), (0.98, 8, 0.69)])
def test_numbers_of_one_start_hold_the_truth_as_often_as_they_state(correlation: float, members: int, middle: float):
    """200 recordings, each of one start, of three numbers, over 16 points with starts of their own each time.

    Two standard deviations of such counts are 7 and 3 %. Taken as independent, sets of numbers correlated by 0.98 hold 70 and
    88 %. The covariance is widened so that T² of 20, 10 and 71 degrees of freedom is below the limit in 95 %; `middle` is
    how often it is then below that of 68 %.
    """
    x, between, misfits = filling(1)[:16], alike(3, correlation), []
    found = fit_of_starts(x, between, members, 0, share=0.03)
    for seed, (truth, targets) in enumerate(recordings(found, between, np.full(3, 0.03), 200)):
        starts = point_of_starts(x, found.computed.values, between, members, seed)
        computed = found.computed._replace(starts=starts.starts)
        misfits.append(replace(found, targets=targets, computed=computed).misfit(truth)[0])
    shares = [np.mean(np.array(misfits) <= found.limit(level)) for level in LEVELS]
    assert shares == pytest.approx([middle, 0.95], abs=0.07), shares
    assert shares[1] > 0.95 - 0.03


@pytest.mark.slow
def test_a_surrogate_of_sixteen_points_is_as_sure_as_it_states():
    """180 exact measurements of three numbers, 60 designs: how their errors correlate is known from 16 values left out,
    less the 3 that a smooth line takes.

    Two standard deviations of 60 counts are 5 and 11 %. Without a wider covariance for so few the set at 95 % held 87 %.
    """
    x, between, misfits = filling(1)[:16], alike(3, 0.95), []
    for seed in range(60):
        computed = point_of_starts(x, numbers_of(x, 3), between, 8, seed, share=0.1)
        columns = zip(computed.values.T, computed.errors.T, strict=True)
        surrogates = tuple(regress(x, values, errors) for values, errors in columns)
        for truth in np.random.default_rng(seed).uniform(0.1, 0.9, (3, 1, 1)):
            values = numbers_of(truth, 3)[0]
            targets = tuple(Target(name, value, 1e-6 * value) for name, value in zip("abc", values, strict=True))
            found = Fit(targets, RANGES[:1], computed, surrogates)
            misfits.append(found.misfit(truth)[0])
    shares = [np.mean(np.array(misfits) <= found.limit(level)) for level in LEVELS]
    assert shares[1] == pytest.approx(0.96, abs=0.05), shares
    # T² of 13 degrees of freedom is below a limit widened for 95 % in 75 %.
    assert shares[0] == pytest.approx(0.75, abs=0.11), shares


@pytest.mark.slow
@pytest.mark.parametrize("correlation", [-0.99, 0.99])
def test_errors_of_one_recording_may_have_any_correlation(correlation: float):
    """Stated ± far above the scatter of starts, 200 recordings: at least as many as stated, whatever they share."""
    found = fit_of_starts(filling(1)[:16], np.eye(2), 8, 0, share=1e-4)
    misfits = []
    for truth, targets in recordings(found, alike(2, correlation), np.full(2, 0.05), 200):
        sizes = 0.05 * numbers_of(truth, 2)[0]
        stated = tuple(each._replace(error=size) for each, size in zip(targets, sizes, strict=True))
        misfits.append(replace(found, targets=stated).misfit(truth)[0])
    shares = [np.mean(np.array(misfits) <= found.limit(level)) for level in LEVELS]
    # Less two standard deviations of such counts.
    assert shares[0] > 0.68 - 0.07
    assert shares[1] > 0.95 - 0.03


def test_starts_at_the_same_places_err_together_in_all_numbers():
    """Every point is off by the draw of the same four starts, in both numbers by the same share: more points, or the
    second number, do not show it."""
    x = filling(1)[:16]
    truth = numbers_of(x, 2)
    errors = 0.03 * truth
    starts = np.einsum("ni,nj->nij", errors, errors) * 4.0
    off = truth * 1.05
    flags = np.zeros(len(x), np.int64)
    computed = ComputedPoint(x, off, errors, starts, np.full(len(x), 7.0), errors, flags)
    columns = zip(computed.values.T, computed.errors.T, strict=True)
    surrogates = tuple(regress(x, values, error, common=error) for values, error in columns)
    targets = (Target("a", 0.45, 1e-4), Target("b", 0.9, 1e-4))
    found = Fit(targets, RANGES[:1], computed, surrogates)
    x_true = np.array([[0.5]])
    # 5 % over ± 3 %: 1.67² once, less what few starts are widened by; independent numbers would count it twice.
    assert 0.5 < found.misfit(x_true)[0] < 1.1 * (5.0 / 3.0) ** 2


@pytest.mark.slow
def test_errors_from_few_members_make_no_value_count_more_for_being_low():
    """Means of 8 draws with a long tail, each with the ± of its own 8: those that happen to be low have a small ±.

    16 fields of 64 points, so the mean bias is known to 0.36/√(8·64·16) = 0.4 %.
    """
    draw, bias = np.random.default_rng(5), []
    x = filling(2)[:32]
    for _ in range(16):
        members = draw.gamma(8.0, 1.0 / 8.0, (len(x), 8)) * (1.0 + x[:, :1])
        errors = student(8) * members.std(axis=1, ddof=1) / 8**0.5
        found, _ = regress(x, members.mean(axis=1), errors).predict(x)
        bias.append(np.mean(found / (1.0 + x[:, 0])) - 1.0)
    assert abs(np.mean(bias)) < 0.02


def test_a_common_error_is_not_averaged_away():
    """Starts at the same places at all points: many points know the smooth dependence no better than one."""
    x = filling(2)
    values = 1.0 + 0.5 * x[:, 0]
    errors = np.full(len(x), 0.05)
    alone = regress(x, values, errors).predict(x)[1]
    common = regress(x, values, errors, common=errors).predict(x)[1]
    assert alone.mean() < 0.03
    assert common.mean() == pytest.approx(0.05, rel=0.2)


def test_members_come_down_elsewhere_at_each_point():
    """Else all points share the error of their starts. The same point is the same case again; a start that is asked for stays."""
    campaign = {"title": "-", "numerics": {"n_x": 33, "scheme": "half_plane"}, "heterogeneity": {"spread": 0.1}}
    manifest = read_campaign({**campaign, "stages": ["contact", "slip"]})
    target = [Target("plateau", 0.3, 0.01)]
    question = make_question(manifest, target, {"mu_i": (0.2, 0.8), "residual_shear": (0.0, 0.8)}, {})
    x = filling(2)
    first, again = ([case.case for case in question.plans(x)[0].cases] for _ in range(2))
    assert first == again
    for places in ([case.start for case in first if case], [case.heterogeneity.seed for case in first if case]):
        assert len({*places}) == len(x)
    held = make_question(manifest, target, {"mu_i": (0.2, 0.8)}, {"start": 0.25})
    assert {case.case.start for case in held.plans(x[:, :1])[0].cases if case.case} == {0.25}


def test_a_point_within_reach_is_found():
    laboratory = Laboratory()
    truth = np.array([[0.6, 0.3]])
    static, kinetic = friction(truth)[0]
    found = search_parameters(measured(static, kinetic, 2e-3), RANGES, laboratory)
    assert found.reached
    for axis, each in enumerate(RANGES):
        low, high = found.intervals(axis, 0.95)[0] or (np.nan, np.nan)
        assert low <= each.at(truth[0])[axis] <= high
    assert found.misfit(truth)[0] < found.limit(0.95)
    low, high = found.intervals(0, 0.95)[0] or (0.0, 0.0)
    assert high - low < 0.05  # 2e-3 of mu_k are 4e-3 of mu_i, times 2.4 to both sides, and as much for the excess
    assert all(np.abs(each).max() <= 1.0 for each in laboratory.calls)


@pytest.mark.slow
def test_more_points_are_put_where_it_is_open():
    """A narrow set: the points that come after the first ones lie closer to it than those."""
    laboratory = Laboratory()
    found = search_parameters(measured(0.288, 0.26, 3e-4), RANGES, laboratory, most=60)
    first, *later = laboratory.calls
    off = [np.abs(friction(x)[:, 1] - 0.26).mean() for x in (first, np.concatenate(later))]
    assert off[1] < 0.2 * off[0]
    assert len(found.computed.x) <= 60


@pytest.mark.slow
def test_what_is_out_of_reach_is_said_with_the_nearest():
    found = search_parameters(measured(0.30, 0.20, 2e-3), RANGES, Laboratory())
    assert not found.reached
    assert len(found.agreeing(0.95)) == 0
    (sentence, *_) = sentences(found)
    assert sentence.startswith("Not reached: mu_s = 0.3 ± 0.002, mu_k = 0.2 ± 0.002. ")
    assert "ratio 1.16, measured 1.5" in sentence  # the model's largest, at the smallest radius
    assert "radius = 20." in sentence


@pytest.mark.slow
def test_of_a_number_far_out_of_reach_the_nearest_is_that_of_the_nearest_number():
    """Its points show that at once, so that no more are computed than at first; those of another target before even these."""
    laboratory = Laboratory()
    found = search_parameters([Target("mu_s", 30.0, 0.01), Target("mu_k", 0.3, 0.01)], RANGES, laboratory)
    assert found.ranges[0].at(found.best)[0] == pytest.approx(0.8, abs=0.005)
    assert found.predict(found.best[None])[0][0, 0] > 0.98 * friction(np.array([[1.0, 0.0]]))[0, 0]
    assert [len(x) for x in laboratory.calls] == [32, 1]
    again = Laboratory()
    search_parameters(found.targets, RANGES, again, found.computed)
    assert [len(x) for x in again.calls] == [1]


def test_two_islands_are_two_ranges():
    """A number that is the same on both sides of the middle: neither range has the middle, and the best one is computed."""

    def simulate(x: Floats) -> ComputedPoint:
        values = np.column_stack([(x[:, 0] - 0.5) ** 2, x[:, 1]])
        return point_of(x, values, 1e-4)

    found = search_parameters(
        [Target("a", 0.09, 0.01), Target("b", 0.5, 0.05)], (Range("x", 0, 1, False), RANGES[1]), simulate
    )
    ends = sorted(each for each in found.intervals(0, 0.95) if each)
    assert np.array(ends) == pytest.approx(np.array([[0.156, 0.244], [0.756, 0.844]]), abs=0.01)  # 0.3 ± 2.4·0.01/0.6
    text = str(found)
    assert "2 separate sets" in text
    assert "told apart" not in text
    assert "Computed there: a = 0.0" in text


def test_a_measured_number_may_be_zero():
    """At a corner of what is looked at: it is reached, and has no ratio."""

    def simulate(x: Floats) -> ComputedPoint:
        return point_of(x, x, 1e-3)

    found = search_parameters([Target("a", 1.0, 0.01), Target("b", 0.0, 0.01)], RANGES, simulate)
    assert found.reached
    assert "ratio" not in "".join(sentences(found))
    assert ": mu_i, radius" in "".join(sentences(found))
    assert found.agreeing(0.95).min(axis=0) == pytest.approx([1.0, 0.0], abs=0.03)


def test_what_cannot_be_told_apart_is_named():
    """mu_k = mu_i (1 + r) / 2 fixes the product alone: mu_i is free between 1 and 2 times, and both are named as a pair."""
    ranges = (Range("mu_i", 0.1, 0.8, False), Range("residual_shear", 0.0, 1.0, False))

    def simulate(x: Floats) -> ComputedPoint:
        values = 0.5 * ranges[0].at(x[:, :1]) * (1.0 + ranges[1].at(x[:, 1:]))
        return point_of(x, values, 1e-4)

    found = search_parameters([Target("mu_k", 0.26, 0.005)], ranges, simulate)
    assert found.undetermined_parameters() == ["residual_shear"]
    ((first, second, ends),) = found.tied()
    assert (first.name, second.name) == ("mu_i", "residual_shear")
    np.testing.assert_allclose(ends[0] * (1.0 + ends[1]) / 2.0, 0.26, rtol=0.05)
    assert ends[0, 1] > 1.7 * ends[0, 0]
    assert any("larger mu_i" in each and "smaller residual_shear" in each for each in sentences(found))


def test_a_share_of_a_range_is_the_inverse_of_its_values():
    for own, middle in zip(RANGES, (0.45, (20.0 * 400.0) ** 0.5), strict=True):
        shares = np.array([0.0, 0.25, 0.5, 1.0])
        np.testing.assert_allclose(own.shares(own.at(shares)), shares, atol=1e-12)
        assert own.at(shares)[[0, 2, 3]] == pytest.approx([own.low, middle, own.high])


def test_the_figure_of_one_parameter_shows_the_measured_number_as_a_band():
    def simulate(x: Floats) -> ComputedPoint:
        values = RANGES[0].at(x[:, :1])
        return point_of(x, values, 0.0)

    found = search_parameters([Target("mu_k", 0.3, 0.02)], RANGES[:1], simulate)
    (axes,) = contours(found).axes
    (band,) = [each for each in axes.patches if each.get_label() == "measured"]
    assert band.get_extents().transformed(axes.transData.inverted()).intervaly == pytest.approx([0.28, 0.32])


def test_a_region_without_numbers_does_not_agree():
    """Where the nearest computed point has no number nothing agrees, though the regression would reach there."""

    def simulate(x: Floats) -> ComputedPoint:
        values = np.where(x[:, 1:] > 0.5, np.nan, friction(x)[:, 1:])
        return point_of(x, values, 0.0)

    found = search_parameters([Target("mu_k", 0.26, 0.01)], RANGES, simulate)
    assert found.agreeing(0.95)[:, 1].max() < 0.62  # half a distance of points beyond
    assert any(each.startswith("Without a number") for each in sentences(found))


def test_where_too_few_points_have_a_number_it_is_said_how_many_and_what_helps():
    def simulate(x: Floats) -> ComputedPoint:
        values = np.where(x[:, 1:] > 0.1, np.nan, friction(x)[:, 1:])
        return point_of(x, values, 0.0)

    with pytest.raises(TooFewError, match=r"mu_k: \d values .* 8; 2\d of 32 points .*\nstep_limit: \d+"):
        search_parameters([Target("mu_k", 0.26, 0.01)], RANGES, simulate, why=lambda x: [f"step_limit: {len(x)}"])


STAGE = """\
title = "A pin on a stage"
[axes]
intrinsic_friction = {from = 0.2, to = 0.8}
radius = {from = 40.0, to = 200.0, scale = "log"}
[numerics]
n_x = 65
scheme = "strip"
[limits]
spacings = 1.0
events = 20000
[ensemble]
members = 4
[[drives]]
name = "stage"
stage_travel = 8e-4
max_slips = 20
samples = 1
[outputs]
records = false
trajectory = false
fit = false
"""


ONLY_SLIP = """\
title = "A pin that slides"
stages = ["contact", "slip"]
[axes]
intrinsic_friction = {from = 0.1, to = 0.8}
residual_shear = {from = 0.0, to = 0.8}
[constants]
radius = 200.0
[numerics]
n_x = 65
scheme = "half_plane"
"""


@pytest.mark.slow
def test_the_set_holds_fifty_truths_of_a_number_whose_error_is_unknown(tmp_path: Path):
    """Plateau ± 2 % and mean drop ± 5 % of 50 truths over 16 starts each, 10 measurements of each truth.

    A drop scatters by a third from start to start and has no ± on short records. Before the starts of points differed from each
    other, and what members scatter counted, the sets held 46 and 81 %, of truths over 48 starts. A share of 50 truths is known
    to 7 and 3 %. Over 16 starts a truth's drop is known to 10 %, with its measurement; a surrogate that is off by another 12 %,
    as a point of 8 starts is, and does not say so, leaves 50 and 82 %.
    """
    (tmp_path / "mine.toml").write_text('design = "sobol"\n' + ONLY_SLIP + "[ensemble]\nmembers = 8\n")
    first = {"plateau_mean": (0.27, 0.0054), "mean_drop": (1.2e-3, 6e-5)}
    found = nanoslip.fit(tmp_path / "mine.toml", first, points=64)
    anywhere = ONLY_SLIP.replace("from = 0.1, to = 0.8", "from = 0.15, to = 0.75").replace("to = 0.8}", "to = 0.7}")
    anywhere = anywhere.replace("[constants]", "start = {from = 0.0, to = 0.999}\n[constants]")
    text = 'design = "latin_hypercube"\npoints = 50\n' + anywhere + "[ensemble]\nmembers = 16\n"
    (tmp_path / "truths.toml").write_text(text)
    data = nanoslip.run(tmp_path / "truths.toml").squeeze()
    x = np.column_stack([each.shares(data[each.name].values) for each in found.ranges])
    draw, held = np.random.default_rng(1), []
    numbers = [(name, share, points_named(data, name)) for name, share in (("plateau_mean", 0.02), ("mean_drop", 0.05))]
    for place in np.tile(np.arange(50), 10):
        targets = []
        for name, share, points in numbers:
            value = float(points.values[place])
            own = float(point_errors(points, spread_of_members(data, points))[place])
            measured_value = value * (1.0 + share * draw.standard_normal())
            targets.append(Target(name, measured_value, float(np.hypot(share * value, own))))
        held.append(replace(found, targets=tuple(targets)).misfit(x[place : place + 1])[0])
    shares = [np.mean(np.array(held) <= found.limit(level)) for level in (0.68, 0.95)]
    assert shares[0] == pytest.approx(0.68, abs=0.14), shares
    assert shares[1] == pytest.approx(0.95, abs=0.06), shares


@pytest.mark.slow
def test_the_set_holds_computed_truths_as_often_as_it_states(tmp_path: Path):
    """Five measurements each of 60 computed cases that the surrogate never saw.

    The ± of a mean over starts is part of the measurement's. One start is a trace, which tells nothing of others.
    """
    (tmp_path / "stage.toml").write_text('design = "sobol"\n' + STAGE)
    found = nanoslip.fit(tmp_path / "stage.toml", {"mu_s": (0.3, 0.006), "mu_k": (0.27, 0.003)}, points=64)
    anywhere = STAGE.replace("[numerics]", "start = {from = 0.0, to = 0.999}\n[numerics]")
    numbers = ("static_friction", 0.006), ("kinetic_friction", 0.003)
    for truths in (STAGE, anywhere.replace("members = 4", "members = 1")):
        (tmp_path / "truths.toml").write_text('design = "latin_hypercube"\npoints = 60\n' + truths)
        data = nanoslip.run(tmp_path / "truths.toml").squeeze()
        good = (data.validity_flags == 0) & data.static_friction.notnull() & data.kinetic_friction.notnull()
        data = data.isel(case=np.flatnonzero(good))
        x = np.column_stack([each.shares(data[each.name].values) for each in found.ranges])
        draw, held, alone = np.random.default_rng(1), [], truths != STAGE
        for place in np.tile(np.arange(data.sizes["case"]), 5):
            targets = []
            for name, error in numbers:
                own = 0.0 if alone else float(data[f"{name}_uncertainty"][place])
                value = float(data[name][place]) + error * draw.standard_normal()
                targets.append(Target(name, value, float(np.hypot(error, own)), one_start=alone))
            held.append(replace(found, targets=tuple(targets)).misfit(x[place : place + 1])[0])
        shares = [np.mean(np.array(held) <= found.limit(level)) for level in (0.68, 0.95)]
        assert len(held) > 240
        # 0.66 to 0.68 and 0.94 to 0.96 seen, two of each scatter by 0.04. Of one start 0.74 to 0.79 if their ± counted as
        # independent, as it is here: the error of a short record, which truths of as short a record share, counts as scatter
        # of starts. 0.86 as the ± of two numbers of a recording counts √2 times, for any correlation that it may have.
        assert shares == pytest.approx([0.86 if alone else 0.68, 0.95], abs=0.07), shares
