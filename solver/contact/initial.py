"""Normal contact at a given load (§2.1.1, §3.1): constraints I-III at first touch -> ContactState.

I. pressure ≥ 0 in contact; II. |shear| ≤ μ_i·pressure; III. no node above the pin. The load W is given and the approach
unknown: ΣN = W in every state.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from solver import _kernels
from solver.case import Case
from solver.compliance import SurfaceCompliance
from solver.conditioning import explained
from solver.coulomb import CoulombContact, CoulombError
from solver.outcome import COMPLETED, Ending, InvalidInput, Outcome, SingularOperator, TooFarApart
from solver.pin import pin_of, surface_from_pin
from solver.pressing import Pressed, pressed
from solver.soundness import NOT_FINITE, STEEP_PIN, soundness
from solver.tableau import Core, core_of, steadied

Vector = NDArray[np.float64]

ENDINGS = {
    _kernels.DONE: COMPLETED,
    _kernels.FULL: COMPLETED,
    _kernels.SLIP_UNBOUNDED: Outcome(
        Ending.SLIP_UNBOUNDED,
        "no slip (at residual 1: no motion) satisfies the friction law here: lower intrinsic_friction, or raise n_x",
    ),
    _kernels.CASCADE_LIMIT: Outcome(
        Ending.CASCADE_LIMIT, "one event needed more slips than slip.cascade_limit: raise it, or lower slip.residual"
    ),
    _kernels.CONTACT_LOST: Outcome(
        Ending.CONTACT_LOST,
        "no node is left that can carry the load: the pin has left the slab; lower the displacement limit",
    ),
    _kernels.EDGE_REACHED: Outcome(
        Ending.EDGE_REACHED,
        "the punch's edge has come upon the next node, where a sharp edge has no answer: "
        "lower the displacement limit, or raise n_x",
    ),
    _kernels.CONTACT_CYCLE: Outcome(
        Ending.CONTACT_NOT_CONVERGED,
        "nodes touch and are released in turn, no contact set satisfies the constraints: "
        "use the other first_touch, the scheme galerkin, or another n_x",
    ),
    _kernels.DRIFTED: Outcome(
        Ending.SINGULAR_OPERATOR,
        "the compliance of the nodes in contact is so ill-conditioned that forces and displacements disagree by more than "
        "1e-10: use the scheme galerkin, or an aspect_ratio nearer 1",
    ),
    _kernels.OVERSHOT: Outcome(
        Ending.OVERSHOT,
        "the smallest step pushed nodes beyond μ_i·pressure by more than 1e-4 of μ_i·W: lower slip.event_floor, or, where it "
        "is small, the radius or the displacement limit",
    ),
    _kernels.STEEP: STEEP_PIN,
    _kernels.NOT_FINITE: NOT_FINITE,
    _kernels.NO_EVENT: Outcome(
        Ending.NO_EVENT,
        "no displacement triggers an event: the contact sticks; set limits.displacement, or lower intrinsic_friction",
    ),
}
"""What the compiled core's return codes mean to a user."""

NO_STUCK_TOUCH = Outcome(
    Ending.CONTACT_NOT_CONVERGED,
    "no choice of sticking and sliding nodes obeys Coulomb's law with all of them brought down at once: "
    'use first_touch = "gradual"',
)
"""Nodes at the edge stick and slide, touch and leave in turn: a contact that grows with its load has no such choice."""

OUT_FROM_UNDER = Outcome(
    Ending.EDGE_REACHED,
    "pressed down without friction, a node moves out from under the punch's edge, where a sharp edge has no answer: "
    'lower load, or use first_touch = "stick" or "gradual"',
)
"""The node would have to be both under the punch and beside it."""

BROKEN = {outcome.ending: outcome for outcome in ENDINGS.values()}
"""The same by ending."""


ROUNDINGS_FAULT = (
    Ending.CONTACT_NOT_CONVERGED,
    Ending.SLIP_UNBOUNDED,
    Ending.CASCADE_LIMIT,
    Ending.SINGULAR_OPERATOR,
    Ending.STEEP_PIN,
)
"""Endings that heights known too coarsely can cause."""


@dataclass(frozen=True, slots=True, eq=False)
class ContactState:
    """The contact at one pin position: arrays of shape (n,) over the surface nodes, read-only.

    pressure ≥ 0 and shear in G (zero where free); slip s_i and gap ≥ 0 in L_x (gap zero in contact); u, w in L_x;
    nodal_force (2, n): f_x and f_z on the slab, in G·L_x per unit depth. approach: how far the pin's lowest point lies below
    the undeformed surface; displacement: δ_p; both in L_x. slips: node slips that constraint II needed.
    """

    contact: NDArray[np.bool_]
    pressure: Vector
    shear: Vector
    slip: Vector
    gap: Vector
    u: Vector
    w: Vector
    nodal_force: NDArray[np.float64]
    approach: float
    displacement: float
    slips: int
    outcome: Outcome

    @property
    def normal_force(self) -> float:
        """ΣN, in G·L_x·L_y."""
        return float(-self.nodal_force[1].sum())

    @property
    def friction_force(self) -> float:
        """ΣF, in G·L_x·L_y: positive where the pin drags the slab to the right."""
        return float(self.nodal_force[0].sum())


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


def first_touch(case: Case, compliance: SurfaceCompliance) -> ContactState:
    """Press the pin into the slab at δ_p = 0 as `case.first_touch` says, until constraints I-III hold.

    Never raises for physics: a state that was not reached carries the reason as its outcome, and the last iterate.
    """
    if case.slab != compliance.slab:
        raise ValueError("the compliance belongs to another slab than the case")
    try:
        state = _touch(case, compliance)
    except (SingularOperator, TooFarApart) as error:
        return _nothing(case, error.outcome)
    return doubted(case, compliance, state)


