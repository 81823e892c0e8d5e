"""Pull the pin over the contact itself (Eq. 12 without Eq. 13-15): its friction remembers the way, and no record repeats."""

from functools import partial
from typing import Final, NamedTuple

import numpy as np

from nanoslip.solver.case import Case
from nanoslip.solver.contact.compiled_contact import contact_value, has_node_beyond_window
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.contact.kernels.state import Direction, Stop
from nanoslip.solver.contact.soundness import OUTCOME_OF_STOP
from nanoslip.solver.contact.state import ContactState
from nanoslip.solver.drive import Drive, refuse_with_memory
from nanoslip.solver.driven.kernels.drive import drive_contact
from nanoslip.solver.dynamics.integrators import Pulled, outcome_of_segments, part_reached
from nanoslip.solver.dynamics.kernels.motion import Course, Motion, PinState, Slip, Tally
from nanoslip.solver.dynamics.kernels.steps import empty_record, make_run_result
from nanoslip.solver.dynamics.result import BINS
from nanoslip.solver.elasticity.compliance import Compliance
from nanoslip.solver.outcome import COMPLETED, Ending, Outcome
from nanoslip.solver.sliding.full_contact import GOING_ON, compile_state, continue_contact
from nanoslip.solver.sliding.way import Way

ANY_WAY: Final = Direction(0.0, 0.0, 1)
"""A contact that is set up for a pin which may go forward or back."""


class DrivenContact(NamedTuple):
    """A drive over a contact: the motion, how it ended, and the contact then."""

    run: Course
    outcome: Outcome
    end: ContactState
    events: int
    lost: float
    """Energy that the events dissipated, in G·L_x²·L_y."""


def pulling(case: Case, compliance: Compliance, drive: Drive) -> Pulled:
    """The way to pull the pin of a case over its contact, for `nanoslip.solver.dynamics.duration.measure_motion`."""
    return partial(_pulled, case, compliance, drive)


def _pulled(case: Case, compliance: Compliance, drive: Drive, motion: Motion) -> tuple[Course, Outcome]:
    found = driven_contact(case, compliance, drive, motion)
    return found.run, found.outcome


def driven_contact(case: Case, compliance: Compliance, drive: Drive, motion: Motion) -> DrivenContact:
    """Pull the pin from rest at x = 0 over its contact, from initial contact on.

    The spring is slack at first, the contact as it is: its friction force may be other than 0.
    """
    refuse_with_memory(case)
    start = initial_contact(case, compliance)
    compliance = compliance if case.effects.coupling else compliance.decouple()
    found = _followed(case, compliance, drive, motion, start, whole=False)
    if found is None:
        found = _followed(case, compliance, drive, motion, start, whole=True)
        assert found is not None  # there are no nodes beyond the whole surface
    return found


def _followed(
    case: Case, compliance: Compliance, drive: Drive, motion: Motion, start: ContactState, whole: bool
) -> DrivenContact | None:
    """The drive within windows, or on the whole surface; None if a node beyond a window proves to lie inside the pin."""
    # The window has to hold whichever way the pin will turn.
    compiled = compile_state(case, compliance, start, whole, Way(case.normal_load, ANY_WAY))
    record = empty_record(motion, drive.samples, BINS)
    pin, slip, tally = PinState(0.0, 0.0, 0.0, 0.0), Slip(False, False, 0.0, 0.0, 0.0, 0, 0.0), Tally(0, 0.0, 0.0, 0, 0)
    slips, events, lost = np.empty((0, 5)), 0, 0.0
    while True:
        left, origin = motion.most_slips - len(slips), start.displacement
        pulled = drive_contact(
            compiled.state, compiled.constants, motion, record, pin, slip, tally, drive.step_limit, left, origin
        )
        stop, pin, slip, tally, more, *_ = pulled
        slips, events, lost = np.concatenate((slips, more)), events + pulled.events, lost + pulled.lost
        if stop not in GOING_ON:
            break
        compiled.state.scalars["pin_rate"] = 0.0  # it may next turn
        again, stop = continue_contact(compiled, stop, whole, whole, anew=True)
        if again is None:
            return None
        compiled = again
        if stop != Stop.DONE:
            break
    run = make_run_result(record, tally, slip, slips, pin.time)
    end = contact_value(compiled, COMPLETED)
    if has_node_beyond_window(compiled, end):
        return None
    return DrivenContact(run, _outcome(stop, run, motion, drive), end, events, lost)


def _outcome(stop: Stop, run: Course, motion: Motion, drive: Drive) -> Outcome:
    """Ending of a drive over a contact."""
    if stop == Stop.DONE:
        return outcome_of_segments(run, motion, drive.step_limit)
    found = OUTCOME_OF_STOP[stop]
    if found.ending is Ending.CONTACT_LOST:
        after = part_reached(run, motion)
        message = f"the contact reaches the slab's end after {after}: shorten the drive, or use a scheme without ends"
        return Outcome(found.ending, message, cause="end_reached")
    return found
