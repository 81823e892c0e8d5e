"""The contact of one case after chosen events, and the record up to there: computed when asked for, kept nowhere."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.case import Case
from nanoslip.solver.contact.pin import node_friction
from nanoslip.solver.contact.state import ContactState
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.outcome import InvalidInput, Outcome
from nanoslip.solver.sliding.record import FrictionRecord
from nanoslip.solver.sliding.slide import slide, states_at

MOST: Final = 1000
"""Frames that one film may have."""
ROUNDING: Final = 1e-12
"""Share of the largest slip by which a node that sticks may seem to slip."""


@dataclass(frozen=True, slots=True, eq=False)
class Moment:
    """The contact after one event. Arrays are (n,) over the surface nodes; tractions in W/(L_x·L_y), lengths in L_x."""

    event: int
    displacement: float
    friction: float
    """F/W."""
    pressure: NDArray[np.float64]
    shear: NDArray[np.float64]
    limit: NDArray[np.float64]
    """μ_i·pressure: the largest shear either way; NaN where μ_i is infinite."""
    slip: NDArray[np.float64]
    """NaN of nodes that are not in contact."""
    slipped: NDArray[np.bool_]
    """Nodes whose slip is another than at the moment before, in contact at both."""


@dataclass(frozen=True, slots=True, eq=False)
class Moments:
    """What a film of one case shows."""

    moments: tuple[Moment, ...]
    x: NDArray[np.float64]
    """(n,) places of the surface nodes, in L_x."""
    record: FrictionRecord
    """Up to the last of the events."""
    outcome: Outcome
    """How the last of them went; not all events asked for are there where it is not ok, or the record ends before."""


def events_of(text: str) -> tuple[int, ...]:
    """Numbers of events from `first:last:step`, both ends included, or from a list as `0,5,12`. Raises InvalidInput."""
    found: Sequence[int] = ()
    with suppress(ValueError, TypeError):
        if ":" in text:
            first, last, *step = map(int, text.split(":"))
            found = range(first, last + 1, *step)
        else:
            found = sorted(set(map(int, text.split(","))))
    if not found or found[0] < 0 or found[-1] < found[0] or len(found) > MOST:
        raise InvalidInput(
            f"events = {text}: needs first:last:step, as 0:200:10, or a list, as 0,5,12; from 0 on, at most {MOST} of them"
        )
    return tuple(found)


def moments_of(case: Case, events: Sequence[int]) -> Moments:
    """The contact of a case after each of these events, as far as its record gets.

    events: increasing numbers; 0 is initial contact. Raises InvalidInput for a case without friction, and where there is no
    contact to begin with.
    """
    compliance = surface_compliance(case.slab)
    states, outcome = states_at(case, compliance, events)
    if not states and outcome.ok:
        raise InvalidInput(f"no event {events[0]}: the record ends before")
    if not states:
        raise InvalidInput(f"no contact after event {events[0]}: {outcome.ending}: {outcome.message}".rstrip(": "))
    record = slide(replace(case, max_events=max(events[len(states) - 1], 1)), compliance)
    before = [None, *states[:-1]]
    shown = tuple(_moment(*each, case) for each in zip(events, before, states, strict=False))
    return Moments(shown, compliance.x, record, outcome)


def _moment(event: int, before: ContactState | None, now: ContactState, case: Case) -> Moment:
    slipped = np.zeros_like(now.contact)
    if before:
        moved = np.abs(now.slip - before.slip) > ROUNDING * max(np.abs(now.slip).max(), now.displacement)
        slipped = now.contact & before.contact & moved
    friction = node_friction(case)
    share = 1.0 / case.normal_load
    return Moment(
        event=event,
        displacement=now.displacement,
        friction=share * now.friction_force,
        pressure=share * now.pressure,
        shear=share * now.shear,
        limit=share * np.where(np.isfinite(friction), friction, np.nan) * now.pressure,
        slip=np.where(now.contact, now.slip, np.nan),
        slipped=slipped,
    )
