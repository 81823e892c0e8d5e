"""Energy-consistent discretization on the graded hierarchy: symmetric, conservative, convergent.

The slab is cut into strips of three node rows. In a strip both displacements are Σ_k L_k(z) φ_k(x): L_k are the Lagrange
quadratics through its rows, φ_k is piecewise quadratic over the nodes of row k (elements two spacings wide). Every row's
intervals are halves or doubles of its neighbour's, so all φ_k lie in the piecewise quadratics of the strip's finest row:
fields are continuous, there are no hanging nodes, and the strip becomes a row of ordinary nine-node elements if each
φ_k is prolonged to that mesh. The virtual work of the stresses (Eq. 3),

    ∫ (λ+2)(u_x δu_x + w_z δw_z) + λ(u_x δw_z + w_z δu_x) + (u_z + w_x)(δu_z + δw_x),

is then integrated as products of one-dimensional matrices: with M = ∫p_i p_j, D = ∫p_i' p_j', B = ∫p_i p_j'
K_u = λ G_z⊗D_x + 2 M_z⊗D_x + D_z⊗M_x, K_w = λ D_z⊗G_x + 2 D_z⊗M_x + M_z⊗D_x, C_uw = λ B_z⊗B_xᵀ + B_zᵀ⊗B_x, C_wu = C_uwᵀ.
All is exact but G, M by two Gauss points: there alone is dilatation resisted. Resisted everywhere it stiffens elements as
ν → 0.5 (locking: smooth fields were up to ten times less accurate at ν = 0.49 than at 1/3), and costs accuracy at any ν > 0
(Malkus and Hughes, selective reduced integration). The matrix stays definite: G omits some energy of dilatation, but no
energy of distortion. In the uppermost strip G = M: with less, odd and even surface nodes would differ more.

The surface row is piecewise linear instead (a subspace of quadratics of half the width), so that contact and slip
find all surface nodes alike: a nodal force is ∫ traction·hat.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import scipy
from numpy.typing import NDArray

from nanoslip.solver.arrays import Dense
from nanoslip.solver.elasticity.condensation import condense_surface
from nanoslip.solver.elasticity.grid import (
    Grid,
    Sparse,
    Stiffness,
    assemble_blocks,
    gram,
    lagrange,
    lame,
    slopes,
    support_mask,
    value,
)
from nanoslip.solver.elasticity.grid_scheme import GridScheme, trunk
from nanoslip.solver.elasticity.schemes.column import TALL, lengthening, make_graded_hierarchy, resultants
from nanoslip.solver.parameter import parameter, require, validate
from nanoslip.solver.slab import SCHEMES, Slab, Support, grid_levels

MOST_ROWS_PER_LEVEL = 1024


@SCHEMES.register
@dataclass(frozen=True, slots=True)
class Galerkin(GridScheme):
    """Settings of the finite elements. Values in place of None:

    rows_per_level: 2; coarsest_row: 2^q + 1 nodes, a spacing of at most min(1, aspect_ratio)/16; bottom_row: 8 times
        as many intervals, at most those of the surface.
    """

    name = "galerkin"
    tallest = TALL
    rows_per_level: int | None = parameter(
        None,
        meaning="node rows of each level",
        comment="until the next row has half the intervals",
        least=1,
        most=MOST_ROWS_PER_LEVEL,
    )
    coarsest_row: int | None = parameter(None, meaning="nodes of the coarsest row", need="2^q + 1 up to n_x")
    bottom_row: int | None = parameter(None, meaning="nodes of the bottom row", need="2^q + 1 from coarsest_row to n_x")

    def complete_settings(self, slab: Slab) -> "Galerkin":
        validate(self)
        levels = grid_levels(slab.n_x)
        fewest_intervals = 16.0 / min(1.0, slab.aspect_ratio)
        coarsest = min(levels, max(1, math.ceil(math.log2(fewest_intervals))))
        if self.bottom_row is not None:
            coarsest = min(coarsest, max(1, grid_levels(self.bottom_row)))
        coarsest_row = 2**coarsest + 1 if self.coarsest_row is None else self.coarsest_row
        finest = 2 ** min(levels, max(1, grid_levels(coarsest_row)) + 3) + 1
        bottom_row = finest if self.bottom_row is None else self.bottom_row
        for name, nodes in (("coarsest_row", coarsest_row), ("bottom_row", bottom_row)):
            allowed = 1 <= grid_levels(nodes) <= levels
            require(name, nodes, allowed, f"2^q + 1 from 3 to {slab.n_x} nodes at n_x = {slab.n_x}")
        require("bottom_row", bottom_row, bottom_row >= coarsest_row, f"at least coarsest_row = {coarsest_row}")
        rows = 2 if self.rows_per_level is None else self.rows_per_level
        return replace(self, rows_per_level=rows, coarsest_row=coarsest_row, bottom_row=bottom_row)

    def grid(self, slab: Slab) -> Grid:
        assert self.rows_per_level  # completed
        assert self.coarsest_row
        assert self.bottom_row
        return make_graded_hierarchy(
            slab.n_x, slab.aspect_ratio, self.rows_per_level, self.coarsest_row, self.bottom_row
        )

    def stiffness(self, slab: Slab) -> Stiffness:
        return galerkin(self.grid(slab), slab.poisson, slab.support)

    def matrix(self, slab: Slab) -> Dense:
        surface_matrix = condense_surface(self.stiffness(trunk(slab)))
        if trunk(slab) != slab:
            acting = resultants(slab.n_x)
            # Only a load's three resultants reach the inserted bar (Saint-Venant), which moves the surface rigidly.
            longer = acting.T @ lengthening(slab) @ acting
            # Symmetric to the last bit: Cholesky's factor is taken only of such a compliance.
            surface_matrix += (longer + longer.T) / 2
        return surface_matrix


def galerkin(grid: Grid, poisson: float, support: Support) -> Stiffness:
    """Stiffness of the slab by finite elements: symmetric, conservative, positive definite once supported."""
    strips = range(0, grid.rows - 1, 2)
    cells = [_cells(grid, strip) for strip in strips]
    fields = _prolongation(grid, cells)
    widths = [1.0 / count for count in cells]
    blocks = [_element_blocks(grid, strip, width, poisson) for strip, width in zip(strips, widths, strict=True)]
    of_mesh = [_assemble_stiffness(cells, block) for block in zip(*blocks, strict=True)]
    k_u, k_w, c_uw = (fields.T @ stiffness_of_mesh @ fields for stiffness_of_mesh in of_mesh)
    matrix = assemble_blocks(k_u, c_uw, c_uw.T, k_w)
    return Stiffness(grid, matrix, support_mask(grid, support), symmetric=True)


def _cells(grid: Grid, strip: int) -> int:
    """Number of elements in the strip below row `strip`: one for each quadratic of its finest row, for the surface's two."""
    # The finest of the strip's three rows: the quadratics of the others lie in those of its elements.
    quadratic = (int(grid.counts[strip : strip + 3].max()) - 1) // 2
    return 2 * quadratic if strip == 0 else quadratic


