"""The nanoscale friction record (§3.2), event by event."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.arrays import Floats
from nanoslip.solver.case import Case
from nanoslip.solver.contact.kernels.state import EventKind
from nanoslip.solver.layout import surface_y
from nanoslip.solver.outcome import Outcome
from nanoslip.solver.parameter import ENERGY, OVER_LOAD, Quantity, quantities, quantity, require
from nanoslip.solver.view import Curve, Labelled, Picture, Viewed, describe_outcome, label_numbers

EVENT_KINDS = tuple(kind.name.lower() for kind in EventKind if kind is not EventKind.NOTHING)
"""Triggers of an event: ("slip", "release", "touch"); `FrictionRecord.kind` holds the position in this tuple."""


def event(meaning: str, name: str, **more: Any) -> Any:
    """Declare a column of events: `column: NDArray[...] = event(...)`. name: the part after `event_`."""
    return quantity(meaning, f"event_{name}", along="event", **more)


def node_column(meaning: str, name: str, **more: Any) -> Any:
    """Declare a column over the surface nodes, of a record as a whole. name: the part after `record_node_`."""
    return quantity(meaning, f"record_node_{name}", along="record_node", **more)


RECORD_Y: Final = Quantity(
    "record_node_y", "position across the drag", coordinate=True, symbol="y/L_x", along="record_node", measure="L_x"
)
"""Position of surface nodes across the drag, on a plane of nodes."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class FrictionRecord(Viewed):
    """The nanoscale friction record of a case: e events, arrays of shape (e,), read-only; two arrays over the surface
    nodes.

    Between events the friction force rises linearly with the pin's displacement, at each event it changes at once.
    Lengths in L_x, forces in G·L_x·L_y, stiffness in G·L_y, energy in G·L_x²·L_y. `to_xarray()` and datasets have
    forces over W and energies in W·L_x, as their variables say; `friction_before` and `friction_after` are F/W here.
    """

    displacement: Floats = quantity("pin displacement", along="event", coordinate=True, symbol="δ_p/L_x", measure="L_x")
    """Increasing."""
    force_before: Floats = event(
        "F/W before the event",
        "force_before",
        **OVER_LOAD,
        comment="friction force over load when the event is triggered; the attribute force_before of a FrictionRecord is in "
        "G·L_x·L_y",
    )
    force_after: Floats = event(
        "F/W after the event",
        "force_after",
        **OVER_LOAD,
        comment="friction force over load when the cascade is over; as event_force_before",
    )
    stiffness: Floats = event(
        "stiffness after the event",
        "stiffness",
        symbol="dF/dδ_p",
        comment="from this event to the next",
        measure="G·L_y",
    )
    kind: NDArray[np.int8] = event("trigger of the event", "kind", codes=EVENT_KINDS, dtype=np.int8)
    """Position in `EVENT_KINDS`."""
    node: NDArray[np.int32] = event(
        "surface node that triggered the event", "node", dtype=np.int32, comment="from 0 at the left"
    )
    slips: NDArray[np.int64] = event("node slips in the cascade", "slips", dtype=np.int64)
    releases: NDArray[np.int32] = event("nodes released in the cascade", "releases", dtype=np.int32)
    touches: NDArray[np.int32] = event("nodes that touch in the cascade", "touches", dtype=np.int32)
    contact_size: NDArray[np.int32] = event("nodes in contact after the event", "contact_size", dtype=np.int32)
    extent: NDArray[np.int32] = event("nodes that slip in the cascade", "extent", dtype=np.int32)
    """Each counted once. They need not be neighbours, as shear reaches far through the slab."""
    dissipated: Floats = event("energy lost in the event", "dissipated", **ENERGY)
    node_x: Floats = node_column("position of the surface node", "x", symbol="x/L_x", coordinate=True, measure="L_x")
    """Positions (n_x,), as is the next; a surface without ends has one more for each new node that the pin has reached."""
    node_slips: NDArray[np.int64] = node_column("slips of the surface node in all events", "slips", dtype=np.int64)
    normal_load: float
    """W."""
    spacing: float
    """Distance between surface nodes: the period of the surface pattern. Infinite with constant pressures: the
    contact then stays on the nodes that the pin touched first."""
    presliding_length: float
    """(μ_i·W + τ_0·area)/K, in L_x: where a contact that stuck as a whole would reach the limits of all its nodes. Infinite if
    K ≤ 0."""
    initial_force: float = quantity("F/W after initial contact", **OVER_LOAD, comment="friction force over load")
    initial_stiffness: float = quantity("initial stiffness", comment="dF/dδ_p before the first event", measure="G·L_y")
    initial_slips: int = quantity("node slips of initial contact")
    initial_contact_size: int = quantity("nodes in contact after initial contact")
    node_area: float = math.nan
    """Surface that belongs to a node inside of the surface, in L_x; of a plane of nodes in L_x²."""
    end_nodes: int = quantity(
        "end nodes of the surface in contact", comment="0 to 2, where the record begins or where it ends"
    )
    final_displacement: float = quantity(
        "displacement at the end",
        symbol="δ_p/L_x",
        comment="pin displacement where the record ends",
        si=Quantity("", "displacement at the end", "m", "length"),
        measure="L_x",
    )
    """The last event, or the displacement limit."""
    final_force: float = quantity("F/W at the end of the record", **OVER_LOAD, comment="friction force over load")
    outcome: Outcome
    """Outcome of the run."""

    @property
    def node_y(self) -> Floats:
        """Positions of the surface nodes across the drag, in L_x, (n,): evenly spaced in each column; 0 in plane strain."""
        rows = int(np.count_nonzero(self.node_x == self.node_x[0]))
        return surface_y(rows, len(self.node_x))

    @property
    def friction_before(self) -> Floats:
        """F/W before each event, (e,): the variable `event_force_before` of a dataset."""
        return np.asarray(self.force_before * self._factors()["normal_load"])

    @property
    def friction_after(self) -> Floats:
        """F/W after each event, (e,): the variable `event_force_after` of a dataset."""
        return np.asarray(self.force_after * self._factors()["normal_load"])

    @property
    def highest_force(self) -> float:
        """The largest friction force, in G·L_x·L_y."""
        largest = self.force_before.max(initial=self.initial_force)
        return float(self.force_after.max(initial=max(largest, self.final_force)))

    @property
    def first_half(self) -> "FrictionRecord":
        """The record up to half of its displacement, where it ends between two events; slips of nodes still count the
        whole record."""
        end = 0.5 * self.final_displacement
        count = int(np.searchsorted(self.displacement, end, side="right"))
        force, slope = self.initial_force, self.initial_stiffness
        if count:
            force = float(self.force_after[count - 1])
            slope = float(self.stiffness[count - 1])
        columns = {name: getattr(self, name)[:count] for name in EVENT_TYPES}
        # From event to event the force is straight, with the stiffness after the last one.
        since = end - float(columns["displacement"][-1] if count else 0.0)
        return replace(self, **columns, final_displacement=end, final_force=force + slope * since)

    @property
    def presliding_lengths(self) -> float:
        """Length of the record in presliding lengths; infinite without friction."""
        return self.final_displacement / self.presliding_length if self.presliding_length > 0.0 else math.inf

    def _facts(self) -> Iterator[str]:
        yield f"{len(self.displacement)} events"
        yield f"δ_p/L_x to {self.final_displacement:.4g}"
        yield f"F/W {self.final_force * self._factors()['normal_load']:.4g} there"
        yield describe_outcome(self.outcome)

    def _label_values(self) -> Iterator[Labelled]:
        yield from label_numbers(self)
        if (y := self.node_y).any():
            yield RECORD_Y, y

    def _factors(self) -> dict[str, float]:
        return {"normal_load": 1.0 / self.normal_load}

    def _picture(self) -> Picture:
        """F/W over displacement: a sawtooth from δ_p = 0 to the record's end."""
        moved = np.concatenate(([0.0], np.repeat(self.displacement, 2), [self.final_displacement]))
        both = np.column_stack((self.force_before, self.force_after)).ravel()
        force = np.concatenate(([self.initial_force], both, [self.final_force]))
        share = force * self._factors()["normal_load"]
        return Picture("pin displacement δ_p/L_x", "friction force F/W", (Curve(moved, share),))


