"""Slide with the whole contact: nodes slip, are released and touch as the pin moves over them (residual_shear below 1)."""

import numpy as np

from nanoslip.solver.case import MOST_EVENTS, Case
from nanoslip.solver.contact.compiled_contact import CompiledContact, compiled_contact, corrected_for_rounding
from nanoslip.solver.contact.kernels.cascade import answer_violations
from nanoslip.solver.contact.kernels.enumerations import Stop
from nanoslip.solver.contact.kernels.equilibrium import total_shear
from nanoslip.solver.contact.outcomes import OUTCOME_OF_STOP
from nanoslip.solver.contact.pin import pin_of, surface_from_pin
from nanoslip.solver.contact.state import ContactState, beyond_window, contact_state
from nanoslip.solver.contact.window import within_reach
from nanoslip.solver.elasticity.compliance import SurfaceCompliance, uncoupled
from nanoslip.solver.outcome import COMPLETED
from nanoslip.solver.sliding.columns import farthest, first_of, first_room, friction_record, grown
from nanoslip.solver.sliding.kernels.full_contact import slide_events
from nanoslip.solver.sliding.record import FrictionRecord

RESUMABLE = 10_000
"""Events after which a run starts afresh from its own state: a run in pieces of so many events has the bits of one in one."""
LASTING = 100
"""Events that a rough pin's windows have to last on average to be worth their setting up, else the whole surface is followed."""
AT_FIRST = 8
"""Windows that do not count: while shear builds up the surface heaves."""
GOING_ON = (Stop.FULL, Stop.INACCURATE, Stop.WINDOW_TOO_NARROW)
"""Why the kernel stops though the run does not."""


def slide_full_contact(
    case: Case, start: ContactState, compliance: SurfaceCompliance
) -> tuple[FrictionRecord, ContactState]:
    """Slide from `start` to the limits of `case`: the record, and the contact where it ends.

    Without the effect `coupling` shear and pressure do not act on each other.
    """
    compliance = compliance if case.effects.coupling else uncoupled(compliance)
    found = _slide(case, start, compliance, whole=False)
    if found is None:
        found = _slide(case, start, compliance, whole=True)
        assert found is not None  # there are no nodes beyond the whole surface
    return found


def _slide(
    case: Case, start: ContactState, compliance: SurfaceCompliance, whole: bool
) -> tuple[FrictionRecord, ContactState] | None:
    """The run within windows, or on the whole surface; None where a node beyond a window proves to lie inside the pin."""
    compiled = compiled_at(case, compliance, start, whole)
    initial_stiffness = total_shear(compiled.state.contact, compiled.state.rate)
    most, end_at = case.max_events or MOST_EVENTS, farthest(case, initial_stiffness)
    events, node_slips, held, windows = first_room(most), np.zeros(case.slab.n_x, np.int64), 0, 0
    while True:
        stop = min(len(events.displacement), most, (held // RESUMABLE + 1) * RESUMABLE)
        room = first_of(events, stop)
        status, held = slide_events(compiled.state, compiled.constants, room, node_slips, held, end_at)
        if status not in GOING_ON or (status == Stop.FULL and held == most):
            break
        if held == len(events.displacement):
            events = grown(events)
        windows += status == Stop.WINDOW_TOO_NARROW
        short = bool(case.heterogeneity.roughness) and windows > AT_FIRST + held % RESUMABLE / LASTING
        continued, status = _continued(compiled, status, whole, whole or short, anew=held % RESUMABLE == 0)
        if continued is None:
            return None
        compiled, windows = continued, windows if held % RESUMABLE else 0
        if status != Stop.DONE:
            break
    end = contact_state(compiled, OUTCOME_OF_STOP[corrected_for_rounding(compiled, status)])
    if beyond_window(compiled, end):
        return None
    return friction_record(case, start, initial_stiffness, events, node_slips, held, end), end


def _continued(
    compiled: CompiledContact, status: Stop, whole: bool, widest: bool, anew: bool
) -> tuple[CompiledContact | None, Stop]:
    """A compiled contact to go on with after `status`, one of GOING_ON, and DONE or why it cannot go on.

    widest: whether what follows a window is the whole surface. anew: set up from its own state, as a resumed run is. None where
    a node beyond the window lies inside the pin.
    """
    followed: CompiledContact | None = compiled
    if status == Stop.WINDOW_TOO_NARROW:
        followed = _set_up_again(compiled, widest)
        if followed is None:
            return None, status
        compiled, status = followed, answer_violations(followed.state, followed.constants, 1.0)
    else:
        status = corrected_for_rounding(compiled, Stop.DONE)
    if anew and status == Stop.DONE:
        status = corrected_for_rounding(compiled, status)
        followed = _set_up_again(compiled, whole)
    return followed, status


def _set_up_again(compiled: CompiledContact, whole: bool) -> CompiledContact | None:
    """The contact set up from its own state; None where a node beyond the window lies inside the pin."""
    state = contact_state(compiled, COMPLETED)
    return None if beyond_window(compiled, state) else compiled_at(compiled.case, compiled.compliance, state, whole)


def compiled_at(case: Case, compliance: SurfaceCompliance, state: ContactState, whole: bool) -> CompiledContact:
    """A compiled contact in this state."""
    contact, u, displacement = state.contact, state.u, state.displacement
    height = pin_of(case).height(np.where(contact, surface_from_pin(case) + u - displacement, 0.0))
    everywhere = np.ones_like(contact)
    followed = everywhere if whole else within_reach(case, contact, u, state.w + state.approach, displacement)
    return compiled_contact(case, compliance, contact, u, height, followed, displacement)