def _element_blocks(grid: Grid, strip: int, width: float, poisson: float) -> tuple[Dense, Dense, Dense]:
    """K_u, K_w and C_uw of an element of a strip, (9, 9) each; its nodes row by row from the top, left to right."""
    dilation = lame(poisson)
    below_top = grid.depths[strip : strip + 3] - grid.depths[strip]
    depths = tuple(below_top.tolist())
    places = (0.0, width / 2, width)
    mass_z, stiffness_z, mixed_z = _line_matrices(depths, depths[2], 0.0)
    mass_x, stiffness_x, mixed_x = _line_matrices(places, 0.0, width)
    along, across = _kronecker_product(mass_z, stiffness_x), _kronecker_product(stiffness_z, mass_x)
    # In the uppermost strip exactly, or odd and even surface nodes would differ more (see above).
    resisted_z = _gauss_mass(depths, depths[2], 0.0) if strip else mass_z
    resisted_x = _gauss_mass(places, 0.0, width) if strip else mass_x
    coupling = dilation * _kronecker_product(mixed_z, mixed_x.T) + _kronecker_product(mixed_z.T, mixed_x)
    k_u = dilation * _kronecker_product(resisted_z, stiffness_x) + 2 * along + across
    k_w = dilation * _kronecker_product(stiffness_z, resisted_x) + 2 * across + along
    return k_u, k_w, coupling


