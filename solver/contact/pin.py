"""The rigid pin: its height above its lowest point, the undeformed gap (Figure 1), and limits of the nodes under it."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
import scipy
from numpy.typing import NDArray

from nanoslip.solver.arrays import Floats, Nodes, Vector
from nanoslip.solver.case import Case, Distribution, Heterogeneity, Image, PinShape, make_image
from nanoslip.solver.contact.closed_forms import smooth_contact, winkler_half_width
from nanoslip.solver.last import cache_last
from nanoslip.solver.layout import surface_x

LONGEST_STEP = 0.05
"""Longest step in node spacings: the pin's slope under a sliding node changes by as much of a node's."""


@dataclass(frozen=True, slots=True)
class Pin:
    """A pin whose height at pin coordinate ξ is curvature·ξ²/2 + across for |ξ| ≤ half_width, and out of reach beyond.

    curvature: L_x/R, 0 of a flat punch. half_width: rounded to whole nodes; infinite of a parabola.
    knots, rises: additional height of a rough parabola at pin coordinates, linear between, constant beyond; one knot: smooth.
        rises: (rows, knots), a single row for all nodes, or a row of heights for each row of nodes; then ξ is given
        for all nodes, (n,).
    across: height over the rows of nodes at ξ = 0. On a plane of nodes half_width and across are (n,), each over its
        node's row.
    """

    curvature: float
    half_width: float | Vector
    knots: Vector
    rises: Vector
    across: float | Vector = 0.0

    @property
    def rough(self) -> bool:
        """True if its height is not only a parabola."""
        return len(self.knots) > 1

    def height(self, xi: Vector) -> Vector:
        """Height of the pin's surface above its lowest point at ξ (any shape), in L_x; infinite beyond the pin."""
        return np.where(np.abs(xi) <= self.half_width, self.unbounded_height(xi), np.inf)

    def unbounded_height(self, xi: Vector) -> Vector:
        """Height of the pin above its lowest point at ξ, as if it had no edges, in L_x."""
        rise = self.rises[0, 0]
        if self.rises.size > 1:  # a smooth pin's is one number
            rise = self._apply_to_rows(xi, lambda places, rises: np.interp(places, self.knots, rises))
        with np.errstate(over="ignore"):  # a search without result may leave places whose height exceeds all numbers
            return np.asarray(self.curvature * xi**2 / 2 + rise + self.across)

    def lower_bound(self, xi: Vector, distance: float) -> Vector:
        """A bound from below of the heights within a distance of ξ, (n,): parabola and rise each at its lowest."""
        nearest = np.maximum(np.abs(xi) - distance, 0.0)
        height = self.curvature * nearest**2 / 2 + self.across
        return np.asarray(height + self._apply_to_rows(xi, partial(self._lowest_rise, distance)))

    def _lowest_rise(self, distance: float, xi: Vector, rises: Vector) -> Vector:
        left, right = xi - distance, xi + distance
        # Between knots the rise is straight: it is lowest at an end of the stretch or at a knot within.
        at_left = np.interp(left, self.knots, rises)
        at_right = np.interp(right, self.knots, rises)
        first = np.searchsorted(self.knots, left)
        last = np.searchsorted(self.knots, right)
        # Of an empty stretch `reduceat` takes the knot after it: one more, which can only lower the bound.
        stretches = np.column_stack((first, last)).ravel()
        with_end = np.append(rises, np.inf)
        between = np.minimum.reduceat(with_end, stretches)[::2]
        return np.asarray(np.minimum(np.minimum(at_left, at_right), between))

    def _apply_to_rows(self, xi: Vector, along: Callable[[Vector, Vector], Vector]) -> Vector:
        """A function of ξ and of the rises over them, row by row of nodes."""
        if len(self.rises) == 1:
            return along(xi, self.rises[0])
        rows = xi.reshape(-1, len(self.rises)).T
        values = list(map(along, rows, self.rises))
        return np.stack(values, axis=1).ravel()

    def largest_fall(self, distance: float) -> float:
        """Upper bound of the roughness' rise or fall within a distance, anywhere on a rough pin."""
        slopes = np.diff(self.rises) / np.diff(self.knots)
        steepest = float(np.abs(slopes).max())
        height = float(np.ptp(self.rises, axis=1).max())
        return min(steepest * distance, height)

    def rounding(self, xi: Vector) -> float:
        """Largest change of displacements by rounding of ξ (any shape) and of heights there, in L_x."""
        place_and_parabola = np.abs(xi) + self.curvature * xi**2 / 2
        highest_rise = float(np.abs(self.rises).max())
        largest = float(place_and_parabola.max()) + highest_rise
        return 4.0 * float(np.finfo(float).eps) * largest

    def slope(self, xi: Vector) -> Vector:
        """dheight/dξ under the pin; at a knot that to its right."""
        return np.asarray(self.curvature * xi + self._apply_to_rows(xi, self._rise_slope))

    def steepest(self, left: Vector, right: Vector, row: int = 0) -> float:
        """The largest |dheight/dξ| over a row of nodes anywhere between left and right, (k,), of k stretches of ξ; 0 without."""
        places = np.concatenate((left, right, self.knots))
        places.sort()
        starts, ends = places[:-1], places[1:]
        middle = (starts + ends) / 2
        # A place is within a stretch if more stretches have begun before it than are over.
        begun = np.searchsorted(np.sort(left), middle, side="right")
        over = np.searchsorted(np.sort(right), middle, side="right")
        within = (begun > over) & (ends > starts)
        rise = self._rise_slope(middle[within], self.rises[row])
        # Between knots the parabola's slope is straight and the rise's constant: the sum is steepest at an end.
        at_starts = np.abs(self.curvature * starts[within] + rise)
        at_ends = np.abs(self.curvature * ends[within] + rise)
        either = np.maximum(at_starts, at_ends)
        return float(either.max(initial=0.0))

    def _rise_slope(self, xi: Vector, rises: Vector) -> Vector:
        """Slope of a row's roughness at ξ; at a knot that to its right."""
        between = np.diff(rises) / np.diff(self.knots)
        # Beyond its outermost knots the roughness goes on level.
        slopes = np.concatenate(([0.0], between, [0.0]))
        return np.asarray(slopes[np.searchsorted(self.knots, xi, side="right")])