def doubted(case: Case, compliance: SurfaceCompliance, state: ContactState) -> ContactState:
    """The state, its outcome what becomes of it in the light of the operator's condition and of `soundness`."""
    outcome = explained(state.outcome, compliance, state.contact)
    # Frozen pressures are those of first touch, however far the pin has gone since.
    carried = case.effects.pin_translation or state.displacement == 0.0
    if carried and (outcome.ok or outcome.ending in ROUNDINGS_FAULT):
        found = soundness(case, compliance, state.contact, state.u, state.displacement)
        # What rounding decides is no fault of friction or operator; a flank's steepness counts where all else is well.
        outcome = found if outcome.ok or found.ending is Ending.ROUNDING else outcome
    return replace(state, outcome=outcome)


def _touch(case: Case, compliance: SurfaceCompliance) -> ContactState:
    if not (case.effects.friction and case.effects.coupling):
        return _touch_without_shear(case, compliance)
    if case.slip_rule.residual == 1.0:
        return _touch_with_coulomb_friction(case, compliance)
    if case.first_touch == "gradual":
        return _load_gradually(case, compliance)
    return _touch_at_once(case, compliance)


def _touch_without_shear(case: Case, compliance: SurfaceCompliance) -> ContactState:
    """Nothing holds the surface, or nothing moves it sideways: the normal problem is all there is."""
    found = pressed(case, compliance, stuck=False)
    forces = np.stack((np.zeros_like(found.pressing), -found.pressing))
    outcome = COMPLETED if found.converged else ENDINGS[_kernels.CONTACT_CYCLE]
    if _out_from_under(case, compliance, found):
        outcome = OUT_FROM_UNDER
    return _state(case, compliance, found.contact, forces, found.u, found.v, found.approach, 0.0, 0, outcome)


def _out_from_under(case: Case, compliance: SurfaceCompliance, found: Pressed) -> bool:
    """Whether a node in contact has moved beyond the punch's edge."""
    return bool((np.abs(surface_from_pin(case) + found.u)[found.contact] > pin_of(case).half_width).any())


def _touch_at_once(case: Case, compliance: SurfaceCompliance) -> ContactState:
    found = pressed(case, compliance, case.first_touch == "stick")
    if _out_from_under(case, compliance, found):
        return replace(_nothing(case, OUT_FROM_UNDER), contact=found.contact)
    contact, u, converged = found.contact, np.where(found.contact, found.u, 0.0), found.converged
    height = pin_of(case).height(np.where(contact, surface_from_pin(case) + u, 0.0))
    if not converged and math.isinf(case.intrinsic_friction):
        unsettled = core_of(case, compliance, contact, u, height, whole=True)
        return contact_state(unsettled, ENDINGS[_kernels.CONTACT_CYCLE])
    # Stuck at once, a node near the edge may be pulled in contact and pushed when free; slips then settle it.
    for whole in (False, True)[not converged :]:
        core = core_of(case, compliance, contact, u, height, whole=whole)
        _kernels.aim_displacement(core.state)
        status = _kernels.resolve(core.state, core.rules, _kernels.NOTHING, -1, 1.0)
        state = contact_state(core, ENDINGS[steadied(core, status)])
        if not beyond_window(core, state):
            break
    return state


def _load_gradually(case: Case, compliance: SurfaceCompliance) -> ContactState:
    """Start from a millionth of a millionth of the load on the lowest nodes and raise it event by event."""
    x = surface_from_pin(case)
    height = pin_of(case).height(x)
    core = core_of(case, compliance, height == height.min(), np.zeros_like(x), height, whole=True)
    core.state.inputs[-1] = -1e-12 * case.load
    _kernels.refresh(core.state)
    _kernels.aim_load(core.state)
    status = _kernels.resolve(core.state, core.rules, _kernels.NOTHING, -1, 0.0)
    if status == _kernels.DONE:
        status = _kernels.raise_load(core.state, core.rules, case.load)
    return contact_state(core, ENDINGS[steadied(core, status)])


def _touch_with_coulomb_friction(case: Case, compliance: SurfaceCompliance) -> ContactState:
    x = surface_from_pin(case)
    if case.first_touch == "gradual":
        height = pin_of(case).height(x)
        contact, u, load = height == height.min(), np.zeros_like(x), 1e-9 * case.load
    else:
        found = pressed(case, compliance, case.first_touch == "stick")
        contact, u, load = found.contact, np.where(found.contact, found.u, 0.0), case.load
    solved = CoulombContact(case, compliance, contact, np.zeros_like(x), u, load)
    try:
        if case.first_touch == "stick":
            solved.press()
        else:
            solved.mend()
            solved.raise_load(case.load)
    except CoulombError as error:
        stuck = case.first_touch == "stick" and error.ending is Ending.SLIP_UNBOUNDED
        return coulomb_state(solved, NO_STUCK_TOUCH if stuck else BROKEN[error.ending])
    return coulomb_state(solved, COMPLETED)


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


def _nothing(case: Case, outcome: Outcome) -> ContactState:
    """The state of a contact that could not even be set up."""
    n = case.slab.n_x
    none, blank = np.zeros(n, dtype=np.bool_), np.full(n, math.nan)
    return ContactState(
        none, blank, blank, blank, blank, blank, blank, np.full((2, n), math.nan), math.nan, 0.0, 0, outcome
    )
