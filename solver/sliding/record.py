"""The nanoscale friction record (§3.2): what the pin met, event by event."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solver.contact.kernels.enumerations import EventKind
from solver.outcome import Outcome

EVENT_KINDS = tuple(kind.name.lower() for kind in EventKind if kind is not EventKind.NOTHING)
"""What can trigger an event: ("slip", "release", "touch"); `FrictionRecord.kind` holds the position in this tuple."""


@dataclass(frozen=True, slots=True, eq=False)
class FrictionRecord:
    """The nanoscale friction record of one case: e events, arrays of shape (e,), read-only.

    Between events the friction force rises linearly with the pin's displacement, at each event it changes at once.
    """

    displacement: NDArray[np.float64]
    """δ_p at the event, in L_x, increasing."""
    force_before: NDArray[np.float64]
    """Friction force F when the event is triggered, in G·L_x·L_y."""
    force_after: NDArray[np.float64]
    """Friction force F when its cascade is over, in G·L_x·L_y."""
    stiffness: NDArray[np.float64]
    """dF/dδ_p from this event to the next, in G·L_y."""
    kind: NDArray[np.int8]
    """Position of the trigger in `EVENT_KINDS`."""
    node: NDArray[np.int32]
    """Surface node that triggered the event."""
    slips: NDArray[np.int64]
    """Slips in the event's cascade."""
    releases: NDArray[np.int32]
    """Nodes released in the event's cascade."""
    touches: NDArray[np.int32]
    """Nodes brought into contact in the event's cascade."""
    contact_size: NDArray[np.int32]
    """Nodes in contact after the event."""
    dissipated: NDArray[np.float64]
    """Energy lost in the event, in G·L_x²·L_y."""
    normal_load: float
    """W, in G·L_x·L_y."""
    spacing: float
    """Distance between surface nodes, in L_x: what the pin meets repeats with it. Infinite where pressures are constant: then
    the pin goes on meeting what it met where it touched."""
    residual_shear: float
    """Shear that a slip leaves, as a share of μ_i·pressure."""
    spread: float
    """Standard deviation of μ_i over the nodes, over its mean."""
    initial_force: float
    """F at δ_p = 0, after initial contact, in G·L_x·L_y."""
    initial_stiffness: float
    """dF/dδ_p from δ_p = 0 to the first event, in G·L_y."""
    initial_slips: int
    """Slips that initial contact needed."""
    initial_contact_size: int
    """Nodes in contact at δ_p = 0."""
    final_displacement: float
    """δ_p where the record ends, in L_x (the last event, or the displacement limit)."""
    final_force: float
    """F where the record ends, in G·L_x·L_y."""
    outcome: Outcome
    """How the run ended."""