def surface_from_pin(case: Case, first_node: int = 0) -> Vector:
    """The undeformed surface nodes as the pin sees them before it moves: x from its lowest point, (n,), in L_x; read-only.

    first_node: of the surface, which the grid's first is; above 0 where a pin has left nodes behind (`advance_grid`).
    """
    places = _surface_at_first(case)
    return places + first_node // case.slab.rows * case.slab.spacing if first_node else places


@cache_last
def _surface_at_first(case: Case) -> Vector:
    places = surface_x(case.slab.n_x) - case.start * case.slab.spacing
    places = np.repeat(places, case.slab.rows)
    places.setflags(write=False)
    return places


@cache_last
def surface_across(case: Case) -> Vector:
    """y of the surface nodes from the pin's lowest point, (n,), in L_x; 0 in plane strain."""
    return case.slab.layout.y - case.start_y * case.slab.spacing


def surface_from_axis(case: Case, moved: Vector | float = 0.0, first_node: int = 0) -> Vector:
    """Distance of surface nodes that have moved along x from the pin's lowest point, (n,), in L_x."""
    x = surface_from_pin(case, first_node) + moved
    return np.hypot(x, surface_across(case))


@cache_last
def make_pin(case: Case) -> Pin:
    """The pin of `case`."""
    return SHAPES[case.pin](case)


def _parabola(case: Case) -> Pin:
    """On a plane of nodes a paraboloid: a ball."""
    y, image = surface_across(case), make_image(case.heterogeneity.roughness)
    heights = image.over(y[: case.slab.rows])
    return Pin(1.0 / case.radius, math.inf, image.xi, heights, case.slab.layout.rise_across(y, case.radius))


