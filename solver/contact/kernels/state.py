"""State of a contact as the kernels hold it, and the constants of a run.

`KernelState` is a tuple of arrays over a window of the surface nodes, i = 0 … n-1. Its `tableau` is the slab's
compliance after a principal pivot on the nodes in contact; the approach is exchanged for the load, which every column
then holds:

    response = inputs @ tableau            (the tableau is stored transposed: row j is the response to input j)
    entry i < n:        u_i is input and f_x,i response in contact; the other way round when free
    entry n + i:        v_i = w_i + approach and f_z,i likewise
    entry 2n:           input -W, response the approach

A slip adds two rows of it to the response; touch and release exchange one node's two entries (a pivot).
"""

from enum import IntEnum
from typing import Any, Final, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.arrays import Floats
from nanoslip.solver.compiled import declare_kernel
from nanoslip.solver.contact.kernels.pivots import Pivots, follow_exchange, follow_exchange_of_node, follow_one

# Kinds of events, and why a kernel stops: each named in this one place.


class EventKind(IntEnum):
    """Change of a node; the first three can trigger an event."""

    SLIP = 0
    RELEASE = 1
    TOUCH = 2
    NOTHING = 3
    """No event, or a cascade that no event triggers."""


class Stop(IntEnum):
    """Reason why a kernel returns. Outcomes for users: `nanoslip.solver.contact.soundness`."""

    DONE = 0
    """Completed as requested."""
    FULL = 1
    """No room for a further event."""
    INACCURATE = 2
    """The equilibrium residual is above its limit: the tableau is to be rebuilt."""
    SLIP_UNBOUNDED = 3
    """No distance lowers a node's shear to its residual, or a pivot is singular."""
    CASCADE_LIMIT = 4
    """More slips in one event than allowed."""
    CONTACT_LOST = 5
    """The last node in contact would have to be released."""
    NO_EVENT = 6
    """No step along the rate reaches a constraint."""
    EDGE_REACHED = 7
    """The edge of a punch has come upon a node."""
    WINDOW_TOO_NARROW = 8
    """A node near the end of the window has touched, or a rough pin could soon meet one beyond it: another is to be set up."""
    CONTACT_CYCLE = 9
    """Nodes touch and are released in turn."""
    OVERSHOT = 10
    """The smallest step exceeds the limits of friction by too much."""
    NOT_FINITE = 11
    """A force or displacement is not a number."""
    STEEP = 12
    """A node in contact is on a flank of the pin above 45°."""
    DOWNHILL = 13
    """Slips have created energy on a flank of the pin that is steep against friction."""


class Scalars(Protocol):
    """Numbers of a state that kernels change: attributes in kernels, items in Python, where attributes of arrays are slow."""

    displacement: float
    """δ_p."""
    pin_rate: float
    """Change of δ_p per unit step along the path: 1 or -1, or 0 where the pin rests."""
    load_rate: float
    """Change of the load per unit step: 1 or -1 where the pin rests."""
    ahead: int
    """Side that counts as ahead in ties: 1 is right, -1 left, the way that the pin moves or last moved."""
    load_work: float
    """Work of the load since the tableau was set up."""
    dissipated: float
    """Energy lost in the current event."""
    residual: float
    """The largest equilibrium residual seen since the tableau was last inverted."""
    slips: int
    """Slips in the current event, as are the next two."""
    releases: int
    touches: int
    slips_since_refresh: int
    """Slips since the response was last summed afresh."""
    changes_since_refresh: int
    """Touches and releases since response and rate were last summed afresh because of them."""
    touches_near_end: int
    """Touches near the ends of the window."""
    pivots: int
    """Number of pivots that some rows of the tableau may not have followed yet (`Pivots`); on a plane the nodes of the exchange
    that are on their other side now, a bit each."""

    def __getitem__(self, name: str) -> Any: ...
    def __setitem__(self, name: str, value: float) -> None: ...


class Plane(NamedTuple):
    """Places of the window's nodes on a plane, where the compliance of two nodes follows from their offset."""

    by_offset: Floats
    """(2, 2, 2m-1, 2m-1) compliance at -(m-1) … m-1 nodes along x and along y from the force, even along y."""
    columns: NDArray[np.int64]
    """(n,) of each node, as are its rows."""
    rows: NDArray[np.int64]
    runs: NDArray[np.int64]
    """First node of each run of neighbours in a column, and n."""


