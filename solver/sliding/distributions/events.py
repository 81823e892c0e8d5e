"""Sizes of the events of a friction record, and how successive events depend on each other."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.quantity import as_metadata, quantities
from nanoslip.solver.sliding.record import FrictionRecord, event
from nanoslip.solver.view import Curve, Picture, Viewed

Vector = NDArray[np.float64]

ROUNDING = 1e-10
"""Force over the load, and energy over the square of the load, below which a difference is rounding: 1e-12 of the load is what
one node's force is known to."""
ALIKE = 1e-9
"""Share of the largest size below which sizes do not differ for their ranks; a thousand times what rounding was seen to do."""
FEWEST = 10
"""Events below which no correlation is computed."""


_OF_RECORD = quantities(FrictionRecord)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class EventSizes(Viewed):
    """What each event of a record was, arrays (e,); a size of 0 is none. Lengths in L_x, forces over W, energies in W·L_x."""

    slips: NDArray[np.int64] = field(metadata=as_metadata(_OF_RECORD["slips"]))
    extent: NDArray[np.int32] = field(metadata=as_metadata(_OF_RECORD["extent"]))
    drop: Vector = field(
        metadata=event(
            "drop of F/W in the event",
            "drop",
            symbol="ΔF/W",
            comment="made of event_friction_before and event_friction_after when asked for; 0 where it is within rounding",
        )
    )
    """Fall of F/W; rises are 0."""
    energy: Vector = field(metadata=as_metadata(replace(_OF_RECORD["dissipated"], per="")))
    """Energy lost."""
    step: Vector = field(metadata=event("displacement to the next event, in L_x", "step"))
    """Displacement to the next event; NaN of the last."""

    def _facts(self) -> Iterator[str]:
        yield f"{len(self.slips)} events"
        yield f"{self.slips.sum()} node slips"
        if len(self.slips):
            yield f"{self.slips.max()} in the largest"

    def _picture(self) -> Picture:
        """Share of the events that are at least so large, over the size in units of its mean."""
        return Picture(
            "size over its mean", "share of events that are as large", tuple(map(self._share, DISCRETE)), True
        )

    def _share(self, name: str) -> Curve:
        sizes = np.asarray(getattr(self, name), np.float64)
        sizes = np.sort(sizes[sizes > 0.0])
        rank = np.arange(len(sizes), 0, -1) / max(len(sizes), 1)
        return Curve(sizes / sizes.mean() if len(sizes) else sizes, rank, name)


DISCRETE = {"slips": True, "extent": True, "drop": False, "energy": False, "step": False}
"""Size -> whether it is a whole number."""


def event_sizes(record: FrictionRecord, beyond: float = -math.inf) -> EventSizes:
    """The sizes of a record's events whose displacement is at least `beyond`."""
    load = record.normal_load
    drop = (record.force_before - record.force_after) / load
    return sizes_of_columns(
        record.displacement, record.slips, record.extent, drop, record.dissipated / load, load, beyond
    )


def sizes_of_columns(
    displacement: Vector,
    slips: NDArray[np.int64],
    extent: NDArray[np.int32],
    drop: Vector,
    energy: Vector,
    normal_load: float,
    beyond: float,
) -> EventSizes:
    """The sizes of a record's events as its columns (e,) say: displacement in L_x, fall of F/W, energy lost in W·L_x."""
    chosen = displacement >= beyond
    step = np.diff(displacement, append=math.nan)
    return EventSizes(
        slips=slips[chosen],
        extent=extent[chosen],
        drop=np.where(drop > ROUNDING, drop, 0.0)[chosen],
        energy=np.where(energy > ROUNDING * normal_load, energy, 0.0)[chosen],
        step=step[chosen],
    )


def pooled(parts: list[EventSizes]) -> EventSizes:
    """The events of several records, such as the members of an ensemble, one record behind the other."""
    return EventSizes(**{name: np.concatenate([getattr(part, name) for part in parts]) for name in DISCRETE})


def rank_correlation(first: Vector, second: Vector) -> float:
    """Spearman's coefficient of two columns, -1 to 1; NaN of fewer than FEWEST pairs, or where one does not vary.

    Of m independent pairs it is 0 with a standard error of 1/√(m - 1).
    """
    known = np.isfinite(first) & np.isfinite(second)
    if known.sum() < FEWEST:
        return math.nan
    ranks = [_ranks(column[known]) for column in (first, second)]
    ranks = [rank - rank.mean() for rank in ranks]
    scale = math.sqrt(float(ranks[0] @ ranks[0]) * float(ranks[1] @ ranks[1]))
    return float(ranks[0] @ ranks[1]) / scale if scale > 0.0 else math.nan


def _ranks(values: Vector) -> Vector:
    """Place of each value among all, from 1 on; equal ones, to within rounding, share the mean of theirs.

    A record repeats itself from spacing to spacing: which of two such events is the larger is decided by rounding.
    """
    order = np.argsort(values, kind="stable")
    larger = np.diff(values[order], prepend=values[order[:1]]) > ALIKE * np.abs(values).max()
    group = np.cumsum(larger)
    counts = np.bincount(group)
    ranks = np.empty(len(values))
    ranks[order] = (np.cumsum(counts) - (counts - 1) / 2.0)[group]
    return ranks
