"""A record's columns are what their declarations say."""

import numpy as np

from solver.case import Case, Effects, SlipRule
from solver.elasticity.compliance import surface_compliance
from solver.slab import Slab
from solver.sliding.events import slide
from solver.sliding.record import EVENT_TYPES, FrictionRecord


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
