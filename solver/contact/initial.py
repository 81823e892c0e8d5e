"""Normal contact at a given load (§2.1.1, §3.1): constraints I-III at initial contact -> ContactState.

I. pressure ≥ 0 in contact; II. |shear| ≤ μ_i·pressure; III. no node above the pin. The load W is given and the approach
unknown: ΣN = W in every state.
"""

import math
from dataclasses import replace
from typing import Any, Final

import numpy as np

from nanoslip.solver.case import Case
from nanoslip.solver.contact import coulomb
from nanoslip.solver.contact.compiled_contact import (
    CompiledContact,
    answer_violations,
    compile_contact,
    contact_value,
    correct_rounding,
    empty_events,
    has_node_beyond_window,
)
from nanoslip.solver.contact.convolved import convolve_contact
from nanoslip.solver.contact.kernels.path import follow_path
from nanoslip.solver.contact.kernels.state import Direction, Stop
from nanoslip.solver.contact.normal import INSIDE, NormalContact, normal_contact
from nanoslip.solver.contact.pin import (
    estimate_half_width,
    make_pin,
    nodes_under_pin,
    surface_from_axis,
    surface_from_pin,
)
from nanoslip.solver.contact.soundness import (
    NOTHING_UNDER_PUNCH,
    OUTCOME_OF_STOP,
    accuracy_of_heights,
    advise,
    advise_on_pillars,
    soundness,
)
from nanoslip.solver.contact.state import ContactState, state_from_forces
from nanoslip.solver.contact.window import nodes_in_reach
from nanoslip.solver.elasticity.compliance import Compliance, EndlessCompliance, explain_outcome
from nanoslip.solver.outcome import COMPLETED, Ending, Outcome, SingularOperator, TooFarApart

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
IN_UNDER = Outcome(
    Ending.EDGE_REACHED,
    "pressed down without friction, a node beside the punch moves in under its edge, where a sharp edge has no answer: "
    "lower normal_load, or use another half_width or n_x",
)
"""It stands higher than the punch, beside which it may stand, and under which it may not."""
CAUSED_BY_ROUNDING = (
    Ending.CONTACT_NOT_CONVERGED,
    Ending.SLIP_UNBOUNDED,
    Ending.CASCADE_LIMIT,
    Ending.SINGULAR_OPERATOR,
    Ending.STEEP_PIN,
    Ending.CONTACT_LOST,
)
"""Endings that rounded heights can cause."""


def initial_contact(case: Case, compliance: Compliance) -> ContactState:
    """Press the pin into the slab at δ_p = 0 by `case.initial_contact`, until constraints I-III hold.

    Never raises for physics: a state that was not reached carries the reason as its outcome, and the last iterate.
    """
    if case.slab != compliance.slab:
        raise ValueError("the compliance belongs to another slab than the case")
    # A disc that is narrower than the distance between rows may come down between two of them.
    if not nodes_under_pin(case).any():
        return _nothing(case, NOTHING_UNDER_PUNCH)
    try:
        state = _touch(case, compliance)
    except (SingularOperator, TooFarApart) as error:
        return _nothing(case, error.outcome)
    return diagnose_state(case, compliance, state)


def diagnose_state(case: Case, compliance: Compliance, state: ContactState) -> ContactState:
    """The state, its outcome checked against the condition of the operator and against `soundness`."""
    explanation = explain_outcome(advise(case, state.outcome), compliance, state.contact)
    outcome = advise_on_pillars(case, explanation)
    # Constant pressures are those of initial contact, however far the pin has gone since.
    carried = case.effects.pin_translation or state.displacement == 0.0
    if carried and (outcome.ok or outcome.ending in CAUSED_BY_ROUNDING):
        where = (state.contact, state.u, state.displacement, state.first_node)
        softness = compliance.own_displacement()
        verdict = soundness(case, softness, *where)
        if outcome.ok and verdict.ok:
            verdict = accuracy_of_heights(case, softness, state)
        verdict = advise_on_pillars(case, verdict)
        # What rounding decides is no fault of friction or operator; a flank's steepness counts where all else is well.
        outcome = verdict if outcome.ok or verdict.ending is Ending.ROUNDING else outcome
    return state if outcome is state.outcome else replace(state, outcome=outcome)


