"""The results of pressing are the solver's."""

from dataclasses import replace

import numpy as np
import pytest

from nanoslip.solver.case import Effects
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.elasticity.compliance import normal_compliance, surface_compliance
from nanoslip.solver.outcome import Ending
from nanoslip.solver.slab import Slab
from nanoslip.study.plan.kinds import compliance_task, contact_task, states_task
from tests.study.plan.running import CASE, first, run


def test_a_compliance_result_is_the_solvers_matrix() -> None:
    np.testing.assert_array_equal(run(compliance_task(Slab(17))).arrays["matrix"], surface_compliance(Slab(17)).matrix)


def test_a_contact_result_is_the_solvers_state() -> None:
    state = initial_contact(CASE, surface_compliance(CASE.slab))
    result = run(compliance_task(CASE.slab), contact_task(CASE))
    assert result.outcome.ok
    assert first(result)["contact_size"] == state.contact.sum() > 2
    assert first(result)["approach"] == state.approach
    assert first(result)["slips"] == state.slips
    assert first(result)["maximum_pressure"] == state.pressure.max()
    for name in ("pressure", "shear", "slip", "gap"):
        np.testing.assert_array_equal(result.arrays[name], getattr(state, name))


ENDLESS = replace(CASE, slab=Slab(65, scheme="half_plane"), effects=Effects(coupling=False))


@pytest.mark.parametrize("effects", [Effects(coupling=False), Effects(friction=False)], ids=str)
def test_a_contact_without_a_matrix_needs_no_compliance(effects: Effects) -> None:
    case = replace(ENDLESS, effects=effects)
    task = contact_task(case)
    assert task.needs == ()
    state, result = initial_contact(case, normal_compliance(case.slab)), run(task)
    assert result.outcome.ok
    for name in ("pressure", "shear", "slip", "gap"):
        np.testing.assert_array_equal(result.arrays[name], getattr(state, name))


def test_what_reads_the_matrix_needs_it() -> None:
    (key,) = contact_task(replace(ENDLESS, effects=Effects())).needs
    assert key == compliance_task(ENDLESS.slab).key
    assert contact_task(replace(CASE, effects=Effects(coupling=False))).needs == (compliance_task(CASE.slab).key,)


def test_a_look_at_initial_contact_needs_what_the_contact_needs() -> None:
    look = states_task(ENDLESS, (0,), subsurface=False)
    assert look.needs == ()
    np.testing.assert_array_equal(run(look).arrays["surface_pressure"], run(contact_task(ENDLESS)).arrays["pressure"])
    assert states_task(ENDLESS, (0, 3), subsurface=False).needs == (compliance_task(ENDLESS.slab).key,)


def test_a_datum_too_near_is_a_result_of_the_contact_itself() -> None:
    shallow = replace(ENDLESS, slab=Slab(65, 0.3, scheme="half_plane"))
    outcome = run(contact_task(shallow)).outcome
    assert outcome.ending is Ending.INVALID
    assert "needs a deeper datum" in outcome.message