class KernelState(NamedTuple):
    """State of a contact; arrays are changed in place. n nodes in the window, N = 2n + 1 entries."""

    columns: Floats
    """(2n, 2n) surface compliance, row j: displacements per force j; (0, 0) on a plane, where it would be as large as the
    tableau."""
    plane: Plane | None
    """None of nodes in a row."""
    tableau: Floats
    """(N, at least N), row j: response to input j, then padding."""
    response: Floats
    """(N,)"""
    inputs: Floats
    """(N,)"""
    rate: Floats
    """(N,) response per unit step along the path."""
    contact: NDArray[np.bool_]
    """(n,)"""
    x: Floats
    """(n,) positions from the slab's middle."""
    node_friction: Floats
    """(n,) μ_i per node; infinite where a node never slips."""
    active_friction: Floats
    """(n,) μ_i where a node is in contact and may slip; NaN elsewhere."""
    node_strength: Floats
    """(n,) shear that each node bears without pressure: its limit is this plus μ_i times its normal force."""
    node_slips: NDArray[np.int64]
    """(n,) slips of each node in the current event."""
    work: Floats
    """(2, N) scratch space of kernels."""
    scalars: Scalars
    pivots: Pivots


# What a scene does not call for is None in these constants, and is left out of the kernels that are compiled for them.


class Rise(NamedTuple):
    """Height that a rough pin adds to its parabola: straight between knots and level beyond them."""

    knots: Floats
    """Pin coordinates, increasing."""
    heights: Floats
    """(rows, knots) heights at the knots over each row of nodes, or over all nodes alike."""
    rows: NDArray[np.int64]
    """(n,) row of each node in `heights`."""


class KernelPin(NamedTuple):
    """A pin without edges: its height is curvature·ξ²/2 + rise(ξ)."""

    curvature: float
    rise: Rise | None
    """None of a smooth pin."""


class SlipConstants(NamedTuple):
    """Constants of slips and steps during a run."""

    residual_shear: float
    simultaneous: bool | None
    """True where nodes slip together, None if they slip in turn."""
    opposite: float
    """Factor of shear against the drag before it is compared with its limit: -1, or 0 where only shear along it is limited."""
    event_floor: float
    """Event floor in node spacings."""
    load_floor: float
    """Smallest step of the load while the pin rests."""
    spacing: float
    """Distance between surface nodes."""
    friction_bound: float
    """μ_i·W; infinite if nodes never slip."""
    cascade_limit: int
    tolerance: float
    """Force below which a constraint counts as met."""


class KernelConstants(NamedTuple):
    """Constants of a run."""

    slip: SlipConstants
    pin: KernelPin
    half_width: Floats
    """(n,) of the pin over each node's row."""
    across: Floats
    """(n,) height of the pin over each node's row at ξ = 0: y²/2R of a ball, 0 in plane strain."""
    tolerance_gap: float
    """Penetration below which a free node counts as free."""
    outer: NDArray[np.bool_]
    """(n,) True if a node beyond the window may be near when this one touches."""
    window_until: tuple[float, NDArray[np.int64], Floats] | None
    """Displacement of the pin in its direction; nodes at the window's ends and heights of them as the pin sees them, at which one
    beyond could be near though no outer one touches. None for a smooth pin, which meets nodes one after another."""


class Direction(NamedTuple):
    """Direction of a path of pin displacement and load; see `Scalars`."""

    pin_rate: float = 1.0
    load_rate: float = 0.0
    ahead: int = 1


FORWARD: Final = Direction()
"""The pin moves to the right under a constant load."""


@declare_kernel()
def clear(values: NDArray[Any]) -> None:
    """Set all to 0; a slice would take longer to compile."""
    for k in range(len(values)):
        values[k] = 0


@declare_kernel(inline="always")
def start_event(scalars: Scalars, node_slips: NDArray[np.int64]) -> None:
    """Set the counters of an event to 0."""
    clear(node_slips)
    scalars.slips = 0
    scalars.releases = 0
    scalars.touches = 0
    scalars.dissipated = 0.0


# Multiples of a tableau's rows added to a vector: where nearly all the time of sliding goes.


@declare_kernel()
def add_row(total: Floats, factor: float, row: Floats) -> None:
    """total += factor·row, in place; both of equal length."""
    for k in range(len(total)):
        total[k] += factor * row[k]


