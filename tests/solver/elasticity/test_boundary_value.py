"""The mixed problem of §2.1.4: either of each pair in, the other out; too much or too little is refused by name."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.elasticity.grid_scheme import blank, solve_mixed, stiffness
from nanoslip.solver.outcome import InvalidInput, SingularOperator
from nanoslip.solver.slab import Slab, Support

SLAB = Slab(n_x=17, poisson=0.3)


def test_forces_in_displacements_out_and_back() -> None:
    k = stiffness(SLAB)
    given = blank(k)
    given.f_x[4], given.f_z[9] = 1.0, -2.0
    solved = solve_mixed(k, given)
    again = replace(given, u=given.u.copy(), f_x=given.f_x.copy(), w=given.w.copy(), f_z=given.f_z.copy())
    again.u[4], again.f_x[4] = solved.u[4], np.nan
    again.w[9], again.f_z[9] = solved.w[9], np.nan
    back = solve_mixed(k, again)
    assert back.f_x[4] == pytest.approx(1.0, rel=1e-11)  # rounding × condition number (about 1e3)
    assert back.f_z[9] == pytest.approx(-2.0, rel=1e-11)
    np.testing.assert_allclose(back.u, solved.u, atol=1e-12)
    np.testing.assert_allclose(
        k.matrix @ np.concatenate((solved.u, solved.w)), np.concatenate((solved.f_x, solved.f_z)), atol=1e-12
    )


@pytest.mark.parametrize("support", ["bonded", "frictionless", "right_side"])
@pytest.mark.parametrize(
    "grid",
    [{"scheme": "biquadratic", "rows": 3}, {"scheme": "biquadratic", "rows": 4}, {"scheme": "biquadratic"}, {},
     {"coarsest_row": 3}, {"coarsest_row": 3, "bottom_row": 3, "rows_per_level": 1}],
)  # fmt: skip
def test_it_agrees_with_the_surface_compliance(support: Support, grid: dict[str, Any]) -> None:
    slab = Slab.of({"n_x": 17, "poisson": 0.3, "support": support, **grid})
    k = stiffness(slab)
    given = blank(k)
    given.f_x[3], given.f_z[11] = 0.7, -1.3
    solved = solve_mixed(k, given)
    forces = np.zeros(34)
    forces[3], forces[17 + 11] = 0.7, -1.3
    surface = surface_compliance(slab).matrix @ forces
    expected = np.concatenate((solved.u[:17], solved.w[:17]))
    np.testing.assert_allclose(surface, expected, atol=1e-11 * np.abs(expected).max())


def test_over_and_under_determined_input_is_refused_by_node_and_pair() -> None:
    k = stiffness(SLAB)
    both = blank(k)
    both.u[5] = 0.0
    with pytest.raises(InvalidInput, match="over-determined: node 5 has both u and f_x"):
        solve_mixed(k, both)
    neither = blank(k)
    neither.f_z[7] = np.nan
    with pytest.raises(InvalidInput, match="under-determined: node 7 has neither of w and f_z"):
        solve_mixed(k, neither)
    short = blank(k)
    with pytest.raises(InvalidInput, match="one value per node"):
        solve_mixed(k, replace(short, u=short.u[:-1]))


def test_a_body_that_can_move_freely_is_refused() -> None:
    k = stiffness(SLAB)
    free = blank(k)
    free.u[:], free.w[:] = np.nan, np.nan
    free.f_x[:], free.f_z[:] = 0.0, 0.0
    free.f_x[0] = 1.0
    with pytest.raises(SingularOperator, match="prescribe enough displacements"):
        solve_mixed(k, free)


def test_a_fully_prescribed_body_needs_no_solve() -> None:
    k = stiffness(SLAB)
    x, _ = k.grid.coordinates().T
    unknown = np.full(k.grid.nodes, np.nan)
    solved = solve_mixed(k, replace(blank(k), u=0.1 * x, w=0.0 * x, f_x=unknown, f_z=unknown.copy()))
    assert solved.f_x.sum() == pytest.approx(0.0, abs=1e-13)
