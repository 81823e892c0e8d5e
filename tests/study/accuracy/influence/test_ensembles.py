"""Influence: the change of the mean and the certainty that is lost, of what both ensembles yield."""

import math
from dataclasses import replace

import numpy as np
import pytest

from solver.case import Case
from solver.slab import Slab
from solver.sliding.sampling import EVENLY
from study.accuracy.influence.ensembles import (
    FEWEST,
    STARTS,
    WHOLE,
    compliance_of,
    driven,
    ensemble_of,
    influence,
    influences_among,
    reduced_in,
)
from study.accuracy.influence.scenes import random_scene
from study.plan.influence.omissions import OMISSIONS
from study.plan.influence.scene import OBSERVABLES, OF_DRIVES, Scene
from study.plan.influence.table import LARGEST

SPREAD = np.linspace(-1.0, 1.0, STARTS)
"""Of starts, with mean 0."""
DEVIATION = float(np.std(SPREAD, ddof=1))
TINY = Scene(Case(radius=50.0, slab=Slab(17), max_events=40))
DRIVEN = TINY._replace(drive=random_scene(3).drive)


def column(*values: np.ndarray) -> np.ndarray:
    return np.column_stack(values)


def test_an_ensemble_changes_nothing_of_itself() -> None:
    values = np.random.default_rng(1).normal(1.0, 0.3, (STARTS, 4))
    assert influence(values, values).tolist() == [0.0] * 4


def error_of(on: float, off: float) -> float:
    """Standard error of the change between two ensembles whose starts are so wide apart."""
    return EVENLY * math.hypot(on, off) * DEVIATION / math.sqrt(STARTS)


def test_a_changed_mean_is_its_change_over_the_mean_less_what_chance_does() -> None:
    on = 2.0 + 0.1 * SPREAD
    expected = (0.2 - error_of(0.1, 0.1)) / 2.0
    assert influence(column(on, -on), column(on + 0.2, -on - 0.2)).tolist() == pytest.approx([expected] * 2, rel=1e-12)


def test_a_change_within_its_standard_error_is_none() -> None:
    on = 2.0 + 0.1 * SPREAD
    for share, nothing in ((0.99, True), (1.01, False)):
        found = influence(column(on), column(on + share * error_of(0.1, 0.1)))[0]
        assert (found == 0.0) == nothing


def lost(on: float, off: float) -> float:
    """Certainty that is lost, over a mean of 2."""
    return (off * DEVIATION * (1.0 - 1.0 / math.sqrt(2.0 * (STARTS - 1))) - on * DEVIATION) / 2.0


def test_starts_that_differ_more_are_lost_certainty_and_those_that_differ_less_are_no_gain() -> None:
    on, wider, narrower = (2.0 + width * SPREAD for width in (0.1, 0.3, 0.01))
    assert influence(column(on, on), column(wider, narrower)).tolist() == pytest.approx(
        [lost(0.1, 0.3), 0.0], abs=1e-12
    )


def test_both_add_up() -> None:
    on, off = 2.0 + 0.1 * SPREAD, 2.4 + 0.3 * SPREAD
    expected = (0.4 - error_of(0.1, 0.3)) / 2.0 + lost(0.1, 0.3)
    assert influence(column(on), column(off))[0] == pytest.approx(expected, rel=1e-12)


def test_ensembles_that_differ_by_chance_alone_seldom_have_an_influence() -> None:
    """Independent starts: beyond one standard error is a third of them, but by evenly spread ones' standard error."""
    draw = np.random.default_rng(4)
    on, off = (2.0 + 0.1 * draw.standard_normal((STARTS, 2000)) for _ in range(2))
    found = influence(on, off)
    assert np.median(found) < 0.01
    assert np.quantile(found, 0.99) < 4.0 * 0.1 / 2.0


def lacking(count: int) -> np.ndarray:
    values = 1.0 + 0.1 * SPREAD
    values[:count] = math.nan
    return values


def test_of_too_few_starts_nothing_is_said() -> None:
    on = 1.0 + 0.1 * SPREAD
    for count in range(STARTS + 1):
        found = influence(column(lacking(count)), column(on))[0]
        assert math.isnan(found) == (STARTS - count < FEWEST)


