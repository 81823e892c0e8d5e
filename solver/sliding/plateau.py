"""The steady part of a friction record after run-in (§3.2.1), and its mean.

Run-in ends after RUN_IN presliding lengths; a shorter record has no plateau. From a steady part of a node spacing or more only
the last whole spacings count: the surface pattern repeats with them.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import ClassVar, Final

import numpy as np

from nanoslip.solver.arrays import Floats
from nanoslip.solver.ensemble import student
from nanoslip.solver.outcome import COMPLETED, Ending, Outcome
from nanoslip.solver.parameter import Quantity, quantity
from nanoslip.solver.sliding.record import RUN_IN, SPACINGS, FrictionRecord, require_record
from nanoslip.solver.view import Curve, Labelled, Picture, Viewed, describe_outcome, label_numbers

FEWEST_EVENTS: Final = 8
"""Fewest events of a steady part: fewer do not determine the mean of a sawtooth."""


@dataclass(frozen=True, slots=True, repr=False)
class Plateau(Viewed):
    """The steady part of a friction record; forces as F/W, NaN where `outcome` is not ok.

    It reaches from event `first_event` at displacement `start` (L_x) to event `last_event` at `end`, just after both.
    mean and std are displacement-weighted integrals over the sawtooth, without approximation. peak: the highest force.
    drift: (mean over its last half) - (mean over its first half); halves of whole node spacings if it has two or
        more.
    event_drift: (events in its last half - events in its first half) / mean of both.
    """

    first_event: int
    last_event: int
    peak: float
    mean: float = quantity(
        "F/W on the plateau",
        symbol="F/W",
        ensemble=True,
        shared="plateau",
        comment="mean friction force over load on the steady part of the record, over displacement",
        si=Quantity(
            "plateau_ratio",
            "plateau over μ_i",
            "1",
            "intrinsic_friction",
            symbol="F/(μ_i·W)",
            comment="plateau_mean over intrinsic_friction; NaN where that is 0 or infinite",
        ),
    )
    stress: float = quantity(
        "F over the contact area on the plateau",
        symbol="F/A",
        ensemble=True,
        shared="stress",
        comment="mean friction force over mean area of the nodes in contact, on the steady part of the record: what a strength "
        "without pressure holds constant, as intrinsic_friction holds F/W",
        measure="W/(L_x·L_y)",
    )
    spacings: float = quantity(
        "length of the plateau", comment="of the steady part of the record", measure="node spacings"
    )
    std: float = quantity(
        "standard deviation on the plateau", comment="of F/W over displacement, on the steady part of the record"
    )
    start: float = quantity(
        "start of the plateau", comment="pin displacement where the steady part starts", measure="L_x"
    )
    end: float = quantity("end of the plateau", comment="pin displacement where the steady part ends", measure="L_x")
    drift: float = math.nan
    event_drift: float = math.nan
    stress_drift: float = math.nan
    outcome: Outcome = COMPLETED

    PREFIX: ClassVar[str] = "plateau_"
    """Prefix of its numbers in a dataset."""

    def _facts(self) -> Iterator[str]:
        if self.outcome.ok:
            yield f"F/W {self.mean:.4g}"
            yield f"δ_p/L_x {self.start:.4g} to {self.end:.4g}"
            yield f"{self.spacings:.4g} node spacings"
        yield describe_outcome(self.outcome)

    def _label_values(self) -> Iterator[Labelled]:
        return label_numbers(self, self.PREFIX)

    def _picture(self) -> Picture:
        """The mean over the steady part, dashed one standard deviation of F/W above and below."""
        ends = np.array([self.start, self.end])
        mean = Curve(ends, np.full(2, self.mean), "plateau")
        # A NaN between both lines breaks the curve.
        both = np.concatenate((ends, [np.nan], ends))
        sides = np.array([1.0, 1.0, np.nan, -1.0, -1.0])
        deviation = Curve(both, self.mean + self.std * sides, "± standard deviation", "--")
        return Picture("pin displacement δ_p/L_x", "friction force F/W", (mean, deviation))


@dataclass(frozen=True, slots=True, eq=False)
class Teeth:
    """Straight pieces of force over displacement: edges (n + 1,), force at each piece's start and end (n,)."""

    edges: Floats
    start: Floats
    end: Floats

    def force(self, x: Floats) -> Floats:
        """F at each x within the edges; at a jump what follows it."""
        piece = self.edges[1:-1].searchsorted(x, side="right")
        part, width = x - self.edges[piece], np.diff(self.edges)[piece]
        share = _share_of_piece(part, width)
        rise = (self.end - self.start)[piece]
        return np.asarray(self.start[piece] + rise * share)

    def integral(self, x: Floats) -> Floats:
        """∫F from the first edge to each x within the edges, without approximation."""
        width = self.edges[1:] - self.edges[:-1]
        pieces = 0.5 * width * (self.start + self.end)
        sums = np.zeros(len(self.edges))
        pieces.cumsum(out=sums[1:])
        piece = self.edges[1:-1].searchsorted(x, side="right")
        part = x - self.edges[piece]
        rise = (self.end - self.start)[piece] * _share_of_piece(part, width[piece])
        return np.asarray(sums[piece] + part * (self.start[piece] + 0.5 * rise))

    def block_means(self, first: float, last: float, count: int) -> Floats:
        """Mean force in `count` equal stretches of displacement from `first` to `last`."""
        integrals = self.integral(np.linspace(first, last, count + 1))
        return (integrals[1:] - integrals[:-1]) * (count / (last - first))