def _kronecker_product(z: Dense, x: Dense) -> Dense:
    """Z ⊗ X of matrices of three nodes, (9, 9); np.kron takes ten times as long for so few, a twentieth of a small compliance."""
    products = np.multiply.outer(z, x)
    return products.transpose(0, 2, 1, 3).reshape(9, 9)


@lru_cache(maxsize=64)  # strips of one level share their widths, and many their depths
def _line_matrices(points: tuple[float, ...], lower: float, upper: float) -> tuple[Dense, Dense, Dense]:
    """∫p_i p_j, ∫p_i' p_j' and ∫p_i p_j' of the Lagrange polynomials through the points."""
    basis = lagrange(points)
    derivatives = slopes(basis)
    mass = gram(basis, basis, lower, upper)
    stiffness = gram(derivatives, derivatives, lower, upper)
    return mass, stiffness, gram(basis, derivatives, lower, upper)


@lru_cache(maxsize=64)
def _gauss_mass(points: tuple[float, ...], lower: float, upper: float) -> Dense:
    """∫p_i p_j of the Lagrange polynomials through the points, by Gauss' rule of two points."""
    basis = lagrange(points)
    half, middle = (upper - lower) / 2, (lower + upper) / 2
    mass = np.zeros((len(points), len(points)))
    # 1/√3 of the half to either side of the middle: exact for cubics, while p_i p_j is of the fourth
    # order. What is left out of it is the reduction.
    for side in (-(3**-0.5), 3**-0.5):
        values = value(basis, middle + side * half)
        mass += np.outer(values, values)
    return half * mass


def _assemble_stiffness(cells: list[int], blocks: Iterable[Dense]) -> Sparse:
    """Stiffness of all strips, summed over their elements. Each strip has three separate rows of mesh nodes."""
    rows, columns, values, first = [], [], [], 0
    for count, block in zip(cells, blocks, strict=True):
        across = 2 * count + 1
        corner = first + 2 * np.arange(count)
        local = (across * np.arange(3)[:, None] + np.arange(3)).ravel()
        nodes = corner[:, None] + local
        rows.append(np.repeat(nodes, 9, axis=1).ravel())
        columns.append(np.tile(nodes, (1, 9)).ravel())
        values.append(np.tile(block.ravel(), count))
        first += 3 * across
    indices = (np.concatenate(rows), np.concatenate(columns))
    return scipy.sparse.csr_array((np.concatenate(values), indices), shape=(first, first))


def _prolongation(grid: Grid, cells: list[int]) -> Sparse:
    """Sparse matrix from values at the grid's nodes to values at the mesh nodes of all strips, shape (mesh nodes, nodes)."""
    rows, columns, values, first = [], [], [], 0
    for strip, count in enumerate(cells):
        for row in range(2 * strip, 2 * strip + 3):
            nodes, weights = _row_fields(int(grid.counts[row]), 2 * count, linear=row == 0)
            mesh_nodes = first + np.arange(2 * count + 1)
            rows.append(np.repeat(mesh_nodes, weights.shape[1]))
            columns.append(grid.row_nodes(row)[0] + nodes.ravel())
            values.append(weights.ravel())
            first += 2 * count + 1
    indices = (np.concatenate(rows), np.concatenate(columns))
    matrix = scipy.sparse.csr_array((np.concatenate(values), indices), shape=(first, grid.nodes))
    matrix.eliminate_zeros()
    return matrix


def _row_fields(count: int, intervals: int, *, linear: bool) -> tuple[NDArray[np.int64], Dense]:
    """Interpolation of a row with `count` nodes at the ends of `intervals` equal intervals: nodes, weights, (intervals + 1, m).

    All positions are small multiples of powers of two, so that weights at the row's own nodes are exactly 0 and 1.
    """
    order = 1 if linear else 2
    elements = (count - 1) // order
    place = np.arange(intervals + 1) * elements / intervals
    element = np.minimum(place.astype(np.int64), elements - 1)
    t = place - element
    weights = [1 - t, t]
    if not linear:
        # Lagrange's quadratics through t = 0, 1/2 and 1.
        weights = [(1 - t) * (1 - 2 * t), 4 * t * (1 - t), t * (2 * t - 1)]
    nodes = order * element[:, None] + np.arange(order + 1)
    return nodes, np.stack(weights, axis=1)
