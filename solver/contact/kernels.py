"""Compiled core of contact and sliding: all functions that call each other, in one module, because numba's cache does
not notice a changed callee elsewhere.

The state is a `Machine`, a tuple of arrays over a window of the surface nodes, i = 0 … n-1. Its `tableau` is the slab's
operator with the contact nodes turned round: forces of the nodes in contact and displacements of the free ones, per
displacement of the nodes in contact and force on the free ones. One more entry exchanges the approach for the load, so that
every column already holds the load:

    response = inputs @ tableau            (the tableau is stored transposed: row j is the response to input j)
    entry i < n:        u_i is input and f_x,i response in contact; the other way round when free
    entry n + i:        v_i = w_i + approach and f_z,i likewise
    entry 2n:           input -W, response the approach

A slip is two rows of the tableau added to the response; touch and release exchange one node's two entries (a pivot).
"""

from typing import NamedTuple

import numpy as np
from numba import njit, types
from numba.extending import overload, register_jitable
from numpy.typing import NDArray

Floats = NDArray[np.float64]

SLIP, RELEASE, TOUCH, NOTHING = 0, 1, 2, 3
DONE, FULL, DRIFTED, SLIP_UNBOUNDED, CASCADE_LIMIT, CONTACT_LOST, NO_EVENT, EDGE_REACHED, OUTGROWN, CONTACT_CYCLE = (
    range(10)
)
OVERSHOT, NOT_FINITE, STEEP = 10, 11, 12

DRIFT_LIMIT = 1e-11  # relative residual of the prescribed displacements or of the load at which the tableau is rebuilt
REFRESH_SLIPS = 65536  # slips after which the response is summed afresh: rounding of a vector sum stays below 1e-12
LOOK_EVENTS = 64  # events after which the drift is looked at, changes of the contact or not
REFRESH_CHANGES = 64  # changes of the contact after which everything is summed afresh
CHANGES_PER_NODE = 20  # touches and releases in one cascade, per node, after which they count as a cycle
STRETCHES = (
    24.0  # the event floor counts in node spacings, or in this many stretches of the contact where those are shorter
)
OVERSHOOT = 1e-4  # what shear may exceed its limit by before an event, all nodes together, as a share of μ_i·W
BLUR = 1e-15  # rounding of the pin's height, as a share of it
EDGE = 1e-9  # relative distance inside a punch's edge at which a node counts as under it
STEEPEST = (
    1.0  # slope of the pin under a node in contact beyond which along and across say nothing of shear and pressure
)
CREATED = 1e-14  # energy that rounding may create in one event, as a share of the load times what it displaces (W² / G)
PLACE = 0xFFFF  # lowest bits of a shear ratio, 2^-36 of it, that give way to the node's place: nearer ratios are ties


class Machine(NamedTuple):
    """State of one contact; arrays are changed in place. n nodes in the window, N = 2n + 1 entries."""

    matrix: Floats
    """(2n, 2n) surface compliance."""
    tableau: Floats
    """(N, at least N), row j: response to input j, then padding."""
    response: Floats
    """(N,)"""
    inputs: Floats
    """(N,)"""
    rate: Floats
    """(N,) response per unit of pin displacement (or of load, in initial contact)."""
    contact: NDArray[np.bool_]
    """(n,)"""
    x: Floats
    """(n,) positions from the slab's middle."""
    friction: Floats
    """(n,) μ_i per node; any value where `sticks`."""
    sticks: NDArray[np.bool_]
    """(n,) infinite μ_i: the node never slips."""
    limits: Floats
    """(n,) μ_i where a node is in contact and may slip; NaN elsewhere."""
    totals: Floats
    """δ_p, dissipated energy of the current event, largest relative drift seen."""
    counts: NDArray[np.int64]
    """slips, releases, touches of the current event; slips since the last refresh; touches near the window's ends;
    changes of the contact since the last look at the drift."""


class Profile(NamedTuple):
    """A rough pin: its height is curvature·ξ²/2 + rise(ξ), the rise straight between knots and level beyond them."""

    curvature: float
    knots: Floats
    """Pin coordinates, increasing."""
    rises: Floats
    """Of the same shape."""


class Rules(NamedTuple):
    """What does not change during a run."""

    profile: float | Profile
    """Curvature of a smooth pin, or a rough one's profile: its type decides which functions are compiled."""
    half_width: float
    residual_shear: float
    simultaneous: bool
    floor: float
    """The event floor, in node spacings."""
    spacing: float
    """Distance between surface nodes."""
    limit: float
    """μ_i·W; infinite where nodes never slip."""
    cascade_limit: int
    tolerance: float
    """Force below which a constraint counts as met."""
    tolerance_gap: float
    """Penetration below which a free node counts as free."""
    offset: int
    """Surface node that the machine's node 0 is."""
    safe: tuple[int, int]
    """First and last node of the machine that can touch without a node beyond its window being near."""


