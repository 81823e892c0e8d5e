"""Classical Coulomb friction (residual_shear 1): the contact, its nodes' roles, its motion."""

from dataclasses import dataclass, field
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.arrays import Floats, Vector
from nanoslip.solver.case import Case, limits_shear
from nanoslip.solver.contact.kernels.events import TIE
from nanoslip.solver.contact.kernels.state import FORWARD, Direction, EventKind, Stop
from nanoslip.solver.contact.normal import finite
from nanoslip.solver.contact.pin import (
    Pin,
    contact_area,
    contact_limit,
    make_pin,
    node_friction,
    node_strength,
    surface_from_pin,
)
from nanoslip.solver.contact.soundness import OUTCOME_OF_STOP
from nanoslip.solver.contact.state import ContactState, state_from_forces
from nanoslip.solver.elasticity.compliance import Compliance, add_node, contact_stiffness_matrix, remove_node
from nanoslip.solver.outcome import Outcome, SingularOperator, SolverError

# Classical Coulomb friction, residual_shear 1: some nodes slide at their limit of shear, the others stick.
#
# Each node in contact has a role: it sticks (u moves with the pin) or slides (f_x = σ (S + μ_i N), σ = ±1, where S = τ_0·area is
# what the strength adds). On all of them v = w +
# approach follows the pin. For given roles everything is linear but the pin's height under a sliding node, for which Newton's
# method takes over. Below: changes of roles, then motion of the pin, or growth of the load, between changes.

Rates = tuple[Floats, float, Vector, Vector]
"""Force (2, n), approach, u and v = w + approach (n,), or their rates."""

TOLERANCE = 1e-12
"""Share of the load below which forces and lengths count as 0."""


class CoulombError(SolverError):
    """The contact has no (unique) solution from here on."""

    def __init__(self, stop: Stop) -> None:
        super().__init__(OUTCOME_OF_STOP[stop].message)
        self.ending = OUTCOME_OF_STOP[stop].ending


