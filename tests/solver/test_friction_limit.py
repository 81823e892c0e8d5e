"""The friction limit takes both sides of every drop from the record, then repeats its steady part for ever."""

from dataclasses import replace

import numpy as np
import pytest

from nanoslip.solver.case import Case
from nanoslip.solver.drive import Drive
from nanoslip.solver.dynamics.duration import measure_motion
from nanoslip.solver.dynamics.friction_limit import (
    COARSE,
    FrictionLimit,
    NoPlateauError,
    coarse,
    linear,
    make_friction_limit,
    merge_teeth,
    sawtooth,
)
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.outcome import InvalidInput
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.plateau import Teeth, plateau_of
from nanoslip.solver.sliding.slide import slide
from tests.synthetic import LOAD, SPACING, modulated_record, noisy_record, profile_through, record_from

RECORD = noisy_record()
PLATEAU = plateau_of(RECORD)
UP_TO_END = slice(0, PLATEAU.last_event + 1)
ROUNDING = 1e-12 * LOAD  # a thousandth of a percent of a drop is 3e-8 LOAD


def test_the_sawtooth_has_the_records_force_on_both_sides_of_every_event():
    profile = sawtooth(RECORD, PLATEAU)
    x = RECORD.displacement[UP_TO_END]
    width = np.diff(profile.edges)
    assert np.array_equal(profile.edges[1:], x)
    assert np.allclose(profile.force + profile.slope * width, RECORD.force_before[UP_TO_END], rtol=0, atol=ROUNDING)
    assert np.allclose(profile.limit(x[:-1]), RECORD.force_after[UP_TO_END][:-1], rtol=0, atol=ROUNDING)
    assert profile.steady_force == pytest.approx(PLATEAU.mean * LOAD, rel=1e-12)


def test_the_linear_profile_joins_the_forces_after_events():
    profile = linear(RECORD, PLATEAU)
    x, after = RECORD.displacement[UP_TO_END], RECORD.force_after[UP_TO_END]
    within = np.linspace(0.0, x[-1] * (1 - 1e-12), 1001)
    joined = np.interp(within, np.append(0.0, x), np.append(RECORD.initial_force, after))
    assert np.allclose(profile.limit(within), joined, rtol=0, atol=ROUNDING)


@pytest.mark.parametrize("shape", ["sawtooth", "coarse", "linear"])
def test_the_steady_part_repeats_and_the_past_is_mirrored(shape):
    profile = make_friction_limit(RECORD, PLATEAU, shape)
    x = np.linspace(PLATEAU.start, PLATEAU.end, 777)[1:-1]
    assert profile.period == pytest.approx(PLATEAU.end - PLATEAU.start, rel=1e-14)
    steep = np.abs(profile.slope).max() * 1e-15  # rounding of x moves the limit along a tooth
    assert np.allclose(profile.limit(x + 5 * profile.period), profile.limit(x), rtol=0, atol=10 * steep)
    assert np.array_equal(profile.limit(-x), profile.limit(x))


def test_a_negative_force_after_first_touch_is_taken_as_none():
    record = record_from(np.full(900, 2e-6), np.append(np.zeros(100), np.full(800, 9e-7)), initial_force=-1e-6)
    profile = sawtooth(record, plateau_of(record))
    assert profile.force[0] == 0.0
    assert profile.limit(np.linspace(0.0, 1e-3, 501)).min() == 0.0


@pytest.mark.parametrize("shape", ["sawtooth", "mean"])
def test_without_a_plateau_there_is_nothing_to_repeat(shape):
    record = record_from(np.full(100, 1e-5), np.zeros(100))
    with pytest.raises(NoPlateauError, match=r"limits\.events"):
        make_friction_limit(record, plateau_of(record), shape)


@pytest.mark.parametrize("shape", ["sawtooth", "linear"])
def test_a_profile_repeats_whole_spacings(shape):
    """A pin that goes on for ever keeps in step with the nodes: within the step between two events."""
    record = modulated_record(2.4, 0.3)
    profile = make_friction_limit(record, plateau_of(record), shape)
    assert profile.period == pytest.approx(2.0 * SPACING, abs=1.01 * record.displacement[0])
    # Half a spacing out of step the limit would be off by twice the modulation, 5 % of a mean of 0.27.
    x = np.linspace(0.0, profile.period, 1001)[:-1] + record.displacement[-1]
    expected = 0.27 * LOAD * (1.0 + 0.05 * np.sin(2.0 * np.pi * (x / SPACING + 0.3)))
    assert np.abs(profile.limit(x + 3.0 * profile.period) - expected).max() < 0.1 * 0.27 * 0.05 * LOAD


@pytest.mark.parametrize(
    ("edges", "force", "slope", "periodic_from", "named"),
    [
        ([0.0, 1.0], [1.0, 1.0], [0.0, 0.0], 0, "teeth = 2"),
        ([0.0, 1.0, 1.0], [1.0, 1.0], [0.0, 0.0], 0, "increase from 0"),
        ([0.5, 1.0], [1.0], [0.0], 0, "increase from 0"),
        ([0.0, 1.0], [1.0], [0.0], 1, "periodic_from = 1"),
        ([0.0, 1.0], [1.0], [-1.5], 0, "force = -0.5"),
        ([0.0, 1.0], [np.nan], [0.0], 0, "finite numbers"),
        ([0.0, 1.0], [np.inf], [0.0], 0, "finite numbers"),
        ([0.0, np.inf], [1.0], [0.0], 0, "finite positions"),
    ],
)
def test_teeth_that_do_not_fit_are_refused_by_name(edges, force, slope, periodic_from, named):
    with pytest.raises(InvalidInput, match=named):
        FrictionLimit(np.array(edges), np.array(force), np.array(slope), periodic_from)


