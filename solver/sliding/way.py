"""Way of pin and load, and a contact's record along it."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.arrays import Floats
from nanoslip.solver.case import Case
from nanoslip.solver.contact.compiled_contact import empty_events
from nanoslip.solver.contact.kernels.path import Events
from nanoslip.solver.contact.kernels.state import FORWARD, Direction
from nanoslip.solver.contact.pin import contact_area, contact_limit
from nanoslip.solver.contact.state import ContactState
from nanoslip.solver.elasticity.compliance import Compliance
from nanoslip.solver.layout import surface_x
from nanoslip.solver.sliding.record import FIRST_CAPACITY, FrictionRecord, farthest, presliding_length


class Way(NamedTuple):
    """Way of pin and load from where they are."""

    load: float
    """Load at its start, in G·L_x·L_y."""
    direction: Direction = FORWARD
    until: float = math.nan
    """δ_p at its end, or the load where the pin rests; NaN where the limits of a case end it."""

    def end(self, case: Case, presliding: float) -> float:
        """Displacement (or load) at the end of the leg. presliding: the presliding length, in L_x."""
        return farthest(case, presliding) if math.isnan(self.until) else self.until

    def stiffness(self, shear_rate: float) -> float:
        """dF/dδ_p before the first event from the rate of shear; NaN where the load changes, too."""
        return math.nan if self.direction.load_rate else shear_rate * self.direction.pin_rate


class Run(NamedTuple):
    """Record of a way, displacements and forces with their signs, and what a record does not hold."""

    record: FrictionRecord
    end: ContactState
    load: Floats
    """(e,) after each event."""
    load_work: float
    """Work of the load, in G·L_x²·L_y."""
    lost: float
    """Energy lost, also after the last event."""


@dataclass(eq=False)
class SlippedNodes:
    """Slips of each surface node in a run, from node `first` on; they grow with the grid."""

    first: int
    slips: NDArray[np.int64]

    def grid_slips(self, first: int, nodes: int) -> NDArray[np.int64]:
        """Slip counts of a grid whose first node is `first`, (nodes,), to be added to."""
        end = self.first + len(self.slips)
        left, right = max(self.first - first, 0), max(first + nodes - end, 0)
        if left or right:
            self.first -= left
            self.slips = np.pad(self.slips, (left, right))
        return self.slips[first - self.first :][:nodes]


def first_room(most: int) -> Events:
    """Allocate the first columns of a run of at most `most` events."""
    return empty_events(min(most, FIRST_CAPACITY))


def allocate_events(events: Events, count: int) -> Events:
    """Room for the first `count` events."""
    return events if count == len(events.load) else Events._make([column[:count] for column in events])


def grow_events(events: Events) -> Events:
    """Copy events into arrays with room for twice as many."""
    grown = empty_events(2 * len(events.displacement))
    for name in events._fields:
        old = getattr(events, name)
        getattr(grown, name)[: len(old)] = old
    return grown


def initial_limit(case: Case, start: ContactState, compliance: Compliance) -> float:
    """Friction force at which all nodes of the contact slide with which a run begins."""
    return contact_limit(case, contact_area(start.contact, compliance.widths))


def make_record_view(
    case: Case,
    start: ContactState,
    compliance: Compliance,
    initial_stiffness: float,
    events: Events,
    slipped: SlippedNodes,
    count: int,
    end: ContactState,
    load_work: float = 0.0,
    rest: float = 0.0,
) -> Run:
    """The record of a run of `count` events from `start` to `end`, read-only. rest: energy lost after the last event."""
    full = count == len(events.displacement)
    columns = {name: column if full else column[:count].copy() for name, column in events._asdict().items()}
    for column in (*columns.values(), slipped.slips):
        column.setflags(write=False)
    load = columns.pop("load")
    final, rows = (end.displacement, end.friction_force), case.slab.rows
    columns_in_contact = (start.contact | end.contact).reshape(-1, rows)
    at_ends = columns_in_contact[[0, -1]]
    if count and not end.outcome.ok:
        # A run that broke off inside an event ends, as a record, with its last whole event.
        last_displacement = float(columns["displacement"][-1])
        last_force = float(columns["force_after"][-1])
        final = (last_displacement, last_force)
    record = FrictionRecord(
        **columns,
        node_x=np.repeat(surface_x(case.slab.n_x, slipped.first // rows, len(slipped.slips) // rows), rows),
        node_slips=slipped.slips,
        normal_load=case.normal_load,
        spacing=case.slab.spacing if case.effects.pin_translation else math.inf,
        node_area=case.slab.node_area,
        presliding_length=presliding_length(initial_limit(case, start, compliance), initial_stiffness),
        initial_force=start.friction_force,
        initial_stiffness=initial_stiffness,
        initial_slips=start.slips,
        initial_contact_size=int(start.contact.sum()),
        end_nodes=int(at_ends.any(axis=1).sum()),
        final_displacement=final[0],
        final_force=final[1],
        outcome=end.outcome,
    )
    return Run(record, end, load, load_work, float(record.dissipated.sum()) + rest)