@dataclass(eq=False)
class CoulombContact:
    """A contact being solved; arrays over the n surface nodes, changed in place."""

    case: Case
    compliance: Compliance
    contact: NDArray[np.bool_]
    sliding: Vector
    """Direction σ of a sliding node; 0 for a sticking or free one."""
    u: Vector
    normal_load: float
    displacement: float = 0.0
    first_node: int = 0
    """Number of the grid's first node on the surface."""
    direction: Direction = FORWARD
    """The way that pin and load go on."""
    x: Vector = field(init=False)
    """Position of every node, from the pin's lowest point at δ_p = 0."""
    node_friction: Vector = field(init=False)
    """μ_i of every node."""
    node_strength: Vector = field(init=False)
    """Shear that every node bears without pressure."""
    v: Vector = field(init=False)
    force: Floats = field(init=False)
    """(2, n): f_x and f_z."""
    approach: float = field(init=False)
    node_slips: NDArray[np.int64] = field(init=False)
    """Number of times that each node began to slide."""
    load_work: float = 0.0
    """Work of the load."""
    gone: float = 0.0
    """Length of the path so far."""
    stalled: int = 0
    """Steps since the path last made PROGRESS."""
    mark: float = -np.inf
    """Length of the path when it last made PROGRESS."""
    _set_up: tuple[bytes, Floats, int] = field(init=False)
    """The contact of which the stiffness is, this, and changes of the contact since it was inverted."""

    def __post_init__(self) -> None:
        self.node_slips = np.zeros(len(self.contact), np.int64)
        no_contact = np.zeros_like(self.contact).tobytes()
        self._set_up = no_contact, np.empty((0, 0)), len(self.contact)
        self.move_grid(0)

    def move_grid(self, nodes: int) -> None:
        """Move the grid by `nodes` nodes to the right (left if negative), dropping nodes it leaves, none of them in contact."""
        self.contact = np.roll(self.contact, -nodes)
        self.sliding = np.roll(self.sliding, -nodes)
        self.u = np.roll(self.u, -nodes)
        self.node_slips = np.roll(self.node_slips, -nodes)
        self.first_node += nodes
        self.x = surface_from_pin(self.case, self.first_node)
        self.node_friction = node_friction(self.case, self.first_node)
        self.node_strength = node_strength(self.case, self.compliance.widths, self.first_node)
        self.solve()

    @property
    def slips(self) -> int:
        """Nodes that began to slide."""
        return int(self.node_slips.sum())

    @property
    def pin(self) -> Pin:
        """The pin of the case."""
        return make_pin(self.case)

    @property
    def xi(self) -> Vector:
        """Pin coordinate of every node, (n,)."""
        return np.asarray(self.x + self.u - self.displacement)

    @property
    def normal_force(self) -> Vector:
        """Normal force N of every node, (n,)."""
        return np.asarray(-self.force[1])

    @property
    def gap(self) -> Vector:
        """Gap of every free node, 0 in contact."""
        return np.where(self.contact, 0.0, self.pin.height(self.xi) - self.v)

    @property
    def excess(self) -> Vector:
        """|shear| beyond the limit of the sticking nodes, over μ_i where that is above 1; -load elsewhere.

        Undivided it is as uncertain as μ_i times a pressure: at a μ_i of 10⁴ rounding alone would pass for a slip.
        """
        limit = self.node_strength + self.node_friction * self.normal_force
        over = np.abs(self.force[0]) - limit
        over /= np.maximum(self.node_friction, 1.0)
        return np.where(self.contact & (self.sliding == 0.0), over, -self.normal_load)

    @property
    def tolerance(self) -> float:
        """Tolerance for forces and lengths: TOLERANCE of the load plus the rounding error of the pin's height."""
        return TOLERANCE * self.normal_load + 4.0 * np.finfo(float).eps * abs(self.approach)

    @property
    def nothing(self) -> float:
        """Force that counts as none in motion: of a node that has just touched, or is about to leave."""
        # Under a small μ_i shears are small themselves: then it is a share of the limit, not of the load.
        share = min(limit_of_all(self) / self.case.normal_load, 1.0)
        return max(1e-9 * self.normal_load * share, self.tolerance)

    def solve(self) -> None:
        """Forces, approach and displacements for the given roles: Newton's method on the sliding nodes' positions."""
        nodes, curvature = np.flatnonzero(self.contact), self.pin.curvature
        across = np.broadcast_to(self.pin.across, len(self.u))[nodes]
        for _ in range(20):
            height = curvature * self.xi[nodes] ** 2 / 2 + across
            # Heights count from their middle: out on a sharp pin they are larger than all the load moves by far.
            middle = float(height.mean())
            prescribed = np.concatenate((self.u[nodes], height - middle, [-self.normal_load]))
            answer, moved = _respond(self, nodes, prescribed, self.sliding * self.node_strength)
            self.u[nodes] += moved
            if np.abs(moved).max() <= 1e-14 * self.normal_load:
                break
        self.force, self.approach, u, self.v = _everywhere(self.compliance, nodes, answer, middle)
        self.u[~self.contact] = u[~self.contact]

    def rates(self) -> Rates:
        """Rates of force, approach, u and v per unit step along the path."""
        pin_rate, load_rate, _ = self.direction
        nodes = np.flatnonzero(self.contact)
        along, down = np.full(len(nodes), pin_rate), np.zeros(len(nodes))
        prescribed = np.concatenate((along, down, [-load_rate]))
        # Strengths do not change as the pin moves.
        answer, _ = _respond(self, nodes, prescribed, np.zeros_like(self.sliding))
        return _everywhere(self.compliance, nodes, answer)

    @property
    def stiffness(self) -> Floats:
        """Forces and approach per u, v and -load at the nodes in contact, (2m + 1, 2m + 1)."""
        self._set_up = _set_up_stiffness(self.compliance, self.contact, *self._set_up)
        return self._set_up[1]


def leaving(solved: CoulombContact, force_rate: Floats) -> NDArray[np.bool_]:
    """True of nodes that bear nothing and lose it. force_rate: (2, n).

    Their limit of shear vanishes with them: sliding they would be dragged along, and stick, and slide, and so on.
    """
    # As much as a node can bear whose shear counts as none, and its distance from its limit as well: see `nothing`.
    least = 2.0 * max(1e-9 * solved.normal_load, solved.tolerance)
    return np.asarray(solved.contact & (solved.normal_force <= least) & (force_rate[1] > 0.0))


def release(solved: CoulombContact, node: int) -> None:
    """Let a node go."""
    if solved.contact.sum() == 1:
        raise CoulombError(Stop.CONTACT_LOST)
    solved.contact[node], solved.sliding[node] = False, 0.0


def touch(solved: CoulombContact, node: int) -> None:
    """Bring a node into contact, sticking where it is."""
    if (np.abs(solved.x) > solved.pin.half_width)[node]:
        raise CoulombError(Stop.EDGE_REACHED)
    solved.contact[node] = True


