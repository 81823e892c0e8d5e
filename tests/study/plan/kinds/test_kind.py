"""Kinds of task: what their results are called is unambiguous, and a record comes back from its result as it was."""

from dataclasses import fields, replace

import numpy as np
import pytest

from nanoslip.solver.case import Case
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.parameter import quantities
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.record import FrictionRecord
from nanoslip.solver.sliding.slide import slide
from nanoslip.study.plan.kinds import KINDS, MEMBER, Kind, compliance_task, declared, record_task
from nanoslip.study.run.compute import compliance_of, run_task, whole_again


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_no_two_numbers_of_a_kind_have_one_name(kind: Kind) -> None:
    found = [each for part in kind.parts for each in quantities(part.type, part.prefix).items()]
    for along in {"", *(ragged.sample for ragged in kind.ragged)} - {MEMBER}:
        keys = [key for key, quantity in found if quantity.along == along]
        assert len(keys) == len(set(keys)) == len(declared(kind, along)), along
    names = [(quantity.along, quantity.name) for _, quantity in found]
    assert len(names) == len(set(names))


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_every_column_lies_along_a_dimension_of_its_kind(kind: Kind) -> None:
    found = {each.along for part in kind.parts for each in quantities(part.type, part.prefix).values()}
    assert found - {""} == {ragged.sample for ragged in kind.ragged} - {MEMBER}  # along which scalars lie


def test_a_kind_is_known_by_its_name_and_comes_after_what_it_needs() -> None:
    assert list(KINDS) == ["compliance", "contact", "record", "statistics", "states", "drive"]
    assert all(name == kind.name for name, kind in KINDS.items())


def test_tasks_of_one_slab_are_given_the_very_same_compliance() -> None:
    """What the solver keeps with it is found again; another result's, though equal, is another."""
    first, second = (record_task(Case(radius=50.0, slab=Slab(17), start=start)) for start in (0.0, 0.5))
    inputs = {first.needs[0]: run_task(compliance_task(first.slab), {})}
    assert compliance_of(first, inputs) is compliance_of(second, inputs)
    assert compliance_of(first, inputs) != compliance_of(first, {first.needs[0]: replace(inputs[first.needs[0]])})


def test_a_record_comes_back_from_its_result() -> None:
    case = Case(radius=50.0, slab=Slab(17), max_events=20)
    slab = run_task(compliance_task(case.slab), {})
    again = whole_again(FrictionRecord, run_task(record_task(case), {slab.key: slab}))
    once = slide(case, surface_compliance(case.slab))
    for item in fields(FrictionRecord):
        if item.name != "outcome":  # the record lacks nothing, its result a plateau
            np.testing.assert_array_equal(getattr(again, item.name), getattr(once, item.name))
