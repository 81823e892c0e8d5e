"""The paper's stencil in exact fractions, and its surface compliance to 200 digits: an oracle without rounding.

Written from Eq. 4-10 anew: polynomials are evaluated, parabolas integrated by Simpson's rule and differentiated by a central
difference, both of which are exact for them.
"""

from fractions import Fraction
from itertools import accumulate

import mpmath
import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.elasticity.grid import support_mask
from nanoslip.solver.elasticity.grid_scheme import grid_scheme
from nanoslip.solver.slab import Slab

Number = Fraction
Row = dict[int, Number]
HALF = Number(1, 2)


def exact_compliance(slab: Slab) -> NDArray[np.float64]:
    """The surface compliance (2n, 2n) of a slab with scheme `biquadratic`, rounded once. A second at n_x = 9, a minute at 17."""
    grid = grid_scheme(slab).grid(slab)
    counts = [int(count) for count in grid.counts]
    held = np.concatenate(support_mask(grid, slab.support))
    kept = np.flatnonzero(~held).tolist()
    equations = _equations(slab, counts)
    surface = [*range(slab.n_x), *range(sum(counts), sum(counts) + slab.n_x)]
    with mpmath.workdps(200):
        system = mpmath.matrix(len(kept))
        for row, place in enumerate(kept):
            for column, other in enumerate(kept):
                value = equations[place].get(other, HALF - HALF)
                system[row, column] = mpmath.mpf(value.numerator) / value.denominator
        inverse = system**-1
        found = {(a, b): float(inverse[i, j]) for i, a in enumerate(kept) for j, b in enumerate(kept)}
    return np.array([[found.get((place, force), 0.0) for force in surface] for place in surface])


def _equations(slab: Slab, counts: list[int]) -> list[Row]:
    """Eq. 11: forces of every node, [f_x; f_z], per displacement [u; w]."""
    poisson = Number(slab.poisson)
    dilation = 2 * poisson / (1 - 2 * poisson)
    steps = [Number(2) ** max(row - 1, 0) for row in range(len(counts) - 1)]
    if slab.scheme.first_spacing == "doubling":
        steps = [Number(2) ** row for row in range(len(counts) - 1)]
    depths = [-depth * Number(slab.aspect_ratio) / sum(steps) for depth in accumulate(steps, initial=Number(0))]
    first = list(accumulate(counts, initial=0))
    nodes, along_x, along_z = first[-1], list[Row](), list[Row]()
    for row, column in [(number, place) for number, count in enumerate(counts) for place in range(count)]:
        of_x, of_z = Row(), Row()
        for other, place, integrals in _integrals(counts, depths, row, column):
            u = first[other] + place
            dx_sides, dz_sides, dx_ends, dz_ends = integrals
            of_x[u] = -(dilation + 2) * dx_sides - dz_ends
            of_x[nodes + u] = -dilation * dz_sides - dx_ends
            of_z[u] = -dilation * dx_ends - dz_sides
            of_z[nodes + u] = -(dilation + 2) * dz_ends - dx_sides
        along_x.append(of_x)
        along_z.append(of_z)
    return along_x + along_z


def _integrals(
    counts: list[int], depths: list[Number], row: int, column: int
) -> list[tuple[int, int, tuple[Number, Number, Number, Number]]]:
    """∂φ/∂x and ∂φ/∂z over a volume's sides, then over its ends, per displacement of each node used: its row, its column."""
    last, bottom = counts[row] - 1, len(counts) - 1
    used = [min(max(row, 1), bottom - 1) + step for step in (-1, 0, 1)]
    heights = [depths[q] - depths[row] for q in used]
    lower = Number(0) if row == bottom else (depths[row + 1] - depths[row]) * HALF
    upper = Number(0) if row == 0 else (depths[row - 1] - depths[row]) * HALF
    left, right = (Number(0) if column == end else sign * HALF / last for sign, end in ((-1, 0), (1, last)))
    sides = [(sign, x) for sign, x in ((-1, left), (1, right)) if x]
    ends = [(sign, z) for sign, z in ((-1, lower), (1, upper)) if z]
    found = []
    for q, other in enumerate(used):
        place, between = divmod(column * (counts[other] - 1), last)
        middle = min(max(place, 1), counts[other] - 2)
        nodes = [place, place + 1] if between else [middle - 1, middle, middle + 1]
        places = [Number(node, counts[other] - 1) - Number(column, last) for node in nodes]
        for k, node in enumerate(nodes):
            dx_sides = sum(s * _slope(places, k, x) for s, x in sides) * _integral(heights, q, lower, upper)
            dz_sides = sum(s * _value(places, k, x) for s, x in sides) * _rise(heights, q, lower, upper)
            dx_ends = sum(s * _value(heights, q, z) for s, z in ends) * _rise(places, k, left, right)
            dz_ends = sum(s * _slope(heights, q, z) for s, z in ends) * _integral(places, k, left, right)
            found.append((other, node, (Number(dx_sides), Number(dz_sides), Number(dx_ends), Number(dz_ends))))
    return found


def _value(points: list[Number], k: int, t: Number) -> Number:
    """The polynomial that is 1 at point k and 0 at the others."""
    value = Number(1)
    for other, point in enumerate(points):
        value *= 1 if other == k else (t - point) / (points[k] - point)
    return value


def _slope(points: list[Number], k: int, t: Number) -> Number:
    return _rise(points, k, t - HALF, t + HALF)


def _rise(points: list[Number], k: int, lower: Number, upper: Number) -> Number:
    return _value(points, k, upper) - _value(points, k, lower)


def _integral(points: list[Number], k: int, lower: Number, upper: Number) -> Number:
    middle = (lower + upper) * HALF
    values = _value(points, k, lower) + 4 * _value(points, k, middle) + _value(points, k, upper)
    return (upper - lower) / 6 * values
