"""Tall slabs with scheme `galerkin`: only the upper and lower end have a grid, as the stresses between them equal
those in a bar.

Other stresses of a surface load decay with depth as exp(-4.2 z/L_x), beside a held right side as exp(-2.1 z/L_x):
roots of sin 2γ = ±2γ (Saint-Venant; Fadle, Papkovich). So a slab taller than TALL is a slab of height TALL, the
`trunk`, with a bar inserted half-way: stresses linear in x for its axial force N and moment M, a parabola for its
shear force Q, and the energy per height (N²/E' + M²/(E'I) + 6/5 Q²)/2 with E' = 2/(1 - ν) and I = 1/12 in the
solver's units.

The compliance of the held end under a bending moment adds a part that grows with the height: it is read from the
trunk's field. A held right side bears shear force and moment, so that only N is left.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.arrays import Dense, Floats
from nanoslip.solver.elasticity.grid import Grid
from nanoslip.solver.elasticity.grid_scheme import blank, solve_mixed, stiffness, trunk
from nanoslip.solver.slab import Slab

# The graded hierarchy of node rows: from the surface down each level has half the intervals of the one above.
#
# Head: `rows_per_level` rows of every level that is finer than the coarsest, each as thick as 3/2 of its node spacing. Middle:
# rows of the coarsest level, at most twice as thick as their spacing; further than L_x from surface and bottom only slowly
# varying fields are left (Saint-Venant), and rows thicken in proportion to that distance. Tail: the head mirrored, up to the
# bottom row's level: where a held bottom meets a free side, stresses are singular (displacements as r^0.69 at ν = 1/3, r^0.60
# at 0.49: Williams), and what they add to a surface load's energy falls as the spacing there to the power 1.4 or 1.2. So the
# bottom row is by default eight times as fine as the coarsest, if the surface is: for a fifth more time than four times as fine
# (n_x = 129, height 1; 8 nodes per surface node instead of 6) it halves the error, to 0.03 % at ν = 1/3 and 0.13 % at 0.49;
# sixteen times halves it again, where n_x is large enough.

_THICKNESS = 1.5
"""Thickness of a row of head or tail, in its node spacings."""
_MIDDLE_THICKNESS = 2.0
"""Largest thickness of a row of the middle, in its node spacings, nearer than L_x to surface or bottom.

Where sixteen of the coarsest node spacings are more than L_x, they take its place.
"""
_THICKEST = 8.0
"""Largest thickness of a row further away, over that near the ends."""


def make_graded_hierarchy(
    n_x: int, aspect_ratio: float, rows_per_level: int, coarsest_row: int, bottom_row: int
) -> Grid:
    """The graded grid of a slab: an odd number of rows, at least three. The nodes of two neighbouring rows are nested.

    rows_per_level: rows until the next has half the intervals; coarsest_row, bottom_row: nodes of these rows. Where the slab is
    too thin for all levels, the coarsest are left out.
    """
    coarsest = round(math.log2((n_x - 1) // (coarsest_row - 1)))
    bottom = round(math.log2((n_x - 1) // (bottom_row - 1)))
    # The coarsest level that leaves some height between head and tail, where the middle's rows are.
    for level in range(coarsest, -1, -1):
        ends = _Ends(n_x, rows_per_level, level, bottom)
        if ends.remaining_height(aspect_ratio) >= ends.spacing / 2:
            break
    head, tail = ends.head, ends.tail
    middle = _middle_depths(ends, aspect_ratio)
    upper = np.cumsum(ends.thickness(head))
    lower = np.cumsum(ends.thickness(tail[::-1]))
    from_top = np.concatenate(([0.0], upper))[:-1]
    from_bottom = np.concatenate(([0.0], lower))[:-1]
    depths = np.concatenate((from_top, middle, aspect_ratio - from_bottom[::-1]))
    levels = np.concatenate((head, np.full(len(middle), ends.coarsest), tail))
    return Grid(counts=(n_x - 1) // 2**levels + 1, depths=-depths)


@dataclass(frozen=True, slots=True)
class _Ends:
    """Head and tail of a hierarchy, as levels of their rows. The node spacing of level k is 2^k times the surface's."""

    n_x: int
    rows_per_level: int
    coarsest: int
    bottom: int

    @property
    def head(self) -> NDArray[np.int64]:
        """Levels of the head's rows, each with the spacing below it."""
        return np.repeat(np.arange(self.coarsest), self.rows_per_level)

    @property
    def tail(self) -> NDArray[np.int64]:
        """Levels of the tail's rows, each with the spacing above it."""
        return np.repeat(np.arange(self.coarsest - 1, self.bottom - 1, -1), self.rows_per_level)

    @property
    def spacing(self) -> float:
        """Node spacing of the coarsest level."""
        return 2.0**self.coarsest / (self.n_x - 1)

    def thickness(self, levels: NDArray[np.int64]) -> Floats:
        """Thickness of rows of these levels, in L_x."""
        return _THICKNESS * 2.0**levels / (self.n_x - 1)

    def remaining_height(self, height: float) -> float:
        """Height that head and tail of a slab leave for the middle, in L_x."""
        ends_height = self.thickness(self.head).sum() + self.thickness(self.tail).sum()
        return height - float(ends_height)


