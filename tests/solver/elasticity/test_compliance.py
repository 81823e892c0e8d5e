"""Compliance of the surface: its matrix, its condition, and the boundary values it solves."""

from dataclasses import replace

import numpy as np
import pytest

from nanoslip.solver.case import Case, Effects
from nanoslip.solver.elasticity.compliance import (
    SurfaceCompliance,
    add_node,
    conditioning,
    contact_stiffness_matrix,
    explain_outcome,
    remove_node,
    surface_compliance,
)
from nanoslip.solver.elasticity.grid_scheme import blank, solve_mixed, stiffness
from nanoslip.solver.outcome import COMPLETED, Ending, InvalidInput, Outcome, SingularOperator
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.slide import slide
from tests.physics import coupled_half_plane, half_plane

# The surface compliance: what a user may rely on whatever the scheme, and what the paper's stencil does not give.

N = 65


def test_the_paper_stencil_is_neither_reciprocal_nor_converging_in_its_coupling() -> None:
    """A property of the scheme that users are told of: reciprocity fails by far more than rounding."""
    matrix = surface_compliance(Slab(n_x=N, scheme="biquadratic")).matrix
    asymmetry = np.abs(matrix - matrix.T).max() / np.abs(matrix).max()
    assert 0.01 < asymmetry < 0.5


def test_what_is_computed_of_a_compliance_may_be_kept_while_nobody_can_change_it() -> None:
    one = surface_compliance(Slab(n_x=N))
    assert one.lasting
    assert not replace(one, matrix=one.matrix.copy()).lasting


def test_nodal_widths_tile_the_surface() -> None:
    compliance = surface_compliance(Slab(n_x=N))
    assert compliance.widths.sum() == pytest.approx(1.0, rel=1e-15)
    assert compliance.x[0] == -0.5
    assert not compliance.matrix.flags.writeable


def test_wrong_input_is_refused() -> None:
    with pytest.raises(ValueError, match=r"needs \(130, 130\)"):
        SurfaceCompliance(np.eye(4), Slab(n_x=N))


def test_a_nearly_incompressible_slab_is_refused_rather_than_wrong() -> None:
    with pytest.raises(SingularOperator, match="poisson"):
        surface_compliance(replace(Slab(n_x=33), poisson=0.5 - 1e-16))


# What a compliance's numbers say of it: condition, definiteness, reciprocity, and the advice that follows.

CONDITIONED = Slab(33, scheme="biquadratic")


def _with_eigenvalues(smallest: float) -> SurfaceCompliance:
    """A reciprocal operator whose smallest eigenvalue is a given share of its largest."""
    values, vectors = np.linalg.eigh(half_plane(CONDITIONED).matrix)
    values[0] = smallest * values[-1]
    return SurfaceCompliance((vectors * values) @ vectors.T, CONDITIONED)


def test_tiny_pivots_are_seen_in_the_reciprocal_condition() -> None:
    # The estimate is in another norm: within a factor of the size.
    assert 1e-16 < conditioning(_with_eigenvalues(1e-14).matrix).reciprocal_condition < 1e-12
    assert conditioning(half_plane(CONDITIONED).matrix).reciprocal_condition > 1e-4


@pytest.mark.parametrize("operator", [half_plane, coupled_half_plane])
def test_reciprocal_operators_are_known_as_such(operator: object) -> None:
    found = conditioning(operator(CONDITIONED).matrix)  # type: ignore[operator]
    assert found.asymmetry == 0.0
    assert found.positive_definite


def test_only_a_bad_end_on_a_bad_operator_is_explained() -> None:
    everywhere = np.ones(33, dtype=np.bool_)
    bad = Outcome(Ending.SLIP_UNBOUNDED, "no slip")
    broken, sound = _with_eigenvalues(-0.1), half_plane(CONDITIONED)
    assert explain_outcome(COMPLETED, broken, everywhere) is COMPLETED
    assert explain_outcome(bad, sound, everywhere) is bad
    assert explain_outcome(bad, broken, ~everywhere) is bad
    assert "ill-conditioned" in explain_outcome(bad, _with_eigenvalues(1e-12), everywhere).message
    message = explain_outcome(bad, broken, everywhere).message
    assert "33 nodes" in message
    assert "galerkin" in message


@pytest.mark.parametrize("sway", [4e15, 1e17])
@pytest.mark.parametrize("effects", [Effects(), Effects(pin_translation=False, coupling=False)], ids=["full", "frozen"])
def test_a_contact_singular_to_rounding_is_named(effects: Effects, sway: float) -> None:
    """A sway of so much beside a local compliance of 1: hardly a digit of the latter is left, and then none; no library is to
    say so instead."""
    slab = Slab(33)
    matrix = half_plane(slab).matrix.copy()
    matrix[:33, :33] += sway
    case = Case(slab=slab, effects=effects, max_events=3)
    outcome = slide(case, SurfaceCompliance(matrix, slab)).outcome
    assert outcome.ending is Ending.SINGULAR_OPERATOR
    assert "aspect_ratio nearer 1" in outcome.message


def test_a_pillar_is_not_sent_to_the_scheme_that_it_has() -> None:
    """Digits that rounding takes from `galerkin` no scheme brings back."""
    slab = Slab(33, 1e4)
    broken = SurfaceCompliance(-np.eye(66), slab)
    message = explain_outcome(Outcome(Ending.SLIP_UNBOUNDED, "no slip"), broken, np.ones(33, dtype=np.bool_)).message
    assert "not positive definite" in message
    assert "use the scheme" not in message
    assert "aspect_ratio nearer 1" in message


# The mixed problem of §2.1.4: either of each pair in, the other out; too much or too little is refused by name.

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


def test_over_and_under_determined_input_is_refused_by_node_and_pair() -> None:
    k = stiffness(SLAB)
    both = blank(k)
    both.u[5] = 0.0
    with pytest.raises(InvalidInput, match=r"node = 5: .*over-determined"):
        solve_mixed(k, both)
    neither = blank(k)
    neither.f_z[7] = np.nan
    with pytest.raises(InvalidInput, match=r"node = 7: .*under-determined"):
        solve_mixed(k, neither)
    short = blank(k)
    with pytest.raises(InvalidInput, match="one value"):
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


@pytest.mark.parametrize("scheme", ["half_space", "strip", "biquadratic"])
def test_a_stiffness_with_a_node_more_or_less_is_that_of_its_nodes(scheme: str) -> None:
    """At either end and in the middle, reciprocal or not."""
    compliance, nodes = surface_compliance(Slab(17, scheme=scheme)), np.arange(5, 13)
    whole = contact_stiffness_matrix(compliance, nodes)
    for place in (0, 3, 7):
        less = contact_stiffness_matrix(compliance, np.delete(nodes, place))
        for found, expected in (
            (add_node(compliance, less, nodes, int(nodes[place])), whole),
            (remove_node(whole, place), less),
        ):
            np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-11 * np.abs(expected).max())
