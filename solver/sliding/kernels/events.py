"""Columns of a friction record in the making, which kernels fill."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.compiled import compiled
from nanoslip.solver.contact.kernels.state import Floats


class Events(NamedTuple):
    """Columns of a friction record in the making (see FrictionRecord), each of shape (capacity,)."""

    displacement: Floats
    force_before: Floats
    force_after: Floats
    stiffness: Floats
    dissipated: Floats
    kind: NDArray[np.int8]
    node: NDArray[np.int32]
    slips: NDArray[np.int64]
    releases: NDArray[np.int32]
    touches: NDArray[np.int32]
    contact_size: NDArray[np.int32]
    extent: NDArray[np.int32]


@compiled()
def add_slips(total: NDArray[np.int64], node_slips: NDArray[np.int64]) -> int:
    """Add the slips of each node (n,) in one event to those of the record; returns how many nodes slipped."""
    extent = 0
    for i in range(len(node_slips)):
        total[i] += node_slips[i]
        extent += node_slips[i] > 0
    return extent


@compiled()
def cycle(node: NDArray[np.int32], before: Floats, after: Floats) -> int:
    """Number of events after which the last of these repeat themselves; 0 where they do not (see `cycle_of`)."""
    last, fallen = len(node) - 1, 0.0
    for period in range(1, len(node) // 3 + 1):
        fallen = max(fallen, abs(before[last - period + 1] - after[last - period + 1]))
        now = last
        while (
            now > last - 2 * period
            and node[now] == node[now - period]
            and abs(after[now] - after[now - period]) <= 1e-3 * fallen
        ):
            now -= 1
        if now == last - 2 * period:
            return period
    return 0