def _middle_depths(ends: _Ends, height: float) -> Floats:
    """Depths of the middle's rows in L_x, its two borders included. Their number makes that of all rows odd."""
    near = max(1.0, 16.0 * ends.spacing)
    upper = float(ends.thickness(ends.head).sum()) / near
    full_height = height / near
    lower = full_height - float(ends.thickness(ends.tail).sum()) / near
    first, last = _rows_above(upper, full_height), _rows_above(lower, full_height)
    # A strip of `galerkin` takes two intervals, so the number of rows, head + tail + rows + 1, has to be
    # odd. The 1e-9 below keeps the rounding of a whole number from adding two rows.
    odd = (len(ends.head) + len(ends.tail)) % 2
    wanted = (last - first) * near / (_MIDDLE_THICKNESS * ends.spacing)
    rows = max(2 - odd, 2 * math.ceil((wanted - odd) / 2 - 1e-9) + odd)
    inner = [near * _rows_depth(place, full_height) for place in np.linspace(first, last, rows + 1)[1:-1]]
    return np.array([near * upper, *inner, near * lower])


def _rows_above(depth: float, height: float) -> float:
    """Number of rows above a depth, a real number. Rows are as thick as they are far from surface or bottom, 1 to _THICKEST."""
    if depth > height / 2:
        return 2 * _rows_above(height / 2, height) - _rows_above(height - depth, height)
    if depth <= 1.0:
        return depth
    # ∫dz/thickness: 1 up to the depth 1, ln z on the way to _THICKEST, z/_THICKEST beyond.
    return 1.0 + math.log(min(depth, _THICKEST)) + max(0.0, depth / _THICKEST - 1.0)


def _rows_depth(rows: float, height: float) -> float:
    """Inverse of `_rows_above`."""
    middle = _rows_above(height / 2, height)
    if rows > middle:
        return height - _rows_depth(2 * middle - rows, height)
    if rows <= 1.0:
        return rows
    # Piece by piece: e^(rows - 1) on the way to _THICKEST, from there on _THICKEST more for each row.
    logarithm = math.log(_THICKEST)
    return math.exp(min(rows - 1.0, logarithm)) + _THICKEST * max(0.0, rows - 1.0 - logarithm)


TALL = 10.0
"""Height in L_x up to which a slab has a grid from top to bottom. Half-way down a taller one, stresses that are not a bar's have
decayed to 1e-9 (right side held: 3e-5). The part of them that the bottom reflects is 1e-18 (1e-9) at the surface."""


def resultants(n_x: int) -> Dense:
    """Matrix from nodal forces [f_x; f_z] to their resultants [N; Q; M] at the surface's middle, shape (3, 2·n_x).

    Its transpose leads from rigid motions [w; u; rotation] to displacements of the surface nodes.
    """
    none, one = np.zeros(n_x), np.ones(n_x)
    x = np.linspace(-0.5, 0.5, n_x)
    pairs = ((none, one), (one, none), (none, x))
    return np.stack([np.concatenate(pair) for pair in pairs])


def bar_forces(n_x: int) -> Dense:
    """Nodal forces [f_x; f_z] on the surface with a bar's stresses, per unit N, Q and M, shape (2·n_x, 3)."""
    uniform = _nodal(n_x, np.ones_like)
    # Shear that vanishes at both sides with ∫ = 1, and a linear pressure with ∫ x·12x dx = 1, over a width of 1.
    parabola = _nodal(n_x, lambda x: 1.5 - 6.0 * x**2)
    linear = _nodal(n_x, lambda x: 12.0 * x)
    none = np.zeros(n_x)
    pairs = ((none, uniform), (parabola, none), (none, linear))
    return np.stack([np.concatenate(pair) for pair in pairs], axis=1)


