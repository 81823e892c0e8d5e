"""Compiled events: displacement, release and touch of nodes; violations, cascades, the next event along a path."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.arrays import Floats
from nanoslip.solver.compiled import declare_kernel
from nanoslip.solver.contact.kernels.pivots import Pivots, find_place
from nanoslip.solver.contact.kernels.state import (
    BLUR,
    EventKind,
    KernelConstants,
    KernelState,
    Plane,
    Rise,
    Stop,
    add_two_rows,
    count,
    equilibrium_residual,
    face_height,
    first_root,
    follow_all,
    follow_pivots,
    knot_ahead,
    piece_entered,
    pin_height,
    pin_slope,
    refresh_response,
    rise_slope,
    set_rate,
    slip_move,
)

REFRESH_CHANGES = 64
"""Touches and releases after which response and rate are summed afresh."""


@declare_kernel()
def _has_room(plane: Plane | None, pivots: Pivots, pivot_count: int, i: int) -> bool:
    """True if a pivot of node i can be noted, beside `Scalars.pivots`."""
    if plane is not None:
        return find_place(pivots.nodes, i) < len(pivots.nodes)
    return pivot_count < len(pivots.nodes)


@declare_kernel()
def _note_pivot(plane: Plane | None, state: KernelState, i: int, ia: float, ib: float, ic: float, id_: float) -> None:
    """Note the pivot of node i, for rows that follow later. ia … id_: A⁻¹."""
    n, pivots, scalars = len(state.x), state.pivots, state.scalars
    if plane is not None:
        place = find_place(pivots.nodes, i)
        pivots.nodes[place] = i
        scalars.pivots ^= 1 << place
        return
    k = scalars.pivots
    pivots.nodes[k] = i
    inverse = pivots.inverses[k]
    inverse[0], inverse[1] = ia, ib
    inverse[2], inverse[3] = ic, id_
    for j in range(state.tableau.shape[1]):
        pivots.rows[k, 0, j] = state.tableau[i, j]
        pivots.rows[k, 1, j] = state.tableau[n + i, j]
    scalars.pivots = k + 1


@declare_kernel()
def _follow_in_exchange(plane: Plane | None, state: KernelState) -> None:
    """Let the rows of the exchange on a plane follow the last pivot, as other rows follow by means of these."""
    if plane is not None:
        for k in range(len(state.pivots.nodes)):
            if state.pivots.nodes[k] >= 0:
                follow_pivots(state, state.pivots.nodes[k])


@declare_kernel(entry=True)
def pivot(state: KernelState, i: int) -> bool:
    """Exchange inputs and responses of node i (a principal pivot with a 2 × 2 block); False where the block is singular."""
    n = len(state.x)
    p, q = i, n + i
    t, pivots, scalars = state.tableau, state.pivots, state.scalars
    # Full: a row that lags behind could never follow a pivot that is not noted.
    if not _has_room(state.plane, pivots, scalars.pivots, i):
        follow_all(state)
    follow_pivots(state, i)
    # The block itself is [[a, b], [c, d]]: storage is transposed.
    a, b = t[p, p], t[q, p]
    c, d = t[p, q], t[q, q]
    determinant = a * d - b * c
    scale = abs(a * d) + abs(b * c)
    # A difference of two products keeps no digit below some dozens of machine epsilon. NaN counts as singular too.
    if not abs(determinant) > 1e-14 * scale:
        return False
    # Responses of the node y = A x + rest, solved for its inputs: x = A⁻¹ (y - rest).
    ia, ib, ic, id_ = d / determinant, -b / determinant, -c / determinant, a / determinant
    row_p, row_q = t[p], t[q]
    _note_pivot(state.plane, state, i, ia, ib, ic, id_)
    # These two rows change here and now; every other one follows when it is next read.
    pivots.followed[p], pivots.followed[q] = scalars.pivots, scalars.pivots
    for j in range(2 * n + 1):  # whole rows at once would take numba longer to compile
        first, second = row_p[j], row_q[j]
        row_p[j], row_q[j] = ia * first + ic * second, ib * first + id_ * second
    # The loop has run over the block too and left the unit matrix there, where A⁻¹ belongs.
    t[p, p], t[p, q] = ia, ic
    t[q, p], t[q, q] = ib, id_
    _follow_in_exchange(state.plane, state)
    for row in (p, q):
        state.inputs[row], state.response[row] = state.response[row], state.inputs[row]
    state.contact[i] = not state.contact[i]
    # NaN keeps a node out of every comparison with its limit: one that is free, or never slips.
    state.active_friction[i] = (
        state.node_friction[i] if state.contact[i] and state.node_friction[i] < np.inf else np.nan
    )
    return True


@declare_kernel(inline="always")
def displace(y: Floats, tableau: Floats, inputs: Floats, i: int, along: float, down: float) -> float:
    """Displace contact node i by (along, down); returns the work ∫ f·du that its forces do on the slab."""
    j = len(y) // 2 + i
    before_x, before_z = y[i], y[j]
    add_two_rows(y, tableau, i, along, j, down)
    inputs[i] += along
    inputs[j] += down
    # Forces are linear along the straight way, so the mean of both ends is exact.
    return float(0.5 * ((before_x + y[i]) * along + (before_z + y[j]) * down))


@declare_kernel(entry=True)
def project_onto_pin(state: KernelState, constants: KernelConstants) -> bool:
    """Move contact nodes that the rounding of many slips has lifted off the pin back onto it; whether there were any."""
    n, moved = len(state.x), False
    for i in range(n):
        if state.contact[i]:
            height = pin_height(constants, i, state.x[i] + state.inputs[i] - state.scalars.displacement)
            lift = height - state.inputs[n + i]
            # Beyond the edge of a punch there is no height to go back to.
            if abs(lift) > constants.slip.tolerance + BLUR * abs(height) and height < np.inf:
                follow_pivots(state, i)
                displace(state.response, state.tableau, state.inputs, i, 0.0, lift)
                moved = True
    return moved


@declare_kernel(inline="always")
def _refresh_after_changes(state: KernelState) -> None:
    """Recompute response, rate and equilibrium residual from time to time, after changes of the contact."""
    state.scalars.changes_since_refresh += 1
    if state.scalars.changes_since_refresh < REFRESH_CHANGES:
        return
    state.scalars.changes_since_refresh = 0
    refresh_response(state)
    set_rate(state)
    # The response has just been summed: what residual is left is the tableau's own, from its pivots.
    state.scalars.residual = max(state.scalars.residual, equilibrium_residual(state))


@declare_kernel(inline="always")
def _release(state: KernelState, i: int) -> bool:
    """Release node i: its forces fall to zero, its displacements follow."""
    if not pivot(state, i):
        return False
    n, y, rate = len(state.x), state.response, state.rate
    j = n + i
    force_x, force_z = state.inputs[i], state.inputs[j]
    before_x, before_z = y[i], y[j]
    # The pivot alone moves nothing: it only makes the forces inputs, which can be taken away.
    add_two_rows(y, state.tableau, i, -force_x, j, -force_z)
    state.inputs[i], state.inputs[j] = 0.0, 0.0
    # Forces that fall to 0 in proportion to the displacement do half of the work of constant ones.
    constant_work = force_x * (y[i] - before_x) + force_z * (y[j] - before_z)
    state.scalars.dissipated -= 0.5 * constant_work
    # The rate is a response like any other: its forces are taken away, the node's own rates were those of the pin.
    rate_x, rate_z = rate[i], rate[j]
    rate[i], rate[j] = state.scalars.pin_rate, 0.0
    add_two_rows(rate, state.tableau, i, -rate_x, j, -rate_z)
    state.scalars.releases += 1
    return True


@declare_kernel(inline="always")
def _touch(state: KernelState, constants: KernelConstants, i: int) -> bool:
    """Bring node i into contact, stuck where it is; a penetration is pushed back along z."""
    j = len(state.x) + i
    # Before the pivot: as long as the node is free its u is a response.
    height = pin_height(constants, i, state.x[i] + state.response[i] - state.scalars.displacement)
    if not pivot(state, i):
        return False
    lift = height - state.inputs[j]
    state.scalars.dissipated -= displace(state.response, state.tableau, state.inputs, i, 0.0, lift)
    rate_x, rate_z = state.rate[i], state.rate[j]
    # A free node's forces stay 0 while it moves; from now on it moves with the pin, and they change.
    state.rate[i], state.rate[j] = 0.0, 0.0
    add_two_rows(state.rate, state.tableau, i, state.scalars.pin_rate - rate_x, j, -rate_z)
    state.scalars.touches += 1
    if constants.outer[i]:
        state.scalars.touches_near_end += 1
    return True


# Which constraint of contact and friction is violated worst, and where the pin is too steep for them.

STEEPEST = 1.0
"""Slope of the pin under a node in contact beyond which forces along and across the slab are not shear and pressure."""

CREATED = 1e-14
"""Energy that rounding may create in one event, as a share of W²/G, the load times the displacement that it
causes."""

# 16 bits number 65,536 nodes: a tableau of as many, (2n + 1)² numbers, would take 137 GB.
PLACE = 0xFFFF
"""Lowest bits of a shear ratio, 2^-36 of it, that give way to the node's place: nearer ratios are ties."""
TIE = 2.0**-36
"""Relative difference below which two events tie: then the event further ahead comes first. 2^-36, as for PLACE."""
HALF_PLACE = PLACE // 2 + 1
"""Added to a ratio before it is cut: ratios that one cut separates though they are ties, the other does not."""