class Events(NamedTuple):
    """Columns of a friction record in the making (see FrictionRecord), each of shape (capacity,)."""

    displacement: Floats
    force_before: Floats
    force_after: Floats
    stiffness: Floats
    dissipated: Floats
    kind: NDArray[np.int8]
    node: NDArray[np.int32]
    slips: NDArray[np.int64]
    releases: NDArray[np.int32]
    touches: NDArray[np.int32]
    contact_size: NDArray[np.int32]


@njit(cache=True, nogil=True)
def _height(rules: Rules, xi: float) -> float:
    """Height of the pin above its lowest point; infinite beyond its edges."""
    if abs(xi) > rules.half_width:
        return np.inf
    return float(_height_of(rules.profile, xi))


def _height_of(profile: float | Profile, xi: float) -> float:
    """Height of a pin without edges above its lowest point (of a rough one: of its parabola). Compiled for either kind."""
    raise NotImplementedError


def _smooth_height(profile: float, xi: float) -> float:
    return 0.5 * profile * xi * xi


@register_jitable
def _rough_height(profile: Profile, xi: float) -> float:
    last = len(profile.knots) - 1
    k = min(max(int(np.searchsorted(profile.knots, xi, side="right")), 1), last)
    along = min(max(xi, profile.knots[0]), profile.knots[last]) - profile.knots[k - 1]
    rise = profile.rises[k - 1] + along * _slope(profile, k)
    return float(0.5 * profile.curvature * xi * xi + rise)


@njit(cache=True, nogil=True)
def _slope(profile: Profile, k: int) -> float:
    """Slope of the rise between knots k - 1 and k; level before the first and behind the last."""
    if not 0 < k < len(profile.knots):
        return 0.0
    return float((profile.rises[k] - profile.rises[k - 1]) / (profile.knots[k] - profile.knots[k - 1]))


def _slope_of(profile: float | Profile, xi: float) -> float:
    """Slope of a pin without edges at ξ; at a knot, of what lies to its right. Compiled for either kind."""
    raise NotImplementedError


def _smooth_slope(profile: float, xi: float) -> float:
    return profile * xi


def _rough_slope(profile: Profile, xi: float) -> float:
    return profile.curvature * xi + _slope(profile, int(np.searchsorted(profile.knots, xi, side="right")))


@overload(_slope_of, strict=False)
def _choose_slope(profile, xi):  # type: ignore[no-untyped-def]
    return _rough_slope if isinstance(profile, types.BaseNamedTuple) else _smooth_slope


@overload(_height_of, strict=False)
def _choose_height(profile, xi):  # type: ignore[no-untyped-def]
    return _rough_height if isinstance(profile, types.BaseNamedTuple) else _smooth_height


@njit(cache=True, nogil=True, fastmath={"contract"})
def _add(total: Floats, factor: float, row: Floats) -> None:
    for k in range(len(total)):
        total[k] += factor * row[k]


@njit(cache=True, nogil=True, fastmath={"contract"})
def _add_two(total: Floats, first: float, row_1: Floats, second: float, row_2: Floats) -> None:
    for k in range(len(total)):
        total[k] += first * row_1[k] + second * row_2[k]


@njit(cache=True, nogil=True, fastmath={"contract"})
def _add_two_rows(total: Floats, rows: Floats, i: int, first: float, j: int, second: float) -> None:
    for k in range(len(total)):
        total[k] += first * rows[i, k] + second * rows[j, k]


@njit(cache=True, nogil=True)
def refresh(m: Machine) -> None:
    """Sum the response afresh from the inputs."""
    m.response[:] = 0.0
    for j in range(len(m.inputs)):
        if m.inputs[j] != 0.0:
            _add(m.response, m.inputs[j], m.tableau[j])
    m.counts[3] = 0


@njit(cache=True, nogil=True)
def aim_displacement(m: Machine) -> None:
    """Set the rate to the response per unit of pin displacement: all contact nodes move along."""
    m.rate[:] = 0.0
    for i in range(len(m.x)):
        if m.contact[i]:
            _add(m.rate, 1.0, m.tableau[i])


@njit(cache=True, nogil=True)
def aim_load(m: Machine) -> None:
    """Set the rate to the response per unit of load, the pin held."""
    m.rate[:] = -m.tableau[2 * len(m.x), : len(m.rate)]


@njit(cache=True, nogil=True)
def total_shear(m: Machine, values: Floats) -> float:
    """Sum of the tangential entries of `values` (response or rate) over the contact."""
    total = 0.0
    for i in range(len(m.x)):
        if m.contact[i]:
            total += values[i]
    return total


