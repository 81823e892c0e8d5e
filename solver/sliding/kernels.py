"""Compiled core of sliding with frozen pressures: shear alone, so that a slip is one row of the tangential tableau.

Over the m nodes of the contact, with their displacements u along x as inputs:

    shear = base + u @ tableau              (row i: the shear forces per displacement of node i)

`base` holds what the frozen normal forces contribute. Numba's cache does not notice a changed callee in another module, so
nothing is called from one, nor a constant of one read.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from solver.contact.kernels import Events

Floats = NDArray[np.float64]

DONE, FULL, SLIP_UNBOUNDED, CASCADE_LIMIT, NO_EVENT, OVERSHOT = range(6)
_SLIP = 0

_REFRESH_SLIPS = 65536  # slips after which the shear is summed afresh: rounding of a vector sum stays below 1e-12
_PLACE = 0xFFFF  # lowest bits of a shear ratio that give way to the node's place: nearer ratios are ties


class Tangent(NamedTuple):
    """State of a contact with frozen pressures; arrays over its m nodes are changed in place."""

    tableau: Floats
    """(m, at least m), row i: response to u of node i, then padding."""
    base: Floats
    """(m,) shear at u = 0."""
    shear: Floats
    """(m,) f_x"""
    u: Floats
    """(m,)"""
    rate: Floats
    """(m,) shear per unit of pin displacement."""
    limits: Floats
    """(m,) μ_i N; infinite where a node never slips."""
    weights: Floats
    """(m,) 1/limits, with the tolerance as smallest limit."""
    nodes: NDArray[np.int32]
    """(m,) surface node that each is."""
    totals: Floats
    """δ_p, dissipated energy of the current event."""
    counts: NDArray[np.int64]
    """Slips of the current event, slips since the last refresh."""


class FrozenRules(NamedTuple):
    """What does not change during a run; see `solver.contact.kernels.Rules`."""

    residual_shear: float
    simultaneous: bool
    floor: float
    spacing: float
    limit: float
    stretches: float
    overshoot: float
    cascade_limit: int
    tolerance: float


@njit(cache=True, nogil=True, fastmath={"contract"})
def _add(total: Floats, factor: float, row: Floats) -> None:
    for k in range(len(total)):
        total[k] += factor * row[k]


@njit(cache=True, nogil=True)
def refresh(t: Tangent) -> None:
    """Sum the shear afresh."""
    t.shear[:] = t.base
    for i in range(len(t.u)):
        _add(t.shear, t.u[i], t.tableau[i])
    t.counts[1] = 0


@njit(cache=True, nogil=True)
def _bits(value: float) -> int:
    return int(np.float64(value).view(np.int64))


@njit(cache=True, nogil=True, fastmath={"contract"}, error_model="numpy")
def _worst(shear: Floats, limits: Floats, weights: Floats, tolerance: float) -> int:
    """The offender with the largest |shear|/(μ_i·N), of ties the one further right, or -1; without a branch, as in
    `solver.contact.kernels._look`."""
    cut, shifted = 0, 0
    for i in range(len(shear)):
        size = abs(shear[i])
        ratio = _bits(size * weights[i])
        offends = size - limits[i] > tolerance
        cut = max(cut, (ratio & ~_PLACE) | i if offends else 0)
        shifted = max(shifted, ((ratio + _PLACE // 2 + 1) & ~_PLACE) | i if offends else 0)
    return max(cut & _PLACE, shifted & _PLACE) if cut > 0 else -1


@njit(cache=True, nogil=True, inline="always")
def _distance(shear: Floats, tableau: Floats, limits: Floats, residual_shear: float, i: int) -> float:
    """How far node i slips, the others held, until residual_shear·μ_i·N is left of its shear."""
    left = residual_shear * limits[i]
    return float(((left if shear[i] > 0.0 else -left) - shear[i]) / tableau[i, i])


@njit(cache=True, nogil=True, inline="always")
def _glide(shear: Floats, tableau: Floats, u: Floats, i: int, along: float) -> float:
    """Displace node i; returns the work that its shear does on the slab."""
    before = shear[i]
    _add(shear, along, tableau[i])
    u[i] += along
    return float(0.5 * (before + shear[i]) * along)


@njit(cache=True, nogil=True)
def _slip_in_turn(t: Tangent, rules: FrozenRules, first: int) -> int:
    """Slip `first`, then the worst offender, the others held, until none is left.

    The arrays are taken out of the state once: passing the whole of it to another compiled function costs more than a slip.
    """
    shear, tableau, u, limits, weights, counts = t.shear, t.tableau, t.u, t.limits, t.weights, t.counts
    node, residual_shear, tolerance = first, rules.residual_shear, rules.tolerance
    while node >= 0:
        if counts[0] >= rules.cascade_limit:
            return CASCADE_LIMIT
        if not tableau[node, node] > 0.0:
            return SLIP_UNBOUNDED
        along = _distance(shear, tableau, limits, residual_shear, node)
        t.totals[1] -= _glide(shear, tableau, u, node, along)
        counts[0] += 1
        counts[1] += 1
        if counts[1] >= _REFRESH_SLIPS:
            refresh(t)
        node = _worst(shear, limits, weights, tolerance)
    return DONE


@njit(cache=True, nogil=True)
def _slip_together(t: Tangent, rules: FrozenRules, first: int) -> int:
    """The same by rounds: every offender of a round slips by the distance it would slip alone."""
    m = len(t.u)
    along = np.zeros(m)
    while True:
        offenders = 0
        for i in range(m):
            slips = abs(t.shear[i]) - t.limits[i] > rules.tolerance or i == first
            along[i] = _distance(t.shear, t.tableau, t.limits, rules.residual_shear, i) if slips else 0.0
            offenders += slips
            if slips and not t.tableau[i, i] > 0.0:
                return SLIP_UNBOUNDED
        if offenders == 0:
            return DONE
        if t.counts[0] >= rules.cascade_limit:
            return CASCADE_LIMIT
        first = -1
        for i in range(m):
            if along[i] != 0.0:
                t.totals[1] -= _glide(t.shear, t.tableau, t.u, i, along[i])
                t.counts[0] += 1
                t.counts[1] += 1
        if t.counts[1] >= _REFRESH_SLIPS:
            refresh(t)


@njit(cache=True, nogil=True)
def _next_slip(t: Tangent) -> tuple[float, int]:
    """Smallest step of the pin at which a node reaches its limit, and the node; infinite and -1 if none does."""
    nearest, node = np.inf, -1
    for i in range(len(t.u) - 1, -1, -1):
        sign = 1.0 if t.rate[i] > 0.0 else -1.0
        speed = sign * t.rate[i]
        if speed > 0.0:
            step = max(t.limits[i] - sign * t.shear[i], 0.0) / speed
            if step < nearest:
                nearest, node = step, i
    return nearest, node


@njit(cache=True, nogil=True)
def _advance(t: Tangent, step: float) -> None:
    t.shear[:] += step * t.rate
    t.u[:] += step
    t.totals[0] += step


@njit(cache=True, nogil=True)
def _smallest_step(rules: FrozenRules, stiffness: float, displacement: float) -> float:
    """See `solver.contact.kernels.smallest_step`."""
    least = 4.5e-16 * displacement
    if not stiffness > 0.0:
        return max(rules.floor * rules.spacing, least)
    unit = min(rules.spacing, rules.stretches * rules.limit / stiffness)
    return max(rules.floor * unit, 0.1 * rules.tolerance / stiffness, least)


@njit(cache=True, nogil=True)
def _overshoot(t: Tangent) -> float:
    """By how much shear exceeds its limits, all nodes together."""
    total = 0.0
    for i in range(len(t.u)):
        total += max(abs(t.shear[i]) - t.limits[i], 0.0)
    return total


@njit(cache=True, nogil=True)
def slide_frozen(t: Tangent, rules: FrozenRules, events: Events, first: int, farthest: float) -> tuple[int, int]:
    """Slide from event to event; returns why it stopped and how many events the record now holds."""
    stiffness = t.rate.sum()
    most = rules.overshoot * rules.limit + len(t.u) * rules.tolerance
    for e in range(first, len(events.displacement)):
        step, node = _next_slip(t)
        step = max(step, _smallest_step(rules, stiffness, t.totals[0]))
        if node < 0 and farthest == np.inf:
            return NO_EVENT, e
        if t.totals[0] + step >= farthest:
            _advance(t, farthest - t.totals[0])
            return DONE, e
        _advance(t, step)
        events.displacement[e] = t.totals[0]
        events.force_before[e] = t.shear.sum()
        events.kind[e] = _SLIP
        events.node[e] = t.nodes[node]
        t.counts[0] = 0
        t.totals[1] = 0.0
        if not _overshoot(t) <= most:
            return OVERSHOT, e
        status = _slip_together(t, rules, node) if rules.simultaneous else _slip_in_turn(t, rules, node)
        if status != DONE:
            return status, e
        events.force_after[e] = t.shear.sum()
        events.stiffness[e] = stiffness
        events.dissipated[e] = t.totals[1]
        events.slips[e] = t.counts[0]
        events.releases[e] = 0
        events.touches[e] = 0
        events.contact_size[e] = len(t.u)
    return FULL, len(events.displacement)