@declare_kernel(inline="always")
def bits(value: float) -> int:
    """A float's bits read as an integer: positive floats keep their order, negative ones stay negative."""
    return int(np.float64(value).view(np.int64))


@declare_kernel(inline="always")
def from_front(k: int, n: int, ahead: int) -> int:
    """Node number k of n, counted from 0 at the side ahead."""
    return n - 1 - k if ahead > 0 else k


@declare_kernel(inline="always")
def reversing_bits(ahead: int) -> int:
    """Bits that turn a node's number round, so that nodes rank higher further ahead: none if that is to the right."""
    return 0 if ahead > 0 else PLACE


@declare_kernel(inline="always")
def rank_ratio(ratio: int, place: int) -> int:
    """The bits of a shear ratio, the lowest of them replaced by the node's place, which is larger further ahead."""
    return (ratio & ~PLACE) | place


@declare_kernel(inline="always")
def highest_ranked(cut: int, shifted: int, turned: int) -> int:
    """The node in the largest rank of either cut, or -1 if both are 0. turned: as from `reversing_bits`."""
    return max(cut & PLACE, shifted & PLACE) ^ turned if cut > 0 else -1


@declare_kernel(inline="always")
def limit_shear(shear: float, opposite: float) -> float:
    """Shear limited by friction: its magnitude, or its part along the drag (see `SlipConstants.opposite`)."""
    return max(shear, opposite * shear)