@declare_kernel()
def advance_quantities(total: Floats, step: float, rate: Floats) -> None:
    """total += step·rate, in place, the product rounded, for quantities linear in the step."""
    for k in range(len(total)):
        total[k] += step * rate[k]


@declare_kernel()
def add_two_rows(total: Floats, rows: Floats, i: int, first: float, j: int, second: float) -> None:
    """Add first·rows[i] + second·rows[j] to `total` in place. rows: a matrix with one column for each element of `total`."""
    for k in range(len(total)):
        total[k] += first * rows[i, k] + second * rows[j, k]


# Height and slope of the pin: a smooth parabola or flat punch, or a rough parabola from knot to knot.

BLUR = 1e-15
"""Rounding of the pin's height, as a share of it."""


@declare_kernel()
def pin_height(constants: KernelConstants, i: int, xi: float) -> float:
    """Height of the pin over node i above its lowest point; infinite beyond its edges."""
    if abs(xi) > constants.half_width[i]:
        return np.inf
    return float(constants.across[i] + face_height(constants.pin.curvature, constants.pin.rise, i, xi))


@declare_kernel()
def face_height(curvature: float, rise: Rise | None, i: int, xi: float) -> float:
    """Height over node i of a pin without edges above its lowest point (of a rough one: of its parabola)."""
    # Lowest point at ξ = 0: curvature 1/R gives the parabola ξ²/2R (model.md), curvature 0 the punch.
    height = 0.5 * curvature * xi * xi
    if rise is None:
        return float(height)
    last = len(rise.knots) - 1
    # Before the first and after the last knot ξ counts as at that knot: the rise is level there.
    k = min(max(int(np.searchsorted(rise.knots, xi, side="right")), 1), last)
    inside = min(max(xi, rise.knots[0]), rise.knots[last])
    along = inside - rise.knots[k - 1]
    knot_height = rise.heights[rise.rows[i], k - 1]
    return float(height + (knot_height + along * rise_slope(rise, i, k)))


@declare_kernel()
def rise_slope(rise: Rise, i: int, k: int) -> float:
    """Slope of the rise over node i between knots k - 1 and k; level before the first and after the last."""
    if not 0 < k < len(rise.knots):
        return 0.0
    row = rise.rows[i]
    climb = rise.heights[row, k] - rise.heights[row, k - 1]
    return float(climb / (rise.knots[k] - rise.knots[k - 1]))


@declare_kernel()
def pin_slope(curvature: float, rise: Rise | None, i: int, xi: float) -> float:
    """Slope of a pin without edges over node i at ξ; at a knot that to its right."""
    if rise is None:
        return curvature * xi
    # Right of a knot, whatever the direction: a node on a knot then has one slope, not the one it came
    # by.
    k = int(np.searchsorted(rise.knots, xi, side="right"))
    return float(curvature * xi + rise_slope(rise, i, k))


@declare_kernel()
def piece_entered(knots: Floats, xi: float, sense: int) -> int:
    """Number k of the piece between knots k - 1 and k that a node at ξ enters."""
    if sense > 0:
        return int(np.searchsorted(knots, xi, side="right"))
    return int(np.searchsorted(knots, xi, side="left"))


@declare_kernel()
def knot_ahead(knots: Floats, k: int, sense: int) -> float:
    """End of the piece between knots k - 1 and k in the direction of `sense`."""
    if sense > 0:
        return float(knots[k]) if k < len(knots) else np.inf
    return float(knots[k - 1]) if k > 0 else -np.inf


@declare_kernel()
def first_root(constant: float, linear: float, quadratic: float) -> float:
    """Smallest t ≥ 0 at which constant + linear·t + quadratic·t², with constant ≥ 0, falls through 0; infinite if none."""
    # (-b ± √D)/2a with b = linear, a = quadratic, c = constant; the smaller root is 2c/(-b + √D), as both have the
    # product c/a.
    discriminant = linear * linear - 4.0 * quadratic * constant
    if discriminant < 0.0:
        return np.inf
    # In this form a vanishing quadratic term is no special case, and nothing cancels while it falls.
    bottom = -linear + np.sqrt(discriminant)
    return float(2.0 * constant / bottom) if bottom > 0.0 else np.inf


# How far one node slips along the pin until its shear has fallen to what a slip leaves.


