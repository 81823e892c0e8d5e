"""Slide the pin quasistatically from event to event (§2.1.1, §3.2): slip, release, touch -> FrictionRecord."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from nanoslip.solver.case import Case
from nanoslip.solver.contact.initial import checked, initial_contact
from nanoslip.solver.contact.state import ContactState
from nanoslip.solver.elasticity.compliance import Compliance, SurfaceCompliance
from nanoslip.solver.outcome import InvalidInput, Outcome, SingularOperator, TooFarApart
from nanoslip.solver.sliding.columns import empty_events, friction_record
from nanoslip.solver.sliding.coulomb import slide_with_coulomb_friction
from nanoslip.solver.sliding.full_contact import slide_full_contact
from nanoslip.solver.sliding.record import FrictionRecord
from nanoslip.solver.sliding.tangential import slide_with_constant_pressures
from nanoslip.solver.sliding.validity import lawfulness

WayToSlide = Callable[[Case, ContactState, SurfaceCompliance], tuple[FrictionRecord, ContactState]]
"""From a case, a contact to start from and the slab's compliance to a record and the contact where it ends."""


def slide(case: Case, compliance: Compliance, start: ContactState | None = None) -> FrictionRecord:
    """Slide the pin of `case` from initial contact (or from `start`) to its limits, event by event.

    Between events all is linear in δ_p (free gaps: quadratic), so the next event is found in closed form: the smallest step
    at which |shear| = μ_i·pressure, pressure = 0 or gap = 0; a step below the event floor is raised to it. The event's node
    is answered first, then the worst offender until constraints I-III hold. Never raises for physics: the record holds the
    events so far and the outcome says why it ended.
    """
    return slide_to_state(case, compliance, start)[0]


def slide_to_state(
    case: Case, compliance: Compliance, start: ContactState | None = None
) -> tuple[FrictionRecord, ContactState]:
    """Like `slide`, and the contact as it is where the record ends."""
    if not case.effects.friction:
        raise InvalidInput("friction = false: needs the stage contact alone, there is nothing to slide against")
    start = initial_contact(case, compliance) if start is None else start
    if not start.outcome.ok:
        return _no_record(case, start, start), start
    try:
        record, end = way_to_slide(case)(case, start, compliance.as_matrix())
    except (SingularOperator, TooFarApart) as error:
        end = replace(start, outcome=error.outcome)
        record = _no_record(case, start, end)
    end = checked(case, compliance, end)
    if end.outcome.ok and not (found := lawfulness(case, record, end)).ok:
        end = checked(case, compliance, replace(end, outcome=found))
    return record if end.outcome is record.outcome else replace(record, outcome=end.outcome), end


def _no_record(case: Case, start: ContactState, end: ContactState) -> FrictionRecord:
    """The record of a run without events."""
    return friction_record(case, start, math.nan, empty_events(0), np.zeros(case.slab.n_x, np.int64), 0, end)


def way_to_slide(case: Case) -> WayToSlide:
    """Which of the three ways to slide a case asks for."""
    if not case.effects.pin_translation:
        return slide_with_constant_pressures
    if case.slip_rule.residual_shear == 1.0:
        return slide_with_coulomb_friction
    return slide_full_contact


def states_at(case: Case, compliance: Compliance, events: Sequence[int]) -> tuple[list[ContactState], Outcome]:
    """The contact after each of these events, as far as the record of `case` gets, and how that went.

    events: increasing numbers; 0 is initial contact.
    """
    state, done = initial_contact(case, compliance), 0
    states: list[ContactState] = []
    events = [event for event in events if event <= (case.max_events or event)]  # pieces know nothing of that limit
    if case.max_presliding is not None and any(events):  # nor of that one: their first contact is another
        reached = len(slide(case, compliance, state).displacement)
        case, events = replace(case, max_presliding=None), [event for event in events if event <= reached]
    for event in events:
        if event > done and state.outcome.ok:
            record, state = slide_to_state(replace(case, max_events=event - done), compliance, state)
            done += len(record.displacement)
        if done < event or not state.outcome.ok:
            break
        states.append(state)
    return states, state.outcome