@declare_kernel(error_model="numpy")
def worst_violation(
    shear: Floats,
    normal: Floats,
    active_friction: Floats,
    node_strength: Floats,
    contact: NDArray[np.bool_],
    tolerance: float,
    opposite: float,
    ahead: int,
) -> tuple[int, float]:
    """The node with the largest limited shear over its limit (of ties the node further ahead), or -1; the largest
    tension.

    A node without shear never counts. Both are maxima of integers, for vector instructions: a ratio's lowest bits
    hold the node. Ratios nearer than half of the cut coincide in at least one of two cuts, half a step apart.
    """
    cut, shifted, tension, turned = 0, 0, 0, reversing_bits(ahead)
    for i in range(len(active_friction)):
        # Normal entries are forces on the slab, so pressure is their negative.
        size, allowed = limit_shear(shear[i], opposite), node_strength[i] - active_friction[i] * normal[i]
        # Where the limit is 0 or below, the tolerance keeps the ratio finite and in order of the shear.
        ratio = bits(size / max(allowed, tolerance))
        # `&`, as `and` is a branch, which keeps a loop from vector instructions. With μ_i above 1 a tension within the
        # tolerance lowers the limit by more than that: without its second half a node without shear would offend.
        offends = (size - allowed > tolerance) & (size > tolerance)
        cut = max(cut, rank_ratio(ratio, i ^ turned) if offends else 0)
        shifted = max(shifted, rank_ratio(ratio + HALF_PLACE, i ^ turned) if offends else 0)
        tension = max(tension, bits(normal[i] if contact[i] else 0.0))
    return highest_ranked(cut, shifted, turned), float(np.int64(tension).view(np.float64))