@declare_kernel(forceinline=True)
def slip_move(
    y: Floats,
    tableau: Floats,
    node_friction: Floats,
    node_strength: Floats,
    i: int,
    xi: float,
    curvature: float,
    rise: Rise | None,
    residual_shear: float,
) -> tuple[float, float]:
    """Distances that node i slips along and down the pin, the others held; infinite if no distance lowers its shear enough.

    On a smooth pin the shear that exceeds residual_shear of the limit is quadratic in the distance, as the pin's height is.
    """
    n = len(node_friction)
    # The normal entry is -pressure: excess is the shear beyond what the slip leaves, both along its sign.
    left = residual_shear * (1.0 if y[i] > 0.0 else -1.0)
    # The node keeps `left` times its limit μ_i p + τ_0·area. A displacement (d, h) changes its forces by the block
    # of the tableau: the excess by along·d + down·h.
    share = left * node_friction[i]
    excess = y[i] + share * y[n + i] - left * node_strength[i]
    along = tableau[i, i] + share * tableau[i, n + i]
    down = tableau[n + i, i] + share * tableau[n + i, n + i]
    if rise is not None:
        return slip_on_rough(excess, along, down, i, xi, curvature, rise)
    # Along the pin the height changes by curvature·(ξ d + d²/2): excess + linear·d + quadratic·d²/2 = 0.
    quadratic = curvature * down
    linear = along + quadratic * xi
    # Below 0 if the excess turns round, at excess - linear²/(2·quadratic), before it vanishes.
    discriminant = linear * linear - 2.0 * quadratic * excess
    # linear ≤ 0: moving back raises the shear, on a steep flank or by a compliance that is not positive definite.
    if not (linear > 0.0 and discriminant >= 0.0):
        return np.inf, 0.0
    # The root nearest to 0, without the cancellation of the usual form where the pin is nearly flat.
    distance = -2.0 * excess / (linear + np.sqrt(discriminant))
    return distance, curvature * distance * (xi + 0.5 * distance)


@declare_kernel()
def slip_on_rough(
    excess: float, along: float, down: float, i: int, xi: float, curvature: float, rise: Rise
) -> tuple[float, float]:
    """Slip of node i on a rough pin, from knot to knot in the direction of its shear: it rests where the excess first vanishes.

    along, down: change of the excess with each displacement.
    """
    sense = -1 if excess > 0.0 else 1
    k = piece_entered(rise.knots, xi, sense)
    here = xi
    # The rise is straight between knots: one quadratic holds up to the next knot and no further.
    while True:
        # Along the slip, s ≥ 0 from `here` on, |excess| falls as |excess| - linear·s + quadratic·s².
        linear = along + down * (curvature * here + rise_slope(rise, i, k))
        quadratic = -sense * 0.5 * down * curvature
        far = knot_ahead(rise.knots, k, sense)
        step = first_root(abs(excess), -linear, quadratic)
        if step <= abs(far - here):
            distance = here - xi + sense * step
            return distance, face_height(curvature, rise, i, xi + distance) - face_height(curvature, rise, i, xi)
        if abs(far) == np.inf:
            return np.inf, 0.0
        # Nearly nothing may be left at a knot: rounding must not give it the other sign.
        remainder = abs(excess) - linear * abs(far - here) + quadratic * (far - here) ** 2
        excess = -sense * max(remainder, 0.0)
        here = far
        k += sense


# Response of the slab to its inputs, its rate as pin or load move, and how far both are from equilibrium.

RESIDUAL_LIMIT = 1e-11
"""Relative residual of the prescribed displacements or of the load at which the tableau is rebuilt."""


@declare_kernel()
def follow_row(state: KernelState, j: int) -> None:
    """Let row j of the tableau follow the pivots that it has not followed yet."""
    _follow_row(state.plane, state, j)


@declare_kernel()
def _follow_row(plane: Plane | None, state: KernelState, j: int) -> None:
    if plane is not None:
        follow_exchange(state.tableau, state.pivots, j, state.scalars.pivots, len(state.x))
    else:
        follow_one(state.tableau, state.pivots, j, state.scalars.pivots, len(state.x))


@declare_kernel()
def _follow_node(plane: Plane | None, state: KernelState, i: int) -> None:
    """Let both tableau rows of node i follow: together on a plane of nodes; one after the other in plane strain, as
    short rows stay in a cache."""
    if plane is not None:
        follow_exchange_of_node(state.tableau, state.pivots, i, state.scalars.pivots, len(state.x))
    else:
        follow_row(state, i)
        follow_row(state, len(state.x) + i)