@njit(cache=True, nogil=True)
def _drift(m: Machine, missing: Floats) -> float:
    """Fill `missing` (N,) with what inputs in contact and responses elsewhere lack of the displacements that the compliance
    gives for the forces, and the load of the forces' sum; returns the largest as a share of all that is displaced (loaded).
    Infinite where anything is not a number or where nothing bears the load."""
    n = len(m.x)
    error, largest, carried = 0.0, 0.0, 0.0
    blur = 8.0 * BLUR * abs(m.response[2 * n])  # far out on a sharp pin heights are more than all the load displaces
    for i in range(n):
        if m.contact[i]:
            carried += m.response[n + i]
        for row in (i, n + i):
            seen = m.response[2 * n] if row >= n else 0.0
            moved = 0.0
            for j in range(n):
                if m.contact[j]:
                    by_x, by_z = m.matrix[row, j] * m.response[j], m.matrix[row, n + j] * m.response[n + j]
                    seen += by_x + by_z
                    moved += abs(by_x) + abs(by_z)
            missing[row] = m.inputs[row] - seen if m.contact[i] else seen - m.response[row]
            off = abs(missing[row]) - blur
            if not off <= error:
                error = off if off < np.inf else np.inf  # no number is above infinity, which NaN becomes
            largest = max(largest, moved)
    missing[2 * n] = m.inputs[2 * n] - carried
    unborne = abs(missing[2 * n] / m.inputs[2 * n])
    if not (largest > 0.0 and unborne < np.inf):
        return np.inf
    return float(max(error / largest, unborne))


@njit(cache=True, nogil=True)
def drift(m: Machine) -> float:
    """How far the response is from equilibrium, see DRIFT_LIMIT."""
    return _drift(m, np.empty(len(m.inputs)))


@njit(cache=True, nogil=True)
def refine(m: Machine) -> None:
    """Where the response of a fresh tableau is off equilibrium, correct it once: an inverse alone loses the digits of its
    condition number, an inverse and its residual do not."""
    n, missing = len(m.x), np.empty(len(m.inputs))
    if not _drift(m, missing) > 0.01 * DRIFT_LIMIT:
        return
    for i in range(n):
        if m.contact[i]:
            _add_two_rows(m.response, m.tableau, i, missing[i], n + i, missing[n + i])
    _add(m.response, missing[2 * n], m.tableau[2 * n])
    _drift(m, missing)
    for i in range(n):
        if not m.contact[i]:
            m.response[i] += missing[i]
            m.response[n + i] += missing[n + i]


@njit(cache=True, nogil=True)
def _exchange(m: Machine, i: int) -> bool:
    """Turn the two entries of node i round (a principal pivot with a 2 × 2 block); False where the block is singular."""
    n = len(m.x)
    p, q = i, n + i
    t = m.tableau
    a, b, c, d = t[p, p], t[q, p], t[p, q], t[q, q]  # the block itself is [[a, b], [c, d]]: storage is transposed
    determinant = a * d - b * c
    scale = abs(a * d) + abs(b * c)
    if not abs(determinant) > 1e-14 * scale:
        return False
    ia, ib, ic, id_ = d / determinant, -b / determinant, -c / determinant, a / determinant
    row_p, row_q = t[p].copy(), t[q].copy()
    for j in range(2 * n + 1):
        if j not in (p, q):
            # What the pivot's two inputs must be to hold its old responses, per unit of input j.
            first = -(ia * t[j, p] + ib * t[j, q])
            second = -(ic * t[j, p] + id_ * t[j, q])
            _add_two(t[j], first, row_p, second, row_q)
            t[j, p], t[j, q] = first, second
    t[p] = ia * row_p + ic * row_q
    t[q] = ib * row_p + id_ * row_q
    t[p, p], t[p, q], t[q, p], t[q, q] = ia, ic, ib, id_
    for row in (p, q):
        m.inputs[row], m.response[row] = m.response[row], m.inputs[row]
    m.contact[i] = not m.contact[i]
    m.limits[i] = m.friction[i] if m.contact[i] and not m.sticks[i] else np.nan
    return True


@njit(cache=True, nogil=True, inline="always")
def _glide(y: Floats, tableau: Floats, inputs: Floats, i: int, along: float, down: float) -> float:
    """Displace contact node i by (along, down); returns the work ∫ f·du that its forces do on the slab."""
    j = len(y) // 2 + i
    before_x, before_z = y[i], y[j]
    _add_two_rows(y, tableau, i, along, j, down)
    inputs[i] += along
    inputs[j] += down
    return float(0.5 * ((before_x + y[i]) * along + (before_z + y[j]) * down))


@njit(cache=True, nogil=True)
def seat(m: Machine, rules: Rules) -> bool:
    """Put contact nodes that the rounding of many slips has lifted off the pin back on it; whether there were any."""
    n, moved = len(m.x), False
    for i in range(n):
        if m.contact[i]:
            height = _height(rules, m.x[i] + m.inputs[i] - m.totals[0])
            lift = height - m.inputs[n + i]
            if abs(lift) > rules.tolerance + BLUR * abs(height) and height < np.inf:
                _glide(m.response, m.tableau, m.inputs, i, 0.0, lift)
                moved = True
    return moved