@declare_kernel()
def largest_tension(state: KernelState, constants: KernelConstants) -> int:
    """The node in contact with the largest tension, of ties the node further ahead, or -1."""
    n = len(state.x)
    found, largest = -1, 0.0
    for k in range(n):
        i = from_front(k, n, state.scalars.ahead)
        # From the front on, and only by more than the tolerance: of ties the first one that is met stays.
        if state.contact[i] and state.response[n + i] > largest + constants.slip.tolerance:
            found, largest = i, state.response[n + i]
    return found


@declare_kernel(inline="always")
def deepest_penetration(state: KernelState, constants: KernelConstants) -> int:
    """The free node that lies deepest inside the pin, of ties the node further ahead, or -1."""
    n = len(state.x)
    found, deepest = -1, 0.0
    # The deepest first: its force pushes its neighbours down too, which may take them out of the pin.
    for k in range(n):
        i = from_front(k, n, state.scalars.ahead)
        if not state.contact[i]:
            xi = state.x[i] + state.response[i] - state.scalars.displacement
            gap = pin_height(constants, i, xi) - state.response[n + i]
            if gap < deepest - constants.tolerance_gap:
                found, deepest = i, gap
    return found


@declare_kernel(inline="always")
def is_on_steep_flank(state: KernelState, constants: KernelConstants, against_friction: bool) -> bool:
    """True if a node in contact is on a flank steeper than STEEPEST, or than half of its limit over its pressure. There the
    pressure may drive a slip downhill harder than the shear resists, which falls from the limit to zero."""
    n = len(state.x)
    for i in range(len(state.x)):
        if state.contact[i]:
            most = STEEPEST
            if against_friction:
                # On a way d downhill the pressure does the work p·slope·d; shear that falls evenly from its limit to 0
                # takes up half of limit·d. Half of limit/p is the slope at which both are equal.
                pressed = max(-state.response[n + i], constants.slip.tolerance)
                most = min(0.5 * (state.node_friction[i] + state.node_strength[i] / pressed), STEEPEST)
            xi = state.x[i] + state.inputs[i] - state.scalars.displacement
            if not abs(pin_slope(constants.pin.curvature, constants.pin.rise, i, xi)) <= most:
                return True
    return False


@declare_kernel(inline="always")
def driven_downhill(state: KernelState, constants: KernelConstants) -> bool:
    """True if slips have created energy and a node is on a flank that is steep against its friction: they may never end."""
    load = state.inputs[-1]
    return bool(state.scalars.dissipated < -CREATED * load * load and is_on_steep_flank(state, constants, True))


# The cascade: what triggers an event is answered, then the worst violation until none is left.

# 65,536 roundings of 1.1e-16 add up to 3e-14 at random and to 7e-12 at worst.
REFRESH_SLIPS = 65536
"""Slips after which the response is summed afresh: rounding of a vector sum stays below 1e-12."""

CHANGES_PER_NODE = 20
"""Touches and releases in one cascade, per node, after which they count as a cycle."""


@declare_kernel(inline="always")
def _refresh_is_downhill(state: KernelState, constants: KernelConstants) -> bool:
    """Sum the response afresh where that is due; whether energy has then come from a flank."""
    if state.scalars.slips_since_refresh < REFRESH_SLIPS:
        return False
    refresh_response(state)
    return driven_downhill(state, constants)


