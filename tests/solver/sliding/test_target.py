"""A record that is to know its plateau ends as soon as it does, and never before; till then it is the record without a target."""

import itertools
import math
from dataclasses import fields, replace
from functools import lru_cache

import numpy as np
import pytest

from solver.case import Case, Effects, Heterogeneity, SlipRule
from solver.elasticity.compliance import SurfaceCompliance, surface_compliance
from solver.outcome import Ending
from solver.slab import Slab
from solver.sliding.events import slide, states_at
from solver.sliding.plateau import TELLING, plateau_of
from solver.sliding.record import EVENT_TYPES, FrictionRecord
from solver.sliding.target import FIRST_LOOK, GROWTH

SMALL = Case(slab=Slab(33), max_events=6000)
CASES = {
    "the whole contact": (SMALL, 0.012),
    "over whole spacings": (Case(slab=Slab(65), max_events=None, max_spacings=6.0), 0.0007),
    "further than the first room for events": (Case(slab=Slab(129), max_events=20_000), 0.0022),
    "the paper's scheme": (replace(SMALL, slab=Slab(33, scheme="biquadratic")), 0.01),
    "a rough pin": (replace(SMALL, heterogeneity=Heterogeneity(roughness=((-0.1, 0.0), (0.1, 1e-6)))), 0.02),
    "half of the shear left": (replace(SMALL, slip_rule=SlipRule(residual_shear=0.5)), 0.008),
    "pressures frozen": (replace(SMALL, effects=Effects(pin_translation=False)), 0.025),
    "classical sliding": (replace(SMALL, slip_rule=SlipRule(residual_shear=1.0), max_events=200), 0.001),
}
"""Each with a target that it reaches."""


@lru_cache
def compliance(slab: Slab) -> SurfaceCompliance:
    return surface_compliance(slab)


@lru_cache(maxsize=2)
def aimed(label: str) -> FrictionRecord:
    case, target = CASES[label]
    return slide(replace(case, target_uncertainty=target), compliance(case.slab))


def same(one: FrictionRecord, other: FrictionRecord) -> bool:
    return all(
        np.array_equal(getattr(one, item.name), getattr(other, item.name), equal_nan=True)
        if isinstance(getattr(one, item.name), np.ndarray)
        else getattr(one, item.name) == getattr(other, item.name)
        for item in fields(FrictionRecord)
    )


def first(record: FrictionRecord, count: int) -> FrictionRecord:
    """The record as it was after so many events."""
    columns = {name: getattr(record, name)[:count] for name in EVENT_TYPES}
    ends = {"final_displacement": record.displacement[count - 1], "final_force": record.force_after[count - 1]}
    return replace(record, **columns, **ends)


@pytest.mark.parametrize("label", CASES)
def test_event_by_event_it_is_the_record_without_a_target(label: str) -> None:
    case, _ = CASES[label]
    record, whole = aimed(label), slide(case, compliance(case.slab))
    count = len(record.displacement)
    assert FIRST_LOOK <= count < len(whole.displacement)
    for name in EVENT_TYPES:
        assert np.array_equal(getattr(record, name), getattr(whole, name)[:count]), name


@pytest.mark.parametrize("label", CASES)
def test_it_is_the_record_of_as_many_events_in_all_its_bits(label: str) -> None:
    case, _ = CASES[label]
    record = aimed(label)
    again = slide(
        replace(case, max_events=len(record.displacement), max_spacings=None, max_displacement=None),
        compliance(case.slab),
    )
    assert same(record, again)


@pytest.mark.parametrize("label", CASES)
def test_it_ends_as_soon_as_its_plateau_is_known_at_two_looks_in_a_row_and_never_before(label: str) -> None:
    target, record = CASES[label][1], aimed(label)
    assert record.outcome.ok
    assert plateau_of(record).relative_uncertainty <= target
    look, last, content = FIRST_LOOK, len(record.displacement), [False]
    while look <= last:
        content.append(plateau_of(first(record, look)).relative_uncertainty <= target)
        look += max(look // GROWTH, 1)
    in_a_row = [before and now for before, now in itertools.pairwise(content)]
    assert in_a_row == [False] * (len(in_a_row) - 1) + [True]


DRAWN = replace(Case(slab=Slab(65), max_events=None, max_spacings=3.0), heterogeneity=Heterogeneity(spread=0.02))


def test_an_error_by_its_length_is_reached_where_other_nodes_would_change_more() -> None:
    """The record without a target, broken off: what it states of itself knows of the other nodes as before."""
    target = 0.0045
    record = slide(replace(DRAWN, target_length_error=target), compliance(DRAWN.slab))
    whole = slide(DRAWN, compliance(DRAWN.slab))
    count = len(record.displacement)
    assert FIRST_LOOK <= count < len(whole.displacement)
    assert same(record, slide(replace(DRAWN, max_events=count, max_spacings=None), compliance(DRAWN.slab)))
    plateau = plateau_of(record)
    assert plateau.relative_length_error <= target < plateau.relative_uncertainty


def test_a_plateau_that_is_short_says_nothing_of_its_error_by_its_length() -> None:
    """Of less than a third of a spacing: what it states then is too little, so no target by its length ends it there."""
    case = replace(DRAWN, target_length_error=0.5)
    known = compliance(case.slab)
    plateau = plateau_of(slide(case, known))
    assert TELLING <= plateau.spacings < 1.0
    short = plateau_of(slide(replace(DRAWN, max_spacings=0.25), known))
    assert short.outcome.ok
    assert math.isinf(short.relative_length_error)


def test_of_one_draw_an_error_by_its_length_is_the_uncertainty() -> None:
    case, target = CASES["the whole contact"]
    assert same(slide(replace(case, target_length_error=target), compliance(case.slab)), aimed("the whole contact"))


def test_of_two_targets_both_are_reached() -> None:
    case, target = CASES["the whole contact"]
    known = compliance(case.slab)
    for one, other in ((0.1, target), (target, 0.1)):
        assert same(
            slide(replace(case, target_uncertainty=one, target_length_error=other), known), aimed("the whole contact")
        )


def test_other_limits_are_the_most_it_may_take() -> None:
    """Bit for bit what it is without a target, where it does not get there."""
    for limit in (replace(SMALL, max_events=500), replace(SMALL, max_events=None, max_spacings=0.3)):
        case = replace(limit, target_uncertainty=1e-6)
        record = slide(case, compliance(case.slab))
        assert record.outcome.ending is Ending.COMPLETED
        assert same(record, slide(limit, compliance(case.slab)))


def test_states_after_events_are_those_that_the_record_gets_to() -> None:
    case, target = CASES["the whole contact"]
    reached = len(aimed("the whole contact").displacement)
    known = compliance(case.slab)
    found, outcome = states_at(replace(case, target_uncertainty=target), known, (0, 10, reached, reached + 1))
    assert outcome.ok
    plain, _ = states_at(case, known, (0, 10, reached))
    assert [state.displacement for state in found] == [state.displacement for state in plain]
    assert len(found) == 3
