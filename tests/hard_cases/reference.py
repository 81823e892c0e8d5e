"""A slow second implementation of contact and sliding, in plain numpy, straight from the model's text.

Every question is answered by one dense solve from scratch: which forces hold the nodes in contact where they are, under the
load? No tableau, no updates, no window, nothing of `solver` but the case and the compliance.

A stuck node moves with the pin and touches it at ξ = x + u - δ_p, so v = w + approach = ξ²/2R there. Free nodes bear no
force. The limit of a node is τ_0·area + μ_i·N. An event is the smallest step at which |shear| = limit, pressure = 0 or gap = 0;
its node is answered first, then by turns, until none is left: the node in largest tension is released, the worst offender by
|shear|/limit slips until its shear is residual_shear·limit, the deepest node inside the pin touches. Ties go to the node
further right.
"""

from dataclasses import dataclass

import numpy as np
import scipy

from nanoslip.solver.case import Case
from nanoslip.solver.elasticity.compliance import SurfaceCompliance

SLIP, RELEASE, TOUCH = 0, 1, 2
NEAR = 1e-10
"""Ratios nearer than this share are ties."""
PIECE = 1e-7
"""L_x within which an image is linear under every node: its pixels are so coarse that none is passed."""


@dataclass
class Event:
    """One event of the record."""

    displacement: float
    kind: int
    node: int
    force_before: float
    force_after: float
    slips: int
    releases: int
    touches: int


