"""The account of a campaign counts each effect in the cases or drives that have it, once."""

import math

import numpy as np
import pytest

from solver.case import Case
from study.plan.influence.account import accounts, times_cheaper
from study.plan.influence.choice import Choice, Length
from study.plan.influence.decision import Decision
from study.plan.influence.scene import OBSERVABLES

COLUMNS = [0, 2]


def choice(effect: str, influence: float, reason: str = "", saves: float = 1.0) -> Choice:
    changes = np.zeros(len(OBSERVABLES))
    changes[0], changes[1] = influence, math.nan
    return Choice(effect, not reason, changes, saves, reason)


DECISIONS = (
    Decision(
        Case(),
        Case(),
        (choice("coupling", 0.1), choice("spread", 0.9, "matters")),
        {"a": (choice("teeth", 0.2),), "b": (choice("teeth", 0.3),)},
        {"": Length(0.003, 1.0, ""), "a": Length(0.004, 0.5, ""), "b": Length(None, 0.5, "saves nothing")},
        seconds=2.0,
        seconds_of_all=8.0,
    ),
    Decision(
        Case(),
        Case(),
        (choice("coupling", 0.4), choice("spread", 0.9, "saves nothing")),
        {"a": (choice("teeth", 0.1, "matters"),), "b": (choice("teeth", 0.1, "matters"),)},
        {"": Length(None, 1.0, "saves nothing")},
        seconds=2.0,
        seconds_of_all=2.0,
    ),
    Decision(Case(), Case(), (choice("spread", 0.9, "matters"),), {}, {}, seconds=1.0, seconds_of_all=5.0),
)


def test_each_effect_is_counted_where_it_is_with_its_largest_change_and_most_frequent_reason() -> None:
    """What is not asked for may be unknown."""
    found = {each.effect: each for each in accounts(DECISIONS, COLUMNS)}
    assert list(found) == ["coupling", "spread", "teeth", "whole_length"]
    assert [(each.having, each.left_out) for each in found.values()] == [(2, 2), (3, 0), (4, 2), (4, 2)]
    assert [each.influence for each in found.values()] == pytest.approx([0.4, 0.0, 0.3, 0.008])
    assert [each.saves for each in found.values()] == [2.0, 0.0, 2.0, 1.5]
    assert [each.reason for each in found.values()] == ["", "matters", "matters", "saves nothing"]


def test_nothing_decided_is_nothing_counted() -> None:
    assert accounts((), COLUMNS) == []


def test_time_is_compared_over_all_cases() -> None:
    assert times_cheaper(DECISIONS) == 3.0