def lengthening(slab: Slab) -> Dense:
    """Compliance that the inserted bar adds: [w; u; rotation] of the surface per [N; Q; M], less the trunk's; (3, 3), symmetric.

    Raises SingularOperator if the trunk can move as a rigid body.
    """
    long, short = slab.aspect_ratio, trunk(slab).aspect_ratio
    if slab.support == "right_side":
        return np.diag([(long - short) / _modulus(slab), 0.0, 0.0])
    foot = _foot(trunk(slab))
    # A force on the surface acts on the foot through the lever T of the height, and moves the surface
    # through it: Tᵀ F T.
    long_lever, short_lever = transfer_matrix(slab, long), transfer_matrix(slab, short)
    more = long_lever.T @ foot @ long_lever
    less = short_lever.T @ foot @ short_lever
    return _bar(slab, long) - _bar(slab, short) + more - less


def transfer_matrix(slab: Slab, height: float) -> Dense:
    """[N; Q; M] of a section at a depth, per those at the surface, shape (3, 3). The shear force adds Q times the depth to M."""
    if slab.support == "right_side":
        return np.diag([1.0, 0.0, 0.0])
    transfer = np.eye(3)
    transfer[2, 1] = -height
    return transfer


def _bar(slab: Slab, height: float) -> Dense:
    """Compliance of a bar clamped at its lower end: [w; u; rotation] of the upper end per [N; Q; M] there, shape (3, 3)."""
    modulus = _modulus(slab)
    # Cantilever with E'I = E'/12: rotation h/E'I and sway h²/2E'I per moment, sway h³/3E'I + 6h/5 (shear, G = 1) per force.
    bent, cross = 12.0 / modulus * height, -6.0 / modulus * height**2
    moved = 4.0 / modulus * height**3 + 1.2 * height
    return np.array([[height / modulus, 0.0, 0.0], [0.0, moved, cross], [0.0, cross, bent]])


def _foot(slab: Slab) -> Dense:
    """Compliance of the held end: its [w; u; rotation] per [N; Q; M], shape (3, 3). Parts that do not grow with height are 0.

    From the field of M = 1 in the middle, bending of curvature κ: at the height h above the foot w = x·θ, θ = κh + foot's,
    and u = foot's - ∫θ dh - ν/(1-ν)·κ/2·(x² - 1/20), of which the last term does no work on the parabola of a shear force.
    """
    k = stiffness(slab)
    question = blank(k)
    bending = bar_forces(slab.n_x)[:, 2]
    question.f_x[: slab.n_x], question.f_z[: slab.n_x] = bending.reshape(2, -1)
    solved = solve_mixed(k, question)
    from_middle = np.abs(k.grid.depths + slab.aspect_ratio / 2)
    row = int(np.argmin(from_middle))
    nodes = k.grid.row_nodes(row)
    above = slab.aspect_ratio + float(k.grid.depths[row])
    # 1/20 is the mean of x² under the parabola, ∫(3/2 - 6x²) x² dx from -1/2 to 1/2. At x = 0, u has
    # +ν/(1-ν)·κ/40.
    curvature, squeezed = 12.0 / _modulus(slab), slab.poisson / (1.0 - slab.poisson)
    turned = float(solved.w[nodes[-1]] - solved.w[nodes[0]]) - curvature * above
    middle = float(solved.u[nodes[len(nodes) // 2]])
    moved = middle + curvature * above**2 / 2 + turned * above - squeezed * curvature / 40
    foot = np.zeros((3, 3))
    foot[1, 2] = foot[2, 1] = moved
    foot[2, 2] = turned
    return foot


def _modulus(slab: Slab) -> float:
    """Plane-strain modulus E' = E/(1 - ν²), in G."""
    return 2.0 / (1.0 - slab.poisson)


def _nodal(n_x: int, traction: Callable[[Dense], Dense]) -> Dense:
    """Nodal forces ∫traction·hat on the surface nodes, shape (n_x,), by two Gauss points an interval: exact for parabolas."""
    x, spacing = np.linspace(-0.5, 0.5, n_x), 1.0 / (n_x - 1)
    force = np.zeros(n_x)
    for place in ((1 - 3**-0.5) / 2, (1 + 3**-0.5) / 2):
        part = traction(x[:-1] + place * spacing) * spacing / 2
        force[:-1] += part * (1 - place)
        force[1:] += part * place
    return force
