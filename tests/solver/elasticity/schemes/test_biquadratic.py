"""The paper's stencil (Eq. 4-10): exact for linear fields on every volume, whatever the grid; mirror symmetric."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from nanoslip.solver.elasticity.grid import FirstSpacing
from nanoslip.solver.elasticity.grid_scheme import stiffness
from nanoslip.solver.elasticity.schemes.biquadratic import WIDEST_BOTTOM
from nanoslip.solver.slab import Slab


def paper(**parameters: Any) -> Slab:
    return Slab.of({"scheme": "biquadratic", **parameters})


ROUNDING = 1e-13  # sums of about 18 weights of order 1 times coordinates of order 1, times machine epsilon


def boundary_forces(slab: Slab, stress: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Nodal forces by which the slab's boundary holds a uniform stress [[σ_x, τ], [τ, σ_z]]: outward traction × length."""
    k = stiffness(slab)
    grid = k.grid
    force = np.zeros((2, grid.nodes))
    for row in range(grid.rows):
        nodes = grid.row_nodes(row)
        lower, upper = grid.volume_z(row)
        force[:, nodes[-1]] += stress[0] * (upper - lower)
        force[:, nodes[0]] -= stress[0] * (upper - lower)
        widths = np.full(len(nodes), grid.spacing(row))
        widths[[0, -1]] /= 2
        if row == 0:
            force[:, nodes] += stress[1][:, None] * widths
        if row == grid.rows - 1:
            force[:, nodes] -= stress[1][:, None] * widths
    return k.matrix, force.ravel()


@pytest.mark.everyday(10)
@pytest.mark.parametrize("first_spacing", ["equal", "doubling"])
@pytest.mark.parametrize(("n_x", "rows"), [(5, 3), (17, 3), (17, 4), (33, None)])
@pytest.mark.parametrize("gradient", [(1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1), (0.3, -0.7, 0.2, 1.1)])
def test_patch_a_linear_field_has_uniform_stress(
    n_x: int, rows: int | None, first_spacing: FirstSpacing, gradient: tuple[float, ...]
) -> None:
    poisson = 0.29
    slab = paper(n_x=n_x, rows=rows, first_spacing=first_spacing, aspect_ratio=0.8, poisson=poisson)
    (u_x, u_z), (w_x, w_z) = np.array(gradient, dtype=float).reshape(2, 2)
    lame = 2 * poisson / (1 - 2 * poisson)
    stress = np.array([[(lame + 2) * u_x + lame * w_z, u_z + w_x], [u_z + w_x, (lame + 2) * w_z + lame * u_x]])
    matrix, expected = boundary_forces(slab, stress)
    x, z = stiffness(slab).grid.coordinates().T
    displacement = np.concatenate((u_x * x + u_z * z, w_x * x + w_z * z))
    np.testing.assert_allclose(matrix @ displacement, expected, atol=ROUNDING * 10)


@pytest.mark.parametrize("poisson", [0.0, 1 / 3, 0.49])
def test_rigid_motions_need_no_force(poisson: float) -> None:
    k = stiffness(paper(n_x=33, poisson=poisson))
    x, z = k.grid.coordinates().T
    zero, one = np.zeros_like(x), np.ones_like(x)
    largest = abs(k.matrix).max()
    for u, w in ((one, zero), (zero, one), (-z, x)):
        assert np.abs(k.matrix @ np.concatenate((u, w))).max() <= ROUNDING * largest


def test_a_quadratic_field_is_interpolated_exactly_in_the_volumes_that_see_three_nodes_a_row() -> None:
    """w = x² on top of a coincident interior node: σ_x = 2λ·0, τ = 2x: the force is -∂τ/∂x × volume area."""
    slab = paper(n_x=33, poisson=0.2)
    k = stiffness(slab)
    grid = k.grid
    x, _ = grid.coordinates().T
    force = k.matrix @ np.concatenate((np.zeros(grid.nodes), x**2))
    node = grid.row_nodes(2)[4]
    lower, upper = grid.volume_z(2)
    assert force[grid.nodes + node] == pytest.approx(-2.0 * (upper - lower) * grid.spacing(2), rel=1e-12)


@pytest.mark.parametrize("rows", [3, 4, None])
def test_a_film_is_followed_under_a_contact_as_wide_as_the_grids_own_bottom_cells(rows: int | None) -> None:
    film, tall = (paper(n_x=65, rows=rows, aspect_ratio=height, poisson=0.3) for height in (0.01, 2.0))
    grid = film.scheme.grid(film)
    least = grid.spacing(grid.rows - 1) / WIDEST_BOTTOM
    assert [film.scheme.resolves(film, share * least) for share in (0.99, 1.01)] == [False, True]
    assert tall.scheme.resolves(tall, 0.01 * least)
    assert not tall.scheme.resolves(replace(tall, poisson=0.39), 1.0)