def _touch(case: Case, compliance: Compliance) -> ContactState:
    """Find initial contact by the case's method."""
    if not (case.effects.friction and case.effects.coupling):
        return _touch_without_shear(case, compliance)
    if case.slip_rule.residual_shear == 1.0:
        return _touch_with_coulomb_friction(case, compliance)
    return (_load_gradually if case.initial_contact == "gradual" else _touch_at_once)(case, compliance)


def _touch_without_shear(case: Case, compliance: Compliance) -> ContactState:
    """Solve the normal problem alone: nothing holds the surface, or nothing moves it sideways."""
    if isinstance(compliance, EndlessCompliance):
        pressed = convolve_contact(case, compliance.convolution)
    else:
        pressed = normal_contact(case, compliance, stuck=False)
    outcome = COMPLETED if pressed.converged else _why_unsettled(case, compliance, pressed)
    return _free_of_shear(case, compliance, pressed, _edge_error(case, pressed) or outcome)


def _free_of_shear(case: Case, compliance: Compliance, pressed: NormalContact, outcome: Outcome) -> ContactState:
    """The state of a contact whose nodes bear pressure alone."""
    forces = np.stack((np.zeros_like(pressed.normal_force), -pressed.normal_force))
    return state_from_forces(
        case, compliance.widths, pressed.contact, forces, pressed.u, pressed.v, pressed.approach, 0.0, 0, outcome
    )


def _why_unsettled(case: Case, compliance: Compliance, pressed: NormalContact) -> Outcome:
    """Reason why no contact was pressed: on flanks that are too steep nodes move further and further."""
    cause = soundness(case, compliance.own_displacement(), pressed.contact, pressed.u, 0.0)
    return OUTCOME_OF_STOP[Stop.CONTACT_CYCLE] if cause.ok else cause


def _edge_error(case: Case, pressed: NormalContact) -> Outcome | None:
    """Reason why a punch pressed down without friction has no solution at its edge; None if it has one.

    A node in contact has moved beyond the edge, or a free one in under it and into the punch: nothing could slide from there.
    """
    pin, xi = make_pin(case), surface_from_pin(case) + pressed.u
    if (pressed.contact & (np.abs(xi) > pin.half_width)).any():
        return OUT_FROM_UNDER
    inside = pin.height(xi) - pressed.v < -INSIDE * case.normal_load
    return IN_UNDER if pressed.converged and (inside & ~pressed.contact).any() else None


def _touch_at_once(case: Case, compliance: Compliance) -> ContactState:
    """Solve the normal problem, nodes stuck or free of friction; then let nodes slip until constraint II holds."""
    pressed = normal_contact(case, compliance, case.initial_contact == "stick")
    edge = _edge_error(case, pressed) if case.initial_contact == "frictionless" else None
    if edge:
        return replace(_nothing(case, edge), contact=pressed.contact)
    contact, u, converged = pressed.contact, np.where(pressed.contact, pressed.u, 0.0), pressed.converged
    if converged and case.initial_contact == "frictionless":
        return _free_of_shear(case, compliance, pressed, COMPLETED)  # then there is nothing to slip
    # Only nodes in contact are brought to a height; others may stand beyond the edge, where it is infinite.
    height = make_pin(case).height(np.where(contact, surface_from_pin(case) + u, 0.0))
    everywhere = np.ones_like(contact)
    if not converged and math.isinf(case.intrinsic_friction):
        unfinished = compile_contact(case, compliance, contact, u, height, everywhere)
        return contact_value(unfinished, OUTCOME_OF_STOP[Stop.CONTACT_CYCLE])
    # Stuck at once, a node near the edge may be pulled in contact and pushed when free; slips then decide.
    expected = contact if converged else contact | (surface_from_axis(case) <= estimate_half_width(case))
    # In a window, whose slips cost less; on the whole surface if a node beyond proves to lie inside the pin.
    for followed in (nodes_in_reach(case, expected, pressed.u, pressed.v), everywhere):
        compiled = compile_contact(case, compliance, contact, u, height, followed)
        status = answer_violations(compiled)
        state = contact_value(compiled, OUTCOME_OF_STOP[correct_rounding(compiled, status)])
        if (converged or state.outcome.ok) and not has_node_beyond_window(compiled, state):
            break
    return state


