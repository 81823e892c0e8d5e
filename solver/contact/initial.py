"""Normal contact at a given load (§2.1.1, §3.1): constraints I-III at initial contact -> ContactState.

I. pressure ≥ 0 in contact; II. |shear| ≤ μ_i·pressure; III. no node above the pin. The load W is given and the approach
unknown: ΣN = W in every state.
"""

import math
from dataclasses import replace

import numpy as np

from solver.case import Case
from solver.contact import kernels
from solver.contact.coulomb import CoulombContact, CoulombError
from solver.contact.normal import Pressed, pressed
from solver.contact.pin import pin_of, surface_from_pin
from solver.contact.soundness import soundness
from solver.contact.state import BROKEN, ENDINGS, ContactState, _state, beyond_window, contact_state, coulomb_state
from solver.contact.tableau import core_of, steadied
from solver.elasticity.compliance import SurfaceCompliance
from solver.elasticity.conditioning import explained
from solver.outcome import COMPLETED, Ending, Outcome, SingularOperator, TooFarApart

NO_STUCK_TOUCH = Outcome(
    Ending.CONTACT_NOT_CONVERGED,
    "no choice of sticking and sliding nodes obeys Coulomb's law with all of them brought down at once: "
    'use initial_contact = "gradual"',
)
"""Nodes at the edge stick and slide, touch and leave in turn: a contact that grows with its load has no such choice."""
OUT_FROM_UNDER = Outcome(
    Ending.EDGE_REACHED,
    "pressed down without friction, a node moves out from under the punch's edge, where a sharp edge has no answer: "
    'lower normal_load, or use initial_contact = "stick" or "gradual"',
)
"""The node would have to be both under the punch and beside it."""
ROUNDINGS_FAULT = (
    Ending.CONTACT_NOT_CONVERGED,
    Ending.SLIP_UNBOUNDED,
    Ending.CASCADE_LIMIT,
    Ending.SINGULAR_OPERATOR,
    Ending.STEEP_PIN,
)
"""Endings that heights known too coarsely can cause."""


def initial_contact(case: Case, compliance: SurfaceCompliance) -> ContactState:
    """Press the pin into the slab at δ_p = 0 as `case.initial_contact` says, until constraints I-III hold.

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
    # Frozen pressures are those of initial contact, however far the pin has gone since.
    carried = case.effects.pin_translation or state.displacement == 0.0
    if carried and (outcome.ok or outcome.ending in ROUNDINGS_FAULT):
        found = soundness(case, compliance, state.contact, state.u, state.displacement)
        # What rounding decides is no fault of friction or operator; a flank's steepness counts where all else is well.
        outcome = found if outcome.ok or found.ending is Ending.ROUNDING else outcome
    return replace(state, outcome=outcome)


def _touch(case: Case, compliance: SurfaceCompliance) -> ContactState:
    if not (case.effects.friction and case.effects.coupling):
        return _touch_without_shear(case, compliance)
    if case.slip_rule.residual_shear == 1.0:
        return _touch_with_coulomb_friction(case, compliance)
    if case.initial_contact == "gradual":
        return _load_gradually(case, compliance)
    return _touch_at_once(case, compliance)


def _touch_without_shear(case: Case, compliance: SurfaceCompliance) -> ContactState:
    """Nothing holds the surface, or nothing moves it sideways: the normal problem is all there is."""
    found = pressed(case, compliance, stuck=False)
    forces = np.stack((np.zeros_like(found.pressing), -found.pressing))
    outcome = COMPLETED if found.converged else ENDINGS[kernels.CONTACT_CYCLE]
    if _out_from_under(case, compliance, found):
        outcome = OUT_FROM_UNDER
    return _state(case, compliance, found.contact, forces, found.u, found.v, found.approach, 0.0, 0, outcome)


def _out_from_under(case: Case, compliance: SurfaceCompliance, found: Pressed) -> bool:
    """Whether a node in contact has moved beyond the punch's edge."""
    return bool((np.abs(surface_from_pin(case) + found.u)[found.contact] > pin_of(case).half_width).any())


def _touch_at_once(case: Case, compliance: SurfaceCompliance) -> ContactState:
    found = pressed(case, compliance, case.initial_contact == "stick")
    if _out_from_under(case, compliance, found):
        return replace(_nothing(case, OUT_FROM_UNDER), contact=found.contact)
    contact, u, converged = found.contact, np.where(found.contact, found.u, 0.0), found.converged
    height = pin_of(case).height(np.where(contact, surface_from_pin(case) + u, 0.0))
    if not converged and math.isinf(case.intrinsic_friction):
        unsettled = core_of(case, compliance, contact, u, height, whole=True)
        return contact_state(unsettled, ENDINGS[kernels.CONTACT_CYCLE])
    # Stuck at once, a node near the edge may be pulled in contact and pushed when free; slips then settle it.
    for whole in (False, True)[not converged :]:
        core = core_of(case, compliance, contact, u, height, whole=whole)
        kernels.aim_displacement(core.state)
        status = kernels.resolve(core.state, core.rules, kernels.NOTHING, -1, 1.0)
        state = contact_state(core, ENDINGS[steadied(core, status)])
        if not beyond_window(core, state):
            break
    return state


def _load_gradually(case: Case, compliance: SurfaceCompliance) -> ContactState:
    """Start from a millionth of a millionth of the load on the lowest nodes and raise it event by event."""
    x = surface_from_pin(case)
    height = pin_of(case).height(x)
    core = core_of(case, compliance, height == height.min(), np.zeros_like(x), height, whole=True)
    core.state.inputs[-1] = -1e-12 * case.normal_load
    kernels.refresh(core.state)
    kernels.aim_load(core.state)
    status = kernels.resolve(core.state, core.rules, kernels.NOTHING, -1, 0.0)
    if status == kernels.DONE:
        status = kernels.raise_load(core.state, core.rules, case.normal_load)
    return contact_state(core, ENDINGS[steadied(core, status)])


def _touch_with_coulomb_friction(case: Case, compliance: SurfaceCompliance) -> ContactState:
    x = surface_from_pin(case)
    if case.initial_contact == "gradual":
        height = pin_of(case).height(x)
        contact, u, normal_load = height == height.min(), np.zeros_like(x), 1e-9 * case.normal_load
    else:
        found = pressed(case, compliance, case.initial_contact == "stick")
        contact, u, normal_load = found.contact, np.where(found.contact, found.u, 0.0), case.normal_load
    solved = CoulombContact(case, compliance, contact, np.zeros_like(x), u, normal_load)
    try:
        if case.initial_contact == "stick":
            solved.press()
        else:
            solved.mend()
            solved.raise_load(case.normal_load)
    except CoulombError as error:
        stuck = case.initial_contact == "stick" and error.ending is Ending.SLIP_UNBOUNDED
        return coulomb_state(solved, NO_STUCK_TOUCH if stuck else BROKEN[error.ending])
    return coulomb_state(solved, COMPLETED)


def _nothing(case: Case, outcome: Outcome) -> ContactState:
    """The state of a contact that could not even be set up."""
    n = case.slab.n_x
    none, blank = np.zeros(n, dtype=np.bool_), np.full(n, math.nan)
    return ContactState(
        none, blank, blank, blank, blank, blank, blank, np.full((2, n), math.nan), math.nan, 0.0, 0, outcome
    )