@declare_kernel()
def _slip_in_turn(state: KernelState, constants: KernelConstants, first: int) -> tuple[Stop, EventKind, int]:
    """Slip `first` (if any), then the worst offender, the others held, until none is left or a node must be released.

    Returns why it stops, and RELEASE with its node or NOTHING with -1. The arrays are taken out of the state once,
    not for every slip.
    """
    n, tolerance, residual_shear = len(state.x), constants.slip.tolerance, constants.slip.residual_shear
    curvature, rise = constants.pin.curvature, constants.pin.rise
    y, tableau, inputs, x, scalars = state.response, state.tableau, state.inputs, state.x, state.scalars
    shear, normal, contact = y[:n], y[n : 2 * n], state.contact
    node_friction, active_friction, node_slips = state.node_friction, state.active_friction, state.node_slips
    node_strength = state.node_strength
    displacement, opposite = scalars.displacement, constants.slip.opposite
    # The trigger slips unasked: it is at its limit, though rounding may leave its shear a little below.
    node = first
    # One node at a time: all others are held (model.md, In words, 4), so that a slip is two rows of the
    # tableau.
    while True:
        if node < 0:
            node, tension = worst_violation(
                shear, normal, active_friction, node_strength, contact, tolerance, opposite, scalars.ahead
            )
            # Before any slip: friction is no law for a node that pulls.
            if tension > tolerance:
                return Stop.DONE, EventKind.RELEASE, largest_tension(state, constants)
            if node < 0:
                return Stop.DONE, EventKind.NOTHING, -1
        if scalars.slips >= constants.slip.cascade_limit:
            return Stop.CASCADE_LIMIT, EventKind.NOTHING, -1
        xi = x[node] + inputs[node] - displacement
        follow_pivots(state, node)
        along, down = slip_move(y, tableau, node_friction, node_strength, node, xi, curvature, rise, residual_shear)
        # NaN ends here as well.
        if not abs(along) < np.inf:
            return Stop.SLIP_UNBOUNDED, EventKind.NOTHING, -1
        scalars.dissipated -= displace(y, tableau, inputs, node, along, down)
        node_slips[node] += 1
        scalars.slips += 1
        scalars.slips_since_refresh += 1
        # Slipped off the edge of a punch; a parabola's half-width is infinite.
        if abs(xi + along) > constants.half_width[node]:
            return Stop.DONE, EventKind.RELEASE, node
        if _refresh_is_downhill(state, constants):
            return Stop.DOWNHILL, EventKind.NOTHING, -1
        node = -1


@declare_kernel()
def _slip_together(state: KernelState, constants: KernelConstants, first: int) -> tuple[Stop, EventKind, int]:
    """Resolve a cascade in rounds: every offender of a round slips by the distance it would slip alone."""
    n, tolerance, y, displacement = len(state.x), constants.slip.tolerance, state.response, state.scalars.displacement
    opposite = constants.slip.opposite
    along, down = state.work[0], state.work[1]
    while True:
        worst, tension = worst_violation(
            y[:n],
            y[n : 2 * n],
            state.active_friction,
            state.node_strength,
            state.contact,
            tolerance,
            opposite,
            state.scalars.ahead,
        )
        if tension > tolerance:
            return Stop.DONE, EventKind.RELEASE, largest_tension(state, constants)
        if worst < 0 and first < 0:
            return Stop.DONE, EventKind.NOTHING, -1
        if state.scalars.slips >= constants.slip.cascade_limit:
            return Stop.CASCADE_LIMIT, EventKind.NOTHING, -1
        for i in range(n):
            # All distances are found before any node moves, so that the order of nodes does not matter.
            along[i] = 0.0
            size = limit_shear(y[i], opposite)
            beyond = size + state.active_friction[i] * y[n + i] - state.node_strength[i]
            offends = size > tolerance and beyond > tolerance
            if offends or i in (first, worst):  # the worst one may offend by the rounding of the search alone
                xi = state.x[i] + state.inputs[i] - displacement
                follow_pivots(state, i)
                along[i], down[i] = slip_move(
                    y,
                    state.tableau,
                    state.node_friction,
                    state.node_strength,
                    i,
                    xi,
                    constants.pin.curvature,
                    constants.pin.rise,
                    constants.slip.residual_shear,
                )
                if not abs(along[i]) < np.inf:
                    return Stop.SLIP_UNBOUNDED, EventKind.NOTHING, -1
        # The trigger slips unasked in the first round only.
        # Each distance ignores that neighbours slip too: what is left over its limit slips again in the next
        # round.
        left, first = -1, -1
        for i in range(n):
            if along[i] != 0.0:
                state.scalars.dissipated -= displace(y, state.tableau, state.inputs, i, along[i], down[i])
                state.node_slips[i] += 1
                state.scalars.slips += 1
                state.scalars.slips_since_refresh += 1
                if abs(state.x[i] + state.inputs[i] - displacement) > constants.half_width[i]:
                    left = i
        if left >= 0:
            return Stop.DONE, EventKind.RELEASE, left
        if _refresh_is_downhill(state, constants):
            return Stop.DOWNHILL, EventKind.NOTHING, -1


