"""A record that is to know its plateau ends as soon as it does, and never before; till then it is the record without a target."""

import itertools
from dataclasses import fields, replace
from functools import lru_cache

import numpy as np
import pytest

from solver.case import Case, Effects, Heterogeneity, SlipRule
from solver.elasticity.compliance import SurfaceCompliance, surface_compliance
from solver.outcome import Ending
from solver.slab import Slab
from solver.sliding.events import slide, states_at
from solver.sliding.plateau import plateau_of
from solver.sliding.record import EVENT_TYPES, FrictionRecord
from solver.sliding.target import FIRST_LOOK, GROWTH

SMALL = Case(slab=Slab(33), max_events=6000)
CASES = {
    "the whole contact": (SMALL, 0.01),
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
