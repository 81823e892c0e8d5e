"""The residual of equilibrium sees what comparisons do not: numbers that are none, and a contact that bears nothing."""

from dataclasses import replace

import numpy as np
import pytest

from nanoslip.solver.case import Case
from nanoslip.solver.contact.compiled_contact import CompiledContact, compiled_contact, corrected_for_rounding
from nanoslip.solver.contact.kernels.events import answer_violations
from nanoslip.solver.contact.kernels.state import RESIDUAL_LIMIT, Stop, equilibrium_residual, refresh
from nanoslip.solver.contact.soundness import OUTCOME_OF_STOP
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.outcome import Ending
from nanoslip.solver.slab import Slab


def one_node() -> CompiledContact:
    slab = Slab(n_x=9)
    contact = np.arange(9) == 4
    return compiled_contact(
        Case(slab=slab), surface_compliance(slab), contact, np.zeros(9), np.zeros(9), np.ones(9, dtype=bool)
    )


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("entry", [1, 4, 13, 18])
def test_what_is_no_number_is_a_residual_and_ends_a_cascade(entry: int, value: float) -> None:
    """In a free node's displacement, a contact node's shear and pressure, and the approach."""
    compiled = one_node()
    assert equilibrium_residual(compiled.state) < RESIDUAL_LIMIT
    compiled.state.response[entry] = value
    assert not equilibrium_residual(compiled.state) <= RESIDUAL_LIMIT
    status = answer_violations(compiled.state, compiled.constants, 1.0)
    assert not OUTCOME_OF_STOP[status].ok  # an infinite shear slips, an infinite tension is released: neither gets far
    if np.isnan(value):
        assert OUTCOME_OF_STOP[status].ending is Ending.ROUNDING


def test_inputs_that_are_no_numbers_cannot_be_corrected() -> None:
    compiled = one_node()
    compiled.state.inputs[4] = np.nan
    refresh(compiled.state)
    assert OUTCOME_OF_STOP[corrected_for_rounding(compiled, Stop.DONE)].ending is Ending.ROUNDING


def test_a_contact_that_bears_nothing_has_an_infinite_residual() -> None:
    """The largest displacement is what it is compared with: there is none."""
    compiled = one_node()
    compiled.state.response[:] = 0.0
    assert equilibrium_residual(compiled.state) == np.inf


def test_every_stop_that_ends_a_run_has_an_outcome() -> None:
    """All but the one after which a wider window is set up."""
    assert set(Stop) - set(OUTCOME_OF_STOP) == {Stop.WINDOW_TOO_NARROW}


def test_a_contact_that_is_set_up_again_is_the_same_whatever_was_done_to_the_first() -> None:
    """Its tableau is remembered, as slips and other cases begin with it, too; kernels change theirs in place."""
    slab = Slab(n_x=33)
    compliance, contact = surface_compliance(slab), np.abs(np.arange(33) - 16) < 4
    height = np.linspace(0.0, 1e-3, 33)
    first = compiled_contact(Case(slab=slab), compliance, contact, np.zeros(33), height, contact)
    alone = compiled_contact(Case(slab=slab), replace(compliance), contact, np.zeros(33), height, contact)
    before = first.state.tableau.copy()
    first.state.tableau[:] = np.nan
    again = compiled_contact(Case(slab=slab), compliance, contact, np.zeros(33), height, contact)
    for each in (alone, again):
        assert each.state.tableau.tobytes() == before.tobytes()
        assert each.state.response.tobytes() == first.state.response.tobytes()


def test_contacts_of_other_slabs_sets_and_windows_are_not_taken_for_each_other() -> None:
    near, far = (surface_compliance(Slab(n_x=33, aspect_ratio=ratio)) for ratio in (0.5, 2.0))
    nodes = np.abs(np.arange(33) - 16)
    tableaus = {
        compiled_contact(
            Case(slab=each.slab), each, contact, np.zeros(33), np.zeros(33), followed
        ).state.tableau.tobytes()
        for each in (near, far)
        for contact in (nodes < 2, nodes < 4)
        for followed in (nodes < 4, nodes < 6)
    }
    assert len(tableaus) == 8


def test_a_compliance_that_may_change_is_looked_at_each_time() -> None:
    slab = Slab(n_x=9)
    changing = replace(surface_compliance(slab), matrix=surface_compliance(slab).matrix.copy())
    contact, zero = np.arange(9) == 4, np.zeros(9)
    soft = compiled_contact(Case(slab=slab), changing, contact, zero, zero, contact)
    changing.matrix[:] *= 0.5
    stiff = compiled_contact(Case(slab=slab), changing, contact, zero, zero, contact)
    # Row and column of the node that is in contact hold its stiffness, less what the load asks for.
    np.testing.assert_allclose(stiff.state.tableau[4, 4], 2.0 * soft.state.tableau[4, 4], rtol=1e-12)