@declare_kernel()
def _slip_offenders(
    state: KernelState, constants: KernelConstants, first: int, simultaneous: bool | None
) -> tuple[Stop, EventKind, int]:
    """Slips in the order of the slip rule."""
    if simultaneous is None:
        return _slip_in_turn(state, constants, first)
    return _slip_together(state, constants, first)


@declare_kernel(inline="always")
def _change_contact(state: KernelState, constants: KernelConstants, kind: EventKind, i: int) -> Stop:
    """Release node i or bring it into contact; DONE or why not."""
    if kind == EventKind.RELEASE:
        # Without any node the load is borne by nothing, and the approach has no value.
        if count(state.contact) == 1:
            return Stop.CONTACT_LOST
        changed = _release(state, i)
    else:
        xi = state.x[i] + state.response[i] - state.scalars.displacement
        if abs(state.x[i]) > constants.half_width[i] or abs(xi) > constants.half_width[i]:
            # The sharp edge of a punch meets a node that was not under it, or has passed over one within a step of the floor:
            # neither side of the edge is an equilibrium.
            return Stop.EDGE_REACHED
        changed = _touch(state, constants, i)
    if not changed:
        return Stop.SLIP_UNBOUNDED
    _refresh_after_changes(state)
    return Stop.DONE


@declare_kernel(entry=True)
def resolve_violations(state: KernelState, constants: KernelConstants) -> Stop:
    """The cascade that begins with the worst violation, for Python: to look at the type of a kind takes longer than this."""
    # A literal -1 is a type of its own, for which all of the cascade would be compiled once more.
    return resolve(state, constants, EventKind.NOTHING, np.int64(-1))  # type: ignore[arg-type]


@declare_kernel()
def resolve(state: KernelState, constants: KernelConstants, kind: EventKind, node: int) -> Stop:
    """The cascade: answer the trigger (or NOTHING, -1), then the worst violation until none is left: tension, shear, penetration.

    Nodes that touch and leave in turns are a CONTACT_CYCLE, found early because a touch costs hundreds of slips.
    """
    changes, most = 0, 100 + CHANGES_PER_NODE * len(state.x)
    while True:
        if kind in (EventKind.RELEASE, EventKind.TOUCH):
            changes += 1
            if changes > most:
                return Stop.CONTACT_CYCLE
            status = _change_contact(state, constants, kind, node)
            if status != Stop.DONE:
                return status
            # The change of contact was the answer to the trigger: no node slips unasked.
            node = -1
        status, kind, node = _slip_offenders(state, constants, node, constants.slip.simultaneous)
        if status != Stop.DONE:
            return status
        if kind == EventKind.NOTHING:
            # Last, as a touch costs a pivot of the tableau, hundreds of slips.
            node = deepest_penetration(state, constants)
            if node < 0:
                return _soundness(state, constants)
            kind = EventKind.TOUCH


@declare_kernel(inline="always")
def _soundness(state: KernelState, constants: KernelConstants) -> Stop:
    """DONE if the end of a cascade is valid: all numbers are finite (no comparison above detects a NaN), and no node
    is on a flank steeper than STEEPEST."""
    for k in range(len(state.response)):
        if not abs(state.response[k]) < np.inf:
            return Stop.NOT_FINITE
    return Stop.STEEP if is_on_steep_flank(state, constants, False) else Stop.DONE


# The next event along the rate: the smallest step at which a node slips, is released or touches.


class _NodeForces(NamedTuple):
    """Forces on a node, their rates along the path, and what limits its shear: friction times pressure, plus strength."""

    shear: float
    normal: float
    shear_rate: float
    normal_rate: float
    friction: float
    strength: float


EDGE = 1e-9
"""Relative distance inside a punch's edge at which a node counts as under it."""


