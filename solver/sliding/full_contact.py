"""Slide with the whole contact: nodes slip, are released and touch as the pin moves over them (residual_shear below 1)."""

import math
from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.case import MOST_EVENTS, Case
from nanoslip.solver.contact.compiled_contact import (
    CompiledContact,
    advance_grid,
    answer_violations,
    compile_contact,
    contact_value,
    correct_rounding,
    has_node_beyond_window,
)
from nanoslip.solver.contact.kernels.path import Events, follow_path
from nanoslip.solver.contact.kernels.state import Direction, Stop, total_shear
from nanoslip.solver.contact.pin import make_pin, surface_from_pin
from nanoslip.solver.contact.soundness import OUTCOME_OF_STOP
from nanoslip.solver.contact.state import ContactState
from nanoslip.solver.contact.window import dropped_nodes, nodes_in_reach
from nanoslip.solver.elasticity.compliance import Compliance
from nanoslip.solver.outcome import COMPLETED
from nanoslip.solver.progress import report_progress
from nanoslip.solver.sliding.record import extend_record, presliding_length
from nanoslip.solver.sliding.way import (
    Run,
    SlippedNodes,
    Way,
    allocate_events,
    first_room,
    grow_events,
    initial_limit,
    make_record_view,
)

RESUMABLE = 10_000
"""Number of events, for each row of nodes, after which a run restarts from its state: a run in such pieces has the same bits as
one run. To set up the window of a plane takes as long as thousands of events."""
REPORTED = 1_000_000
"""Number of events, times nodes of the window, between two reports of progress: some tenths of a second."""
LASTING = 100
"""Events that a rough pin's windows have to last on average to be worth their setting up, else the whole surface is followed."""
AT_FIRST = 8
"""Windows that do not count: while shear builds up the surface heaves."""
GOING_ON = (Stop.FULL, Stop.INACCURATE, Stop.WINDOW_TOO_NARROW)
"""Stops of the kernel after which the run continues."""


def slide_full_contact(case: Case, start: ContactState, compliance: Compliance, way: Way) -> Run:
    """Follow the way from `start`.

    Without the effect `coupling` shear and pressure do not act on each other.
    """
    compliance = compliance if case.effects.coupling else compliance.decouple()
    run = _slide(case, start, compliance, way, whole=False)
    if run is None:
        run = _slide(case, start, compliance, way, whole=True)
        assert run is not None  # there are no nodes beyond the whole surface
    return run


