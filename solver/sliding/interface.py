"""An interface: contacts of a rigid slider, displaced together, and the sum of their friction records.

The first contact is the case itself. Each other contact has a different start, different nodes and place on the
profile, and its share of the load. The contacts do not interact. The sum is in nanoslip.solver.sliding.slider.
"""

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.arrays import Floats
from nanoslip.solver.case import Case, Interface
from nanoslip.solver.ensemble import ALONE, Ensemble, draw_start
from nanoslip.solver.outcome import COMPLETED, Outcome

PIECES: Final = 2**14
"""Equal parts of the displacement in which records are added: 2000 in a presliding length of a record of eight."""
BATCHES: Final = 16
"""Batches of the contacts of an interface, at the most."""
SMALLEST: Final = 16
"""Fewest contacts of a batch, if there are enough."""

Counts = NDArray[np.int32]


@dataclass(frozen=True, slots=True, eq=False)
class Portion:
    """Sums over some contacts of an interface; forces in G·L_x·L_y."""

    force: Floats
    """(PIECES + 1,) Exact, at the ends of the pieces."""
    contact_size: Counts
    highest: Floats
    """(PIECES,) Each contact's highest force in a piece, added: the sum is nowhere higher."""
    slips: NDArray[np.int64]
    releases: Counts
    touches: Counts
    extent: Counts
    dissipated: Floats
    contacts: int
    load: float
    end: float
    """δ_p in L_x at which all of them end."""
    stiffness: float
    presliding_length: float
    """The longest of them."""
    half_width: float
    validity_flags: int
    """Flags that any contact has."""
    end_nodes: int
    initial_slips: int
    events: int
    slip_events: int
    release_events: int
    touch_events: int
    fallen: float
    """Drops of force, added."""
    lost: int
    ending: int
    """Position in `Ending` of the first lost contact's ending; `outcome` gives the reason."""
    outcome: Outcome = COMPLETED


def chances(case: Case) -> Floats:
    """(N,) Numbers from 0 to below 1 that decide the contacts' loads."""
    drawn = np.random.PCG64(draw_start(case, 0, case.start).seed).random_raw(case.interface.contacts)
    # 53 bits, as in `draw_start`.
    return np.asarray((drawn >> np.uint64(11)) * 2.0**-53)


def compressions(drawn: Floats) -> Floats:
    """(N,) How far the plane presses each asperity down, over the mean: heights are exponentially distributed, whatever it is."""
    # Inversion of the distribution 1 - e^(-c); drawn is below 1, so no logarithm of 0.
    return -np.log1p(-drawn)


def interface_contact(case: Case, number: int, share: float = 1.0, places: Ensemble = ALONE) -> Case:
    """A contact of an interface by its number from 0, as a separate case."""
    alone = replace(case, interface=Interface(), normal_load=case.normal_load * share)
    if number == 0:
        return alone
    return places.move_case(alone, draw_start(case, number, case.start))


def batches(contacts: int) -> list[tuple[int, int]]:
    """First contact of each batch, and the first beyond it. They depend on the number alone, so that sums keep their order."""
    size = max(math.ceil(contacts / BATCHES), SMALLEST)
    return [(first, min(first + size, contacts)) for first in range(0, contacts, size)]