def _load_gradually(case: Case, compliance: Compliance) -> ContactState:
    """Start from a millionth of a millionth of the load on the lowest nodes and raise it event by event."""
    x = surface_from_pin(case)
    height = make_pin(case).height(x)
    lowest = height == height.min()
    everywhere = np.ones(len(x), dtype=np.bool_)
    compiled = compile_contact(
        case, compliance, lowest, np.zeros_like(x), height, everywhere, load=1e-12 * case.normal_load, direction=PRESSED
    )
    status, slips = _raise_load(compiled, case.normal_load)
    state = contact_value(compiled, OUTCOME_OF_STOP[correct_rounding(compiled, status)])
    return replace(state, slips=slips)


PRESSED: Final = Direction(pin_rate=0.0, load_rate=1.0)
"""The load grows, the pin rests."""
ROOM: Final = 4096
"""Events of a rising load for which room is made; none is kept."""


def _raise_load(compiled: CompiledContact, load: float) -> tuple[Stop, int]:
    """Raise the load event by event, the pin held; why that ended, and the node slips of all events."""
    events = empty_events(ROOM)
    node_slips = np.zeros(len(compiled.state.x), np.int64)
    status = answer_violations(compiled)
    slips, moved = int(compiled.state.scalars["slips"]), 0
    while status == Stop.DONE:
        status, count = follow_path(compiled.state, compiled.constants, events, node_slips, 0, load)
        if status not in (Stop.FULL, Stop.INACCURATE):
            break
        moved += count
        if moved + node_slips.sum() >= compiled.case.slip_rule.cascade_limit:  # an event costs as much as a slip
            status = Stop.CASCADE_LIMIT
            break
        status = correct_rounding(compiled, Stop.DONE)
    return status, slips + int(node_slips.sum())


def _touch_with_coulomb_friction(case: Case, compliance: Compliance) -> ContactState:
    """Find initial contact with Coulomb friction (residual_shear 1): full load at once, or raised from a billionth."""
    x = surface_from_pin(case)
    if case.initial_contact == "gradual":
        height = make_pin(case).height(x)
        # A load so small that it displaces less than heights differ: the lowest nodes alone bear it.
        contact = height == height.min()
        u, normal_load = np.zeros_like(x), 1e-9 * case.normal_load
    else:
        pressed = normal_contact(case, compliance, case.initial_contact == "stick")
        contact, u, normal_load = pressed.contact, np.where(pressed.contact, pressed.u, 0.0), case.normal_load
    solved = coulomb.CoulombContact(case, compliance, contact, np.zeros_like(x), u, normal_load, direction=PRESSED)
    try:
        if case.initial_contact == "stick":
            coulomb.stick_and_slide_at_rest(solved)
        else:
            coulomb.settle_roles(solved)
            coulomb.raise_load_of_sliding(solved, case.normal_load)
    except coulomb.CoulombError as error:
        stuck = case.initial_contact == "stick" and error.ending is Ending.SLIP_UNBOUNDED
        return coulomb.coulomb_state(solved, NO_STUCK_TOUCH if stuck else error.outcome)
    return coulomb.coulomb_state(solved, COMPLETED)


def _nothing(case: Case, outcome: Outcome) -> ContactState:
    """The state of a contact that could not even be set up."""
    n = case.slab.nodes
    blank: dict[str, Any] = dict.fromkeys(("u", "w", "pressure", "shear", "slip", "gap"), np.full(n, math.nan))
    blank |= {"contact": np.zeros(n, dtype=np.bool_), "nodal_force": np.full((2, n), math.nan)}
    return ContactState(**blank, displacement=0.0, outcome=outcome, approach=math.nan, slips=0, rows=case.slab.rows)
