"""Options of a case or drive: every set of effects within the tolerance, once, the cheapest first."""

import itertools
import math

import numpy as np
import pytest

from study.plan.influence.choice import BEATEN, Choice, Part

CHANGES = {"one": 0.004, "two": 0.005, "three": 0.002}
SAVES = {"one": 5.0, "two": 2.0, "three": 1.0}


def choice(name: str, reason: str = "") -> Choice:
    return Choice(name, False, np.array([CHANGES[name], math.nan]), SAVES[name], reason)


PART = Part(10.0, tuple(map(choice, CHANGES)), {0.005: 0.2, 0.002: 0.5}, "")


@pytest.mark.parametrize("within", [0.001, 0.004, 0.0065, 0.0095, 0.012])
def test_every_set_that_stays_within_is_an_option(within: float) -> None:
    """By the sum of its changes, and the product of what is left of the time; what is not asked for may be unknown."""
    found = PART.options([0], within)
    sets = itertools.chain.from_iterable(itertools.combinations(CHANGES, size) for size in range(4))
    assert {each.effects for each in found} == {each for each in sets if sum(CHANGES[name] for name in each) <= within}
    assert [each.seconds for each in found] == sorted(each.seconds for each in found)
    for each in found:
        assert each.changes[0] == pytest.approx(sum(CHANGES[name] for name in each.effects))
        assert each.seconds == pytest.approx(10.0 * math.prod(1.0 - SAVES[name] / 10.0 for name in each.effects))


def test_what_has_a_reason_to_stay_is_no_option() -> None:
    part = PART._replace(choices=(choice("one", "matters"), choice("two")))
    assert {each.effects for each in part.options([0], 1.0)} == {(), ("two",)}
    taken = {each.effect: (each.left_out, each.reason) for each in part.taken(("two",))}
    assert taken == {"one": (False, "matters"), "two": (True, "")}
    assert {each.reason for each in part.taken(())} == {"matters", BEATEN}


def test_a_length_says_what_it_saves_or_why_it_is_whole() -> None:
    assert PART.length(0.002) == (0.002, 5.0, "")
    assert PART.length(None) == (None, 8.0, BEATEN)
    assert PART._replace(shorter={}).length(None) == (None, 0.0, "saves nothing")
    assert PART._replace(shorter={}, stays="kept by the file").length(None) == (None, 0.0, "kept by the file")
