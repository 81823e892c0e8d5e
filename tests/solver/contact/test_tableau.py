"""The tableau against what it means: prescribed values in, unknown values out, wherever the nodes in contact lie."""

import numpy as np
import pytest

from nanoslip.solver.contact.compiled_contact import tableau
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.slab import Slab

TOUCHING = {"middle": [3, 4, 5], "with a gap": [1, 2, 6], "at both ends": [0, 8], "all": list(range(9))}


@pytest.mark.parametrize("scheme", ["galerkin", "biquadratic"], ids=["symmetric", "not symmetric"])
@pytest.mark.parametrize("nodes", TOUCHING.values(), ids=TOUCHING)
def test_the_tableau_exchanges_what_is_given_and_what_is_unknown_in_the_bordered_compliance(
    nodes: list[int], scheme: str
) -> None:
    n, matrix = 9, surface_compliance(Slab(9, scheme=scheme)).matrix
    contact = np.isin(np.arange(n), nodes)
    bordered = np.zeros((2 * n + 1, 2 * n + 1))
    bordered[:-1, :-1] = matrix
    bordered[n:-1, -1] = bordered[-1, n:-1] = 1.0
    exchanged = np.concatenate((contact, contact, [True]))
    forces = np.random.default_rng(1).standard_normal(2 * n + 1)
    moved = bordered @ forces
    given, unknown = np.where(exchanged, moved, forces), np.where(exchanged, forces, moved)
    # The condition of these compliances is below 1e3.
    np.testing.assert_allclose(
        given @ tableau(matrix, contact), unknown, rtol=0.0, atol=1e-12 * np.abs(given).max() * 1e3
    )
