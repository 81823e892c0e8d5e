"""The columns of a friction record while it grows, and the record made of them."""

import math

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.case import Case
from nanoslip.solver.contact.state import ContactState
from nanoslip.solver.slab import surface_x
from nanoslip.solver.sliding.kernels.events import Events
from nanoslip.solver.sliding.record import EVENT_TYPES, FrictionRecord

FIRST_CAPACITY = 4096
"""Events for which room is made first; it doubles as they come."""


def first_room(most: int) -> Events:
    """Columns to begin with in a run of at most so many events."""
    return empty_events(min(most, FIRST_CAPACITY))


def empty_events(capacity: int) -> Events:
    """Columns for so many events, not filled."""
    return Events(**{name: np.empty(capacity, dtype) for name, dtype in EVENT_TYPES.items()})


def first_of(events: Events, count: int) -> Events:
    """Room for the first `count` events."""
    if count == len(events.displacement):
        return events
    return Events(**{name: column[:count] for name, column in events._asdict().items()})


def grown(events: Events) -> Events:
    """The same events with room for twice as many."""
    grown = empty_events(2 * len(events.displacement))
    for name in events._fields:
        old = getattr(events, name)
        getattr(grown, name)[: len(old)] = old
    return grown


def presliding_length(case: Case, stiffness: float) -> float:
    """μ_i·W/K in L_x, from the contact's lateral stiffness K (G·L_y); infinite where K is not above 0."""
    if case.intrinsic_friction == 0.0:
        return 0.0
    return case.intrinsic_friction * case.normal_load / stiffness if stiffness > 0.0 else math.inf


def farthest(case: Case, stiffness: float) -> float:
    """δ_p in L_x at which a record ends at the latest; stiffness: of the contact before it slides, in G·L_y."""
    length = presliding_length(case, stiffness)
    if case.max_presliding is None or not length:  # without friction nothing preslides
        return case.farthest
    return min(case.farthest, case.max_presliding * length)


def friction_record(
    case: Case,
    start: ContactState,
    initial_stiffness: float,
    events: Events,
    node_slips: NDArray[np.int64],
    held: int,
    end: ContactState,
) -> FrictionRecord:
    """The record of a run of `held` events from `start` to `end`, read-only. node_slips: of each surface node, (n_x,)."""
    full = held == len(events.displacement)
    columns = {name: column if full else column[:held].copy() for name, column in events._asdict().items()}
    for column in (*columns.values(), node_slips):
        column.setflags(write=False)
    final = (end.displacement, end.friction_force)
    if held and not end.outcome.ok:
        # A run that broke off inside an event ends, as a record, with its last whole event.
        final = (float(columns["displacement"][-1]), float(columns["force_after"][-1]))
    return FrictionRecord(
        **columns,
        node_x=surface_x(case.slab.n_x),
        node_slips=node_slips,
        normal_load=case.normal_load,
        spacing=case.slab.spacing if case.effects.pin_translation else math.inf,
        presliding_length=presliding_length(case, initial_stiffness),
        initial_force=start.friction_force,
        initial_stiffness=initial_stiffness,
        initial_slips=start.slips,
        initial_contact_size=int(start.contact.sum()),
        end_nodes=sum([bool(start.contact[node] | end.contact[node]) for node in (0, -1)]),
        final_displacement=final[0],
        final_force=final[1],
        outcome=end.outcome,
    )
