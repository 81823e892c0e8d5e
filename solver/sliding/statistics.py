"""What is read off a friction record and a drive: event statistics (§3.2), μ_s and μ_k with uncertainties (§3.3).

The plateau of a friction record is found in solver.sliding.plateau; the same truncation and block rules serve the drive.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from solver.sliding.plateau import (
    BLOCKS,
    mean_uncertainty,
    sampling_of,
)
from solver.sliding.record import EVENT_KINDS, FrictionRecord
from solver.sliding.sampling import Sampling

LONGEST_CYCLE: Final = 6000
"""Events at the end of a record that are searched for a cycle."""


@dataclass(frozen=True, slots=True)
class EventStatistics:
    """Counts and means over the events of one friction record. What has no event to be taken over is NaN."""

    events: int
    slips: int
    """Events that a slip triggered; likewise releases and touches."""
    releases: int
    touches: int
    cascade_slips: int
    """Slips of all cascades together; likewise releases and touches."""
    cascade_releases: int
    cascade_touches: int
    mean_step: float
    """Displacement per event, in L_x."""
    mean_step_uncertainty: float
    """Its standard error as an estimate of the mean over all positions of the pin, see solver.sliding.sampling."""
    mean_slips: float
    """Slips per event."""
    mean_drop: float
    """Fall of F/W in an event."""
    mean_drop_uncertainty: float
    """Its standard error likewise."""
    peak_friction: float
    """Highest F/W anywhere."""
    dissipated: float
    """Energy lost in all events, in G·L_x²·L_y."""
    spacings: float
    """Node spacings that the record spans: what the pin meets repeats with them."""
    cycle_events: int
    """Events after which the end of the record repeats itself, 0 where it does not."""
    cycle_spacings: float
    """How far the pin moves in one such cycle, in node spacings; 0 without one."""


def event_statistics(record: FrictionRecord) -> EventStatistics:
    """Count and average the events of a record."""
    events = len(record.displacement)
    slips, releases, touches = (int(np.sum(record.kind == kind)) for kind in range(len(EVENT_KINDS)))
    per_event = 1.0 / events if events else float("nan")
    forces = (record.force_before, record.force_after, [record.initial_force, record.final_force])
    sampling = sampling_of(record, 0, record.final_displacement)
    cycle = cycle_of(record)
    drops = (record.force_before - record.force_after) / record.normal_load
    return EventStatistics(
        events=events,
        slips=slips,
        releases=releases,
        touches=touches,
        cascade_slips=int(record.slips.sum()),
        cascade_releases=int(record.releases.sum()),
        cascade_touches=int(record.touches.sum()),
        mean_step=float(record.displacement[-1]) * per_event if events else float("nan"),
        mean_step_uncertainty=_uncertainty_of_mean(np.diff(record.displacement, prepend=0.0), sampling),
        mean_slips=float(record.slips.sum()) * per_event,
        mean_drop=float(drops.sum()) * per_event,
        mean_drop_uncertainty=_uncertainty_of_mean(drops, sampling),
        peak_friction=float(np.concatenate(forces).max()) / record.normal_load,
        dissipated=float(record.dissipated.sum()),
        spacings=sampling.spacings,
        cycle_events=cycle,
        cycle_spacings=float(record.displacement[-1] - record.displacement[-1 - cycle]) / record.spacing
        if cycle
        else 0.0,
    )


def cycle_of(record: FrictionRecord) -> int:
    """Number of events after which the end of a record repeats itself; 0 where it does not.

    A cycle is seen at least three times over: the same nodes in turn, the same forces to a thousandth of its largest drop.
    """
    node, after = record.node[-LONGEST_CYCLE:], record.force_after[-LONGEST_CYCLE:]
    if not len(node):
        return 0
    drops = np.abs(record.force_before[-LONGEST_CYCLE:] - after)
    near = 1e-3 * float(drops.max())
    again = len(node) - 1 - np.flatnonzero((node[:-1] == node[-1]) & (np.abs(after[:-1] - after[-1]) <= near))[::-1]
    for period in again[3 * again <= len(node)]:
        end = slice(-2 * int(period), None)
        before = slice(-3 * int(period), -int(period))
        near = 1e-3 * float(drops[-int(period) :].max())
        if np.array_equal(node[end], node[before]) and np.all(np.abs(after[end] - after[before]) <= near):
            return int(period)
    return 0


def _uncertainty_of_mean(values: NDArray[np.float64], sampling: Sampling) -> float:
    """Standard error of the mean over events: that of blocks (the last events, less than a block, are left out), and what
    the phases that were not seen may have brought, which is all from one spacing on where slips drop anything. NaN where a
    block has fewer than two events."""
    size = len(values) // BLOCKS
    if size < 2:
        return float("nan")
    within = mean_uncertainty(values[: BLOCKS * size].reshape(BLOCKS, -1).mean(axis=1))
    unseen = sampling.of_events() * abs(float(values.mean()))
    modelled = sampling.spacings >= 1.0 and sampling.residual_shear < 1.0
    return unseen if modelled else float(np.hypot(within, unseen))