@njit(cache=True, nogil=True)
def _settle(m: Machine, push: float) -> None:
    """From time to time, after changes of the contact: fresh sums, a fresh rate, and a look at the tableau's drift."""
    m.counts[5] += 1
    if m.counts[5] < REFRESH_CHANGES:
        return
    m.counts[5] = 0
    refresh(m)
    if push > 0.0:
        aim_displacement(m)
    else:
        aim_load(m)
    m.totals[2] = max(m.totals[2], drift(m))


@njit(cache=True, nogil=True)
def _release(m: Machine, i: int, push: float) -> bool:
    """Let node i go: its forces fall to zero, its displacements follow. push: how fast contact nodes move, see `resolve`."""
    if not _exchange(m, i):
        return False
    n, y, rate = len(m.x), m.response, m.rate
    j = n + i
    force_x, force_z, before_x, before_z = m.inputs[i], m.inputs[j], y[i], y[j]
    _add_two_rows(y, m.tableau, i, -force_x, j, -force_z)
    m.inputs[i], m.inputs[j] = 0.0, 0.0
    m.totals[1] -= 0.5 * (force_x * (y[i] - before_x) + force_z * (y[j] - before_z))
    # The rate is a response like any other: its forces are taken away, the node's own rates were those of the pin.
    rate_x, rate_z = rate[i], rate[j]
    rate[i], rate[j] = push, 0.0
    _add_two_rows(rate, m.tableau, i, -rate_x, j, -rate_z)
    m.counts[1] += 1
    _settle(m, push)
    return True


@njit(cache=True, nogil=True)
def _touch(m: Machine, rules: Rules, i: int, push: float) -> bool:
    """Bring node i into contact, stuck where it is; a penetration is pushed back along z. push: as in `_release`."""
    j = len(m.x) + i
    height = _height(rules, m.x[i] + m.response[i] - m.totals[0])
    if not _exchange(m, i):
        return False
    m.totals[1] -= _glide(m.response, m.tableau, m.inputs, i, 0.0, height - m.inputs[j])
    rate_x, rate_z = m.rate[i], m.rate[j]
    m.rate[i], m.rate[j] = 0.0, 0.0
    _add_two_rows(m.rate, m.tableau, i, push - rate_x, j, -rate_z)
    m.counts[2] += 1
    if not rules.safe[0] <= i <= rules.safe[1]:
        m.counts[4] += 1
    _settle(m, push)
    return True


def _slip_move(
    y: Floats, tableau: Floats, friction: Floats, i: int, xi: float, profile: float | Profile, residual_shear: float
) -> tuple[float, float]:
    """How far node i slips along and down the pin, the others held; infinite where no distance lowers its shear enough.

    Compiled for a smooth pin or a rough one.
    """
    raise NotImplementedError


def _slip_on_smooth(
    y: Floats, tableau: Floats, friction: Floats, i: int, xi: float, curvature: float, residual_shear: float
) -> tuple[float, float]:
    """The shear that exceeds residual_shear·μ_i·pressure is quadratic in the distance, as the pin's height under the node is."""
    n = len(friction)
    share = residual_shear * friction[i] * (1.0 if y[i] > 0.0 else -1.0)
    excess = y[i] + share * y[n + i]
    down = curvature * (tableau[n + i, i] + share * tableau[n + i, n + i])
    linear = tableau[i, i] + share * tableau[i, n + i] + down * xi
    discriminant = linear * linear - 2.0 * down * excess
    if not (linear > 0.0 and discriminant >= 0.0):
        return np.inf, 0.0
    distance = -2.0 * excess / (linear + np.sqrt(discriminant))
    return distance, curvature * distance * (xi + 0.5 * distance)


def _slip_on_rough(
    y: Floats, tableau: Floats, friction: Floats, i: int, xi: float, profile: Profile, residual_shear: float
) -> tuple[float, float]:
    """The same from knot to knot, the way the shear pushes: the node rests where the excess is first gone."""
    n = len(friction)
    share = residual_shear * friction[i] * (1.0 if y[i] > 0.0 else -1.0)
    excess = y[i] + share * y[n + i]
    along = tableau[i, i] + share * tableau[i, n + i]
    down = tableau[n + i, i] + share * tableau[n + i, n + i]
    sense = -1 if excess > 0.0 else 1
    k = _stretch(profile, xi, sense)
    here = xi
    while True:
        linear = along + down * (profile.curvature * here + _slope(profile, k))
        quadratic = -sense * 0.5 * down * profile.curvature
        far = _knot_ahead(profile, k, sense)
        step = _first_root(abs(excess), -linear, quadratic)
        if step <= abs(far - here):
            distance = here - xi + sense * step
            return distance, _rough_height(profile, xi + distance) - _rough_height(profile, xi)
        if abs(far) == np.inf:
            return np.inf, 0.0
        # Rounding must not turn a knot's little rest into an excess of the other sign.
        excess = -sense * max(abs(excess) - linear * abs(far - here) + quadratic * (far - here) ** 2, 0.0)
        here = far
        k += sense


