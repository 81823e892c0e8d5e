"""Displacements and stresses inside the slab, at every node of its grid, under given nodal forces on the surface (Eq. 11).

Derivatives are taken of parabolas along the row and through the three nearest rows; if a row has no node in this
column, a cubic spline along it gives the value. Linear fields have exact derivatives.

A tall slab (schemes/column.py) has a grid in its two ends only. The lower one bears the stresses of a bar, with the
bending moment that the shear force adds on the way down.
"""

from dataclasses import fields, replace

import numpy as np
import scipy

from nanoslip.solver.arrays import Floats, Vector
from nanoslip.solver.elasticity.condensation import families, project_stiffness
from nanoslip.solver.elasticity.fields import InteriorFields
from nanoslip.solver.elasticity.grid import Grid, Stiffness, across, lame, slopes, value
from nanoslip.solver.elasticity.grid_scheme import solve_sparse, stiffness, trunk
from nanoslip.solver.elasticity.schemes.column import bar_forces, lengthening, resultants, transfer_matrix
from nanoslip.solver.slab import Slab

_NAMES = [item.name for item in fields(InteriorFields)]


def interior_fields(slab: Slab, nodal_force: Floats) -> InteriorFields:
    """The fields under nodal forces (f_x, f_z) on the surface, shape (2, n), in G·L_x per unit depth.

    Raises SingularOperator if the slab can move as a rigid body.
    """
    trunk_stiffness = stiffness(trunk(slab))
    fields_of_trunk = _solve_fields(trunk_stiffness, slab.poisson, nodal_force)
    return (
        fields_of_trunk
        if trunk(slab) == slab
        else _extend_fields(slab, trunk_stiffness, fields_of_trunk, nodal_force.ravel())
    )


def _solve_fields(trunk_stiffness: Stiffness, poisson: float, nodal_force: Floats) -> InteriorFields:
    """The fields of a slab whose grid reaches from its surface to its bottom."""
    forces, nodes = np.zeros((2, trunk_stiffness.grid.nodes)), int(trunk_stiffness.grid.counts[0])
    forces[:, :nodes] = nodal_force
    u, w = _nodal_displacements(trunk_stiffness, forces.ravel()).reshape(2, -1)
    u_x, u_z = gradient(trunk_stiffness.grid, u)
    w_x, w_z = gradient(trunk_stiffness.grid, w)
    dilation = lame(poisson)
    x, z = trunk_stiffness.grid.coordinates().T
    # Eq. 3 in units of G: σ_xx = λ (u_x + w_z) + 2 u_x, σ_zz likewise, σ_xz = u_z + w_x.
    volumetric = dilation * (u_x + w_z)
    stress_xx, stress_zz = volumetric + 2 * u_x, volumetric + 2 * w_z
    return InteriorFields(x - 0.5, z, u, w, stress_xx=stress_xx, stress_zz=stress_zz, stress_xz=u_z + w_x)


def _nodal_displacements(trunk_stiffness: Stiffness, forces: Vector) -> Vector:
    """[u; w] of all nodes, (2·nodes,), under forces on them."""
    total = np.zeros_like(forces)
    for one in families(trunk_stiffness):
        kept = one.number >= 0
        number, weight = one.number[kept], one.weight[kept]
        shares = weight * forces[kept]
        right = np.bincount(number, shares, one.count).astype(np.float64)
        solution = solve_sparse(project_stiffness(trunk_stiffness.matrix, one), right)
        total[kept] += weight * solution[number]
    return total


def _extend_fields(
    slab: Slab, trunk_stiffness: Stiffness, fields_of_trunk: InteriorFields, force: Vector
) -> InteriorFields:
    """The fields of a tall slab: the trunk's upper half moved along with the surface, its lower half under a bar's forces."""
    acting = resultants(slab.n_x) @ force
    w, u, rotation = lengthening(slab) @ acting
    carried_u = fields_of_trunk.u + u - rotation * fields_of_trunk.z
    carried_w = fields_of_trunk.w + w + rotation * fields_of_trunk.x
    upper = replace(fields_of_trunk, u=carried_u, w=carried_w)
    more = slab.aspect_ratio - trunk(slab).aspect_ratio
    bar = bar_forces(slab.n_x) @ transfer_matrix(slab, more) @ acting
    lower = _solve_fields(trunk_stiffness, slab.poisson, bar.reshape(2, -1))
    lower = replace(lower, z=lower.z - more)
    # The bar is inserted half-way down: only its stresses are left there.
    inside = fields_of_trunk.z > -trunk(slab).aspect_ratio / 2
    pairs = ((getattr(upper, name), getattr(lower, name)) for name in _NAMES)
    return InteriorFields(*(np.where(inside, above, below) for above, below in pairs))


def gradient(grid: Grid, values: Vector) -> tuple[Vector, Vector]:
    """∂/∂x and ∂/∂z of a field at every node, from its nodal values; all of shape (nodes,)."""
    rows = [values[grid.row_nodes(row)] for row in range(grid.rows)]
    along, down = [], []
    for row in range(grid.rows):
        # With edge_order=2 the ends of a row have derivatives of parabolas, too.
        along.append(np.gradient(rows[row], grid.spacing(row), edge_order=2))
        used, basis = across(grid, row)
        above_or_below = [_interpolate_row(grid, rows[q], int(q), row) for q in used]
        weights = value(slopes(basis), 0.0)
        pairs = zip(weights, above_or_below, strict=True)
        down.append(sum(weight * seen for weight, seen in pairs))
    return np.concatenate(along), np.concatenate(down)


def _interpolate_row(grid: Grid, values: Vector, row: int, here: int) -> Vector:
    """Values of a row's field, interpolated to the x of the nodes of another row."""
    if grid.counts[row] == grid.counts[here]:
        return values
    spline = scipy.interpolate.CubicSpline(grid.row_x(row), values)
    return np.asarray(spline(grid.row_x(here)))
