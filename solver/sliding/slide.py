"""Slide the pin of a case quasistatically from event to event (§2.1.1, §3.2), by its rules: slip, release, touch."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from nanoslip.solver.case import Case, Interface
from nanoslip.solver.contact.compiled_contact import empty_events
from nanoslip.solver.contact.initial import diagnose_state, initial_contact
from nanoslip.solver.contact.state import ContactState
from nanoslip.solver.elasticity.compliance import Compliance
from nanoslip.solver.outcome import InvalidInput, Outcome, SingularOperator, TooFarApart
from nanoslip.solver.sliding.constant_pressures import slide_with_constant_pressures
from nanoslip.solver.sliding.coulomb_friction import slide_with_coulomb_friction
from nanoslip.solver.sliding.full_contact import slide_full_contact
from nanoslip.solver.sliding.record import FrictionRecord
from nanoslip.solver.sliding.validity import lawfulness
from nanoslip.solver.sliding.way import Run, SlippedNodes, Way, make_record_view


def slide(case: Case, compliance: Compliance, start: ContactState | None = None) -> FrictionRecord:
    """Slide the pin of `case` from initial contact (or from `start`) to its limits, event by event.

    The next event is the smallest step, at least the event floor, to a shear at its limit, pressure = 0 or gap = 0; then the
    worst offender until constraints I-III hold. Failures of the physics are the record's outcome.
    """
    return slide_to_state(case, compliance, start)[0]


def slide_to_state(
    case: Case, compliance: Compliance, start: ContactState | None = None
) -> tuple[FrictionRecord, ContactState]:
    """Like `slide`, and the contact as it is where the record ends."""
    return run_way(case, compliance, start)[:2]


def run_way(case: Case, compliance: Compliance, start: ContactState | None = None, way: Way | None = None) -> Run:
    """The run along a way from `start`: without one, the record of the case."""
    if not case.effects.friction:
        raise InvalidInput("friction", False, "the stage contact alone, there is nothing to slide against")
    start = initial_contact(case, compliance) if start is None else start
    if not start.outcome.ok:
        return _no_record(case, start, compliance, start)
    try:
        run = _method(case)(case, start, compliance, way or Way(case.normal_load))
    except (SingularOperator, TooFarApart) as error:
        run = _no_record(case, start, compliance, replace(start, outcome=error.outcome))
    end = diagnose_state(case, compliance, run.end)
    if end.outcome.ok and not (lawful := lawfulness(case, start, run.record, end, run.load_work)).ok:
        end = diagnose_state(case, compliance, replace(end, outcome=lawful))
    record = run.record
    record = record if end.outcome is record.outcome else replace(record, outcome=end.outcome)
    return run._replace(record=record, end=end)


def _no_record(case: Case, start: ContactState, compliance: Compliance, end: ContactState) -> Run:
    """The record of a run without events."""
    slipped = SlippedNodes(start.first_node, np.zeros(case.slab.nodes, np.int64))
    return make_record_view(case, start, compliance, math.nan, empty_events(0), slipped, 0, end)


def _method(case: Case) -> Callable[[Case, ContactState, Compliance, Way], Run]:
    """Select one of the three ways to slide, by the case."""
    # One kernel could follow all three: over a flat punch without coupling, where pressures are constant anyhow, records of
    # the full one agree with those of the first to rounding, but each event takes it three to five times as long.
    if not case.effects.pin_translation:
        return slide_with_constant_pressures
    return slide_with_coulomb_friction if case.slip_rule.residual_shear == 1.0 else slide_full_contact


def find_states(case: Case, compliance: Compliance, events: Sequence[int]) -> tuple[list[ContactState], Outcome]:
    """The contact after each of these events, as far as the record of `case` gets, and how that went.

    events: increasing numbers; 0 is initial contact. Of an interface it is the first contact, by itself.
    """
    case = replace(case, interface=Interface())
    state, done = initial_contact(case, compliance), 0
    states: list[ContactState] = []
    events = [event for event in events if event <= (case.max_events or event)]  # pieces know nothing of that limit
    if case.max_presliding is not None and any(events):  # nor of that one: their first contact is another
        reached = len(slide(case, compliance, state).displacement)
        case = replace(case, max_presliding=None, max_events=max(reached, 1))
        events = [event for event in events if event <= reached]
    for event in events:
        if event > done and state.outcome.ok:
            record, state = slide_to_state(replace(case, max_events=event - done), compliance, state)
            done += len(record.displacement)
        if done < event or not state.outcome.ok:
            break
        states.append(state)
    return states, state.outcome
