"""The residual of equilibrium sees what comparisons do not: numbers that are none, and a contact that bears nothing."""

import numpy as np
import pytest

from solver.case import Case
from solver.contact.compiled_contact import CompiledContact, compiled_contact, corrected_for_rounding
from solver.contact.kernels.cascade import answer_violations
from solver.contact.kernels.enumerations import Stop
from solver.contact.kernels.equilibrium import RESIDUAL_LIMIT, equilibrium_residual, refresh
from solver.contact.outcomes import OUTCOME_OF_STOP
from solver.elasticity.compliance import surface_compliance
from solver.outcome import Ending
from solver.slab import Slab


def one_node() -> CompiledContact:
    slab = Slab(n_x=9)
    contact = np.arange(9) == 4
    return compiled_contact(
        Case(slab=slab), surface_compliance(slab), contact, np.zeros(9), np.zeros(9), followed=np.ones(9, dtype=bool)
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