def _flat_punch(case: Case) -> Pin:
    """On a plane of nodes a disc: over each row as wide as its chord, in whole nodes."""
    half_width = case.slab.layout.chords(case.half_width, surface_across(case))
    # A node stands for its width of surface: it is under the punch while the greater part of that is.
    return Pin(0.0, half_width + 0.499 * case.slab.spacing, np.zeros(1), np.zeros((1, 1)))


def roughness_slopes(image: Image, spacing: float) -> tuple[float, float]:
    """Root mean square slopes of a roughness, of an image both ways, and of its residual from linear interpolation at
    this spacing."""
    slope_along, missed_along = profile_slopes(image.xi, image.height, spacing)
    slope_across, missed_across = profile_slopes(image.y, image.height.T, spacing)
    return math.hypot(slope_along, slope_across), math.hypot(missed_along, missed_across)


def profile_slopes(knots: Vector, rows: Vector, spacing: float) -> tuple[float, float]:
    """Root mean square slopes of profiles (rows, knots), and of their residuals from linear interpolation at this
    spacing; 0 for a single knot."""
    if len(knots) == 1:
        return 0.0, 0.0
    left = np.floor(knots / spacing)  # nothing is missed between nodes without a knot
    nodes = spacing * np.unique(np.concatenate((left, left + 1.0)))
    xi = np.unique(np.concatenate((nodes, knots)))
    heights = np.array([np.interp(xi, knots, rises) for rises in rows])
    at_nodes = [np.interp(nodes, knots, rises) for rises in rows]
    seen = [np.interp(xi, nodes, rises) for rises in at_nodes]
    width = float(knots[-1] - knots[0]) * len(rows)

    def mean_slope(values: Floats) -> float:
        # Between knots the slope is Δh/Δξ: its square over the stretch adds up to Δh²/Δξ.
        squares = np.diff(values) ** 2 / np.diff(xi)
        return math.sqrt(float(squares.sum()) / width)

    return mean_slope(heights), mean_slope(heights - seen)


SHAPES: dict[PinShape, Callable[[Case], Pin]] = {"parabola": _parabola, "flat_punch": _flat_punch}
"""Shape of a case's pin -> the pin."""


# μ_i of every surface node: one value for all, or drawn from a distribution by the case's own seed.


def node_friction(case: Case, first_node: int = 0) -> Floats:
    """μ_i of the case's surface nodes, shape (n,), from this one on."""
    return case.intrinsic_friction * node_factors(case, first_node)


def node_factors(case: Case, first_node: int = 0) -> Floats:
    """Limit of each surface node from this one on over the mean limit under its pressure, (n,)."""
    layout, drawn = case.slab.layout, case.heterogeneity
    if drawn.spread == 0.0:
        return np.ones(layout.nodes)
    stretches = layout.random_stretches(first_node)
    return np.concatenate([_factors(drawn, first, count) for first, count in stretches])


def _factors(drawn: Heterogeneity, first: int, n: int) -> Floats:
    """Independent random numbers with mean 1 and standard deviation `spread`, by inversion of uniform random
    numbers."""
    # Of numpy's streams only the raw one is promised to stay the same.
    raw = np.random.PCG64(drawn.seed).advance(first).random_raw(n)
    # 53 bits, as a float has, in the middle of their steps: never 0 or 1, whose quantiles are infinite.
    # The upper 53 of 64 random bits, as a float has: the middles of 2^53 equal parts of (0, 1).
    bits = np.right_shift(raw, np.uint64(11)).astype(np.float64)
    uniform = (bits + 0.5) * 2.0**-53
    return DISTRIBUTIONS[drawn.distribution](uniform, drawn.spread)


def _lognormal(uniform: Vector, spread: float) -> Vector:
    # exp(σz) has the mean exp(σ²/2) and the squared variation exp(σ²) - 1.
    sigma = math.sqrt(math.log1p(spread**2))
    return np.asarray(np.exp(sigma * scipy.special.ndtri(uniform) - sigma**2 / 2.0))