def test_what_cannot_be_computed_without_the_effect_is_the_largest_influence() -> None:
    on = 1.0 + 0.1 * SPREAD
    found = [float(influence(column(on), column(lacking(count)))[0]) for count in range(STARTS + 1)]
    assert found[-1] == found[-2] == LARGEST
    assert found[0] == 0.0
    assert max(found[: STARTS - FEWEST // 2 + 1]) < 1.0


def test_of_starts_that_yield_a_number_by_chance_nothing_is_said() -> None:
    """Half of the starts have it, with the effect and without, but hardly the same ones."""
    first, last = np.arange(STARTS) < STARTS // 2, np.arange(STARTS) >= STARTS // 2
    on, off = (np.where(known, 1.0 + 0.1 * SPREAD, math.nan) for known in (first, last))
    assert math.isnan(influence(column(on), column(off))[0])
    rarely = np.where(np.arange(STARTS) == STARTS - 1, 1.0, math.nan)
    assert influence(column(on), column(rarely))[0] == LARGEST


def test_a_start_that_either_lacks_is_left_out_of_both() -> None:
    on, off = 1.0 + 0.1 * SPREAD, 1.0 + 0.1 * SPREAD
    off[-1] = math.nan
    assert influence(column(on), column(off))[0] == 0.0


def test_of_what_is_nothing_no_share_can_change() -> None:
    assert math.isnan(influence(np.zeros((STARTS, 1)), np.ones((STARTS, 1)))[0])


def test_starts_are_spread_over_a_spacing_and_give_what_a_record_gives() -> None:
    found = ensemble_of(TINY, compliance_of(TINY), starts=4)
    assert found.values.shape == (4, len(OBSERVABLES))
    assert len(found.records) == 4
    columns = [OBSERVABLES.index(name) for name in OF_DRIVES]
    assert np.isnan(found.values[:, columns]).all()
    peak = found.values[:, OBSERVABLES.index("peak_friction")]
    assert np.isfinite(peak).all()
    assert len(set(peak.tolist())) > 1
    moved = TINY._replace(case=replace(TINY.case, start=0.25))
    other = ensemble_of(moved, compliance_of(moved), starts=4)
    np.testing.assert_allclose(np.roll(other.values, 1, axis=0), found.values, rtol=0.0, atol=0.0)


def test_the_same_records_are_pulled_over_without_being_computed_again() -> None:
    still = ensemble_of(TINY, compliance_of(TINY), starts=2)
    moved = driven(DRIVEN, still)
    assert moved.records is still.records
    columns = [number for number, name in enumerate(OBSERVABLES) if name not in OF_DRIVES]
    np.testing.assert_array_equal(moved.values[:, columns], still.values[:, columns])
    assert driven(TINY, still) is still


def test_a_pin_that_does_not_slide_without_an_effect_of_the_contact_says_nothing_of_its_drive() -> None:
    """That is the drive's matter. Of an effect of the drive itself it is the largest influence."""
    whole = np.tile((1.0 + 0.01 * SPREAD)[:, None], len(OBSERVABLES))
    stuck = whole.copy()
    columns = [OBSERVABLES.index(name) for name in OF_DRIVES]
    stuck[:, columns] = math.nan
    found = influences_among({WHOLE: whole, "coupling": stuck, "damping": stuck})
    assert found["damping"].tolist() == [LARGEST] * len(OF_DRIVES)
    assert np.isnan(found["coupling"][columns]).all()
    assert np.count_nonzero(found["coupling"] == 0.0) == len(OBSERVABLES) - len(OF_DRIVES)


@pytest.mark.slow
def test_every_effect_that_a_scene_has_gets_an_influence_on_what_it_can_change() -> None:
    """8 starts of a small scene, once for each effect: some seconds."""
    scene = next(
        each for each in map(random_scene, range(50)) if each.case.slab.n_x == 33 and each.case.heterogeneity.spread
    )
    scene = scene._replace(case=replace(scene.case, max_events=100))
    values = dict(reduced_in(scene))
    assert next(iter(values)) == WHOLE
    found = influences_among(values)
    assert set(found) == {name for name, omission in OMISSIONS.items() if omission.there(scene)}
    for name, changes in found.items():
        assert changes.shape == (len(OMISSIONS[name].observables),)
        known = changes[~np.isnan(changes)]
        assert (known >= 0.0).all()