@njit(cache=True, nogil=True)
def _stretch(profile: Profile, xi: float, sense: int) -> int:
    """Number k of the stretch between knots k - 1 and k that a node at ξ enters."""
    if sense > 0:
        return int(np.searchsorted(profile.knots, xi, side="right"))
    return int(np.searchsorted(profile.knots, xi, side="left"))


@njit(cache=True, nogil=True)
def _knot_ahead(profile: Profile, k: int, sense: int) -> float:
    """End of the stretch between knots k - 1 and k in the direction of `sense`."""
    if sense > 0:
        return float(profile.knots[k]) if k < len(profile.knots) else np.inf
    return float(profile.knots[k - 1]) if k > 0 else -np.inf


@njit(cache=True, nogil=True)
def _first_root(constant: float, linear: float, quadratic: float) -> float:
    """Smallest t ≥ 0 at which constant + linear·t + quadratic·t², with constant ≥ 0, falls through 0; infinite if none."""
    discriminant = linear * linear - 4.0 * quadratic * constant
    if discriminant < 0.0:
        return np.inf
    bottom = -linear + np.sqrt(discriminant)
    return float(2.0 * constant / bottom) if bottom > 0.0 else np.inf


@overload(_slip_move, strict=False)
def _choose_slip(y, tableau, friction, i, xi, profile, residual_shear):  # type: ignore[no-untyped-def]
    return _slip_on_rough if isinstance(profile, types.BaseNamedTuple) else _slip_on_smooth


@njit(cache=True, nogil=True)
def _bits(value: float) -> int:
    """A float's bits read as an integer: positive floats keep their order, negative ones stay negative."""
    return int(np.float64(value).view(np.int64))


