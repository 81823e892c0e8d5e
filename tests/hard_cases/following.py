"""Follow a case event by event and keep the worst error of every law on the way."""

import functools
from collections import Counter
from dataclasses import dataclass, field, replace

from nanoslip.solver.case import Case
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.contact.state import ContactState
from nanoslip.solver.elasticity.compliance import SurfaceCompliance, surface_compliance
from nanoslip.solver.outcome import Ending
from nanoslip.solver.sliding.record import FrictionRecord
from nanoslip.solver.sliding.slide import slide_to_state
from tests.physics import LIMITS, law_errors


@dataclass
class Followed:
    """Course of a case: the worst error of every law, the states' number, and how each run on the way ended."""

    worst: dict[str, float] = field(default_factory=lambda: dict.fromkeys(LIMITS, 0.0))
    states: int = 0
    endings: Counter[Ending] = field(default_factory=Counter)
    messages: set[str] = field(default_factory=set)
    record: FrictionRecord | None = None
    end: ContactState | None = None

    def check(self, state: ContactState, case: Case, compliance: SurfaceCompliance) -> bool:
        """Take one state into account; False where it is not one."""
        if not state.outcome.ok:
            self.endings[state.outcome.ending] += 1
            self.messages.add(state.outcome.message)
            return False
        for law, error in law_errors(state, case, compliance).items():
            # A NaN must not get lost in a maximum.
            self.worst[law] = error if not error <= self.worst[law] else self.worst[law]
        self.states += 1
        return True

    @property
    def broken(self) -> dict[str, float]:
        """The laws that did not hold, with their worst errors."""
        return {law: error for law, error in self.worst.items() if not error <= LIMITS[law]}


compliance_of = functools.cache(surface_compliance)


def follow(case: Case, compliance: SurfaceCompliance, events: int = 20, whole: int | None = 200) -> Followed:
    """Initial contact, then as many runs of `case` one after the other as `events`, each from where the last one ended; then,
    from initial contact again, one run of `whole` events (None: to the displacement limit), as far as they go."""
    seen = Followed()
    start = state = initial_contact(case, compliance)
    if not seen.check(start, case, compliance):
        return seen
    for _ in range(events):
        _, state = slide_to_state(case, compliance, state)
        if not seen.check(state, case, compliance):
            break
    seen.record, seen.end = slide_to_state(replace(case, max_events=whole), compliance, start)
    if seen.check(seen.end, case, compliance):
        seen.endings[Ending.COMPLETED] += 1
    return seen