def let_slide(solved: CoulombContact, node: int) -> None:
    """Let a sticking node slide, the way its shear pushes."""
    solved.sliding[node] = 1.0 if solved.force[0, node] >= 0.0 else -1.0
    solved.node_slips[node] += 1


def limit_of_all(solved: CoulombContact) -> float:
    """Friction force at which all nodes in contact slide, under the load of the case."""
    return contact_limit(solved.case, contact_area(solved.contact, solved.compliance.widths))


def _respond(
    solved: CoulombContact, nodes: NDArray[np.int64], prescribed: Vector, unpressed: Vector
) -> tuple[Vector, Vector]:
    """Answer u, v and -load at the nodes in contact with f_x, f_z and approach, sliding nodes moved along the pin so that
    they are at their limits; and by how much each has moved, (m,). unpressed: shear of sliding nodes without pressure, (n,).
    """
    m, stiffness = len(nodes), solved.stiffness
    slide = np.flatnonzero(solved.sliding[nodes])
    slope = solved.pin.curvature * solved.xi[nodes[slide]]
    share = (solved.sliding * solved.node_friction)[nodes[slide]]
    lifted = m + slide
    beyond = stiffness.take(lifted, 0)
    beyond *= share[:, None]
    beyond += stiffness.take(slide, 0)  # f_x + σ μ_i f_z, which is σ S at the limit: N is -f_z
    # A sliding node that moves by d along x moves by slope·d along z; its limit makes d linear in what is lacking.
    lacking = unpressed[nodes[slide]] - beyond @ prescribed
    try:
        by_move = beyond.take(slide, 1) + beyond.take(lifted, 1) * slope
        moved = np.linalg.solve(by_move, lacking)
    except np.linalg.LinAlgError as error:
        raise SingularOperator(f"{m} nodes with Coulomb friction: singular; lower μ_i", "coulomb") from error
    prescribed, along = prescribed.copy(), np.zeros(m)
    prescribed[slide] += moved
    prescribed[lifted] += slope * moved
    along[slide] = moved
    return stiffness @ prescribed, along


def _set_up_stiffness(
    compliance: Compliance, contact: NDArray[np.bool_], before: bytes, stiffness: Floats, changes: int
) -> tuple[bytes, Floats, int]:
    """Update the stiffness of an earlier contact to this contact, see `CoulombContact._set_up`."""
    key, nodes = contact.tobytes(), np.flatnonzero(contact)
    if key == before:
        return before, stiffness, changes
    changed, changes = np.flatnonzero(np.frombuffer(before, np.bool_) != contact), changes + 1
    if len(changed) != 1 or changes * changes > len(nodes):  # an inverse costs as much as all these changes
        return key, contact_stiffness_matrix(compliance, nodes), 0
    if contact[changed[0]]:
        return key, add_node(compliance, stiffness, nodes, int(changed[0])), changes
    return key, remove_node(stiffness, int(np.searchsorted(nodes, changed[0]))), changes


def _everywhere(compliance: Compliance, nodes: NDArray[np.int64], answer: Vector, middle: float = 0.0) -> Rates:
    """Answers of the nodes in contact, and the displacements of all nodes that follow from them. middle: height from
    which the approach counts."""
    answer = finite(answer)
    force = np.zeros((2, compliance.slab.nodes))
    force[:, nodes] = answer[:-1].reshape(2, -1)
    u, v = compliance.displacements(force)
    approach = float(answer[-1]) + middle
    return force, approach, u, v + approach


# Roles of the surface nodes (free, stick, slide): changed one at a time, the worst violation first, until all constraints hold.
#
# A sticking node slides where its shear would exceed its limit. A sliding node sticks where it would move in the direction of
# its own shear. Where an earlier assignment of roles comes back, none (or no unique one) satisfies all constraints.


def settle_roles(solved: CoulombContact) -> None:
    """Change one role per violated constraint, the worst first, until none is violated: tension, shear, penetration."""
    seen: set[bytes] = set()
    while True:
        solved.solve()
        tolerance = solved.tolerance
        # A node beyond the edge of a punch leaves whatever it bears: that counts as much as the load.
        is_beyond = np.abs(solved.xi) > solved.pin.half_width
        tension = np.where(is_beyond, solved.normal_load, -solved.normal_force)
        # In the order of `resolve`: without pressure a limit of shear means nothing.
        in_tension = (release, np.where(solved.contact, tension, -1.0))
        answers = (in_tension, (let_slide, solved.excess), (touch, -solved.gap))
        for answer, violation in answers:
            worst = _largest(violation, tolerance, solved.direction.ahead)
            if violation[worst] > tolerance:
                answer(solved, worst)
                break
        else:
            return
        _refuse_cycles(seen, solved)