@declare_kernel(inline="always")
def follow_pivots(state: KernelState, i: int) -> None:
    """Let both rows of node i follow all pivots."""
    followed, pivots = state.pivots.followed, state.scalars.pivots
    if followed[i] != pivots or followed[len(state.x) + i] != pivots:
        _follow_node(state.plane, state, i)


@declare_kernel(entry=True)
def follow_all(state: KernelState) -> None:
    """Let all rows of the tableau follow all pivots, which makes room for others."""
    for i in range(len(state.x)):
        follow_pivots(state, i)
    follow_row(state, 2 * len(state.x))
    clear(state.pivots.followed)
    for k in range(len(state.pivots.nodes)):
        state.pivots.nodes[k] = -1
    state.scalars.pivots = 0


@declare_kernel()
def refresh_response(state: KernelState) -> None:
    """Sum the response afresh from the inputs."""
    # Every slip rounds the response once more: many drift off what the inputs say, a fresh sum does not.
    clear(state.response)
    for j in range(len(state.inputs)):
        # Free nodes bear nothing: their rows are not read, and need not follow the pivots.
        if state.inputs[j] != 0.0:
            if j < 2 * len(state.x):
                follow_pivots(state, j % len(state.x))
            else:
                follow_row(state, j)
            add_row(state.response, state.inputs[j], state.tableau[j])
    state.scalars.slips_since_refresh = 0


@declare_kernel()
def set_rate(state: KernelState) -> None:
    """Set the rate to the response per unit step along the path: contact nodes move with the pin, the load changes."""
    clear(state.rate)
    # A stuck node has u_i = δ_p + s_i and stays at its place on the pin (model.md, In equations): u_i
    # moves with the pin, v_i = w_i + approach does not.
    if state.scalars.pin_rate != 0.0:
        for i in range(len(state.x)):
            if state.contact[i]:
                follow_pivots(state, i)
                add_row(state.rate, state.scalars.pin_rate, state.tableau[i])
    # The last input is -W, hence the minus below.
    if state.scalars.load_rate != 0.0:
        follow_row(state, 2 * len(state.x))
        add_row(state.rate, -state.scalars.load_rate, state.tableau[2 * len(state.x)])


@declare_kernel()
def advance_path(state: KernelState, step: float) -> None:
    """Go on by `step` along the path, every contact node stuck to the pin."""
    last, scalars = 2 * len(state.x), state.scalars
    moved, raised = step * scalars.pin_rate, step * scalars.load_rate
    # The last input is -W: this is the mean load over the step times the change of the approach.
    scalars.load_work += (0.5 * raised - state.inputs[last]) * step * state.rate[last]
    advance_quantities(state.response, step, state.rate)
    for i in range(len(state.x)):
        if state.contact[i]:
            state.inputs[i] += moved
    state.inputs[last] -= raised
    scalars.displacement += moved


@declare_kernel(inline="always")
def count(contact: NDArray[np.bool_]) -> int:
    """Number of nodes in contact; numpy's sum would take longer to compile."""
    nodes = 0
    for i in range(len(contact)):
        nodes += contact[i]
    return nodes


@declare_kernel(entry=True)
def total_shear(contact: NDArray[np.bool_], values: Floats) -> float:
    """Sum of the tangential entries of `values` (response or rate) over the contact, (n,)."""
    total = 0.0
    for i in range(len(contact)):
        if contact[i]:
            total += values[i]
    return total


# Displacements by all forces: a force at a time, in the order of nodes. So each sum has one order, and the same bits however many
# entries a processor adds at once; a sum over the forces on one entry would be fast only in an order that the processor chooses.


@declare_kernel()
def _displace(plane: Plane | None, state: KernelState, seen: Floats, moved: Floats) -> float:
    """Set displacements by the forces on nodes in contact, (2n,), and the magnitudes in their sums; returns the largest one."""
    n, largest = len(state.x), 0.0
    clear(seen)
    clear(moved)
    for i in range(n):
        if state.contact[i]:
            along, down = state.response[i], state.response[n + i]
            if plane is not None:
                _displace_plane(plane, i, along, down, seen, moved)
            else:
                _add_displacements(state.columns[i], state.columns[n + i], along, down, seen, moved)
    for each in moved:
        largest = max(largest, each)
    return largest


