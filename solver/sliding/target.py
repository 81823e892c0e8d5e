"""When a record ends that is to know its plateau to a given uncertainty: as soon as it does.

It is looked at after numbers of events that grow by a tenth, so that looking costs little and the record is at most about a fifth
longer than it had to be. Two looks in a row have to be content: who stops at the first picks records that are lucky just then, of
which twice ± held in 90 of 100 at 0.1 %, and in 94 with two. Looking changes nothing: event by event the record is one without a
target.
"""

import math
from dataclasses import replace
from typing import Final

import numpy as np

from solver.case import MOST_EVENTS, Case
from solver.contact.state import ContactState
from solver.outcome import Ending, Outcome
from solver.sliding.columns import friction_record
from solver.sliding.kernels.events import Events
from solver.sliding.plateau import TELLING, plateau_of
from solver.sliding.sampling import Sampling, nodes_as_one

FIRST_LOOK: Final = 64
"""Events of a record that is looked at first; a plateau needs 16 at the least."""
GROWTH: Final = 10
"""A look comes after a tenth more events than the last one."""
_BROKEN_OFF: Final = Outcome(Ending.NO_PLATEAU, "not yet certain enough")


class Target:
    """The looks at one record in the making. Without a target there are none."""

    def __init__(self, case: Case, start: ContactState, initial_stiffness: float) -> None:
        self._case, self._start, self._initial_stiffness = case, start, initial_stiffness
        self._uncertainty, self._length_error = (
            case.target_uncertainty or math.inf,
            case.target_length_error or math.inf,
        )
        self._content = False
        self.next_look = FIRST_LOOK if case.aimed else MOST_EVENTS

    def reached(self, events: Events, held: int) -> bool:
        """Whether the record of the first `held` events, and that at the look before, knows its plateau well enough.

        False where no look is due.
        """
        if held < self.next_look:
            return False
        self.next_look = held + max(held // GROWTH, 1)
        before = self._content
        self._content = self._possible(events, held) and self._known(events, held)
        return before and self._content

    def _possible(self, events: Events, held: int) -> bool:
        """Whether the plateau of so many events can be known well enough, whatever it is like: cheap, as the model says that."""
        case = self._case
        spacing = case.slab.spacing if case.effects.pin_translation else math.inf
        most_nodes = float(events.contact_size[:held].max())
        length, residual_shear = events.displacement[held - 1] / spacing, case.slip_rule.residual_shear
        if case.target_length_error is not None and 0.0 < length < TELLING:
            return False
        longest = Sampling(length, most_nodes, residual_shear, nodes_as_one=nodes_as_one(case))
        return longest.least_of_mean_force <= min(self._uncertainty, self._length_error)

    def _known(self, events: Events, held: int) -> bool:
        """Whether the plateau of so many events is known: a run that breaks off is a record up to its last event."""
        broken_off = replace(self._start, outcome=_BROKEN_OFF)
        nothing = np.zeros(self._case.slab.n_x, np.int64)
        record = friction_record(self._case, self._start, self._initial_stiffness, events, nothing, held, broken_off)
        plateau = plateau_of(record)
        return plateau.relative_uncertainty <= self._uncertainty and plateau.relative_length_error <= self._length_error