def _uniform(uniform: Vector, spread: float) -> Vector:
    # 2u - 1 has the variance 1/3.
    return np.asarray(1.0 + math.sqrt(3.0) * spread * (2.0 * uniform - 1.0))


def _normal(uniform: Vector, spread: float) -> Vector:
    # Friction is not negative: at the widest spread, 0.25, 3e-5 of the nodes are cut off at 0.
    return np.maximum(1.0 + spread * scipy.special.ndtri(uniform), 0.0)


DISTRIBUTIONS: dict[Distribution, Callable[[Vector, float], Vector]] = {
    "lognormal": _lognormal,
    "uniform": _uniform,
    "normal": _normal,
}
"""Distribution -> its numbers of mean 1 and this standard deviation, from uniform ones in (0, 1)."""


# The limit of shear of a node, τ_0·area + μ_i·N: the only place where it is defined.
#
# A strength τ_0 needs no pressure (Bowden and Tabor): where the pressure falls to 0 a node still bears τ_0·area, and is
# released with the shear that it has then.


def node_strength(case: Case, areas: float | Vector, first_node: int = 0) -> Floats:
    """Shear that each node bears without pressure, τ_0·area, (n,); of spread limits its share of the mean.

    areas: of the surface that belongs to each node (`Compliance.widths`).
    """
    return np.asarray(case.slip_rule.strength * areas * node_factors(case, first_node))


def node_limit(case: Case, areas: float | Vector, normal_force: Vector, first_node: int = 0) -> Floats:
    """Largest shear force of each node under its normal force, (n,); with areas of 1 and pressures the largest traction."""
    friction = node_friction(case, first_node)
    # Not everywhere: nodes that never slip have an infinite μ_i, also without a force.
    pressed = np.multiply(friction, normal_force, out=np.zeros_like(friction), where=normal_force != 0.0)
    return node_strength(case, areas, first_node) + pressed


def limit_over_pressure(case: Case, pressure: Vector, first_node: int = 0) -> Floats:
    """The limit of each node over its pressure, (n,): at least μ_i; infinite without pressure where there is a strength."""
    strength = node_strength(case, 1.0, first_node)
    unpressed = np.where(strength > 0.0, math.inf, 0.0)
    above = np.divide(strength, pressure, out=unpressed, where=pressure > 0.0)
    return np.asarray(node_friction(case, first_node) + above)


def contact_limit(case: Case, area: float) -> float:
    """Friction force at which all nodes of a contact of this area slide, μ_i·W + τ_0·area, in G·L_x·L_y."""
    return case.intrinsic_friction * case.normal_load + case.slip_rule.strength * area


def contact_area(contact: Nodes, areas: Vector) -> float:
    """True contact area, of the nodes (n,) in contact: in L_x of a row, in L_x² of a plane."""
    return float(areas[contact].sum())


@cache_last
def estimate_half_width(case: Case) -> float:
    """Hertz's contact half-width on a half-plane or half-space, that on a bed of springs, or the punch's own: a first guess."""
    if case.pin == "flat_punch":
        return case.half_width
    bed = case.slab.scheme.bed_stiffness
    if bed is not None:
        return winkler_half_width(case.normal_load, case.radius, bed)
    return smooth_contact(case.slab.scheme.LAYOUT).hertz(case.normal_load, case.radius, case.slab.poisson)


def nodes_under_pin(case: Case) -> NDArray[np.bool_]:
    """Nodes (n,) that a pin at δ_p = 0 could meet: all nodes, or the nodes that a punch covers."""
    return np.abs(surface_from_pin(case)) <= make_pin(case).half_width


def guess_contact(case: Case) -> NDArray[np.bool_]:
    """Nodes (n,) of the expected contact, a first guess: at least the nearest."""
    away = surface_from_axis(case)
    under = (away <= estimate_half_width(case)) & nodes_under_pin(case)
    return under if under.any() else away <= away.min()