class Reference:
    """A parabolic pin of finite μ_i on a slab; arrays over the n surface nodes."""

    def __init__(self, case: Case, compliance: SurfaceCompliance) -> None:
        self.case, self.c = case, compliance.matrix
        self.spacing = 1.0 / (case.slab.n_x - 1)
        self.x, y = compliance.x - case.start * self.spacing, compliance.y - case.start_y * self.spacing
        self.y, self.across = y, y**2 / (2.0 * case.radius)  # 0 in plane strain
        self.image = np.array(case.heterogeneity.roughness)
        self.n = len(self.x)
        self.mu, self.normal_load = case.intrinsic_friction, case.normal_load
        self.strength = case.slip_rule.strength * compliance.widths
        self.nothing = 1e-12 * case.normal_load
        self.contact = np.hypot(self.x, y) <= 0.3
        self.u, self.delta = np.zeros(self.n), 0.0
        self.counts = [0, 0, 0]
        self._find_stuck_contact()
        self.counts = [0, 0, 0]
        self._settle()

    def height(self, u: np.ndarray) -> np.ndarray:
        """The pin's height above its lowest point over every node, with the nodes at x + u."""
        xi = self.x + u - self.delta
        return xi**2 / (2.0 * self.case.radius) + self.across + self.rise(xi)

    def rise(self, xi: np.ndarray) -> np.ndarray:
        """Height of a rough plane's image over every node, bilinear between its points and constant beyond; 0 without one."""
        if not len(self.image):
            return np.zeros(self.n)
        axes = [np.unique(self.image[:, axis]) for axis in (0, 1)]
        heights = self.image[np.lexsort((self.image[:, 1], self.image[:, 0])), 2].reshape([*map(len, axes)])
        inside = [np.clip(each, axis[0], axis[-1]) for each, axis in zip((xi, self.y), axes, strict=True)]
        return np.asarray(scipy.interpolate.RegularGridInterpolator(axes, heights)(np.column_stack(inside)))

    def answer(
        self, u: np.ndarray, v: np.ndarray, normal_load: float
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """f_x, f_z, u and v of all nodes if the nodes in contact are put at u and v under the load."""
        nodes = np.flatnonzero(self.contact)
        both, m = np.concatenate((nodes, nodes + self.n)), len(nodes)
        system = np.zeros((2 * m + 1, 2 * m + 1))
        system[:-1, :-1] = self.c[np.ix_(both, both)]
        system[m:-1, -1] = system[-1, m:-1] = 1.0
        solution = np.linalg.solve(system, np.concatenate((u[nodes], v[nodes], [-normal_load])))
        forces = np.zeros(2 * self.n)
        forces[both] = solution[:-1]
        moved = self.c @ forces
        return forces[: self.n], forces[self.n :], moved[: self.n], moved[self.n :] + solution[-1]

    def now(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """The present answer."""
        return self.answer(self.u, self.height(self.u), self.normal_load)

    def _find_stuck_contact(self) -> None:
        """The contact set at u = 0, the worst node changed at a time."""
        while True:
            _, f_z, u, v = self.now()
            tension, inside = np.where(self.contact, f_z, -1.0), np.where(self.contact, -1.0, v - self.height(u))
            worst = int(np.argmax(np.maximum(tension, inside)))
            if max(tension[worst], inside[worst]) <= self.nothing:
                return
            self.contact[worst] = not self.contact[worst]

    def _slip(self, node: int) -> None:
        """Move the node along the pin until its shear is `residual_shear` of what it can bear: a parabola in the distance."""
        f_x, _, _, _ = self.now()
        side = 1.0 if f_x[node] > 0.0 else -1.0
        left = side * self.case.slip_rule.residual_shear
        there, step = [], -side * abs(f_x[node])
        for distance in (0.0, step, 2.0 * step):
            u = self.u.copy()
            u[node] += distance
            f_x, f_z, _, _ = self.answer(u, self.height(u), self.normal_load)
            there.append(f_x[node] - left * (self.strength[node] - self.mu * f_z[node]))
        first, second = there[1] - there[0], there[2] - 2.0 * there[1] + there[0]
        # Newton's divided differences, in units of the step.
        b, a = first - 0.5 * second, 0.5 * second
        root = -2.0 * there[0] / (b + np.sign(b) * np.sqrt(b * b - 4.0 * a * there[0]))
        self.u[node] += root * step
        self.counts[SLIP] += 1

    def _do(self, kind: int, node: int) -> None:
        if kind == SLIP:
            self._slip(node)
        elif kind == RELEASE:
            self.contact[node] = False
            self.counts[RELEASE] += 1
        else:
            self.u[node] = self.now()[2][node]
            self.contact[node] = True
            self.counts[TOUCH] += 1

    def _violation(self) -> tuple[int, int] | None:
        f_x, f_z, u, v = self.now()
        tension = np.where(self.contact, f_z, -1.0)
        if tension.max() > self.nothing:
            return RELEASE, int(np.argmax(tension))
        limit = self.strength - self.mu * f_z
        over = self.contact & (np.abs(f_x) - limit > self.nothing)
        if over.any():
            ratio = np.where(over, np.abs(f_x) / np.maximum(limit, self.nothing), 0.0)
            return SLIP, int(np.flatnonzero(ratio >= ratio.max() * (1.0 - NEAR))[-1])
        inside = np.where(self.contact, -1.0, v - self.height(u))
        if inside.max() > self.nothing + 4e-16 / self.case.radius:
            return TOUCH, int(np.flatnonzero(inside >= inside.max() * (1.0 - NEAR))[-1])
        return None

    def _settle(self) -> None:
        while (found := self._violation()) is not None:
            self._do(*found)

    def _next(self) -> tuple[float, int, int]:
        """Step to the next event, what it is and where."""
        f_x, f_z, u, v = self.now()
        d_x, d_z, du, dv = self.answer(np.where(self.contact, 1.0, 0.0), np.zeros(self.n), 0.0)
        found, places, radius = [], self.x + u - self.delta, self.case.radius
        gaps, steep = self.height(u) - v, (self.rise(places + PIECE) - self.rise(places - PIECE)) / (2.0 * PIECE)
        for i in range(self.n):
            if self.contact[i]:
                if d_z[i] > 0.0:
                    found.append((max(-f_z[i], 0.0) / d_z[i], RELEASE, i))
                for side in (1.0, -1.0):
                    rate = side * d_x[i] + self.mu * d_z[i]
                    if rate > 0.0:
                        room = self.strength[i] - (side * f_x[i] + self.mu * f_z[i])
                        found.append((max(room, 0.0) / rate, SLIP, i))
            else:
                moving = du[i] - 1.0
                rate = (places[i] / radius + steep[i]) * moving - dv[i]
                roots = np.roots([moving**2 / (2 * radius), rate, gaps[i]])
                ahead = [root.real for root in roots if abs(root.imag) < 1e-300 and root.real >= 0.0]
                if ahead and rate < 0.0:
                    found.append((min(ahead), TOUCH, i))
        nearest = min(step for step, _, _ in found)
        # Of what happens at once: the node further right.
        return max((one for one in found if one[0] <= nearest * (1.0 + 1e-12)), key=lambda one: one[2])

    def _floor(self) -> float:
        """The smallest step, counted in node spacings or in 24 stretches of the contact, whichever is shorter."""
        shear, normal, _, _ = self.answer(np.where(self.contact, 1.0, 0.0), np.zeros(self.n), 0.0)
        stiffness = float((np.abs(shear) + self.mu * np.abs(normal)).sum())
        limit = self.mu * self.normal_load + float(self.strength[self.contact].sum())
        return self.case.slip_rule.event_floor * min(self.spacing, 24.0 * limit / stiffness)

    def slide(self, events: int) -> list[Event]:
        """The next events of the record."""
        record = []
        for _ in range(events):
            step, kind, node = self._next()
            step = max(step, self._floor())
            self.delta += step
            self.u[self.contact] += step
            before = float(self.now()[0].sum())
            self.counts = [0, 0, 0]
            self._do(kind, node)
            self._settle()
            record.append(Event(self.delta, kind, node, before, float(self.now()[0].sum()), *self.counts))
        return record
