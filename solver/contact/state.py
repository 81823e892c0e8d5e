"""What a contact is at one position of the pin: ContactState, and how the solvers' own states become one."""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from solver.case import Case
from solver.contact import kernels
from solver.contact.coulomb import CoulombContact
from solver.contact.pin import pin_of, surface_from_pin
from solver.contact.soundness import NOT_FINITE, STEEP_PIN
from solver.contact.tableau import Core
from solver.elasticity.compliance import SurfaceCompliance
from solver.outcome import COMPLETED, Ending, InvalidInput, Outcome
from solver.quantity import GRID_ERROR, quantity

Vector = NDArray[np.float64]
ENDINGS = {
    kernels.DONE: COMPLETED,
    kernels.FULL: COMPLETED,
    kernels.SLIP_UNBOUNDED: Outcome(
        Ending.SLIP_UNBOUNDED,
        "no slip (at residual_shear 1: no motion) satisfies the friction law here: lower intrinsic_friction, or raise n_x",
    ),
    kernels.CASCADE_LIMIT: Outcome(
        Ending.CASCADE_LIMIT,
        "one event needed more slips than slip.cascade_limit: raise it, or lower slip.residual_shear",
    ),
    kernels.CONTACT_LOST: Outcome(
        Ending.CONTACT_LOST,
        "no node is left that can carry the load: the pin has left the slab; lower the displacement limit",
    ),
    kernels.EDGE_REACHED: Outcome(
        Ending.EDGE_REACHED,
        "the punch's edge has come upon the next node, where a sharp edge has no answer: "
        "lower the displacement limit, or raise n_x",
    ),
    kernels.CONTACT_CYCLE: Outcome(
        Ending.CONTACT_NOT_CONVERGED,
        "nodes touch and are released in turn, no contact set satisfies the constraints: "
        "use the other initial_contact, the scheme galerkin, or another n_x",
    ),
    kernels.DRIFTED: Outcome(
        Ending.SINGULAR_OPERATOR,
        "the compliance of the nodes in contact is so ill-conditioned that forces and displacements disagree by more than "
        "1e-10: use the scheme galerkin, or an aspect_ratio nearer 1",
    ),
    kernels.OVERSHOT: Outcome(
        Ending.OVERSHOT,
        "the smallest step pushed nodes beyond μ_i·pressure by more than 1e-4 of μ_i·W: lower slip.event_floor, or, where it "
        "is small, the radius or the displacement limit",
    ),
    kernels.STEEP: STEEP_PIN,
    kernels.NOT_FINITE: NOT_FINITE,
    kernels.NO_EVENT: Outcome(
        Ending.NO_EVENT,
        "no displacement triggers an event: the contact sticks; set limits.displacement, or lower intrinsic_friction",
    ),
}
"""What the compiled core's return codes mean to a user."""
BROKEN = {outcome.ending: outcome for outcome in ENDINGS.values()}
"""The same by ending."""


@dataclass(frozen=True, slots=True, eq=False)
class ContactState:
    """The contact at one pin position: arrays of shape (n,) over the surface nodes, read-only.

    pressure ≥ 0 and shear in G (zero where free); slip s_i and gap ≥ 0 in L_x (gap zero in contact); u, w in L_x;
    nodal_force (2, n): f_x and f_z on the slab, in G·L_x per unit depth. approach: how far the pin's lowest point lies below
    the undeformed surface; displacement: δ_p; both in L_x. slips: node slips that constraint II needed.
    """

    contact: NDArray[np.bool_]
    pressure: Vector = field(
        metadata=quantity(
            "contact pressure at initial contact over W/(L_x·L_y)",
            "surface_pressure",
            per="normal_load",
            along="surface_node",
        )
    )
    shear: Vector = field(
        metadata=quantity(
            "shear traction at initial contact over W/(L_x·L_y)",
            "surface_shear",
            per="normal_load",
            along="surface_node",
        )
    )
    slip: Vector = field(
        metadata=quantity("slip of the node at initial contact, in L_x", "surface_slip", along="surface_node")
    )
    gap: Vector = field(
        metadata=quantity("gap between slab and pin at initial contact, in L_x", "surface_gap", along="surface_node")
    )
    u: Vector
    w: Vector
    nodal_force: NDArray[np.float64]
    approach: float = field(
        metadata=quantity(
            "approach of the pin below the undeformed surface at initial contact, in L_x", uncertainty=GRID_ERROR
        )
    )
    displacement: float
    slips: int = field(metadata=quantity("node slips of initial contact", "initial_slips"))
    outcome: Outcome

    @property
    def normal_force(self) -> float:
        """ΣN, in G·L_x·L_y."""
        return float(-self.nodal_force[1].sum())

    @property
    def friction_force(self) -> float:
        """ΣF, in G·L_x·L_y: positive where the pin drags the slab to the right."""
        return float(self.nodal_force[0].sum())


