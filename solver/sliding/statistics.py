"""What is read off the events of a friction record (§3.2): counts, means with uncertainties, the cycle it ends in.

The plateau of a friction record is found in solver.sliding.plateau.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from solver.quantity import GRID_ERROR, companion, quantity
from solver.sliding.plateau import (
    BLOCKS,
    mean_uncertainty,
    sampling_of,
)
from solver.sliding.record import EVENT_KINDS, FrictionRecord, drops
from solver.sliding.sampling import Sampling, scatter
from solver.view import Labels, with_error

HALVES: Final = 0.25
"""Uncertainty of step and drop per event over what halves of the record differ by, where that is more than the model's."""
SINGLE: Final = 3.0
"""The same over the standard error of as many independent events: a few large ones carry a mean, and they come in groups."""
GROUPS: Final = 0.4
"""The same over that of blocks of one spacing, in which runs of small events count once; most of it repeats with the nodes."""
LOADING: Final = 0.5
"""The same, of the mean, over how much more all drops would be had the friction force not risen since initial contact."""
STILL_LOADING: Final = 0.5
"""That share above which step and drop per event are not known: they are those of a contact that has hardly begun to slide."""
_OF_EVENTS: Final = (
    "of an estimate of the mean over all starts; NaN below a fifth of a node spacing, where the friction force rose by more "
    "than half of what it dropped, and with the contact at an end of the surface"
)
LONGEST_CYCLE: Final = 6000
"""Events at the end of a record that are searched for a cycle."""


@dataclass(frozen=True, slots=True, repr=False)
class EventStatistics(Labels):
    """Counts and means over the events of one friction record. What has no event to be taken over is NaN."""

    peak_friction: float = field(
        metadata=quantity(
            "largest F/W of the record",
            symbol="F/W",
            ensemble="event",
            comment="friction force over load, of the whole record; NaN where the pin has not moved",
        )
    )
    surface_stiffness: float = field(
        metadata=quantity(
            "lateral stiffness, in G·L_y",
            uncertainty=GRID_ERROR,
            symbol="K",
            comment="of the contact before it slides (Eq. 15)",
            si=companion("lateral stiffness", "N m-1", "stiffness", symbol="K"),
        )
    )
    events: int = field(metadata=quantity("events of the record"))
    spacings: float = field(
        metadata=quantity(
            "length of the record, in node spacings", "record_spacings", comment="what the pin meets repeats with them"
        )
    )
    cycle_events: int = field(
        metadata=quantity(
            "events of the cycle at the end",
            ensemble="own",
            comment="after which the end of the record repeats itself; 0: it does not",
        )
    )
    cycle_spacings: float = field(
        metadata=quantity(
            "length of that cycle, in node spacings",
            ensemble="own",
            comment="how far the pin moves in a cycle of cycle_events",
        )
    )
    """0 without one."""
    slips: int = field(metadata=quantity("events triggered by a slip"))
    releases: int = field(metadata=quantity("events triggered by a release"))
    touches: int = field(metadata=quantity("events triggered by a new contact"))
    cascade_slips: int = field(metadata=quantity("node slips of all cascades together"))
    cascade_releases: int = field(metadata=quantity("nodes that left contact in the record"))
    cascade_touches: int = field(metadata=quantity("nodes that touched in the record"))
    mean_step: float = field(
        metadata=quantity(
            "mean step per event, in L_x",
            uncertainty="mean_step_uncertainty",
            ensemble="per_event",
            comment="pin displacement from one event to the next",
            si=companion("mean step per event", "m", "length"),
        )
    )
    mean_step_uncertainty: float = field(metadata=quantity("standard error of mean_step, in L_x", comment=_OF_EVENTS))
    """See solver.sliding.sampling."""
    mean_slips: float = field(metadata=quantity("mean number of node slips per event"))
    mean_drop: float = field(
        metadata=quantity("mean drop of F/W per event", uncertainty="mean_drop_uncertainty", ensemble="per_event")
    )
    mean_drop_uncertainty: float = field(
        metadata=quantity("standard error of mean_drop", comment=f"as F/W; {_OF_EVENTS}")
    )
    dissipated: float = field(
        metadata=quantity("energy lost in all events, in W·L_x", "dissipated_energy", per="normal_load")
    )
    """In G·L_x²·L_y here."""

    def _facts(self) -> Iterator[str]:
        yield f"{self.events} events"
        yield f"mean step/L_x {with_error(self.mean_step, self.mean_step_uncertainty)}"
        yield f"mean drop of F/W {with_error(self.mean_drop, self.mean_drop_uncertainty)}"
        yield f"largest F/W {self.peak_friction:.4g}"


