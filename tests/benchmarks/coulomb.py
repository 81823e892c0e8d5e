"""One increment of Coulomb friction on a whole finite-element slab, beside ours on the condensed one."""

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import splu
from skfem import Basis, BilinearForm, ElementQuad1, ElementVector, MeshQuad, asm
from skfem.helpers import ddot, eye, sym_grad, trace

from nanoslip import Case, Slab, SlipRule, contact_state, friction_record, surface_compliance
from nanoslip.solver.sliding.slide import slide
from tests.benchmarks.table import Row, best, verdict, versus

Vector = NDArray[np.float64]

INCREMENT = 2e-4
"""Displacement of the pin from initial contact, in L_x: a fortieth of a node spacing, a fifth of the way to full sliding."""
SAME = 0.05
"""Largest difference of F/W: the two discretizations of the slab differ by as much in their lateral stiffness."""


@dataclass(frozen=True)
class Contact:
    """A solved contact of the finite-element slab; arrays over its n surface nodes."""

    unknowns: Vector
    """Displacements of all free degrees of freedom, f_x and f_z of the surface nodes, approach."""
    touching: NDArray[np.bool_]
    sliding: Vector
    """σ = ±1 where |f_x| = μ_i·N, 0 elsewhere."""
    held: Vector
    """u at which a node sticks, before the pin moves on."""
    rounds: int = 0


class FiniteElementSlab:
    """A bonded slab of n_x × n_x nodes, bilinear quadrilaterals; Newton's method with an active set, nothing condensed."""

    def __init__(self, case: Case) -> None:
        n = case.slab.n_x
        lame = 2 * case.slab.poisson / (1 - 2 * case.slab.poisson)
        mesh = MeshQuad.init_tensor(np.linspace(-0.5, 0.5, n), np.linspace(-case.slab.aspect_ratio, 0.0, n))
        basis = Basis(mesh, ElementVector(ElementQuad1()))

        @BilinearForm
        def elasticity(u, v, _):  # type: ignore[no-untyped-def]
            return ddot(lame * eye(trace(sym_grad(u)), 2) + 2 * sym_grad(u), sym_grad(v))

        free = np.setdiff1d(np.arange(basis.N), basis.get_dofs(lambda p: p[1] < -case.slab.aspect_ratio + 1e-9).all())
        top = np.flatnonzero(mesh.p[1] > -1e-9)
        top = top[np.argsort(mesh.p[0, top])]
        surface = np.searchsorted(free, basis.nodal_dofs[:, top].ravel())
        self.case, self.n, self.x, self.surface = case, n, mesh.p[0, top], surface
        self.stiffness = asm(elasticity, basis).tocsr()[free][:, free]
        self.along, self.down = (
            sp.csr_array((np.ones(n), (np.arange(n), dofs)), shape=(n, len(free))) for dofs in np.split(surface, 2)
        )

    def rest(self) -> Contact:
        """The contact initial contact begins with: the middle third of the surface, stuck where it is."""
        unknowns, none = np.zeros(len(self.surface) + self.stiffness.shape[0] + 1), np.zeros(self.n)
        return Contact(unknowns, np.abs(self.x) < 1 / 6, none, none)

    def increment(self, start: Contact, push: float, pin: float) -> Contact:
        """Move the pin by `push` to `pin`: all roles change at once until none does and the pin's height is met."""
        now = start
        for rounds in range(1, 51):
            solved = self._solve(now, push, pin)
            after = replace(self._roles(solved, push, pin), rounds=rounds)
            moved = np.abs(solved.unknowns - now.unknowns).max()
            if (after.touching == now.touching).all() and (after.sliding == now.sliding).all() and moved < 1e-12:
                return after
            now = after
        raise ArithmeticError("no set of roles after 50 rounds")

    def held_there(self, contact: Contact) -> Contact:
        """The same contact, every node to be held from where it is now."""
        return replace(contact, held=contact.unknowns[self.surface[: self.n]])

    def friction(self, contact: Contact) -> float:
        """F/W."""
        return float(self._forces(contact)[: self.n].sum() / self.case.normal_load)

    def _forces(self, contact: Contact) -> Vector:
        return contact.unknowns[self.stiffness.shape[0] : -1]

    def _solve(self, now: Contact, push: float, pin: float) -> Contact:
        n, mu, curvature = self.n, self.case.intrinsic_friction, 1.0 / self.case.radius
        u = now.unknowns[self.surface[:n]]
        sticks, slides = now.touching & (now.sliding == 0.0), now.touching & (now.sliding != 0.0)
        u = np.where(sticks, now.held + push, u)
        xi = self.x + u - pin
        slope = np.where(slides, curvature * xi, 0.0)
        stick, slide, touch = (sp.diags_array(1.0 * each) for each in (sticks, now.sliding, now.touching))
        one = sp.eye_array(n)
        every = sp.csr_array(np.ones((1, n)))
        blocks = [
            [self.stiffness, -self.along.T, -self.down.T, None],
            [stick @ self.along, one - stick, mu * slide, None],
            [touch @ self.down - sp.diags_array(slope) @ self.along, None, one - touch, touch @ every.T],
            [None, None, every, None],
        ]
        height = np.where(now.touching, curvature * xi**2 / 2 - slope * u, 0.0)
        inside, held = np.zeros(self.stiffness.shape[0]), np.where(sticks, u, 0.0)
        factors = splu(sp.block_array(blocks, format="csc"), permc_spec="MMD_AT_PLUS_A")
        return replace(now, unknowns=factors.solve(np.concatenate((inside, held, height, [-self.case.normal_load]))))

    def _roles(self, now: Contact, push: float, pin: float) -> Contact:
        n, least = self.n, 1e-12 * self.case.normal_load
        u, w = now.unknowns[self.surface].reshape(2, n)
        shear, normal = self._forces(now).reshape(2, n)
        gap = (self.x + u - pin) ** 2 / (2 * self.case.radius) - w - now.unknowns[-1]
        touching = np.where(now.touching, normal < least, gap < -least)
        exceeds = np.abs(shear) > -self.case.intrinsic_friction * normal + least
        drags = now.sliding * (u - now.held - push) > least
        begun, kept = np.where(exceeds, np.sign(shear), 0.0), np.where(drags, 0.0, now.sliding)
        sliding = np.where(now.sliding == 0.0, begun, kept)
        held = np.where(now.touching, now.held, u - push)
        return replace(now, touching=touching, sliding=np.where(touching & now.touching, sliding, 0.0), held=held)


