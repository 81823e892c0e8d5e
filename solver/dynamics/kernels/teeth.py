"""Teeth of the limit F̃: any of infinitely many, and the one that holds a position."""

import math

import numpy as np

from nanoslip.solver.compiled import compiled
from nanoslip.solver.dynamics.kernels.state import Teeth


@compiled(error_model="numpy")
def repeated_tooth(teeth: Teeth, index: int) -> tuple[int, float]:
    """Which of the given teeth tooth `index` ≥ 0 repeats, and how far to the right."""
    count = teeth.force.size
    if index < count:
        return index, 0.0
    laps = (index - teeth.periodic_from) // (count - teeth.periodic_from)
    shift = laps * (teeth.edges[count] - teeth.edges[teeth.periodic_from])
    return index - laps * (count - teeth.periodic_from), shift


@compiled(error_model="numpy")
def tooth_at(teeth: Teeth, index: int) -> tuple[float, float, float, float]:
    """Left edge, right edge, force at the left edge and slope of any tooth: periodic to the right, mirrored about 0."""
    j, shift = repeated_tooth(teeth, index if index >= 0 else -1 - index)
    left, right = teeth.edges[j] + shift, teeth.edges[j + 1] + shift
    force, slope = teeth.force[j], teeth.slope[j]
    if index >= 0:
        return left, right, force, slope
    return -right, -left, force + slope * (right - left), -slope


_NEARBY = 8
"""Teeth to try one by one before the period and bisection are asked."""

_COUNTABLE = 4.5e15
"""Teeth that a position in double precision can tell apart."""


@compiled(error_model="numpy")
def _tooth_near(teeth: Teeth, x: float) -> int:
    """The tooth that holds x, or one beside it where rounding blurs an edge: by whole periods, then bisection."""
    count, first = teeth.force.size, teeth.periodic_from
    start, far = teeth.edges[first], abs(x)
    period = teeth.edges[count] - start
    laps = max(0, int((far - start) / period))
    within = int(np.searchsorted(teeth.edges, far - laps * period, side="right")) - 1
    index = min(max(within, 0), count - 1) + laps * (count - first)
    return index if x >= 0.0 else -1 - index


@compiled(error_model="numpy")
def tooth_holding(teeth: Teeth, index: int, x: float) -> tuple[int, float, float, float, float]:
    """The tooth that holds x, looked for from tooth `index` on: its index, and what `tooth_at` says of it.

    NaN for an x so far out that teeth cannot be told apart any more, or that is no number.
    """
    count, first = teeth.force.size, teeth.periodic_from
    if not abs(x) <= _COUNTABLE / (count - first) * (teeth.edges[count] - teeth.edges[first]):
        return index, math.nan, math.nan, math.nan, math.nan
    left, right, base, slope = tooth_at(teeth, index)
    for _ in range(_NEARBY):  # nearly every step ends in one of the next teeth
        if left <= x < right:
            return index, left, right, base, slope
        index += 1 if x >= right else -1
        left, right, base, slope = tooth_at(teeth, index)
    index = _tooth_near(teeth, x)
    left, right, base, slope = tooth_at(teeth, index)
    while x >= right:
        index += 1
        left, right, base, slope = tooth_at(teeth, index)
    while x < left:
        index -= 1
        left, right, base, slope = tooth_at(teeth, index)
    return index, left, right, base, slope