@njit(cache=True, nogil=True, fastmath={"contract"}, error_model="numpy")
def _look(
    shear: Floats, normal: Floats, limits: Floats, contact: NDArray[np.bool_], tolerance: float
) -> tuple[int, float]:
    """The offender with the largest |shear|/(μ_i·pressure), of ties the one further right, or -1; the largest tension.

    All as maxima of integers, which compilers turn into vector instructions (`error_model` drops a branch that forbids it):
    a ratio's lowest bits give way to the node's place. Ratios nearer than half of what is cut off fall together in at least
    one of two cuts, half a step apart.
    """
    cut, shifted, tension = 0, 0, 0
    for i in range(len(limits)):
        size, allowed = abs(shear[i]), -limits[i] * normal[i]
        ratio = _bits(size / max(allowed, tolerance))
        offends = size - allowed > tolerance
        cut = max(cut, (ratio & ~PLACE) | i if offends else 0)
        shifted = max(shifted, ((ratio + PLACE // 2 + 1) & ~PLACE) | i if offends else 0)
        tension = max(tension, _bits(normal[i] if contact[i] else 0.0))
    worst = max(cut & PLACE, shifted & PLACE) if cut > 0 else -1
    return worst, float(np.int64(tension).view(np.float64))


@njit(cache=True, nogil=True)
def _slip_in_turn(m: Machine, rules: Rules, first: int) -> tuple[int, int, int]:
    """Slip `first` (if any), then the worst offender, the others held, until none is left or a node must be released.

    Returns a status, and RELEASE with its node or NOTHING. The arrays are taken out of the machine once: passing the
    whole of it to another compiled function costs more than a slip.
    """
    n, tolerance, profile, residual_shear = len(m.x), rules.tolerance, rules.profile, rules.residual_shear
    y, tableau, inputs, x, counts, totals = m.response, m.tableau, m.inputs, m.x, m.counts, m.totals
    shear, normal, friction, limits, contact = y[:n], y[n : 2 * n], m.friction, m.limits, m.contact
    displacement = totals[0]
    node = first
    while True:
        if node < 0:
            node, tension = _look(shear, normal, limits, contact, tolerance)
            if tension > tolerance:
                return DONE, RELEASE, _lowest_pressure(m)
            if node < 0:
                return DONE, NOTHING, -1
        if counts[0] >= rules.cascade_limit:
            return CASCADE_LIMIT, NOTHING, -1
        xi = x[node] + inputs[node] - displacement
        along, down = _slip_move(y, tableau, friction, node, xi, profile, residual_shear)
        if not abs(along) < np.inf:
            return SLIP_UNBOUNDED, NOTHING, -1
        totals[1] -= _glide(y, tableau, inputs, node, along, down)
        counts[0] += 1
        counts[3] += 1
        if abs(xi + along) > rules.half_width:
            return DONE, RELEASE, node
        if counts[3] >= REFRESH_SLIPS:
            refresh(m)
        node = -1


@njit(cache=True, nogil=True)
def _slip_together(m: Machine, rules: Rules, first: int) -> tuple[int, int, int]:
    """The same by rounds: every offender of a round slips by the distance it would slip alone."""
    n, tolerance, y, displacement = len(m.x), rules.tolerance, m.response, m.totals[0]
    along, down = np.zeros(n), np.zeros(n)
    while True:
        worst, tension = _look(y[:n], y[n : 2 * n], m.limits, m.contact, tolerance)
        if tension > tolerance:
            return DONE, RELEASE, _lowest_pressure(m)
        if worst < 0 and first < 0:
            return DONE, NOTHING, -1
        if m.counts[0] >= rules.cascade_limit:
            return CASCADE_LIMIT, NOTHING, -1
        for i in range(n):
            along[i] = 0.0
            if abs(y[i]) + m.limits[i] * y[n + i] > tolerance or i == first:
                xi = m.x[i] + m.inputs[i] - displacement
                along[i], down[i] = _slip_move(y, m.tableau, m.friction, i, xi, rules.profile, rules.residual_shear)
                if not abs(along[i]) < np.inf:
                    return SLIP_UNBOUNDED, NOTHING, -1
        left, first = -1, -1
        for i in range(n):
            if along[i] != 0.0:
                m.totals[1] -= _glide(y, m.tableau, m.inputs, i, along[i], down[i])
                m.counts[0] += 1
                m.counts[3] += 1
                if abs(m.x[i] + m.inputs[i] - displacement) > rules.half_width:
                    left = i
        if left >= 0:
            return DONE, RELEASE, left
        if m.counts[3] >= REFRESH_SLIPS:
            refresh(m)


@njit(cache=True, nogil=True)
def _lowest_pressure(m: Machine) -> int:
    n = len(m.x)
    lowest = -1
    for i in range(n):
        if m.contact[i] and (lowest < 0 or m.response[n + i] > m.response[n + lowest]):
            lowest = i
    return lowest


@njit(cache=True, nogil=True)
def _deepest_penetration(m: Machine, rules: Rules) -> int:
    """The free node that lies deepest inside the pin, or -1."""
    n = len(m.x)
    found, deepest = -1, -rules.tolerance_gap
    for i in range(n - 1, -1, -1):
        if not m.contact[i]:
            gap = _height(rules, m.x[i] + m.response[i] - m.totals[0]) - m.response[n + i]
            if gap < deepest:
                found, deepest = i, gap
    return found


@njit(cache=True, nogil=True)
def _change_contact(m: Machine, rules: Rules, kind: int, i: int, push: float) -> int:
    """Release node i or bring it into contact; DONE or why not."""
    if kind == RELEASE:
        if m.contact.sum() == 1:
            return CONTACT_LOST
        return DONE if _release(m, i, push) else SLIP_UNBOUNDED
    if abs(m.x[i]) > rules.half_width or abs(m.x[i] + m.response[i] - m.totals[0]) > rules.half_width:
        # The sharp edge of a punch meets a node that was not under it, or has passed over one within a step of the floor:
        # neither side of the edge is an equilibrium.
        return EDGE_REACHED
    return DONE if _touch(m, rules, i, push) else SLIP_UNBOUNDED


@njit(cache=True, nogil=True)
def resolve(m: Machine, rules: Rules, kind: int, node: int, push: float) -> int:
    """The cascade: answer the trigger, then the worst violation until none is left: tension, then shear, then penetration.

    kind, node: what triggers it; NOTHING, -1 where the cascade begins with its worst violation. push: how far nodes in
    contact move per unit step of the rate: 1 where the pin moves, 0 where the load does. Nodes that take turns in touching
    and leaving for ever are a CONTACT_CYCLE: a change costs what hundreds of slips do, so few are waited for.
    """
    changes, most = 0, 100 + CHANGES_PER_NODE * len(m.x)
    while True:
        if kind in (RELEASE, TOUCH):
            changes += 1
            if changes > most:
                return CONTACT_CYCLE
            status = _change_contact(m, rules, kind, node, push)
            if status != DONE:
                return status
            node = -1
        if rules.simultaneous:
            status, kind, node = _slip_together(m, rules, node)
        else:
            status, kind, node = _slip_in_turn(m, rules, node)
        if status != DONE:
            return status
        if kind == NOTHING:
            node = _deepest_penetration(m, rules)
            if node < 0:
                return _verdict(m, rules)
            kind = TOUCH


@njit(cache=True, nogil=True)
def _verdict(m: Machine, rules: Rules) -> int:
    """DONE where the end of a cascade means something: all numbers finite (none of the comparisons above sees a NaN), and
    no node on a flank steeper than STEEPEST."""
    for k in range(len(m.response)):
        if not abs(m.response[k]) < np.inf:
            return NOT_FINITE
    return STEEP if _steep(m, rules, False) else DONE


@njit(cache=True, nogil=True)
def _steep(m: Machine, rules: Rules, against_friction: bool) -> bool:
    """Whether a node in contact is on a flank steeper than STEEPEST, or than half of its μ_i: there the pressure may drive a
    slip downhill harder than the shear, which falls from μ_i·pressure to none, holds it back."""
    for i in range(len(m.x)):
        if m.contact[i]:
            most = min(0.5 * m.friction[i], STEEPEST) if against_friction and not m.sticks[i] else STEEPEST
            if not abs(_slope_of(rules.profile, m.x[i] + m.inputs[i] - m.totals[0])) <= most:
                return True
    return False


@njit(cache=True, nogil=True)
def next_event(m: Machine, rules: Rules, drift: float) -> tuple[float, int, int]:
    """Smallest step along the rate at which a constraint is reached, with its kind and node; infinite if there is none.

    drift: pin displacement per unit step (1 in sliding, 0 in loading).
    """
    n = len(m.x)
    nearest, kind, node = np.inf, NOTHING, -1
    horizon = _horizon(rules.profile, m)
    for i in range(n - 1, -1, -1):
        if m.contact[i]:
            step, what = _step_to_limit(m, i)
        else:
            step, what = _step_to_touch(m, rules, i, drift, min(nearest, horizon)), TOUCH
        if step < nearest:
            nearest, kind, node = step, what, i
    return nearest, kind, node


def _horizon(profile: float | Profile, m: Machine) -> float:
    """A step beyond which nothing is looked for: going along a rough profile takes time, a smooth one has no such limit."""
    raise NotImplementedError


def _no_horizon(profile: float, m: Machine) -> float:
    return np.inf


def _next_slip_or_release(profile: Profile, m: Machine) -> float:
    nearest = np.inf
    for i in range(len(m.x)):
        if m.contact[i]:
            nearest = min(nearest, _step_to_limit(m, i)[0])
    return nearest * (1.0 + 1e-9)  # what comes first by rounding alone is still seen


@overload(_horizon, strict=False)
def _choose_horizon(profile, m):  # type: ignore[no-untyped-def]
    return _next_slip_or_release if isinstance(profile, types.BaseNamedTuple) else _no_horizon


@njit(cache=True, nogil=True)
def _step_to_limit(m: Machine, i: int) -> tuple[float, int]:
    """Step at which contact node i slips (|shear| = μ_i·pressure) or is released (pressure = 0)."""
    n = len(m.x)
    pressure, pressure_rate = -m.response[n + i], -m.rate[n + i]
    release = max(pressure, 0.0) / -pressure_rate if pressure_rate < 0.0 else np.inf
    mu = m.friction[i]
    slip = np.inf
    if not m.sticks[i]:
        for sign in (1.0, -1.0):
            excess = sign * m.response[i] - mu * pressure
            excess_rate = sign * m.rate[i] - mu * pressure_rate
            if excess_rate > 0.0:
                slip = min(slip, max(-excess, 0.0) / excess_rate)
    if release <= slip * (1.0 + 1e-12):
        return release, RELEASE
    return slip, SLIP


@njit(cache=True, nogil=True)
def _step_to_touch(m: Machine, rules: Rules, i: int, drift: float, nearest: float) -> float:
    """Step at which free node i meets the pin: the gap is quadratic in the step. Of no interest beyond `nearest`."""
    n = len(m.x)
    xi, xi_rate = m.x[i] + m.response[i] - m.totals[0], m.rate[i] - drift
    height, height_rate = m.response[n + i], m.rate[n + i]
    if abs(xi) > rules.half_width:
        # Outside a flat punch: the edge arrives, and meets a node that stands above the punch's face.
        if xi * xi_rate >= 0.0:
            return np.inf
        step = (abs(xi) - rules.half_width * (1.0 - EDGE)) / abs(xi_rate)
        return step if height + height_rate * step >= 0.0 else np.inf
    return float(_step_to_profile(rules.profile, xi, xi_rate, height, height_rate, nearest))


def _step_to_profile(
    profile: float | Profile, xi: float, xi_rate: float, height: float, height_rate: float, nearest: float
) -> float:
    """Step at which a node at ξ and this height meets a pin without edges. Compiled for a smooth pin or a rough one."""
    raise NotImplementedError


def _step_to_smooth(
    curvature: float, xi: float, xi_rate: float, height: float, height_rate: float, nearest: float
) -> float:
    gap = 0.5 * curvature * xi * xi - height
    linear = curvature * xi * xi_rate - height_rate
    quadratic = 0.5 * curvature * xi_rate * xi_rate
    if linear >= 0.0:
        return np.inf
    if gap <= 0.0:
        return 0.0
    discriminant = linear * linear - 4.0 * quadratic * gap
    if discriminant < 0.0:
        return np.inf
    return float(2.0 * gap / (-linear + np.sqrt(discriminant)))


def _step_to_rough(
    profile: Profile, xi: float, xi_rate: float, height: float, height_rate: float, nearest: float
) -> float:
    """From knot to knot, to where the gap first closes; a node that lies inside and closes in has met the pin."""
    sense = 1 if xi_rate > 0.0 else -1
    k = _stretch(profile, xi, sense)
    here, passed, gap = xi, 0.0, _rough_height(profile, xi) - height
    quadratic = 0.5 * profile.curvature * xi_rate * xi_rate
    while passed < nearest:
        linear = (profile.curvature * here + _slope(profile, k)) * xi_rate - height_rate
        far = _knot_ahead(profile, k, sense)
        longest = (far - here) / xi_rate if xi_rate != 0.0 else np.inf
        if linear < 0.0 and gap <= 0.0:
            return passed
        step = _first_root(max(gap, 0.0), linear, quadratic) if gap > 0.0 else np.inf
        if step <= longest:
            return passed + step
        if longest == np.inf:
            return np.inf
        gap += longest * (linear + longest * quadratic)
        passed += longest
        here = far
        k += sense
    return np.inf


@overload(_step_to_profile, strict=False)
def _choose_step(profile, xi, xi_rate, height, height_rate, nearest):  # type: ignore[no-untyped-def]
    return _step_to_rough if isinstance(profile, types.BaseNamedTuple) else _step_to_smooth


@njit(cache=True, nogil=True)
def advance(m: Machine, step: float) -> None:
    """Move the pin by `step`, every contact node stuck to it."""
    m.response[:] += step * m.rate
    for i in range(len(m.x)):
        if m.contact[i]:
            m.inputs[i] += step
    m.totals[0] += step


@njit(cache=True, nogil=True)
def raise_load(m: Machine, rules: Rules, target: float) -> int:
    """Raise the load to `target` event by event, the pin held; slips are counted in `counts`."""
    n = len(m.x)
    floor = 1e-9 * target
    while True:
        left = target + m.inputs[2 * n]
        if left <= 0.0:
            return DONE
        step, kind, node = next_event(m, rules, 0.0)
        last = step >= left
        step = left if last else min(max(step, floor), left)
        m.response[:] += step * m.rate
        m.inputs[2 * n] = -target if step == left else m.inputs[2 * n] - step
        if last:
            kind, node = NOTHING, -1
        status = resolve(m, rules, kind, node, 0.0)
        if status != DONE:
            return status
        if m.counts[4]:
            return OUTGROWN


@njit(cache=True, nogil=True)
def smallest_step(m: Machine, rules: Rules) -> float:
    """The event floor as a length. It is to outlive rounding, so it counts in what stretches the contact to its friction limit
    where that is short: by STRETCHES·event_floor of μ_i·W it may overshoot. In the paper's case a node spacing is shorter. Never
    so little that all forces stay within the tolerance, or δ_p the same."""
    n, stiffness = len(m.x), 0.0
    for i in range(n):
        if m.contact[i]:
            stiffness += abs(m.rate[i]) + m.friction[i] * abs(m.rate[n + i])
    least = 4.5e-16 * m.totals[0]
    if not stiffness > 0.0:
        return float(max(rules.floor * rules.spacing, least))
    unit = min(rules.spacing, STRETCHES * rules.limit / stiffness)
    return float(max(rules.floor * unit, 0.1 * rules.tolerance / stiffness, least))


@njit(cache=True, nogil=True)
def overshoot(m: Machine) -> float:
    """By how much shear exceeds μ_i·pressure, all nodes together."""
    n, total = len(m.x), 0.0
    for i in range(n):
        excess = abs(m.response[i]) + m.limits[i] * m.response[n + i]
        total += excess if excess > 0.0 else 0.0
    return total


@njit(cache=True, nogil=True)
def slide_events(m: Machine, rules: Rules, events: Events, first: int, farthest: float) -> tuple[int, int]:
    """Slide from event to event; returns why it stopped and how many events the record now holds."""
    most = OVERSHOOT * rules.limit + len(m.x) * rules.tolerance
    for e in range(first, len(events.displacement)):
        step, kind, node = next_event(m, rules, 1.0)
        if node < 0 and farthest == np.inf:
            return NO_EVENT, e
        left = farthest - m.totals[0]
        if step >= left:
            advance(m, left)
            return DONE, e
        # A floor beyond the end of the run does not hide the event before it.
        step = min(max(step, smallest_step(m, rules)), left)
        advance(m, step)
        events.displacement[e] = m.totals[0]
        events.force_before[e] = total_shear(m, m.response)
        events.kind[e] = kind
        events.node[e] = rules.offset + node
        m.counts[:3] = 0
        m.totals[1] = 0.0
        status = resolve(m, rules, kind, node, 1.0) if overshoot(m) <= most else OVERSHOT
        if status == DONE and m.totals[1] < -CREATED * m.inputs[-1] * m.inputs[-1] and _steep(m, rules, True):
            status = STEEP
        if status != DONE:
            return status, e
        events.force_after[e] = total_shear(m, m.response)
        events.stiffness[e] = total_shear(m, m.rate)
        events.dissipated[e] = m.totals[1]
        events.slips[e] = m.counts[0]
        events.releases[e] = m.counts[1]
        events.touches[e] = m.counts[2]
        events.contact_size[e] = m.contact.sum()
        if m.counts[4]:
            return OUTGROWN, e + 1
        if m.counts[1] + m.counts[2] > 0 or e % LOOK_EVENTS == 0:
            seat(m, rules)
            m.totals[2] = max(m.totals[2], drift(m))
        if m.totals[2] > DRIFT_LIMIT:
            return DRIFTED, e + 1
    return FULL, len(events.displacement)
