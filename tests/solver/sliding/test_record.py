"""A record's columns are what their declarations say."""

import numpy as np

from solver.case import Case, Effects, SlipRule
from solver.elasticity.compliance import surface_compliance
from solver.slab import Slab
from solver.sliding.events import slide
from solver.sliding.record import EVENT_TYPES, FrictionRecord, drops


def test_columns_have_the_types_that_they_declare_whoever_slides() -> None:
    case = Case(radius=50.0, slab=Slab(17), max_events=10)
    cases = (
        case,
        Case(radius=50.0, slab=Slab(17), effects=Effects(pin_translation=False), max_events=10),
        Case(radius=50.0, slab=Slab(17), slip_rule=SlipRule(residual_shear=1.0), max_events=10),
    )
    for each in cases:
        record: FrictionRecord = slide(each, surface_compliance(case.slab))
        for name, dtype in EVENT_TYPES.items():
            column = getattr(record, name)
            assert column.dtype == np.dtype(dtype), name
            assert column.shape == (10,)
            assert not column.flags.writeable


def test_a_force_that_falls_by_rounding_alone_falls_by_nothing() -> None:
    before = np.array([0.3, 0.3, 0.3, 0.3])
    found = drops(before, before - np.array([1e-3, 2e-12, 5e-17, -1e-13]))
    np.testing.assert_allclose(found, [1e-3, 2e-12, 0.0, 0.0], rtol=1e-4)  # 2e-12 of 0.3: to 1e-17/2e-12
    assert not np.any(found[2:])


def test_classical_sliding_drops_nothing_but_what_it_is_solved_to() -> None:
    """Classical sliding goes on at μ_i·p: what is left is how well its roles are solved, and rounding."""
    case = Case(radius=50.0, slab=Slab(17), slip_rule=SlipRule(residual_shear=1.0), max_events=10)
    record = slide(case, surface_compliance(case.slab))
    found = drops(record.force_before / case.normal_load, record.force_after / case.normal_load)
    raw = (record.force_before - record.force_after) / case.normal_load
    assert np.all((found == 0.0) | (np.abs(found) > 1e-12))
    assert np.any((found == 0.0) & (raw != 0.0))
