"""Classical Coulomb friction, residual_shear 1: some nodes slide at |shear| = μ_i·pressure, the others stick.

Each node in contact has a role: it sticks (u moves with the pin) or slides (f_x = σ μ_i N, σ = ±1). On all of them
v = w + approach follows the pin. For given roles everything is linear but the pin's height under a sliding node, for which
Newton's method takes over. `roles` changes roles, `motion` moves the pin or raises the load between changes.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.case import Case
from nanoslip.solver.contact.node_friction import node_friction
from nanoslip.solver.contact.pin import Pin, pin_of, surface_from_pin
from nanoslip.solver.elasticity.compliance import SurfaceCompliance
from nanoslip.solver.outcome import Ending, SingularOperator, SolverError, TooFarApart

Vector = NDArray[np.float64]
Rates = tuple[NDArray[np.float64], float, Vector, Vector]
"""Force (2, n), approach, u and v = w + approach (n,), or their rates."""

TOLERANCE = 1e-12
"""Share of the load below which forces and lengths count as 0."""


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
    node_friction: Vector = field(init=False)
    """μ_i of every node."""
    v: Vector = field(init=False)
    force: NDArray[np.float64] = field(init=False)
    """(2, n): f_x and f_z."""
    approach: float = field(init=False)
    node_slips: NDArray[np.int64] = field(init=False)
    """How often each node began to slide."""
    stalled: int = 0
    """Steps since displacement and load last made `motion.PROGRESS`."""
    mark: float = 0.0
    """Displacement plus load at that time."""

    def __post_init__(self) -> None:
        self.x, self.node_friction = surface_from_pin(self.case), node_friction(self.case)
        self.node_slips = np.zeros(len(self.x), np.int64)
        self.solve()

    @property
    def slips(self) -> int:
        """Nodes that began to slide."""
        return int(self.node_slips.sum())

    @property
    def pin(self) -> Pin:
        """The pin of the case."""
        return pin_of(self.case)

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
        """|shear| - μ_i·N of the sticking nodes, -load elsewhere."""
        over = np.abs(self.force[0]) - self.node_friction * self.normal_force
        return np.where(self.contact & (self.sliding == 0.0), over, -self.normal_load)

    @property
    def tolerance(self) -> float:
        """Tolerance for forces and lengths: TOLERANCE of the load plus the rounding error of the pin's height."""
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

    def rates(self, pin_rate: float) -> Rates:
        """Rates of force, approach, u and v per unit of pin displacement (pin_rate = 1) or of load (pin_rate = 0)."""
        slide = self.sliding[self.contact] != 0.0
        tangential = np.where(slide, 0.0, pin_rate)
        normal = np.where(slide, -pin_rate * self.pin.curvature * self.xi[self.contact], 0.0)
        return self._respond(tangential, normal, -(1.0 - pin_rate))

    def _respond(self, tangential: Vector, normal: Vector, normal_load: float) -> Rates:
        """Solve for the contact's forces and the approach: right sides of the tangential, normal and load equations."""
        c, n, nodes = self.compliance.matrix, len(self.u), np.flatnonzero(self.contact)
        m, sigma = len(nodes), self.sliding[nodes]
        columns = np.concatenate((nodes, nodes + n))
        c_x, c_z, one = c[np.ix_(nodes, columns)], c[np.ix_(nodes + n, columns)], np.eye(m)
        limit = np.hstack((one, (sigma * self.node_friction[nodes])[:, None] * one))
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

    def let_slide(self, node: int) -> None:
        """Let a sticking node slide, the way its shear pushes."""
        self.sliding[node] = 1.0 if self.force[0, node] >= 0.0 else -1.0
        self.node_slips[node] += 1
