"""The paper's control-volume stencil (Eq. 4-10): bi-quadratic interpolants, integrated exactly over each volume's faces.

Around node (i, j) both displacements are φ = Σ_q γ_q(z) Σ_k α_qk(x)·(nodal value): γ_q are Lagrange polynomials through the
node's row and its two neighbours, α_qk through the three nodes of row q nearest to x_i, or two if x_i is half-way between
coarser nodes. Boundaries use the three nearest inside. The stresses of φ (Eq. 3) over the inner faces are the neighbours' forces.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import scipy
from numpy.typing import NDArray

from nanoslip.solver.arrays import Floats
from nanoslip.solver.elasticity.grid import (
    FirstSpacing,
    Grid,
    Stiffness,
    across,
    assemble_blocks,
    binary_hierarchy,
    integral,
    lagrange,
    lame,
    slopes,
    support_mask,
    value,
)
from nanoslip.solver.elasticity.grid_scheme import GridScheme
from nanoslip.solver.parameter import parameter, require, validate
from nanoslip.solver.slab import SCHEMES, Slab, Support, grid_levels

WIDEST_BOTTOM = 1.25
"""Largest spacing of the bottom row in half-widths of the contact, of a slab lower than that spacing: 4 to 7 % wrong, whatever
n_x is. The row has 3 nodes unless `rows` are fewer than the paper's."""


@SCHEMES.register
@dataclass(frozen=True, slots=True)
class Biquadratic(GridScheme):
    """Settings of the paper's stencil. In place of None stand the paper's: `equal` first spacings, N + 1 rows."""

    name = "biquadratic"
    reciprocal = False
    first_spacing: FirstSpacing | None = parameter(None, meaning="spacing of the first node rows")
    rows: int | None = parameter(None, meaning="node rows of the paper's grid", need="3 to N + 1")

    def complete_settings(self, slab: Slab) -> "Biquadratic":
        levels = grid_levels(slab.n_x)
        validate(self)
        rows = levels + 1 if self.rows is None else self.rows
        require("rows", rows, 3 <= rows <= levels + 1, f"3 to {levels + 1} rows at n_x = {slab.n_x}")
        return replace(self, first_spacing=self.first_spacing or "equal", rows=rows)

    def grid(self, slab: Slab) -> Grid:
        assert self.rows  # completed
        assert self.first_spacing
        return binary_hierarchy(slab.n_x, slab.aspect_ratio, self.rows, self.first_spacing)

    def resolves(self, slab: Slab, half_width: float) -> bool:
        assert self.rows  # completed
        bottom = 2 ** (self.rows - 2) * slab.spacing
        follows = bottom < slab.aspect_ratio or bottom <= WIDEST_BOTTOM * half_width
        return follows and GridScheme.resolves(self, slab, half_width)

    def stiffness(self, slab: Slab) -> Stiffness:
        return biquadratic(self.grid(slab), slab.poisson, slab.support)


def biquadratic(grid: Grid, poisson: float, support: Support) -> Stiffness:
    """Stiffness of the slab by the paper's scheme: not symmetric, not conservative, exact for linear fields."""
    dilation = lame(poisson)
    parts: list[_FaceIntegrals] = []
    for row in range(grid.rows):
        parts += [_face_integrals(grid, row, columns) for columns in _column_classes(grid, row)]
    places = (np.concatenate([part.rows for part in parts]), np.concatenate([part.columns for part in parts]))

    def block(weights: list[Floats]) -> scipy.sparse.csr_array:
        return scipy.sparse.csr_array((np.concatenate(weights), places), shape=(grid.nodes, grid.nodes))

    # Tractions on the sides: σ_xx = (λ+2) u_x + λ w_z and σ_xz = u_z + w_x; on the ends: σ_xz and
    # σ_zz = (λ+2) w_z + λ u_x. k_u and c_uw collect the forces along x, c_wu and k_w those along z.
    # An external nodal force balances the forces of the neighbours, hence the minus signs.
    k_u = block([-(dilation + 2) * p.dx_on_sides - p.dz_on_ends for p in parts])
    c_uw = block([-dilation * p.dz_on_sides - p.dx_on_ends for p in parts])
    c_wu = block([-dilation * p.dx_on_ends - p.dz_on_sides for p in parts])
    k_w = block([-(dilation + 2) * p.dz_on_ends - p.dx_on_sides for p in parts])
    matrix = assemble_blocks(k_u=k_u, c_uw=c_uw, c_wu=c_wu, k_w=k_w)
    return Stiffness(grid=grid, matrix=matrix, fixed=support_mask(grid, support), symmetric=False)


