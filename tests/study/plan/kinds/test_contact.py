"""The results of pressing are the solver's."""

import numpy as np

from solver.contact.initial import initial_contact
from solver.elasticity.compliance import surface_compliance
from solver.slab import Slab
from study.plan.tasks import (
    compliance_task,
    contact_task,
)
from tests.study.plan.running import CASE, run


def test_a_compliance_result_is_the_solvers_matrix() -> None:
    np.testing.assert_array_equal(run(compliance_task(Slab(17))).arrays["matrix"], surface_compliance(Slab(17)).matrix)


def test_a_contact_result_is_the_solvers_state() -> None:
    state = initial_contact(CASE, surface_compliance(CASE.slab))
    result = run(compliance_task(CASE.slab), contact_task(CASE))
    assert result.outcome.ok
    assert result.scalars["contact_size"] == state.contact.sum() > 2
    assert result.scalars["approach"] == state.approach
    assert result.scalars["slips"] == state.slips
    assert result.scalars["maximum_pressure"] == state.pressure.max()
    for name in ("pressure", "shear", "slip", "gap"):
        np.testing.assert_array_equal(result.arrays[name], getattr(state, name))
