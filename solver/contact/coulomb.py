"""Classical Coulomb friction, the slip rule's residual of 1: some nodes slide at |shear| = μ_i·pressure, the others stick.

The contact is solved as it stands: per node either u moves with the pin (stick) or f_x = σ μ_i N (slide, σ = ±1), and on
all of them v = w + approach follows the pin. Between changes of these roles everything is linear but the pin's height under
a sliding node, for which Newton's method takes over. Roles change one at a time, the worst first: a sticking node slides
where its shear would grow beyond the limit, a sliding node sticks where it would be dragged with its shear.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from solver.case import Case
from solver.contact.node_friction import node_friction
from solver.contact.pin import Pin, pin_of, surface_from_pin
from solver.elasticity.compliance import SurfaceCompliance
from solver.outcome import Ending, SingularOperator, SolverError, TooFarApart

Vector = NDArray[np.float64]

LONGEST_STEP = 0.05
"""Longest step in node spacings: the pin's slope under a sliding node changes by as much of a node's."""
TOLERANCE = 1e-12
"""Forces and lengths below this share of the load count as none."""

PROGRESS = 1e-6
"""Motion in node spacings, or growth of the load as a share of it, that counts as progress."""
PATIENCE = 20
"""Steps per node without progress after which no motion is found consistent."""


class CoulombError(SolverError):
    """The contact has no (unique) solution from here on; `ending` says of what kind."""

    def __init__(self, ending: Ending) -> None:
        super().__init__(ending)
        self.ending = ending


@dataclass(eq=False)
class CoulombContact:
    """A contact being solved; arrays over the n surface nodes, changed in place."""

    case: Case
    compliance: SurfaceCompliance
    contact: NDArray[np.bool_]
    sliding: Vector
    """σ of a sliding node, 0 of a sticking or free one."""
    u: Vector
    normal_load: float
    displacement: float = 0.0
    x: Vector = field(init=False)
    """Of every node, from the pin's lowest point at δ_p = 0."""
    friction: Vector = field(init=False)
    """μ_i of every node."""
    v: Vector = field(init=False)
    force: NDArray[np.float64] = field(init=False)
    """(2, n): f_x and f_z."""
    approach: float = field(init=False)
    slips: int = 0
    """Nodes that began to slide."""
    stalled: int = 0
    """Steps since displacement and load last made PROGRESS."""
    mark: float = 0.0
    """Displacement plus load at that time."""

    def __post_init__(self) -> None:
        self.x, self.friction = surface_from_pin(self.case), node_friction(self.case)
        self.solve()

    @property
    def pin(self) -> Pin:
        """The pin of the case."""
        return pin_of(self.case)

    @property
    def xi(self) -> Vector:
        """Pin coordinate of every node, (n,)."""
        return np.asarray(self.x + self.u - self.displacement)

    @property
    def pressing(self) -> Vector:
        """Normal force N of every node, (n,)."""
        return np.asarray(-self.force[1])

    @property
    def gap(self) -> Vector:
        """Gap of every free node, 0 in contact."""
        return np.where(self.contact, 0.0, self.pin.height(self.xi) - self.v)

    @property
    def excess(self) -> Vector:
        """|shear| - μ_i·N of the sticking nodes, -load elsewhere."""
        over = np.abs(self.force[0]) - self.friction * self.pressing
        return np.where(self.contact & (self.sliding == 0.0), over, -self.normal_load)

    @property
    def least(self) -> float:
        """Force or length that counts as none: heights of the pin are known to rounding only, and so is what they cause."""
        return TOLERANCE * self.normal_load + 4.0 * np.finfo(float).eps * abs(self.approach)

    def solve(self) -> None:
        """Forces, approach and displacements for the given roles: Newton's method on the sliding nodes' positions."""
        curvature = self.pin.curvature
        for _ in range(20):
            before = self.u.copy()
            u, xi, slide = self.u[self.contact], self.xi[self.contact], self.sliding[self.contact] != 0.0
            tangential = np.where(slide, 0.0, u)
            normal = curvature * (xi**2 / 2 - np.where(slide, xi * u, 0.0))
            self.force, self.approach, u, self.v = self._respond(tangential, normal, -self.normal_load)
            self.u = np.where(self.contact & (self.sliding == 0.0), before, u)
            if np.abs(self.u - before).max() <= 1e-14 * self.normal_load:
                return

    def rates(self, push: float) -> tuple[NDArray[np.float64], float, Vector, Vector]:
        """Rates of force, approach, u and v per unit of pin displacement (push = 1) or of load (push = 0)."""
        slide = self.sliding[self.contact] != 0.0
        tangential = np.where(slide, 0.0, push)
        normal = np.where(slide, -push * self.pin.curvature * self.xi[self.contact], 0.0)
        return self._respond(tangential, normal, -(1.0 - push))

    def _respond(
        self, tangential: Vector, normal: Vector, normal_load: float
    ) -> tuple[NDArray[np.float64], float, Vector, Vector]:
        """Solve for the contact's forces and the approach: right sides of the tangential, normal and load equations."""
        c, n, nodes = self.compliance.matrix, len(self.u), np.flatnonzero(self.contact)
        m, sigma = len(nodes), self.sliding[nodes]
        columns = np.concatenate((nodes, nodes + n))
        c_x, c_z, one = c[np.ix_(nodes, columns)], c[np.ix_(nodes + n, columns)], np.eye(m)
        limit = np.hstack((one, (sigma * self.friction[nodes])[:, None] * one))
        slide = (sigma != 0.0)[:, None]
        system = np.zeros((2 * m + 1, 2 * m + 1))
        system[:m, : 2 * m] = np.where(slide, limit, c_x)
        system[m : 2 * m, : 2 * m] = c_z - np.where(slide, self.pin.curvature * self.xi[nodes][:, None] * c_x, 0.0)
        system[m : 2 * m, 2 * m] = system[2 * m, m : 2 * m] = 1.0
        # Heights are solved for from their middle: out on a sharp pin they are larger than all the load moves by far.
        middle = float(normal.mean())
        try:
            solution = np.linalg.solve(system, np.concatenate((tangential, normal - middle, [normal_load])))
        except np.linalg.LinAlgError as error:
            raise SingularOperator(f"{m} nodes in contact with Coulomb friction: singular; lower μ_i") from error
        if not np.isfinite(solution).all():
            # Every comparison with a NaN is false: nothing would seem to be wrong.
            raise TooFarApart("the forces of the contact are no numbers: use a load and a radius nearer 1")
        force = np.zeros((2, n))
        force[:, nodes] = solution[:-1].reshape(2, m)
        u, v = (c[:, columns] @ solution[:-1]).reshape(2, n)
        approach = float(solution[-1]) + middle
        return force, approach, u, v + approach

    def release(self, node: int) -> None:
        """Let a node go."""
        if self.contact.sum() == 1:
            raise CoulombError(Ending.CONTACT_LOST)
        self.contact[node], self.sliding[node] = False, 0.0

    def touch(self, node: int) -> None:
        """Bring a node into contact, sticking where it is."""
        if abs(self.x[node]) > self.pin.half_width:
            raise CoulombError(Ending.EDGE_REACHED)
        self.contact[node] = True

    def slide(self, node: int) -> None:
        """Let a sticking node slide, the way its shear pushes."""
        self.sliding[node] = 1.0 if self.force[0, node] >= 0.0 else -1.0
        self.slips += 1

    def mend(self) -> None:
        """Answer violated conditions one by one, the worst first, until none is left: tension, shear, penetration."""
        seen: set[bytes] = set()
        while True:
            self.solve()
            least = self.least
            tension = np.where(np.abs(self.xi) > self.pin.half_width, self.normal_load, -self.pressing)
            answers = ((self.release, np.where(self.contact, tension, -1.0)), (self.slide, self.excess))
            for answer, violation in (*answers, (self.touch, -self.gap)):
                worst = int(np.argmax(violation))
                if violation[worst] > least:
                    answer(worst)
                    break
            else:
                return
            _once(seen, self)

    def settle(self, push: float) -> tuple[NDArray[np.float64], float, Vector, Vector]:
        """Change roles until none is left by the motion to come (see `rates`); returns the rates."""
        seen: set[bytes] = set()
        while True:
            rates = force_rate, _, u_rate, _ = self.rates(push)
            # A node that has just touched bears no force yet, and slides the way its shear begins to push.
            near = max(1e-9 * self.normal_load * min(self.case.intrinsic_friction, 1.0), self.least)
            none = np.abs(self.force[0]) <= near
            sign = np.sign(np.where(none, force_rate[0], self.force[0]))
            growth = sign * force_rate[0] + self.friction * force_rate[1]
            growth = np.where(self.excess > -near, growth, -1.0)
            dragged = np.where(self.sliding != 0.0, self.sliding * (u_rate - push), -1.0)
            least = TOLERANCE * max(np.abs(force_rate).max(), 1.0)
            if growth.max() > least:
                node = int(np.argmax(growth))
                self.sliding[node] = sign[node]
                self.slips += 1
            elif self.case.intrinsic_friction > 0.0 and dragged.max() > 1e-9:
                self.sliding[int(np.argmax(dragged))] = 0.0
            else:
                return rates
            _once(seen, self)

    def press(self) -> None:
        """Find the roles at rest: mend, and stick again what slides against its shear from where it touched (u = 0)."""
        seen: set[bytes] = set()
        while True:
            self.mend()
            _once(seen, self)
            # Without friction the sign of a sliding node means nothing.
            against = (self.sliding * self.u > self.least) & (self.case.intrinsic_friction > 0.0)
            if not against.any():
                return
            self.sliding[against], self.u[against] = 0.0, 0.0

    def raise_load(self, target: float) -> None:
        """Raise the load to `target`, the pin held."""
        while self.normal_load < target:
            rates = self.settle(0.0)
            step, kind, node = self.next_change(rates, 0.0)
            # The contact grows from one node to many: steps keep to the load's own size.
            longest = min(self.normal_load, target - self.normal_load)
            self.advance(min(step, longest), rates, 0.0)
            self.change(kind if step <= longest else "", node)

    def change(self, kind: str, node: int) -> None:
        """Answer an event (none where `kind` is empty) and all that follows from it at once."""
        if kind:
            {"slip": self.slide, "release": self.release, "touch": self.touch}[kind](node)
        self.mend()

    def next_change(
        self, rates: tuple[NDArray[np.float64], float, Vector, Vector], push: float
    ) -> tuple[float, str, int]:
        """Step after which a role changes, how, and whose; infinite where none does. The gap is taken as linear."""
        force_rate, _, u_rate, v_rate = rates
        mu, stick = self.friction, self.contact & (self.sliding == 0.0)
        steps = {"release": _time(self.pressing, force_rate[1], self.contact)}
        for sign in (1.0, -1.0):
            room = mu * self.pressing - sign * self.force[0]
            until = _time(room, sign * force_rate[0] + mu * force_rate[1], stick)
            steps["slip"] = np.minimum(steps.get("slip", until), until)
        closing = v_rate - self.pin.curvature * self.xi * (u_rate - push)
        steps["touch"] = _time(self.gap, closing, ~self.contact & np.isfinite(self.gap))
        kind = min(steps, key=lambda name: float(steps[name].min()))
        node = int(np.argmin(steps[kind]))
        return float(steps[kind][node]), kind, node

    def advance(self, step: float, rates: tuple[NDArray[np.float64], float, Vector, Vector], push: float) -> float:
        """Move the pin (push = 1) or raise the load (push = 0) by `step`; returns the energy dissipated."""
        self.stalled += 1
        if self.displacement + self.normal_load > self.mark + PROGRESS * (
            self.case.slab.spacing if push else self.normal_load
        ):
            self.mark, self.stalled = self.displacement + self.normal_load, 0
        if self.stalled > PATIENCE * len(self.u):
            # A node that touches is pulled off at once, and closes in at once when free: no motion is consistent.
            raise CoulombError(Ending.SLIP_UNBOUNDED)
        before, slip, height = self.force, self.u - self.displacement, self.v
        moved = np.where(self.contact & (self.sliding == 0.0), push, rates[2])
        self.u = self.u + step * moved
        self.displacement += push * step
        self.normal_load += (1.0 - push) * step
        self.solve()
        mean = (before + self.force) / 2
        return float(-(mean[0] @ (self.u - self.displacement - slip) + mean[1] @ (self.v - height)))


def _time(room: Vector, rate: Vector, which: NDArray[np.bool_]) -> Vector:
    """Step after which a falling margin is used up, where it applies; infinite elsewhere."""
    falling = which & (rate > 0.0)
    return np.where(falling, np.maximum(room, 0.0) / np.where(falling, rate, 1.0), np.inf)


def _once(seen: set[bytes], state: CoulombContact) -> None:
    roles = np.where(state.contact, state.sliding, 2.0).tobytes()
    if roles in seen:
        # For large μ_i there need not be an assignment of roles that satisfies all conditions.
        raise CoulombError(Ending.SLIP_UNBOUNDED)
    seen.add(roles)