@declare_kernel()
def next_event(state: KernelState, constants: KernelConstants, blur: float) -> tuple[float, EventKind, int]:
    """Smallest step along the path at which a constraint is reached, with its kind and node; infinite if there is none.

    Of ties (within TIE, or within `blur`, the rounding error of a step) it is the node further ahead: which of two mirror nodes
    comes first is not left to rounding.
    """
    n, opposite = len(state.x), constants.slip.opposite
    y, rate, steps = state.response, state.rate, state.work[0, : len(state.x)]
    friction, strength = state.node_friction, state.node_strength
    # All is linear in the step but gaps, which are quadratic: each node has its step in closed form.
    _find_steps_to_limits(y[:n], y[n : 2 * n], rate[:n], rate[n : 2 * n], friction, strength, opposite, steps)
    # Slips and releases are cheap to find: once known, no search along a rough pin goes further.
    horizon = _horizon(constants.pin.rise, state.contact, steps)
    nearest, kind, node = np.inf, EventKind.NOTHING, -1
    for k in range(n):
        i = from_front(k, n, state.scalars.ahead)
        step = steps[i] if state.contact[i] else _step_to_touch(state, constants, i, min(nearest, horizon))
        # Of ties the first node met stays, but the step is the smallest of theirs: no limit is passed.
        if step < nearest * (1.0 - TIE) - blur:
            node = i
        nearest = min(nearest, step)
    if node >= 0:
        kind = EventKind.TOUCH
        if state.contact[node]:
            forces = _NodeForces(y[node], y[n + node], rate[node], rate[n + node], friction[node], strength[node])
            released = _comes_first(_step_to_release(forces), _step_to_slip(forces, opposite))
            kind = EventKind.RELEASE if released else EventKind.SLIP
    return nearest, kind, node


@declare_kernel()
def _horizon(rise: Rise | None, contact: NDArray[np.bool_], steps: Floats) -> float:
    """Step beyond which touches are not searched: that of the next slip or release, as a search along a rough pin takes time.

    steps: of nodes in contact to their limits."""
    nearest = np.inf
    if rise is None:
        return nearest
    for i in range(len(contact)):
        if contact[i]:
            nearest = min(nearest, steps[i])
    return float(nearest * (1.0 + 1e-9))  # what comes first by rounding alone is still seen


@declare_kernel(error_model="numpy")
def _find_steps_to_limits(
    shear: Floats,
    normal: Floats,
    shear_rate: Floats,
    normal_rate: Floats,
    node_friction: Floats,
    node_strength: Floats,
    opposite: float,
    steps: Floats,
) -> None:
    """Find the steps at which contact nodes slip (limited shear = its limit) or are released (pressure = 0), all (n,); of free
    nodes they mean nothing. In a loop without branches, for vector instructions."""
    for i in range(len(steps)):
        forces = _NodeForces(shear[i], normal[i], shear_rate[i], normal_rate[i], node_friction[i], node_strength[i])
        slip, release = _step_to_slip(forces, opposite), _step_to_release(forces)
        steps[i] = release if _comes_first(release, slip) else slip


@declare_kernel(inline="always")
def _step_to_release(node: _NodeForces) -> float:
    """Step at which a node's pressure, the negative of its normal entry, is 0."""
    # Below 0 by rounding: released where it is, not at a step back.
    return max(-node.normal, 0.0) / node.normal_rate if node.normal_rate > 0.0 else np.inf


@declare_kernel(inline="always")
def _step_to_slip(node: _NodeForces, opposite: float) -> float:
    """Step at which a node's limited shear is its limit."""
    # The factor 0 stands for shear against the drag that is not limited: it has no limit to reach.
    forward, backward = _step_of_sign(1.0, node), _step_of_sign(opposite, node)
    return min(forward, backward if opposite != 0.0 else np.inf)


@declare_kernel(inline="always")
def _step_of_sign(sign: float, node: _NodeForces) -> float:
    """Step at which a node's shear of this sign is its limit."""
    pressure, pressure_rate = -node.normal, -node.normal_rate
    # Shear and pressure are linear in the step, and so is ±shear - (μ_i p + τ_0·area), which rises to 0.
    excess = sign * node.shear - node.friction * pressure - node.strength
    excess_rate = sign * node.shear_rate - node.friction * pressure_rate
    # `&`, as `and` is a branch. An infinite μ_i has no limit.
    return max(-excess, 0.0) / excess_rate if (excess_rate > 0.0) & (node.friction < np.inf) else np.inf