def _slide(case: Case, start: ContactState, compliance: Compliance, way: Way, whole: bool) -> Run | None:
    """The run within windows, or on the whole surface; None if a node beyond a window proves to lie inside the pin."""
    compiled = compile_state(case, compliance, start, whole, way)
    initial_stiffness = way.stiffness(total_shear(compiled.state.contact, compiled.state.rate))
    presliding = presliding_length(initial_limit(case, start, compliance), initial_stiffness)
    most, end_at = case.max_events or MOST_EVENTS, way.end(case, presliding)
    share = partial(_share_done, case, start, way, presliding)
    piece = RESUMABLE * case.slab.rows
    events, count, windows, load_work = first_room(most), 0, 0, 0.0
    slipped = SlippedNodes(start.first_node, np.zeros(case.slab.nodes, np.int64))
    while True:
        stop = min(len(events.displacement), most, (count // piece + 1) * piece)
        before, first, window = count, compiled.first_node, compiled.window
        slips = np.zeros(len(window), np.int64)
        status, count = _follow_in_batches(compiled, allocate_events(events, stop), slips, count, end_at, share)
        slipped.grid_slips(first, case.slab.nodes)[window] += slips
        # Kernels count nodes from the first of the window.
        events.node[before:count] = first + window[events.node[before:count]]
        beyond = extend_record(case, presliding, count) if math.isnan(way.until) else end_at
        # A record with few enough events goes on (`extend_record`): how many there are is known only at its first end.
        if status == Stop.DONE and end_at < beyond:
            end_at = beyond
            continue
        if status not in GOING_ON or (status == Stop.FULL and count == most):
            break
        if count == len(events.displacement):
            events = grow_events(events)
        windows += status == Stop.WINDOW_TOO_NARROW
        short = bool(case.heterogeneity.roughness) and windows > AT_FIRST + count % piece / LASTING
        going_on, status = continue_contact(compiled, status, whole, whole or short, anew=count % piece == 0)
        if going_on is None:
            return None
        if going_on is not compiled:
            load_work += compiled.state.scalars["load_work"]
        compiled, windows = going_on, windows if count % piece else 0
        if status != Stop.DONE:
            break
    end = contact_value(compiled, OUTCOME_OF_STOP[correct_rounding(compiled, status)])
    if has_node_beyond_window(compiled, end):
        return None
    load_work += compiled.state.scalars["load_work"]
    return make_record_view(case, start, compliance, initial_stiffness, events, slipped, count, end, load_work)


def _follow_in_batches(
    compiled: CompiledContact,
    events: Events,
    slips: NDArray[np.int64],
    count: int,
    end_at: float,
    share: Callable[[CompiledContact, int, float], float],
) -> tuple[Stop, int]:
    """`follow_path` in batches that report progress. They change no bit: between events all of its state is in `compiled`.

    share: the share of the run that is done, see `_share_done`.
    """
    batch = max(REPORTED // len(compiled.window), 1)
    while True:
        room = allocate_events(events, min(count + batch, len(events.displacement)))
        status, count = follow_path(compiled.state, compiled.constants, room, slips, count, end_at)
        if status != Stop.FULL or count == len(events.displacement):
            return status, count
        report_progress(share(compiled, count, end_at))


def _share_done(
    case: Case, start: ContactState, way: Way, presliding: float, compiled: CompiledContact, count: int, end_at: float
) -> float:
    """Share that is done of a way that ends at `end_at`, or of the events that limit a record, after `count` events."""
    begin, here = start.displacement, float(compiled.state.scalars["displacement"])
    if not way.direction.pin_rate:
        begin, here = way.load, float(-compiled.state.inputs[-1])
    done = (here - begin) / (end_at - begin) if end_at != begin else 1.0
    if math.isnan(way.until) and done > 0.0:
        # Where it ends first the record has held / done events, and may go on.
        done *= end_at / max(end_at, extend_record(case, presliding, count / done))
    return min(max(done, count / (case.max_events or MOST_EVENTS)), 1.0)


def continue_contact(
    compiled: CompiledContact, status: Stop, follow_all: bool, widest: bool, anew: bool
) -> tuple[CompiledContact | None, Stop]:
    """A compiled contact to go on with after `status` (in GOING_ON), and DONE or why it cannot go on.

    widest: True if the next window is the whole surface. anew: True to set the contact up from its state, as a
        resumed run does. None if a node beyond the window lies inside the pin.
    """
    followed: CompiledContact | None = compiled
    if status == Stop.WINDOW_TOO_NARROW:
        followed = _set_up_again(compiled, widest)
        if followed is None:
            return None, status
        compiled, status = followed, answer_violations(followed)
    else:
        status = correct_rounding(compiled, Stop.DONE)
    if anew and status == Stop.DONE:
        status = correct_rounding(compiled, status)
        followed = _set_up_again(compiled, follow_all)
    return followed, status


def _set_up_again(compiled: CompiledContact, follow_all: bool) -> CompiledContact | None:
    """Set the contact up again from its current state; None if a node beyond the window lies inside the pin."""
    state = contact_value(compiled, COMPLETED)
    if has_node_beyond_window(compiled, state):
        return None
    scalars, load = compiled.state.scalars, float(-compiled.state.inputs[-1])
    way = Way(load, Direction(*(scalars[name] for name in Direction._fields)))
    compiled.give_up()
    return compile_state(compiled.case, compiled.compliance, state, follow_all, way)


def compile_state(
    case: Case, compliance: Compliance, state: ContactState, whole: bool, way: Way | None = None
) -> CompiledContact:
    """A compiled contact in this state; on a surface without ends with a grid that has gone on where the contact has."""
    load, direction, _ = way or Way(case.normal_load)
    followed = _nodes_to_follow(case, state, whole)
    if nodes := dropped_nodes(case, followed, state.contact, direction.pin_rate):
        state = advance_grid(case, compliance, state, nodes)
        followed = _nodes_to_follow(case, state, whole)
    contact, u, displacement, first = state.contact, state.u, state.displacement, state.first_node
    # Of nodes in contact alone: where free ones lie follows from the forces.
    height = make_pin(case).height(np.where(contact, surface_from_pin(case, first) + u - displacement, 0.0))
    place = (displacement, first, load, direction)
    return compile_contact(case, compliance, contact, u, height, followed, *place, slides=True)


def _nodes_to_follow(case: Case, state: ContactState, follow_all: bool) -> NDArray[np.bool_]:
    where = (state.u, state.w + state.approach, state.displacement, state.first_node)
    return np.ones_like(state.contact) if follow_all else nodes_in_reach(case, state.contact, *where)