def teeth(record: FrictionRecord) -> Teeth:
    """The whole record as straight pieces: from δ_p = 0 to the first event, between events, on to the record's end."""
    edges = np.concatenate(([0.0], record.displacement, [record.final_displacement]))
    start = np.concatenate(([record.initial_force], record.force_after))
    end = np.concatenate((record.force_before, [record.final_force]))
    return Teeth(edges, start, end)


def _share_of_piece(part: Floats, width: Floats) -> Floats:
    """Part of a piece over its width; 0 at its start, also of a piece without width, where two events coincide."""
    share = np.zeros_like(part)
    np.divide(part, width, out=share, where=part > 0.0)
    return share


def plateau_of(record: FrictionRecord) -> Plateau:
    """The steady part of `record`; without a plateau the outcome is `NO_PLATEAU`, with advice."""
    require_record(record)
    events, spacings = len(record.displacement), 0
    begins = RUN_IN * record.presliding_length
    if not begins < record.final_displacement:
        reached = f"the record ends after {record.presliding_lengths:.2g} presliding lengths"
        return _missing_plateau("run_in", f"{reached}, run-in takes {RUN_IN:g}", record)
    if events and (spacings := math.floor((record.displacement[-1] - begins) / record.spacing)):
        # Counted back from the last event: what is left over falls to run-in.
        begins = record.displacement[-1] - spacings * record.spacing
    first, last = int(np.searchsorted(record.displacement, begins)), events - 1
    if last - first < FEWEST_EVENTS:
        return _missing_plateau(
            "few_events", f"{max(last - first, 0)} events after run-in: needs {FEWEST_EVENTS}", record
        )
    force_after, force_before = record.force_after[first:last], record.force_before[first + 1 :]
    steady = Teeth(record.displacement[first:], force_after, force_before)
    start, end = float(steady.edges[0]), float(steady.edges[-1])
    mean, std = _moments(steady)
    widths = np.diff(steady.edges)
    node_widths = np.concatenate(([0.0], (widths * record.contact_size[first:last]).cumsum()))
    half = 0.5 * (end - start)
    if spacings > 1:
        # Halves of whole node spacings see the same pattern of the surface.
        half = spacings // 2 * record.spacing
    places = np.array((start, start + half, end - half, end))
    # Over the width between the places of the integral, which is rounded, not over `half`.
    per_early, per_late = 1.0 / (start + half - start), 1.0 / (end - (end - half))
    force_until = steady.integral(places)
    early = float(force_until[1] - force_until[0]) * per_early
    late = float(force_until[3] - force_until[2]) * per_late
    nodes_until = np.interp(places, steady.edges, node_widths)
    early_nodes = float(nodes_until[1] - nodes_until[0]) * per_early
    late_nodes = float(nodes_until[3] - nodes_until[2]) * per_late
    node_load = record.node_area * record.normal_load
    # Between events by interpolation: whether one lies just before or after an end of a half is decided by rounding.
    events_until = np.interp(places[1:3], steady.edges, np.arange(len(steady.edges)))
    before, after = float(events_until[0]), last - first - float(events_until[1])
    return Plateau(
        start=start,
        end=end,
        first_event=first,
        last_event=last,
        mean=mean / record.normal_load,
        stress=mean * float(widths.sum()) / (float(node_widths[-1]) * node_load),
        std=std / record.normal_load,
        peak=float(max(steady.start.max(), steady.end.max())) / record.normal_load,
        spacings=(end - start) / record.spacing,
        drift=(late - early) / record.normal_load,
        event_drift=2.0 * (after - before) / (after + before),
        stress_drift=(late / late_nodes - early / early_nodes) / node_load,
    )