def stick_and_slide_in_motion(solved: CoulombContact) -> Rates:
    """Change roles until all of them agree with the motion to come; returns its rates (see `CoulombContact.rates`)."""
    seen: set[bytes] = set()
    pin_rate, _, ahead = solved.direction
    while True:
        rates = force_rate, _, u_rate, _ = solved.rates()
        # A node that has just touched bears no force yet, and slides the way its shear begins to push.
        near = solved.nothing
        none = np.abs(solved.force[0]) <= near
        sign = np.sign(np.where(none, force_rate[0], solved.force[0]))
        # Rate of |T| - L, with L = S + μ_i N and N = -f_z.
        growth = sign * force_rate[0] + solved.node_friction * force_rate[1]
        # Only a node at its limit (its excess is 0) may begin to slide, and none without any shear to push it.
        may_slide = (solved.excess > -near) & (sign != 0.0)
        growth = np.where(may_slide, growth, -1.0)
        # One that leaves as it slides stays so until it has left; whether it leaves if it sticks says nothing of that.
        slides = (solved.sliding != 0.0) & ~leaving(solved, force_rate)
        dragged = np.where(slides, solved.sliding * (u_rate - pin_rate), -1.0)
        least = TOLERANCE * max(np.abs(force_rate).max(), 1.0)
        if growth.max() > least:
            node = _largest(growth, least, ahead)
            solved.sliding[node] = sign[node]
            solved.node_slips[node] += 1
        # After all growth is answered: whether a node is dragged along depends on which others slide.
        elif limits_shear(solved.case) and dragged.max() > 1e-9:
            solved.sliding[_largest(dragged, 1e-9, ahead)] = 0.0
        else:
            return rates
        _refuse_cycles(seen, solved)


def stick_and_slide_at_rest(solved: CoulombContact) -> None:
    """Find the roles at rest: resolve violations, and let nodes stick again at u = 0 that slide against their shear."""
    seen: set[bytes] = set()
    while True:
        settle_roles(solved)
        _refuse_cycles(seen, solved)
        # Without friction the sign of a sliding node means nothing.
        against = (solved.sliding * solved.u > solved.tolerance) & limits_shear(solved.case)
        if not against.any():
            return
        solved.sliding[against], solved.u[against] = 0.0, 0.0


def _largest(values: Vector, tolerance: float, ahead: int) -> int:
    """The node with the largest value; among values within the tolerance of it, the node furthest ahead."""
    return _front(values >= values.max() - tolerance, ahead)


def _front(nodes: NDArray[np.bool_], ahead: int) -> int:
    """The node furthest ahead (see `Direction`)."""
    return int(np.flatnonzero(nodes)[-1 if ahead > 0 else 0])


def _refuse_cycles(seen: set[bytes], solved: CoulombContact) -> None:
    """Raises CoulombError if the same roles come back."""
    roles = np.where(solved.contact, solved.sliding, 2.0).tobytes()
    if roles in seen:
        # For large μ_i there need not be an assignment of roles that satisfies all conditions.
        raise CoulombError(Stop.SLIP_UNBOUNDED)
    seen.add(roles)


# Motion of pin or load up to the next change of a node's role: its distance, and the step. Forces are continuous, but for the
# shear that the strength leaves a node which is released.

PROGRESS = 1e-6
"""Motion in node spacings, or growth of the load as a share of it, that counts as progress."""
MOST_STALLED = 20
"""Steps per node without progress after which no motion is found consistent."""


def raise_load_of_sliding(solved: CoulombContact, target: float) -> None:
    """Raise the load to `target`, the pin held."""
    while solved.normal_load < target:
        rates = stick_and_slide_in_motion(solved)
        step, kind, node = next_change(solved, rates)
        # The contact grows from one node to many: steps keep to the load's own size.
        longest = min(solved.normal_load, target - solved.normal_load)
        advance(solved, min(step, longest), rates)
        change(solved, kind if step <= longest else EventKind.NOTHING, node)