def rows() -> list[Row]:
    """Time of one increment: the peer's, ours at residual_shear 1, and one event of the stress-drop rule."""
    case = Case(slab=Slab(n_x=129), slip_rule=SlipRule(residual_shear=1.0), max_events=None, max_displacement=INCREMENT)
    compliance = surface_compliance(case.slab)
    start = contact_state(case, compliance)
    record = slide(case, compliance, start)
    ours = best(lambda: slide(case, compliance, start), repeats=3)
    slab = FiniteElementSlab(case)
    touch = slab.held_there(slab.increment(slab.rest(), 0.0, 0.0))
    moved = slab.increment(touch, INCREMENT, INCREMENT)
    peer = best(lambda: slab.increment(touch, INCREMENT, INCREMENT), repeats=1)
    here, there = record.final_force / case.normal_load, slab.friction(moved)
    paper = Case(slab=case.slab, max_events=2000)
    event = best(lambda: friction_record(paper, compliance), repeats=3) / 2000
    name = f"scikit-fem, 129 × 129 bilinear quadrilaterals, {moved.rounds} active-set rounds"
    what = f"Coulomb increment of {INCREMENT:g} L_x, n_x = 129: {len(record.kind)} changes between stick and slip"
    near, event_ratio = verdict(f"F/W within {SAME:.0%}", abs(here - there) <= SAME * there), f"1/{peer / event:.0f}"
    return [
        versus(f"{what}, F/W = {here:.4f} against {there:.4f}", ours, peer, name, near, ratio=f"1/{peer / ours:.0f}"),
        versus("event of the stress-drop rule, n_x = 129", event, peer, name, ratio=event_ratio),
    ]
