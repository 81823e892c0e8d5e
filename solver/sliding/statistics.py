"""What is read off a friction record and a drive: event statistics (§3.2), μ_s and μ_k with uncertainties (§3.3).

The plateau of a friction record is found in solver.plateau; the same truncation and block rules serve the drive.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from solver.dynamics import DynamicsResult
from solver.outcome import COMPLETED, Ending, Outcome
from solver.plateau import (
    BLOCKS,
    Plateau,
    latest_truncation,
    mean_uncertainty,
    plateau_of,
    sampling_of,
    truncation,
    unsteadiness,
)
from solver.sampling import MODULATION, Sampling
from solver.sliding import EVENT_KINDS, FrictionRecord

__all__ = [
    "EventStatistics",
    "FrictionCoefficients",
    "Plateau",
    "event_statistics",
    "friction_coefficients",
    "plateau_of",
]


PERIODS: Final = 2.0
"""Of its own motion that a pin has to slide before a mean driving force is friction, not inertia."""
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
    """Its standard error as an estimate of the mean over all positions of the pin, see solver.sampling."""
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
    drops = (record.force_before - record.force_after) / record.load
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
        peak_friction=float(np.concatenate(forces).max()) / record.load,
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
    modelled = sampling.spacings >= 1.0 and sampling.residual < 1.0
    return unseen if modelled else float(np.hypot(within, unseen))


@dataclass(frozen=True, slots=True, eq=False)
class FrictionCoefficients:
    """Macroscopic friction of one drive, as forces over W; NaN where it could not be measured, for which see `outcome`.

    static_friction: largest driving force before the first macroscopic slip ran off (μ_s). every_static_friction: (s,)
    the same for each slip. static_friction_uncertainty: standard deviation between starts of the pin within a node spacing,
    from the scatter between stretches of the plateau or, where it is larger, from the model of solver.sampling.
    kinetic_friction: mean of the driving force where it is steady (μ_k). kinetic_friction_uncertainty: from its block
    means, from the plateau that it repeats, and from how much of a node spacing the pin travels.
    """

    static_friction: float
    static_friction_uncertainty: float
    every_static_friction: NDArray[np.float64]
    kinetic_friction: float
    kinetic_friction_uncertainty: float
    outcome: Outcome


def friction_coefficients(result: DynamicsResult, record: FrictionRecord, plateau: Plateau) -> FrictionCoefficients:
    """μ_s and μ_k of a drive over `record`. The outcome is the drive's, or `NO_SLIP`, or `NO_PLATEAU` of its force."""
    nan = float("nan")
    if not len(result.slip_force):
        message = (
            f"no slip longer than {result.presliding_length:.3g} L_x: raise the drive's duration or stage_velocity"
        )
        failed = result.outcome if not result.outcome.ok else Outcome(Ending.NO_SLIP, message)
        return FrictionCoefficients(nan, nan, result.slip_force, nan, nan, failed)
    static = result.slip_force / record.load
    kinetic, uncertainty, outcome = nan, nan, result.outcome
    slides = float(result.time[-1] - result.slip_time[0])
    if outcome.ok and slides < PERIODS * result.settling_time:
        message = f"the pin slides for {slides / result.settling_time:.2g} of its periods, {PERIODS:g} are needed: raise duration"
        outcome = Outcome(Ending.NO_PLATEAU, f"the driving force is not steady: {message}")
    if outcome.ok:
        kinetic, uncertainty, outcome = _steady_mean(result.binned_force / record.load)
    return FrictionCoefficients(
        static_friction=float(static[0]),
        static_friction_uncertainty=math.hypot(
            _uncertainty_of_peak(record, plateau, float(static[0])), _beyond(record, float(static[0]))
        ),
        every_static_friction=static,
        kinetic_friction=kinetic,
        kinetic_friction_uncertainty=math.hypot(
            uncertainty, plateau.uncertainty, _not_travelled(result, record, kinetic), _beyond(record, kinetic)
        ),
        outcome=outcome,
    )


def _steady_mean(bins: NDArray[np.float64]) -> tuple[float, float, Outcome]:
    """Mean of the steady part of evenly binned values, its uncertainty, and whether there is a steady part."""
    first = truncation(bins)
    edges = np.linspace(first, len(bins), BLOCKS + 1)
    impulse = np.interp(edges, np.arange(len(bins) + 1), np.concatenate(([0.0], np.cumsum(bins))))
    blocks = np.diff(impulse) / np.diff(edges)
    complaint = unsteadiness(blocks, latest=first >= latest_truncation(len(bins)))
    if complaint:
        return float("nan"), float("nan"), Outcome(Ending.NO_PLATEAU, f"the driving force {complaint}: raise duration")
    return float(blocks.mean()), mean_uncertainty(blocks), COMPLETED


def _uncertainty_of_peak(record: FrictionRecord, plateau: Plateau, static: float) -> float:
    """Standard deviation of F/W where the pin first slides, between starts; NaN without a plateau."""
    if not plateau.outcome.ok:
        return float("nan")
    expected = sampling_of(record, plateau.first_event, plateau.end - plateau.start).of_peak() * static
    return float(np.fmax(_scatter_of_peaks(record, plateau) / record.load, expected))


def _beyond(record: FrictionRecord, coefficient: float) -> float:
    """By how much a coefficient lies outside all that the record holds, F/W: inertia and damper are in the driving force too."""
    highest = float(max(record.force_before.max(), record.initial_force, record.final_force)) / record.load
    return max(coefficient - highest, -coefficient, 0.0) if math.isfinite(coefficient) else 0.0


def _not_travelled(result: DynamicsResult, record: FrictionRecord, kinetic: float) -> float:
    """What the part of a node spacing that the pin does not travel leaves open of the mean force over load."""
    travelled = sampling_of(record, 0, float(np.nanmax(result.position)) - result.presliding_length)
    return travelled.unseen * MODULATION * travelled.discreteness * kinetic


def _scatter_of_peaks(record: FrictionRecord, plateau: Plateau) -> float:
    """Standard deviation of the highest force in eight equal stretches of the plateau; NaN without a plateau."""
    if not plateau.outcome.ok:
        return float("nan")
    within = slice(plateau.first_event + 1, plateau.last_event + 1)
    place = (record.displacement[within] - plateau.start) / (plateau.end - plateau.start)
    stretch = np.minimum((8.0 * place).astype(np.int64), 7)
    highest = [record.force_before[within][stretch == number].max() for number in np.unique(stretch)]
    return float(np.std(highest, ddof=1)) if len(highest) > 1 else float("nan")
