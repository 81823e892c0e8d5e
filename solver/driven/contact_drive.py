"""Pull the pin over the contact itself (Eq. 12 without Eq. 13-15): its friction remembers the way, and no record repeats."""

from collections.abc import Callable
from functools import partial
from typing import Final, NamedTuple, TypeVar

import numpy as np

from nanoslip.solver.arrays import Floats
from nanoslip.solver.case import Case
from nanoslip.solver.contact.compiled_contact import contact_value, has_node_beyond_window
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.contact.kernels.state import Direction, Stop
from nanoslip.solver.contact.soundness import OUTCOME_OF_STOP
from nanoslip.solver.contact.state import ContactState
from nanoslip.solver.drive import Drive, refuse_with_memory
from nanoslip.solver.driven.kernels.drive import Frame, drive_contact
from nanoslip.solver.dynamics.integrators import AT_REST, ONE_WAY, Pull, outcome_of_segments, part_reached
from nanoslip.solver.dynamics.kernels.motion import Course, Motion, PinState, Slip, Tally
from nanoslip.solver.dynamics.kernels.steps import empty_record, make_run_result
from nanoslip.solver.dynamics.result import BINS
from nanoslip.solver.dynamics.to_and_fro import Leg, LegsPull, pull_to_and_fro
from nanoslip.solver.elasticity.compliance import Compliance
from nanoslip.solver.outcome import COMPLETED, Ending, Outcome
from nanoslip.solver.sliding.full_contact import GOING_ON, compile_state, continue_contact
from nanoslip.solver.sliding.way import Way

Driven = TypeVar("Driven")
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


def pull_of_contact(case: Case, compliance: Compliance, drive: Drive) -> Pull:
    """The way to pull the pin of a case over its contact, for `nanoslip.solver.dynamics.duration.measure_motion`."""
    return partial(_pull, case, compliance, drive)


def _pull(case: Case, compliance: Compliance, drive: Drive, motion: Motion) -> tuple[Course, Outcome]:
    driven = driven_contact(case, compliance, drive, motion)
    return driven.run, driven.outcome


def legs_pull_of_contact(case: Case, compliance: Compliance, drive: Drive) -> LegsPull:
    """The way to pull the pin of a case to and fro over its contact, for `measure_strokes`."""
    return partial(_pull_legs, case, compliance, drive)


def _pull_legs(case: Case, compliance: Compliance, drive: Drive, motion: Motion) -> tuple[list[Leg], Outcome]:
    def pull(contact: _Contact) -> tuple[list[Leg], Outcome]:
        return pull_to_and_fro(drive, motion, contact.pull_leg)

    return _pull_over_contact(case, compliance, drive, pull)


def driven_contact(case: Case, compliance: Compliance, drive: Drive, motion: Motion) -> DrivenContact:
    """Pull the pin from rest at x = 0 over its contact, from initial contact on.

    The spring is slack at first, the contact as it is: its friction force may be other than 0.
    """

    def pull(contact: _Contact) -> DrivenContact:
        frame = Frame(contact.start.displacement, 1.0)
        run, stop = contact.pull(motion, ONE_WAY, AT_REST, frame, drive.samples)
        end = contact_value(contact.compiled, COMPLETED)
        return DrivenContact(run, _outcome(stop, run, motion, drive), end, contact.events, contact.lost)

    return _pull_over_contact(case, compliance, drive, pull)


class _BeyondWindow(Exception):
    """A node beyond a window proves to lie inside the pin."""


def _pull_over_contact(
    case: Case, compliance: Compliance, drive: Drive, pull: Callable[["_Contact"], Driven]
) -> Driven:
    """A drive of a case within windows, or if they prove too narrow on the whole surface."""
    refuse_with_memory(case)
    start = initial_contact(case, compliance)
    compliance = compliance if case.effects.coupling else compliance.decouple()
    for follow_all in (False, True):
        contact = _Contact(case, compliance, drive, start, follow_all)
        try:
            pulled = pull(contact)
        except _BeyondWindow:
            continue
        if not has_node_beyond_window(contact.compiled, contact_value(contact.compiled, COMPLETED)):
            return pulled
    raise AssertionError("there are no nodes beyond the whole surface")


class _Contact:
    """A contact over which a pin is pulled; it is set up anew as often as it needs to be."""

    def __init__(self, case: Case, compliance: Compliance, drive: Drive, start: ContactState, follow_all: bool) -> None:
        # The window has to hold whichever way the pin will turn.
        self.compiled = compile_state(case, compliance, start, follow_all, Way(case.normal_load, ANY_WAY))
        self.drive, self.start, self.whole = drive, start, follow_all
        self.events, self.lost = 0, 0.0

    def pull(self, motion: Motion, pieces: Floats, pin: PinState, frame: Frame, samples: int) -> tuple[Course, Stop]:
        """Pull the pin until the duration, or until the contact cannot go on. pieces: see `integrate_exactly`.

        Raises _BeyondWindow.
        """
        record = empty_record(motion, samples, BINS)
        slip = Slip(False, False, 0.0, 0.0, 0.0, 0, 0.0)
        tally = Tally(0, 0.0, 0.0, 0, 0)
        slips = np.empty((0, 5))
        while True:
            compiled, slips_left = self.compiled, motion.most_slips - len(slips)
            where = (compiled.state, compiled.constants, motion, record, pin, slip, tally)
            driven = drive_contact(*where, self.drive.step_limit, slips_left, pieces, frame)
            stop, pin, slip, tally, more, *_ = driven
            slips = np.concatenate((slips, more))
            self.events, self.lost = self.events + driven.events, self.lost + driven.lost
            if stop not in GOING_ON:
                break
            compiled.state.scalars["pin_rate"] = 0.0  # it may next turn
            again, stop = continue_contact(compiled, stop, self.whole, self.whole, anew=True)
            if again is None:
                raise _BeyondWindow
            self.compiled = again
            if stop != Stop.DONE:
                break
        return make_run_result(record, tally, slip, slips, pin.time), stop

    def pull_leg(
        self, motion: Motion, pieces: Floats, pin: PinState, sign: int, samples: int
    ) -> tuple[Course, Outcome]:
        """Pull the pin along a leg of the stage."""
        displacement = float(self.compiled.state.scalars["displacement"])
        # The pin is where the contact is.
        frame = Frame(displacement - sign * pin.position, float(sign))
        run, stop = self.pull(motion, pieces, pin, frame, samples)
        return run, _outcome(stop, run, motion._replace(duration=motion.recorded), self.drive)


def _outcome(stop: Stop, run: Course, motion: Motion, drive: Drive) -> Outcome:
    """Ending of a drive over a contact."""
    if stop == Stop.DONE:
        return outcome_of_segments(run, motion, drive.step_limit)
    outcome = OUTCOME_OF_STOP[stop]
    if outcome.ending is Ending.CONTACT_LOST:
        after = part_reached(run, motion)
        message = f"the contact reaches the slab's end after {after}: shorten the drive, or use a scheme without ends"
        return Outcome(outcome.ending, message, cause="end_reached")
    return outcome