def plateau_error(plateaus: Sequence[Plateau]) -> float:
    """The part of the ± of a mean plateau that all its starts share, as F/W; more starts do not reduce it.

    Drift from half to half that chance does not explain (two-way analysis of variance: Searle et al., Variance
    Components, 1992). NaN for a single start.
    """
    return _drift_error([plateau.drift for plateau in plateaus])


def stress_error(plateaus: Sequence[Plateau]) -> float:
    """Part of the ± of a mean stress on the plateau that all its starts share, including changes of the area; in
    W/(L_x·L_y)."""
    return _drift_error([plateau.stress_drift for plateau in plateaus])


def event_drift_error(plateaus: Sequence[Plateau]) -> float:
    """The part of the ± of a mean over events that all its starts share, over that mean, by the drift of their number.

    NaN (unknown) if records are shorter than two node spacings: half of the events come in a tenth of a spacing, so that starts
    with short records miss them together. With constant pressures records have no spacings, and each is its start's own.
    """
    if not all(map(repeats, plateaus)):
        return math.nan
    return _drift_error([plateau.event_drift for plateau in plateaus])


def repeats(plateau: Plateau) -> bool:
    """True if a record has met the surface pattern twice; with constant pressures it is its start's own."""
    return plateau.spacings == 0.0 or plateau.spacings > SPACINGS - 0.5


def extreme_error(growth: Sequence[float]) -> float:
    """The part of the ± of a mean extreme that all its starts share, as their records end somewhere; NaN for a single
    start.

    growth: extreme of each whole record less the extreme of its first half. If the extreme has a bound that the
        surface reaches with finite density, its distance from the bound falls as the inverse of the length: a half is
        twice as far from the bound as the whole, so the whole lacks as much as the later half added. Two lengths show
        that, hence Student's factor for two.
    """
    if len(growth) < 2:
        return math.nan
    return float(student(2)) * abs(float(np.mean(growth)))


def repetition_error(growth: Sequence[float]) -> float:
    """The part of the ± of a mean that all its starts share, as drives repeat records of one length; NaN for a single start.

    growth: number of each drive less that over the first half of its record. The whole is the mean of both halves, so that this
        is half of the change from half to half.
    """
    return _drift_error([2.0 * each for each in growth])


def _drift_error(drifts: Sequence[float]) -> float:
    """Error of a mean by the part of its change from half to half that all starts share; NaN for a single start."""
    if len(drifts) < 2:
        return math.nan
    mean = float(np.mean(drifts))
    scatter = float(np.var(drifts, ddof=1)) / len(drifts)
    # Starts that scatter change their mean by chance: the square of that is expected to be `scatter`.
    shared = math.sqrt(max(mean**2 - scatter, 0.0))
    # As of two measurements, the halves: standard error |change|/2 of their mean, with Student's factor for two.
    return 0.5 * float(student(2)) * shared


def _moments(steady: Teeth) -> tuple[float, float]:
    """Mean and standard deviation of the force over displacement."""
    width = steady.edges[1:] - steady.edges[:-1]
    mean = float(width @ (steady.start + steady.end)) / (2.0 * float(width.sum()))
    low, high = steady.start - mean, steady.end - mean
    # The mean square of a straight line from a to b is (a² + ab + b²)/3.
    squares = low * low + low * high + high * high
    variance = width @ squares / (3.0 * width.sum())
    return mean, float(np.sqrt(variance))


def _missing_plateau(cause: str, message: str, record: FrictionRecord) -> Plateau:
    """Report no plateau, and the limit to raise: displacement ends a record between two events, events at the last.

    A single node has one event in a presliding length: it is no contact yet.
    """
    if cause == "few_events" and record.contact_size.max(initial=record.initial_contact_size) == 1:
        alone = f"{message}; one node in contact: raise n_x, or normal_load or radius"
        return Plateau(0, 0, *(math.nan,) * 7, outcome=Outcome(Ending.NO_PLATEAU, alone, cause="one_node"))
    last = record.displacement[-1] if len(record.displacement) else -math.inf
    # Beyond the rounding of a sum of steps.
    between = record.final_displacement - last > 1e-12 * record.final_displacement
    limit = "limits.presliding, spacings or displacement, whichever ended it" if between else "limits.events"
    cause = f"{cause} {'travel' if between else 'events'}"
    outcome = Outcome(Ending.NO_PLATEAU, f"{message}; raise {limit}", cause=cause)
    return Plateau(0, 0, *(math.nan,) * 7, outcome=outcome)