def test_at_a_jump_the_limit_is_the_force_ahead():
    profile = profile_through([0.0, 1.0, 2.0], [0.0, 0.5], [1.0, 2.0])
    assert profile.limit(np.array([1.0, 2.0])).tolist() == [0.5, 0.0]


def test_the_mean_profile_is_the_plateaus_mean_everywhere():
    profile = make_friction_limit(RECORD, PLATEAU, "mean")
    assert np.array_equal(profile.limit(np.linspace(-3.0, 3.0, 11)), np.full(11, PLATEAU.mean * LOAD))
    assert profile.steady_force == PLATEAU.mean * LOAD


def random_teeth(seed: int, count: int = 500) -> Teeth:
    """Teeth of very different lengths that rise by up to a fifth."""
    draw = np.random.default_rng(seed)
    edges = np.concatenate(([0.0], np.cumsum(draw.exponential(1.0, count) ** 2)))
    start = draw.uniform(1.0, 1.2, count)
    return Teeth(edges, start, start + draw.uniform(0.0, 0.2, count))


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("shortest", [0.1, 7.0, 1e5])
def test_mean_and_highest_force_of_each_stretch_stay(seed: int, shortest: float):
    """By the integral of the old teeth over each new one; forces here are too high for a tooth to begin below zero."""
    old, stays = random_teeth(seed), 123
    new, place = merge_teeth(old, stays, shortest)
    assert new.edges[place] == old.edges[stays]
    assert set(new.edges) <= set(old.edges)
    assert (new.edges[0], new.edges[-1]) == (old.edges[0], old.edges[-1])
    work = np.diff(old.integral(new.edges))
    whole = float(work.sum())
    assert np.allclose(0.5 * np.diff(new.edges) * (new.start + new.end), work, rtol=0, atol=1e-13 * whole)
    for left, right, highest in zip(new.edges[:-1], new.edges[1:], np.maximum(new.start, new.end), strict=True):
        within = (old.edges[:-1] >= left) & (old.edges[1:] <= right)
        assert highest == pytest.approx(max(old.start[within].max(), old.end[within].max()), rel=1e-13)
    stretches = old.edges[stays] // shortest + (old.edges[-1] - old.edges[stays]) // shortest + 2
    assert len(new.start) <= stretches


def test_a_tooth_by_itself_stays_as_it_is():
    old = random_teeth(9)
    new, place = merge_teeth(old, 123, 1e-9)
    assert place == 123
    for name in ("edges", "start", "end"):
        assert np.array_equal(getattr(new, name), getattr(old, name))


def test_no_tooth_begins_below_zero():
    """A single high tooth among low ones: the mean is kept, its height is not."""
    old = Teeth(np.arange(101.0), np.zeros(100), np.where(np.arange(100) == 50, 1.0, 0.01))
    new, _ = merge_teeth(old, 50, 1000.0)
    assert np.all(new.start >= 0.0)
    assert np.sum(np.diff(new.edges) * (new.start + new.end)) == pytest.approx(np.sum(old.end), rel=1e-13)


def test_a_records_coarse_teeth_are_few_and_as_strong():
    """Their steady force is the sawtooth's, and so is the force that a stiff spring has to reach."""
    fine, few = sawtooth(RECORD, PLATEAU), coarse(RECORD, PLATEAU)
    most = (fine.edges[-1] - fine.edges[0]) / RECORD.spacing * COARSE + 2.0
    assert len(few.force) <= most < len(fine.force)
    assert few.steady_force == pytest.approx(fine.steady_force, rel=1e-12)
    tops = [limit.force + limit.slope * np.diff(limit.edges) for limit in (fine, few)]
    assert tops[1].max() == pytest.approx(tops[0].max(), rel=1e-12)


@pytest.mark.parametrize("compliant", [True, False])
@pytest.mark.parametrize("speed", [5e-4, 1e-2])
def test_coarse_teeth_hold_and_drag_a_pin_as_the_records_do(speed: float, compliant: bool):
    """By a spring of a hundredth of the slab's stiffness, which gives way by hundreds of teeth: 6e-3 seen of μ_s, 2e-3 of μ_k."""
    case = Case(slab=Slab(n_x=65), max_events=None, max_spacings=2.0)
    record = slide(case, surface_compliance(case.slab))
    plateau = plateau_of(record)
    drive = Drive.from_si(stage_velocity=speed, surface_compliance=compliant, duration=1.0)
    fine, few = (measure_motion(record, plateau, replace(drive, profile=shape))[1] for shape in ("sawtooth", "coarse"))
    assert few.static_friction == pytest.approx(fine.static_friction, rel=1e-2)
    assert few.kinetic_friction == pytest.approx(fine.kinetic_friction, rel=3e-3)
