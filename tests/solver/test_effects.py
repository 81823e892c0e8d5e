"""Effects that a scene may leave out: each is there or not, and gone in the scene without it."""

import numpy as np
import pytest

from nanoslip.solver.case import Case, Heterogeneity
from nanoslip.solver.drive import Drive
from nanoslip.solver.effects import OF_CASES, OF_DRIVES, SPARED, Effect
from nanoslip.solver.ensemble import change_by, mean_of
from nanoslip.solver.slab import Slab

WHOLE = Case(slab=Slab(33), heterogeneity=Heterogeneity(spread=0.1, roughness=((-0.5, 0.0), (0.0, 1e-5), (0.5, 0.0))))
PULLED = Drive(2e-3, 0.1, 1e-5, 100.0)


@pytest.mark.parametrize("effect", OF_CASES, ids=lambda effect: effect.name)
def test_a_case_without_an_effect_does_not_have_it_and_has_the_others(effect: Effect[Case]) -> None:
    without = effect.without(WHOLE)
    assert {each.name for each in OF_CASES if each.there(WHOLE)} == {each.name for each in OF_CASES}
    assert {each.name for each in OF_CASES if not each.there(without)} == {effect.name}


@pytest.mark.parametrize("effect", OF_DRIVES, ids=lambda effect: effect.name)
def test_a_drive_without_an_effect_does_not_have_it(effect: Effect[Drive]) -> None:
    assert effect.there(PULLED)
    assert not effect.there(effect.without(PULLED))


def test_coarse_teeth_are_teeth_and_no_teeth_are_not_fine() -> None:
    teeth, fine = SPARED
    assert teeth.there(fine.without(PULLED))
    assert not fine.there(teeth.without(PULLED))


def test_a_change_is_known_better_than_what_it_is_a_change_of() -> None:
    """Members that differ by 10 %, each changed by 1 % of the mean: the change is 1 %, without any ±."""
    whole = [1.0, 0.9, 1.1]
    assert change_by([each + 0.01 for each in whole], whole) == pytest.approx(0.01, rel=1e-12)
    changes = np.array([0.01, 0.02, 0.03])
    expected = 0.02 + 2.0 * float(mean_of(changes).uncertainty)
    assert change_by(changes + whole, whole) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(
    ("without", "whole"), [([1.0, np.nan], [1.0, 1.0]), ([1.0, 1.0], [1.0, np.nan]), ([0.1, 0.0], [0.1, -0.1])]
)
def test_a_change_that_nobody_knows_is_never_allowed(without: list[float], whole: list[float]) -> None:
    assert change_by(without, whole) == np.inf
