"""The surface compliance: what a user may rely on whatever the scheme, and what the paper's stencil does not give."""

from dataclasses import replace

import numpy as np
import pytest

from nanoslip.solver.elasticity.compliance import SurfaceCompliance, surface_compliance
from nanoslip.solver.outcome import InvalidInput, SingularOperator
from nanoslip.solver.slab import Slab, Support

N = 65


def mirrored(matrix: np.ndarray) -> np.ndarray:
    n = len(matrix) // 2
    order = np.concatenate((np.arange(n)[::-1], np.arange(n)[::-1] + n))
    sign = np.concatenate((-np.ones(n), np.ones(n)))
    return matrix[np.ix_(order, order)] * np.outer(sign, sign)


@pytest.mark.parametrize("support", ["bonded", "frictionless"])
def test_mirror_symmetry(support: Support) -> None:
    matrix = surface_compliance(Slab(n_x=N, support=support)).matrix
    # Even and odd fields are condensed apart, so nothing but the last sum is rounded differently.
    np.testing.assert_allclose(mirrored(matrix), matrix, atol=1e-15 * np.abs(matrix).max())


def test_a_right_side_restraint_breaks_the_mirror() -> None:
    matrix = surface_compliance(Slab(n_x=N, support="right_side")).matrix
    assert np.abs(mirrored(matrix) - matrix).max() > 0.1 * np.abs(matrix).max()


def test_forces_do_work_on_their_own_displacement() -> None:
    matrix = surface_compliance(Slab(n_x=N)).matrix
    assert np.all(np.linalg.eigvalsh((matrix + matrix.T) / 2) > 0.0)


def test_signs_a_node_moves_with_its_force_and_a_drag_dents_ahead() -> None:
    """Pushed to the right, the surface sinks ahead and rises behind (z points out of the slab)."""
    matrix, middle = surface_compliance(Slab(n_x=N)).matrix, N // 2
    assert matrix[middle, middle] > 0.0
    assert matrix[N + middle, N + middle] > 0.0
    assert matrix[N + middle + 8, middle] < 0.0 < matrix[N + middle - 8, middle]


@pytest.mark.parametrize(
    ("support", "low", "high"), [("bonded", 0.42, 0.55), ("frictionless", 0.34, 0.55), ("right_side", 1.2, 2.6)]
)
def test_lateral_stiffness_depends_on_the_support(support: Support, low: float, high: float) -> None:
    """All middle half of the surface moved by 1: 0.42-0.5 G for the bottom restraints, about 2 G for a held side.

    A frictionless bottom is held at a point, which gives way as it is resolved better (0.36 here).
    """
    compliance = surface_compliance(Slab(n_x=N, support=support))
    moved = np.flatnonzero(np.abs(compliance.x) <= 0.29)
    both = np.concatenate((moved, moved + N))
    forces = np.linalg.solve(compliance.matrix[np.ix_(both, both)], np.repeat([1.0, 0.0], len(moved)))
    assert low < forces[: len(moved)].sum() < high


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


def test_a_deeper_slab_is_softer() -> None:
    pressed = [
        surface_compliance(Slab(n_x=33, aspect_ratio=aspect_ratio)).matrix[33:, 33:].sum()
        for aspect_ratio in (0.25, 0.5, 1.0, 2.0)
    ]
    assert pressed == sorted(pressed)


def test_wrong_input_is_refused() -> None:
    with pytest.raises(InvalidInput, match="n_x = 100"):
        surface_compliance(Slab(n_x=100))
    with pytest.raises(ValueError, match=r"needs \(130, 130\)"):
        SurfaceCompliance(np.eye(4), Slab(n_x=N))


def test_a_nearly_incompressible_slab_is_refused_rather_than_wrong() -> None:
    with pytest.raises(SingularOperator, match="poisson is not too close"):
        surface_compliance(replace(Slab(n_x=33), poisson=0.5 - 1e-16))
