"""The finite-element scheme: laws that hold to rounding on every grid of its family, and convergence."""

from typing import Any

import numpy as np
import pytest

from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.elasticity.grid import Stiffness
from nanoslip.solver.elasticity.grid_scheme import stiffness
from nanoslip.solver.slab import Slab

ROUNDING = 1e-13  # sums of some ten integrals, their weights and coordinates of order 1, times machine epsilon

GRIDS: dict[str, dict[str, Any]] = {
    "default": {"n_x": 33},
    "smallest": {"n_x": 5},
    "graded down to three nodes and up again": {"n_x": 33, "coarsest_row": 3, "bottom_row": 17},
    "the paper's hierarchy": {"n_x": 33, "rows_per_level": 1, "coarsest_row": 3, "bottom_row": 3},
    "three rows a level": {"n_x": 65, "rows_per_level": 3, "coarsest_row": 9, "bottom_row": 33},
    "thin": {"n_x": 17, "aspect_ratio": 0.02},
    "deep": {"n_x": 9, "aspect_ratio": 20.0},
}
every_grid = pytest.mark.parametrize("grid", GRIDS.values(), ids=GRIDS)


def uniform_tractions(k: Stiffness, stress: np.ndarray) -> np.ndarray:
    """Nodal forces, (2·nodes,), by which the boundary holds a uniform stress [[σ_x, τ], [τ, σ_z]]: ∫ traction·(the node's
    function): hats on top, Simpson's rule on quadratics elsewhere."""
    grid = k.grid
    force = np.zeros((2, grid.nodes))
    top, bottom = grid.row_nodes(0), grid.row_nodes(grid.rows - 1)
    hats = np.full(len(top), grid.spacing(0))
    hats[[0, -1]] /= 2
    quadratics = np.full(len(bottom), 2 / 3 * grid.spacing(grid.rows - 1))
    quadratics[1::2] *= 2
    quadratics[[0, -1]] /= 2
    force[:, top] += stress[1][:, None] * hats
    force[:, bottom] -= stress[1][:, None] * quadratics
    for strip in range(0, grid.rows - 1, 2):
        rows = [strip, strip + 1, strip + 2]
        z = grid.depths[rows] - grid.depths[strip]
        # Weights that integrate 1, z and z² exactly over the strip: those of its Lagrange quadratics.
        lengths = np.linalg.solve(np.vander(z / z[2], 3, increasing=True).T, -z[2] / np.array([1.0, 2.0, 3.0]))
        for row, length in zip(rows, lengths, strict=True):
            force[:, grid.row_nodes(row)[-1]] += stress[0] * length
            force[:, grid.row_nodes(row)[0]] -= stress[0] * length
    return force.ravel()


@every_grid
@pytest.mark.parametrize("gradient", [(1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1), (0.3, -0.7, 0.2, 1.1)])
def test_patch_a_linear_field_has_uniform_stress(grid: dict[str, Any], gradient: tuple[float, ...]) -> None:
    poisson = 0.29
    k = stiffness(Slab.of({**grid, "poisson": poisson}))
    (u_x, u_z), (w_x, w_z) = np.array(gradient, dtype=float).reshape(2, 2)
    lame = 2 * poisson / (1 - 2 * poisson)
    shear = u_z + w_x
    stress = np.array([[(lame + 2) * u_x + lame * w_z, shear], [shear, (lame + 2) * w_z + lame * u_x]])
    x, z = k.grid.coordinates().T
    displacement = np.concatenate((u_x * x + u_z * z, w_x * x + w_z * z))
    scale = abs(k.matrix).max() * np.abs(displacement).max()
    np.testing.assert_allclose(k.matrix @ displacement, uniform_tractions(k, stress), atol=ROUNDING * scale)


@every_grid
def test_rigid_motions_need_no_force(grid: dict[str, Any]) -> None:
    k = stiffness(Slab.of({**grid}))
    x, z = k.grid.coordinates().T
    zero, one = np.zeros_like(x), np.ones_like(x)
    for u, w in ((one, zero), (zero, one), (-z, x)):
        motion = np.concatenate((u, w))
        assert np.abs(k.matrix @ motion).max() <= ROUNDING * abs(k.matrix).max() * np.abs(motion).max()


@every_grid
def test_symmetric_and_definite_but_for_the_three_rigid_motions(grid: dict[str, Any]) -> None:
    matrix = stiffness(Slab.of({**grid, "poisson": 0.4})).matrix.toarray()
    np.testing.assert_allclose(matrix, matrix.T, atol=1e-14 * np.abs(matrix).max())
    values = np.linalg.eigvalsh(matrix)
    assert np.abs(values[:3]).max() <= 1e-12 * values[-1]
    assert values[3] > 10 * np.abs(values[:3]).max()


@every_grid
@pytest.mark.parametrize("support", ["bonded", "frictionless", "right_side"])
def test_the_compliance_is_symmetric_and_positive_definite(grid: dict[str, Any], support: Any) -> None:
    matrix = surface_compliance(Slab.of({**grid, "support": support})).matrix
    np.testing.assert_array_equal(matrix, matrix.T)
    assert np.linalg.eigvalsh(matrix)[0] > 0.0


@every_grid
def test_the_mirrored_slab_is_the_same_slab(grid: dict[str, Any]) -> None:
    k = stiffness(Slab.of({**grid}))
    nodes = np.concatenate([k.grid.row_nodes(row)[::-1] for row in range(k.grid.rows)])
    mirror = np.concatenate((nodes, nodes + k.grid.nodes))
    sign = np.concatenate((-np.ones(k.grid.nodes), np.ones(k.grid.nodes)))
    dense = k.matrix.toarray()
    mirrored = dense[np.ix_(mirror, mirror)] * np.outer(sign, sign)
    np.testing.assert_allclose(mirrored, dense, atol=1e-13 * np.abs(dense).max())