def event_statistics(record: FrictionRecord) -> EventStatistics:
    """Count and average the events of a record."""
    events = len(record.displacement)
    slips, releases, touches = np.bincount(record.kind, minlength=len(EVENT_KINDS)).tolist()
    per_event = 1.0 / events if events else float("nan")
    sampling = sampling_of(record, 0, record.final_displacement)
    cycle = cycle_of(record)
    fallen = drops(record.force_before / record.normal_load, record.force_after / record.normal_load)
    loaded = _loaded(record, float(fallen.sum()))
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
        mean_step_uncertainty=_uncertainty_of_mean(
            np.diff(np.concatenate(([0.0], record.displacement))), record, sampling, loaded
        ),
        mean_slips=float(record.slips.sum()) * per_event,
        mean_drop=float(fallen.sum()) * per_event,
        mean_drop_uncertainty=_uncertainty_of_mean(fallen, record, sampling, loaded),
        peak_friction=_peak(record) / record.normal_load if record.final_displacement > 0.0 else float("nan"),
        dissipated=float(record.dissipated.sum()),
        spacings=sampling.spacings,
        cycle_events=cycle,
        cycle_spacings=float(record.displacement[-1] - record.displacement[-1 - cycle]) / record.spacing
        if cycle
        else 0.0,
    )


def _peak(record: FrictionRecord) -> float:
    """The largest friction force of a record."""
    largest = record.force_before.max(initial=record.initial_force)
    return float(record.force_after.max(initial=max(largest, record.final_force)))


def cycle_of(record: FrictionRecord) -> int:
    """Number of events after which the end of a record repeats itself; 0 where it does not.

    A cycle is seen at least three times over: the same nodes in turn, the same forces to a thousandth of its largest drop.
    """
    node, after = record.node[-LONGEST_CYCLE:], record.force_after[-LONGEST_CYCLE:]
    if not len(node):
        return 0
    fallen = np.abs(record.force_before[-LONGEST_CYCLE:] - after)
    near = 1e-3 * float(fallen.max())
    again = len(node) - 1 - np.flatnonzero((node[:-1] == node[-1]) & (np.abs(after[:-1] - after[-1]) <= near))[::-1]
    for period in again[3 * again <= len(node)]:
        end = slice(-2 * int(period), None)
        before = slice(-3 * int(period), -int(period))
        near = 1e-3 * float(fallen[-int(period) :].max())
        if np.array_equal(node[end], node[before]) and np.all(np.abs(after[end] - after[before]) <= near):
            return int(period)
    return 0


def _loaded(record: FrictionRecord, fallen: float) -> float:
    """How much the friction force has risen over a record, over all its drops (F/W): a pin that slides on drops that too."""
    risen = abs(record.final_force - record.initial_force) / record.normal_load
    return risen / fallen if fallen > 0.0 else math.inf


def _uncertainty_of_mean(
    values: NDArray[np.float64], record: FrictionRecord, sampling: Sampling, loaded: float
) -> float:
    """Standard error of the mean over events: that of single events and of blocks (the last events, less than a block, are left
    out), what the phases that were not seen may have brought, and what initial contact left. NaN where a block has fewer than two
    events, and where the contact has hardly begun to slide."""
    size = len(values) // BLOCKS
    if size < 2:
        return math.nan
    within = mean_uncertainty(values[: BLOCKS * size].reshape(BLOCKS, -1).mean(axis=1))
    mean = abs(float(values.mean()))
    unseen = sampling.of_events() * mean
    if sampling.residual_shear == 1.0:
        return math.hypot(within, unseen)
    if loaded > STILL_LOADING:
        return math.nan
    count = math.floor(sampling.spacings)
    single = SINGLE * scatter(values) / math.sqrt(len(values))
    seen = math.hypot(single, GROUPS * within / math.sqrt(max(sampling.spacings, 1.0)))
    seen = _with_spacings(values, record, count, seen)
    halves = HALVES * _between_halves(values, record, count)
    return float(np.maximum(math.hypot(seen, unseen, LOADING * loaded * mean), halves))


def _with_spacings(values: NDArray[np.float64], record: FrictionRecord, count: int, seen: float) -> float:
    """Standard error of the mean over events by what the last spacings, so many whole ones, differ by: hundreds of small events
    come at once in some, and in others not. A few may be alike by chance: what events and blocks tell (`seen`) counts as one."""
    begins = np.searchsorted(
        record.displacement, record.final_displacement - record.spacing * np.arange(count, 0, -1.0)
    )
    means = np.array([part.mean() for part in np.split(values, begins)[1:] if len(part)])
    if len(means) < 2:
        return seen
    return math.sqrt((len(means) - 1) * scatter(means) ** 2 + len(means) * seen**2) / len(means)


def _between_halves(values: NDArray[np.float64], record: FrictionRecord, spacings: int) -> float:
    """How much the mean over events differs between the two halves of the last spacings, both whole ones; 0 of fewer than two.

    Steps are longer until initial contact is forgotten: how long that takes differs from case to case.
    """
    half = spacings // 2 * record.spacing
    before, middle = np.searchsorted(record.displacement, record.final_displacement - half * np.array([2.0, 1.0]))
    if not before < middle < len(values):
        return 0.0
    return abs(float(values[middle:].mean()) - float(values[before:middle].mean()))
