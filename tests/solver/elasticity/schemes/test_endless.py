"""A surface without ends has no rows of nodes to be halved: any odd n_x does, and a convolution says all of its matrix."""

import pytest

from nanoslip.solver.case import Case
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.outcome import InvalidInput
from nanoslip.solver.slab import FEWEST_NODES, MOST_NODES, Slab
from nanoslip.solver.sliding.slide import slide_to_state
from tests.physics import assert_contact_laws


@pytest.mark.parametrize("n_x", [FEWEST_NODES, 7, 1001, 100_001, MOST_NODES])
def test_every_odd_number_of_nodes_is_taken(n_x: int) -> None:
    assert Slab(n_x=n_x, scheme="half_plane").n_x == n_x


@pytest.mark.parametrize("n_x", [FEWEST_NODES - 2, 6, 100_000, MOST_NODES + 2])
def test_other_numbers_of_nodes_are_refused_by_name(n_x: int) -> None:
    with pytest.raises(InvalidInput, match=rf"n_x = {n_x}: needs an odd number from 5 to 1048577"):
        Slab(n_x=n_x, scheme="half_plane")


@pytest.mark.parametrize("scheme", ["galerkin", "biquadratic"])
def test_a_grid_still_needs_rows_that_can_be_halved(scheme: str) -> None:
    with pytest.raises(InvalidInput, match=r"n_x = 100001: needs 2\^N \+ 1"):
        Slab(n_x=100_001, scheme=scheme)


def test_a_pin_slides_over_an_odd_number_of_nodes_as_over_any() -> None:
    case = Case(slab=Slab(n_x=71, scheme="half_plane"), max_events=50)
    compliance = surface_compliance(case.slab)
    record, end = slide_to_state(case, compliance)
    assert record.outcome.ok
    assert len(record.displacement) == 50
    assert_contact_laws(end, case, compliance)
