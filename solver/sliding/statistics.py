"""Statistics of the events of a friction record (§3.2): counts, means, the cycle at its end, and the collective friction.

The plateau of a friction record is found in nanoslip.solver.sliding.plateau.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from nanoslip.solver.arrays import Floats
from nanoslip.solver.ensemble import student
from nanoslip.solver.parameter import ENERGY, Quantity, quantity
from nanoslip.solver.sliding.kernels.cycle import cycle
from nanoslip.solver.sliding.plateau import Plateau
from nanoslip.solver.sliding.record import EVENT_KINDS, FrictionRecord, drops, require_record
from nanoslip.solver.view import Labels

LONGEST_CYCLE: Final = 6000
"""Events at the end of a record that are searched for a cycle."""


@dataclass(frozen=True, slots=True, repr=False)
class EventStatistics(Labels):
    """Counts and means over the events of a friction record. NaN without events."""

    peak_friction: float = quantity(
        "largest F/W of the record",
        symbol="F/W",
        ensemble=True,
        shared="length",
        comment="friction force over load, of the whole record; NaN where the pin has not moved",
    )
    surface_stiffness: float = quantity(
        "lateral stiffness",
        ensemble=True,
        shared="nodes",
        symbol="K",
        comment="of the contact before it slides (Eq. 15)",
        si=Quantity("", "lateral stiffness", "N m-1", "stiffness", symbol="K"),
        measure="G·L_y",
    )
    events: int = quantity("events of the record")
    spacings: float = quantity(
        "length of the record", "record_spacings", comment="the surface repeats each spacing", measure="node spacings"
    )
    presliding_lengths: float = quantity(
        "record's length",
        "record_presliding_lengths",
        comment="of μ_i·W/K; run-in takes one and a half; infinite without friction",
        measure="presliding lengths",
    )
    cycle_events: int = quantity(
        "events of the cycle at the end",
        comment="period with which the end of the record repeats exactly; 0: no period",
    )
    cycle_spacings: float = quantity(
        "length of that cycle", comment="how far the pin moves in a cycle of cycle_events", measure="node spacings"
    )
    """0 without one."""
    slips: int = quantity("events triggered by a slip")
    releases: int = quantity("events triggered by a release")
    touches: int = quantity("events triggered by a new contact")
    cascade_slips: int = quantity("node slips of all cascades together")
    cascade_releases: int = quantity("nodes that left contact in the record")
    cascade_touches: int = quantity("nodes that touched in the record")
    mean_step: float = quantity(
        "mean step per event",
        ensemble=True,
        shared="events",
        comment="pin displacement from one event to the next",
        si=Quantity("", "mean step per event", "m", "length"),
        measure="L_x",
    )
    mean_slips: float = quantity("mean number of node slips per event")
    mean_drop: float = quantity("mean drop of F/W per event", ensemble=True, shared="events")
    dissipated: float = quantity("energy lost in all events", "dissipated_energy", **ENERGY)
    """Energy in G·L_x²·L_y here."""

    def _facts(self) -> Iterator[str]:
        yield f"{self.events} events"
        yield f"mean step/L_x {self.mean_step:.4g}"
        yield f"mean drop of F/W {self.mean_drop:.4g}"
        yield f"largest F/W {self.peak_friction:.4g}"


def event_statistics(record: FrictionRecord) -> EventStatistics:
    """Count and average the events of a record."""
    require_record(record)
    events = len(record.displacement)
    slips, releases, touches = np.bincount(record.kind, minlength=len(EVENT_KINDS)).tolist()
    per_event = 1.0 / events if events else float("nan")
    period = repeat_length(record)
    fallen = drops(record.force_before / record.normal_load, record.force_after / record.normal_load)
    return EventStatistics(
        surface_stiffness=record.initial_stiffness,
        events=events,
        slips=slips,
        releases=releases,
        touches=touches,
        cascade_slips=int(record.slips.sum()),
        cascade_releases=int(record.releases.sum()),
        cascade_touches=int(record.touches.sum()),
        mean_step=float(record.displacement[-1]) * per_event if events else float("nan"),
        mean_slips=float(record.slips.sum()) * per_event,
        mean_drop=float(fallen.sum()) * per_event,
        peak_friction=record.highest_force / record.normal_load if record.final_displacement > 0.0 else float("nan"),
        dissipated=float(record.dissipated.sum()),
        spacings=record.final_displacement / record.spacing,
        presliding_lengths=record.presliding_lengths,
        cycle_events=period,
        cycle_spacings=float(record.displacement[-1] - record.displacement[-1 - period]) / record.spacing
        if period
        else 0.0,
    )


def node_error(stiffness: Floats, step: float) -> float:
    """Part of the ± of a mean K that its starts do not show: with it, ± is at least the effect of another node in a
    single start."""
    count = len(stiffness)
    if count < 2:
        return math.nan
    # Another node in contact in one of n starts changes their mean by step/n.
    scatter = float(stiffness.var(ddof=1)) / count
    # Only what the scatter between starts does not already hold is added.
    return float(student(count)) * math.sqrt(max((step / count) ** 2 - scatter, 0.0))


def repeat_length(record: FrictionRecord) -> int:
    """Number of events after which the end of a record repeats itself; 0 where it does not.

    A cycle is seen at least three times over: the same nodes in turn, the same forces to a thousandth of its largest drop.
    """
    tail = slice(-LONGEST_CYCLE, None)
    return cycle(record.node[tail], record.force_before[tail], record.force_after[tail])


@dataclass(frozen=True, slots=True, repr=False)
class Collective:
    """Collective numbers of the contacts of an interface, also of a single one."""

    static_excess: float = quantity(
        "highest force over plateau, minus 1",
        symbol="F_max/F - 1",
        ensemble=True,
        shared="length",
        comment="of the whole record of the slider: peak_friction over plateau_mean, less 1",
    )
    fluctuation: float = quantity(
        "fluctuation of the plateau",
        ensemble=True,
        shared="length",
        comment="standard deviation of the force of the slider over its mean, on the steady part of its record",
    )
    unseen_force: float = quantity(
        "bound of the force between two readings",
        comment="largest possible excess of the highest force over the one that was read, over the plateau; 0 of one contact",
    )
    lost_contacts: float = quantity(
        "contacts without a record",
        comment="of the slider; the other contacts carry their load, and the outcome states the reason",
    )


def collective(record: FrictionRecord, plateau: Plateau, bound: float | None = None, lost: int = 0) -> Collective:
    """Collective friction of a record. bound: of its highest force, in G·L_x·L_y, if it is not exact."""
    steady = plateau.mean * record.normal_load
    highest = record.highest_force
    unseen = 0.0 if bound is None else max(bound - highest, 0.0)
    if not steady > 0.0:
        return Collective(math.nan, math.nan, math.nan, lost)
    return Collective(highest / steady - 1.0, plateau.std / plateau.mean, unseen / steady, lost)