@dataclass(frozen=True, slots=True, eq=False)
class _FaceIntegrals:
    """Weights of the nodal values in the integrals of ∂φ/∂x and ∂φ/∂z over a control volume's faces, normals outward.

    Sides are its faces at constant x, ends those at constant z.
    """

    rows: NDArray[np.int64]
    columns: NDArray[np.int64]
    dx_on_sides: Floats
    dz_on_sides: Floats
    dx_on_ends: Floats
    dz_on_ends: Floats


def _column_classes(grid: Grid, row: int) -> Iterator[NDArray[np.int64]]:
    """The columns of a row in classes with the same stencil: left end, right end, inner even and inner odd columns."""
    # Even columns stand on nodes of the next coarser row, odd ones half-way between two.
    last = int(grid.counts[row]) - 1
    yield np.array([0])
    yield np.array([last])
    yield np.arange(1, last, 2)
    if last > 2:
        yield np.arange(2, last, 2)


def _face_integrals(grid: Grid, row: int, columns: NDArray[np.int64]) -> _FaceIntegrals:
    """The stencil of a class of columns. It is computed for the first column and repeated for the others."""
    column = int(columns[0])
    used_rows, gamma = across(grid, row)
    lower, upper = (z - float(grid.depths[row]) for z in grid.volume_z(row))
    half = grid.spacing(row) / 2
    # A node on the boundary has no face on its outer side, and half of the volume. Faces with their normal's sign.
    left = -half if column > 0 else 0.0
    right = half if column < grid.counts[row] - 1 else 0.0
    sides = [(sign, x) for sign, x in ((-1.0, left), (1.0, right)) if x]
    ends: list[tuple[float, float]] = []
    if row < grid.rows - 1:
        ends.append((-1.0, lower))
    if row > 0:
        ends.append((1.0, upper))

    gamma_integral = integral(gamma, lower, upper)
    gamma_rise = value(gamma, upper) - value(gamma, lower)
    entries: list[NDArray[np.int64]] = []
    weights: list[tuple[Floats, ...]] = []
    for q, other in enumerate(used_rows):
        nodes, offsets = _nearest(grid, row, column, int(other))
        alpha = lagrange(offsets)
        alpha_rise = value(alpha, right) - value(alpha, left)
        alpha_integral = integral(alpha, left, right)
        none = np.zeros(len(nodes))
        # A field Σ α(x) γ(z) (Eq. 8-10): on a side ∂/∂x integrates to α'(x) ∫γ dz and ∂/∂z to α(x) times the rise of γ,
        # on an end ∂/∂x to γ(z) times the rise of α and ∂/∂z to γ'(z) ∫α dx.
        alpha_slopes = sum((s * value(slopes(alpha), x) for s, x in sides), none)
        alphas = sum((s * value(alpha, x) for s, x in sides), none)
        gammas = sum(s * value(gamma, z)[q] for s, z in ends)
        gamma_slopes = sum(s * value(slopes(gamma), z)[q] for s, z in ends)
        on_sides = (alpha_slopes * gamma_integral[q], alphas * gamma_rise[q])
        on_ends = (gammas * alpha_rise, gamma_slopes * alpha_integral)
        weights.append((*on_sides, *on_ends))
        # Along a class the stencil repeats, shifted by whole nodes of the other row, coarser or finer.
        stride = (int(grid.counts[other]) - 1) / (int(grid.counts[row]) - 1)
        shifts = np.rint((columns - column) * stride).astype(np.int64)
        first = grid.row_nodes(int(other))[0]
        entries.append(first + nodes[None, :] + shifts[:, None])
    columns_used = np.concatenate(entries, axis=1)
    own_nodes = grid.row_nodes(row)[0] + columns
    rows_used = np.broadcast_to(own_nodes[:, None], columns_used.shape)
    stencils = [np.concatenate(weight) for weight in zip(*weights, strict=True)]
    integrals = [np.tile(stencil, len(columns)) for stencil in stencils]
    return _FaceIntegrals(rows_used.ravel(), columns_used.ravel(), *integrals)


def _nearest(grid: Grid, row: int, column: int, other: int) -> tuple[NDArray[np.int64], list[float]]:
    """Nodes of row `other` in the stencil of node (column, row), and their x relative to that node."""
    last = int(grid.counts[row]) - 1
    last_other = int(grid.counts[other]) - 1
    scaled, remainder = divmod(column * last_other, last)
    if remainder:  # between two nodes of the other row
        nodes = scaled + np.array([0, 1])
    else:
        middle = int(np.clip(scaled, 1, last_other - 1))
        nodes = middle + np.array([-1, 0, 1])
    return nodes, [float(node / last_other - column / last) for node in nodes]