def change(solved: CoulombContact, kind: EventKind, node: int) -> float:
    """Answer an event (none if `kind` is NOTHING) and all that follows from it at once; returns the energy dissipated."""
    before = Place.read(solved)
    if kind != EventKind.NOTHING:
        answers = {EventKind.SLIP: let_slide, EventKind.RELEASE: release, EventKind.TOUCH: touch}
        answers[kind](solved, node)
    settle_roles(solved)
    # Without a strength forces do not jump: the difference would be rounding.
    if solved.case.slip_rule.strength == 0.0:
        return 0.0
    solved.load_work += solved.normal_load * (solved.approach - before.approach)
    return before.energy_lost(solved)


def next_change(solved: CoulombContact, rates: Rates) -> tuple[float, EventKind, int]:
    """Step after which a role changes, how, and whose; infinite if none does. The gap is taken as linear."""
    force_rate, _, u_rate, v_rate = rates
    mu, stick = solved.node_friction, solved.contact & (solved.sliding == 0.0)
    steps = {EventKind.RELEASE: _time(solved.normal_force, force_rate[1], solved.contact)}
    for sign in (1.0, -1.0):
        room = solved.node_strength + mu * solved.normal_force - sign * solved.force[0]
        until = _time(room, sign * force_rate[0] + mu * force_rate[1], stick)
        steps[EventKind.SLIP] = np.minimum(steps.get(EventKind.SLIP, until), until)
    # The gap of a smooth pin is ξ²/2R - v: it closes at v' - ξ ξ'/R.
    closing = v_rate - solved.pin.curvature * solved.xi * (u_rate - solved.direction.pin_rate)
    may_touch = ~solved.contact & np.isfinite(solved.gap)
    steps[EventKind.TOUCH] = _time(solved.gap, closing, may_touch)
    kind = min(steps, key=lambda change: float(steps[change].min()))
    step = float(steps[kind].min())
    # Of ties the node further ahead, as in `next_event`.
    ties = steps[kind] <= step * (1.0 + TIE)
    return step, kind, _front(ties, solved.direction.ahead)


def advance(solved: CoulombContact, step: float, rates: Rates) -> float:
    """Move pin and load by `step` along the path; returns the energy dissipated."""
    pin_rate, load_rate, _ = solved.direction
    solved.stalled += 1
    solved.gone += step
    scale = solved.case.slab.spacing if pin_rate else solved.normal_load
    if solved.gone > solved.mark + PROGRESS * scale:
        solved.mark, solved.stalled = solved.gone, 0
    if solved.stalled > MOST_STALLED * len(solved.u):
        # A node that touches is pulled off at once, and closes in at once when free: no motion is consistent.
        raise CoulombError(Stop.SLIP_UNBOUNDED)
    before, load = Place.read(solved), solved.normal_load
    # Sticking nodes move exactly with the pin; their rates have passed through a solve.
    moved = np.where(solved.contact & (solved.sliding == 0.0), pin_rate, rates[2])
    solved.u = solved.u + step * moved
    solved.displacement += pin_rate * step
    solved.normal_load += load_rate * step
    solved.solve()
    solved.load_work += (load + solved.normal_load) / 2 * (solved.approach - before.approach)
    return before.energy_lost(solved)


class Place(NamedTuple):
    """Forces (2, n) and displacements (n,) of a contact at one moment, from which energy is counted."""

    force: Floats
    slip: Vector
    height: Vector
    approach: float

    @classmethod
    def read(cls, solved: CoulombContact) -> Self:
        """The forces and displacements of a contact now."""
        return cls(solved.force, solved.u - solved.displacement, solved.v, solved.approach)

    def energy_lost(self, solved: CoulombContact) -> float:
        """Energy dissipated since then, by the trapezoidal rule: along a step forces are linear but for the pin's
        curvature, and the forces of a released node fall in proportion to its displacement."""
        mean = (self.force + solved.force) / 2
        moved = solved.u - solved.displacement - self.slip
        lifted = solved.v - self.height
        return float(-(mean[0] @ moved + mean[1] @ lifted))


def _time(room: Vector, rate: Vector, which: NDArray[np.bool_]) -> Vector:
    """Step after which a falling margin is used up, where it applies; infinite elsewhere."""
    falling = which & (rate > 0.0)
    speed = np.where(falling, rate, 1.0)  # no division by zero where the step is not taken
    return np.where(falling, np.maximum(room, 0.0) / speed, np.inf)


def coulomb_state(solved: CoulombContact, outcome: Outcome) -> ContactState:
    """A contact with classical Coulomb friction as a value."""
    reached = (solved.contact.copy(), solved.force, solved.u, solved.v, solved.approach)
    moved = (solved.displacement, solved.slips, outcome, solved.first_node)
    return state_from_forces(solved.case, solved.compliance.widths, *reached, *moved)
