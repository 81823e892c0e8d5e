"""A made-up friction record: what the kernels of a driven pin are compiled with while those of records are."""

from typing import Final

import numpy as np

from nanoslip.solver.case import Case
from nanoslip.solver.outcome import COMPLETED
from nanoslip.solver.sliding.record import EVENT_TYPES, FrictionRecord

TEETH: Final = 64
HEIGHT: Final = 0.01
"""Of a tooth, as F/W; they stand at ten times that."""


def sawtooth(case: Case) -> FrictionRecord:
    """A record of equal teeth, over one node spacing of the case, with the types of a record that was computed."""
    n, load = case.slab.n_x, case.normal_load
    spacing = 1.0 / (n - 1)
    low, high = 10.0 * HEIGHT * load, 11.0 * HEIGHT * load
    stiffness = (high - low) * TEETH / spacing
    columns = {name: np.zeros(TEETH, kind) for name, kind in EVENT_TYPES.items()}
    columns["displacement"][:] = np.arange(1, TEETH + 1) * spacing / TEETH
    for name, value in (("force_before", high), ("force_after", low), ("stiffness", stiffness)):
        columns[name][:] = value
    return FrictionRecord(
        **columns,
        node_x=np.linspace(-0.5, 0.5, n),
        node_slips=np.zeros(n, np.int64),
        normal_load=load,
        spacing=spacing,
        presliding_length=0.1 * spacing,
        initial_force=low,
        initial_stiffness=stiffness,
        initial_slips=0,
        initial_contact_size=1,
        end_nodes=0,
        final_displacement=spacing,
        final_force=low,
        outcome=COMPLETED,
    )