@declare_kernel(inline="always")
def _comes_first(release: float, slip: float) -> bool:
    """True if a node is released, not slipped; both at once: it has nothing left that presses it to the pin, and goes with the
    shear that it bears."""
    return release <= slip * (1.0 + 1e-12)


@declare_kernel(inline="always")
def _step_to_touch(state: KernelState, constants: KernelConstants, i: int, nearest: float) -> float:
    """Step at which free node i meets the pin: the gap is quadratic in the step. Of no interest beyond `nearest`."""
    n = len(state.x)
    scalars = state.scalars
    xi = state.x[i] + state.response[i] - scalars.displacement
    xi_rate = state.rate[i] - scalars.pin_rate
    height, height_rate = state.response[n + i] - constants.across[i], state.rate[n + i]
    if abs(xi) > constants.half_width[i]:
        # Outside a flat punch: the edge arrives, and meets a node that stands above the punch's face.
        if xi * xi_rate >= 0.0:
            return np.inf
        # Just inside, as exactly at the edge rounding decides whether the node is under the punch.
        step = (abs(xi) - constants.half_width[i] * (1.0 - EDGE)) / abs(xi_rate)
        return step if height + height_rate * step >= 0.0 else np.inf
    pin = constants.pin
    return float(_step_to_profile(pin.curvature, pin.rise, i, xi, xi_rate, height, height_rate, nearest))


@declare_kernel(forceinline=True)
def _step_to_profile(
    curvature: float,
    rise: Rise | None,
    i: int,
    xi: float,
    xi_rate: float,
    height: float,
    height_rate: float,
    nearest: float,
) -> float:
    """Step at which node i at ξ and this height meets a pin without edges."""
    if rise is not None:
        return _step_to_rough(curvature, rise, i, xi, xi_rate, height, height_rate, nearest)
    # Gap after a step s: curvature·(ξ + ξ' s)²/2 - (height + height' s) = gap + linear·s + quadratic·s².
    gap = 0.5 * curvature * xi * xi - height
    linear = curvature * xi * xi_rate - height_rate
    quadratic = 0.5 * curvature * xi_rate * xi_rate
    # First: a node that rounding has left inside the pin has not met it if it moves away.
    if linear >= 0.0:
        return np.inf
    if gap <= 0.0:
        return 0.0
    discriminant = linear * linear - 4.0 * quadratic * gap
    if discriminant < 0.0:
        return np.inf
    # The smaller root, in the form that does not cancel on a nearly flat pin.
    return float(2.0 * gap / (-linear + np.sqrt(discriminant)))


@declare_kernel()
def _step_to_rough(
    curvature: float, rise: Rise, i: int, xi: float, xi_rate: float, height: float, height_rate: float, nearest: float
) -> float:
    """Step from knot to knot until the gap first closes; a node that lies inside and approaches has met the pin."""
    sense = 1 if xi_rate > 0.0 else -1
    k = piece_entered(rise.knots, xi, sense)
    here, passed, gap = xi, 0.0, face_height(curvature, rise, i, xi) - height
    quadratic = 0.5 * curvature * xi_rate * xi_rate
    # From knot to knot as in `_step_to_profile`, where the rise adds its slope to that of the parabola.
    while passed < nearest:
        linear = (curvature * here + rise_slope(rise, i, k)) * xi_rate - height_rate
        far = knot_ahead(rise.knots, k, sense)
        longest = (far - here) / xi_rate if xi_rate != 0.0 else np.inf
        if linear < 0.0 and gap <= 0.0:
            return passed
        step = first_root(max(gap, 0.0), linear, quadratic) if gap > 0.0 else np.inf
        if step <= longest:
            return passed + step
        if longest == np.inf:
            return np.inf
        gap += longest * (linear + longest * quadratic)
        passed += longest
        here = far
        k += sense
    return np.inf