@dataclass(frozen=True, slots=True)
class ContactSummary:
    """Single numbers of a contact: forces in G·L_x·L_y, pressure in G."""

    contact_size: int = field(metadata=quantity("nodes in contact after initial contact", "initial_contact_size"))
    maximum_pressure: float = field(
        metadata=quantity(
            "largest pressure after initial contact, over W/(L_x·L_y)", per="normal_load", uncertainty=GRID_ERROR
        )
    )
    friction_force: float = field(
        metadata=quantity("friction force over load after initial contact, F/W", "initial_friction", per="normal_load")
    )


def contact_summary(state: ContactState) -> ContactSummary:
    """The numbers of initial contact that are not in its state as such."""
    return ContactSummary(int(state.contact.sum()), float(state.pressure.max()), state.friction_force)


def mirrored(case: Case, state: ContactState) -> ContactState:
    """The same contact seen in a mirror at the slab's middle: sliding on from it moves the pin to the left.

    Forces, displacements and nodes of what follows are those of the mirror image. Raises InvalidInput where the support, the
    pin's start, its roughness or the nodes' μ_i are not their own mirror image: what follows would meet them unturned.
    """
    if case.slab.support == "right_side":
        raise InvalidInput("support = 'right_side': sliding to the left needs a support that is its own mirror image")
    if case.start:
        raise InvalidInput(f"start = {case.start!r}: sliding to the left needs a pin over the slab's middle, start = 0")
    for name in ("spread", "roughness"):
        given = getattr(case.heterogeneity, name)
        if given:
            raise InvalidInput(f"{name} = {given!r}: sliding to the left needs nodes alike and a smooth pin")
    signs = {"shear": -1.0, "slip": -1.0, "u": -1.0}
    turned = {
        name: signs.get(name, 1.0) * getattr(state, name)[::-1]
        for name in ("pressure", "shear", "slip", "gap", "u", "w")
    }
    turned["contact"] = state.contact[::-1].copy()
    turned["nodal_force"] = np.array([[-1.0], [1.0]]) * state.nodal_force[:, ::-1]
    for value in turned.values():
        value.setflags(write=False)
    return replace(state, displacement=-state.displacement, **turned)


def contact_state(core: Core, outcome: Outcome) -> ContactState:
    """What the compiled core's state says, as a value; nodes beyond its window follow from the compliance."""
    state, n = core.state, core.case.slab.n_x
    inside = (2, len(state.x))
    contact = np.zeros(n, dtype=np.bool_)
    contact[core.window] = state.contact
    forces = np.zeros((2, n))
    forces[:, core.window] = np.where(state.contact, state.response[:-1].reshape(inside), 0.0)
    approach = float(state.response[-1])
    uv = _displacements(core, forces) + np.array([[0.0], [approach]])
    uv[:, core.window] = np.where(state.contact, state.inputs[:-1].reshape(inside), state.response[:-1].reshape(inside))
    found = (contact, forces, uv[0], uv[1], approach, float(state.totals[0]), int(state.counts[0]))
    return _state(core.case, core.compliance, *found, outcome)


def coulomb_state(solved: CoulombContact, outcome: Outcome) -> ContactState:
    """What a contact with Coulomb friction says, as a value."""
    found = (
        solved.contact.copy(),
        solved.force,
        solved.u,
        solved.v,
        solved.approach,
        solved.displacement,
        solved.slips,
    )
    return _state(solved.case, solved.compliance, *found, outcome)


def _state(
    case: Case,
    compliance: SurfaceCompliance,
    contact: NDArray[np.bool_],
    forces: NDArray[np.float64],
    u: Vector,
    v: Vector,
    approach: float,
    displacement: float,
    slips: int,
    outcome: Outcome,
) -> ContactState:
    values = {
        "contact": contact,
        "pressure": -forces[1] / compliance.widths,
        "shear": forces[0] / compliance.widths,
        "slip": np.where(contact, u - displacement, 0.0),
        "gap": np.where(contact, 0.0, pin_of(case).height(surface_from_pin(case) + u - displacement) - v),
        "u": u.copy(),
        "w": v - approach,
        "nodal_force": forces,
    }
    for value in values.values():
        value.setflags(write=False)
    return ContactState(**values, approach=approach, displacement=displacement, slips=slips, outcome=outcome)


def beyond_window(core: Core, state: ContactState) -> bool:
    """Whether a node that the core does not follow lies inside the pin, so that a wider window is needed."""
    gap = state.gap.copy()
    gap[core.window] = 0.0
    return bool(gap.min() < -core.rules.tolerance_gap)


def _displacements(core: Core, forces: NDArray[np.float64]) -> NDArray[np.float64]:
    """[u; w] of all surface nodes, (2, n), under the forces of the window; left zero where there is nothing beyond it."""
    n, nodes = core.case.slab.n_x, np.arange(core.case.slab.n_x)[core.window]
    if len(nodes) == n:
        return np.zeros((2, n))
    columns = np.concatenate((nodes, nodes + n))
    return (core.compliance.matrix[:, columns] @ forces[:, core.window].ravel()).reshape(2, n)
