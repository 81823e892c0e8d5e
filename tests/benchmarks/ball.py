"""A ball's record beside what it cannot do without: two rows from memory for each slip, and one inverse of its contact."""

import numpy as np
import scipy
from numba import njit
from numpy.typing import NDArray

from nanoslip import Case, FrictionRecord, friction_record
from tests.benchmarks.table import Row, best, timed, verdict, versus

RUBBER = {
    "scheme": "layer",
    "radius": 1.5,
    "normal_load": 0.0745,
    "poisson": 0.49,
    "aspect_ratio": 1.0,
    "intrinsic_friction": 0.8,
}
"""A ball on a sheet of rubber as thick as it is wide."""
FOLLOWED = 1.15
"""Nodes that a window follows over those in contact, of a thousand."""
EVENTS, MOST = 20_000, 2.5


@njit(cache=True, nogil=True)
def _add_pairs(total: NDArray[np.float64], rows: NDArray[np.float64], order: NDArray[np.int64]) -> None:
    """Add two rows at a time in the order given, as a slip does."""
    for pair in order:
        for k in range(len(total)):
            total[k] += 1e-9 * rows[pair[0], k] + 1e-9 * rows[pair[1], k]


def rows() -> list[Row]:
    """A record of 20,000 events that sets everything up itself."""
    record, ours = min((_record() for _ in range(3)), key=lambda each: each[1])
    slips, changes = int(record.slips.sum()), int(record.touches.sum() + record.releases.sum())
    nodes = int(record.contact_size[-1])
    entries = 2 * int(FOLLOWED * nodes) + 1
    tableau = np.full((entries, entries), 1e-9)
    order = np.random.default_rng(1).integers(0, entries, (slips, 2))
    block = np.eye(2 * nodes) + 1e-3
    limit = best(lambda: _add_pairs(np.zeros(entries), tableau, order), 3) + best(lambda: scipy.linalg.inv(block), 3)
    what = f"a ball's record of {EVENTS} events: {nodes} nodes, {slips} slips, {changes} changes"
    name = "two rows from memory for each slip, one inverse"
    return [versus(what, ours, limit, name, verdict(f"≤ {MOST:g}", ours <= MOST * limit))]


def _record() -> tuple[FrictionRecord, float]:
    """The record and its seconds, after that of another ball, which shares nothing with it and compiles kernels."""
    other, case = (Case.of({**RUBBER, "n_x": n_x, "max_events": events}) for n_x, events in ((33, 100), (65, EVENTS)))
    friction_record(other)
    return timed(lambda: friction_record(case))