@declare_kernel()
def _displace_plane(plane: Plane, i: int, along: float, down: float, seen: Floats, moved: Floats) -> None:
    """Add displacements by the force on node i: of a run of nodes they stand side by side in the table, which is even along y."""
    n, middle, table = len(plane.rows), plane.by_offset.shape[-1] // 2, plane.by_offset
    # On a uniform plane the compliance of two nodes depends on their offset alone: (2m-1)² numbers stand
    # for n².
    for run in range(len(plane.runs) - 1):
        first, end = plane.runs[run], plane.runs[run + 1]
        x = plane.columns[first] - plane.columns[i] + middle
        y = plane.rows[first] - plane.rows[i] + middle
        until = y + end - first
        for component in range(2):
            start, stop = component * n + first, component * n + end
            by_shear, by_pressure = table[component, 0, x, y:until], table[component, 1, x, y:until]
            _add_displacements(by_shear, by_pressure, along, down, seen[start:stop], moved[start:stop])


@declare_kernel()
def _add_displacements(
    by_shear: Floats, by_pressure: Floats, along: float, down: float, seen: Floats, moved: Floats
) -> None:
    """Add displacements by the force on one node, per unit of shear and of normal force, and their magnitudes."""
    for k in range(len(seen)):
        sideways, below = along * by_shear[k], down * by_pressure[k]
        seen[k] += sideways + below
        moved[k] += abs(sideways) + abs(below)


@declare_kernel(entry=True)
def equilibrium_residual(state: KernelState) -> float:
    """Relative distance of the response from equilibrium (see RESIDUAL_LIMIT); the residual, (N,), is left in `state.work[0]`.

    Displacements by the compliance, less inputs and responses; last, the load less all forces. Infinite where a number is
    missing or nothing bears the load.
    """
    n, response, inputs, missing = len(state.x), state.response, state.inputs, state.work[0]
    error, carried = 0.0, 0.0
    for i in range(n):
        if state.contact[i]:
            carried += response[n + i]
    largest = _displace(state.plane, state, missing[: 2 * n], state.work[1, : 2 * n])
    blur = 8.0 * BLUR * abs(response[2 * n])  # far out on a sharp pin heights are more than all the load displaces
    for row in range(2 * n):
        # Entries are v = w + approach, and the compliance gives w.
        seen = missing[row]
        if row >= n:
            seen += response[2 * n]
        # In contact displacements are given, elsewhere they are what responds.
        missing[row] = inputs[row] - seen if state.contact[row % n] else seen - response[row]
        off = abs(missing[row]) - blur
        if not off <= error:
            error = off if off < np.inf else np.inf  # NaN becomes infinite, which no later number replaces
    missing[2 * n] = inputs[2 * n] - carried
    unborne = abs(missing[2 * n] / inputs[2 * n])
    if not (largest > 0.0 and unborne < np.inf):
        return np.inf
    # A sum is known to the rounding of the magnitudes in it, which its own value may be far below.
    return float(max(error / largest, unborne))


@declare_kernel(inline="always")
def _refine(state: KernelState) -> None:
    """One step of iterative refinement, where the response of a fresh tableau leaves a residual.

    An inverse alone loses the digits of its condition number; an inverse and its residual do not.
    """
    n, missing = len(state.x), state.work[0]
    # A step costs as much as all nodes in contact slipping once: not where there is nothing to gain.
    if not equilibrium_residual(state) > 0.01 * RESIDUAL_LIMIT:
        return
    for i in range(n):
        if state.contact[i]:
            follow_pivots(state, i)
            add_two_rows(state.response, state.tableau, i, missing[i], n + i, missing[n + i])
    follow_row(state, 2 * n)
    add_row(state.response, missing[2 * n], state.tableau[2 * n])
    # Once more for the corrected forces: free nodes then lack displacement alone, which can be added as it is.
    equilibrium_residual(state)
    for i in range(n):
        if not state.contact[i]:
            state.response[i] += missing[i]
            state.response[n + i] += missing[n + i]


@declare_kernel(entry=True)
def respond(state: KernelState) -> None:
    """Recompute response and rate from a fresh tableau."""
    refresh_response(state)
    _refine(state)
    set_rate(state)