EVENT_TYPES = {name: column.dtype for name, column in quantities(FrictionRecord).items() if column.along == "event"}
"""Column of events -> type of its values."""

FORCE_ROUNDING: Final = 1e-12
"""Relative rounding error of friction forces, over the load."""


def drops(before: Floats, after: Floats) -> Floats:
    """Fall of F/W in each event, (e,), from F/W before and after. 0 where it is within rounding, as when a node is released."""
    fall = before - after
    return np.where(np.abs(fall) > FORCE_ROUNDING, fall, 0.0)


RUN_IN: Final = 1.5
"""Presliding lengths after which the first slips are forgotten: measured by tests.verification.run_in."""

FIRST_CAPACITY = 4096
"""Events for which room is made first; it doubles as they come."""


def presliding_length(limit: float, stiffness: float) -> float:
    """limit/K in L_x, from the friction force at which all nodes slide and the contact's lateral stiffness K (G·L_y); infinite if
    K is not above 0."""
    if limit == 0.0:
        return 0.0
    return limit / stiffness if stiffness > 0.0 else math.inf


def farthest(case: Case, presliding: float) -> float:
    """δ_p in L_x at which a record ends at the latest; presliding: the presliding length, in L_x."""
    if case.max_presliding is None or not presliding:  # without friction nothing preslides
        return case.farthest
    return min(case.farthest, case.max_presliding * presliding)


def require_record(record: object) -> None:
    """Raise InvalidInput unless the argument is a friction record."""
    require(
        "record", record, isinstance(record, FrictionRecord), "a FrictionRecord, as friction_record(case) returns it"
    )


SPACINGS: Final = 2
"""Node spacings to which a record goes on: the surface pattern repeats, so two show how much each start still matters."""


def extend_record(case: Case, presliding: float, events: int | float) -> float:
    """Displacement δ_p in L_x at which a record with this number of events ends by its limits of length.

    Two presliding lengths more than SPACINGS: run-in, and the last event before the end.
    """
    end = farthest(case, presliding)
    beyond = min(SPACINGS * case.slab.spacing + 2.0 * presliding, case.farthest)
    if case.spacing_events is None or case.interface.contacts > 1 or events * beyond > case.spacing_events * end:
        return end
    return max(end, beyond)


def off_the_slab(case: Case) -> float:
    """δ_p in L_x at which a pin that slides on and on has certainly left the slab; infinite on a surface without ends."""
    length: float = case.slab.scheme.length
    return OFF_THE_SLAB * length


OFF_THE_SLAB = 2.0
"""Displacement δ_p in L_x at which a pin has certainly left a slab with ends."""
