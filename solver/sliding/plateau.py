"""Where a friction record becomes steady (§3.2.1), and its mean there: deterministic, from the record alone.

The force is integrated exactly into equal bins of displacement. The steady part starts where truncation minimises the
marginal standard error of the mean, the sum of squares about the mean over the squared number of bins kept (MSER).
Where a record goes on for half a node spacing or more after its initial contact is forgotten, the steady part is all of that;
from one spacing on, the last whole spacings: what the pin meets repeats with them, so a mean over whole ones is free of the
modulation within one, and a pin that goes on over them for ever (§2.2.2) meets what it would meet.
It is refused where the force of whole spacings differs from that before them, so many spacings ago; of less, where a line
through eight block means still rises or falls by more than `LARGEST_CHANGE` of the mean, unless the change is lost in the
scatter of the blocks (less than `SIGNIFICANT` standard errors). A truncation as late as it is allowed to be has no such excuse.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import ClassVar, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from solver.outcome import COMPLETED, Ending, Outcome
from solver.quantity import companion, quantity
from solver.sliding.record import FrictionRecord
from solver.sliding.sampling import Sampling, scatter
from solver.view import Curve, Labelled, Picture, Viewed, in_words, labelled, with_error

BINS: Final = 512
BLOCKS: Final = 32
LEAST_SHARE: Final = 0.25
"""Share of the bins that truncation always keeps."""
LARGEST_CHANGE: Final = 0.01
"""Change along the steady part, as a fraction of its mean, that still counts as steady."""
LEAST_OVERLAP: Final = 0.1
"""Part of a node spacing before whole ones that is enough to compare their end with."""
WHOLE: Final = 0.02
"""Part of a node spacing by which events may miss a whole number of them."""
SIGNIFICANT: Final = 5.0
"""Standard errors beyond which a change is no accident (one record in four hundred with eight blocks)."""
FEWEST_EVENTS: Final = 8
SETTLING: Final = 3.0
"""How often the contact is stretched as far as before it slides until nothing is left of initial contact."""


@dataclass(frozen=True, slots=True, repr=False)
class Plateau(Viewed):
    """The steady part of a friction record; forces as F/W, NaN where `outcome` is not ok.

    It reaches from event `first_event` at displacement `start` (L_x) to event `last_event` at `end`, just after both.
    mean and std are displacement-weighted integrals over the sawtooth, without approximation. uncertainty is the standard
    error of the mean as an estimate of that over all positions of the pin (see solver.sliding.sampling): it knows how many node
    spacings the steady part spans, and is NaN where nothing tells it (`Sampling.of_length`). of_length is the part of it that a
    longer record makes smaller; drawn that by the draw of μ_i, over the mean. peak: the highest force; spacings: its length.
    """

    mean: float = field(
        metadata=quantity(
            "F/W on the plateau",
            uncertainty="plateau_uncertainty",
            symbol="F/W",
            ensemble="mean",
            comment="mean friction force over load on the steady part of the record, over displacement",
            si=companion(
                "plateau over μ_i",
                "1",
                "intrinsic_friction",
                "plateau_ratio",
                symbol="F/(μ_i·W)",
                uncertainty="plateau_ratio_uncertainty",
                comment="plateau_mean over intrinsic_friction; NaN where that is 0 or infinite",
            ),
        )
    )
    spacings: float = field(
        metadata=quantity("length of the plateau, in node spacings", comment="of the steady part of the record")
    )
    std: float = field(
        metadata=quantity(
            "standard deviation on the plateau", comment="of F/W over displacement, on the steady part of the record"
        )
    )
    uncertainty: float = field(
        metadata=quantity(
            "standard error of plateau_mean",
            comment="of an estimate of the mean over all starts, as F/W; NaN with the contact at an end of the surface, "
            "or where ν is near 0.5 and all nodes slip at once",
            si=companion("standard error of plateau_ratio", "1", "intrinsic_friction", "plateau_ratio_uncertainty"),
        )
    )
    start: float = field(
        metadata=quantity("start of the plateau, in L_x", comment="pin displacement where the steady part starts")
    )
    end: float = field(
        metadata=quantity("end of the plateau, in L_x", comment="pin displacement where the steady part ends")
    )
    drawn: float = field(metadata=quantity("relative error by the draw of μ_i", comment="part of plateau_uncertainty"))
    of_length: float
    first_event: int
    last_event: int
    peak: float
    outcome: Outcome = COMPLETED

    PREFIX: ClassVar[str] = "plateau_"
    """What its numbers get in front in a dataset."""

    def _facts(self) -> Iterator[str]:
        if self.outcome.ok:
            yield f"F/W {with_error(self.mean, self.uncertainty)}"
            yield f"δ_p/L_x {self.start:.4g} to {self.end:.4g}"
            yield f"{self.spacings:.4g} node spacings"
        yield in_words(self.outcome)

    def _labelled(self) -> Iterator[Labelled]:
        return labelled(self, self.PREFIX)

    def _picture(self) -> Picture:
        """The mean over the steady part, dashed one standard deviation of F/W above and below."""
        ends = np.array([self.start, self.end])
        both = np.array([self.start, self.end, np.nan, self.start, self.end])
        around = self.mean + self.std * np.array([1.0, 1.0, np.nan, -1.0, -1.0])
        curves = Curve(ends, np.full(2, self.mean), "plateau"), Curve(both, around, "± standard deviation", "--")
        return Picture("pin displacement δ_p/L_x", "friction force F/W", curves)


@dataclass(frozen=True, slots=True, eq=False)
class Teeth:
    """Straight pieces of force over displacement: edges (n + 1,), force at each piece's start and end (n,)."""

    edges: NDArray[np.float64]
    start: NDArray[np.float64]
    end: NDArray[np.float64]

    def integral(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """∫F from the first edge to each x within the edges, without approximation."""
        width = self.edges[1:] - self.edges[:-1]
        whole = np.zeros(len(self.edges))
        (0.5 * width * (self.start + self.end)).cumsum(out=whole[1:])
        piece = self.edges[1:-1].searchsorted(x, side="right")
        part = x - self.edges[piece]
        rise = (self.end - self.start)[piece] * np.divide(part, width[piece], out=np.zeros_like(part), where=part > 0.0)
        return np.asarray(whole[piece] + part * (self.start[piece] + 0.5 * rise))

    def block_means(self, first: float, last: float, count: int) -> NDArray[np.float64]:
        """Mean force in `count` equal stretches of displacement from `first` to `last`."""
        whole = self.integral(np.linspace(first, last, count + 1))
        return (whole[1:] - whole[:-1]) * (count / (last - first))


def teeth(record: FrictionRecord) -> Teeth:
    """The whole record as straight pieces: from δ_p = 0 to the first event, between events, on to the record's end."""
    return Teeth(
        np.concatenate(([0.0], record.displacement, [record.final_displacement])),
        np.concatenate(([record.initial_force], record.force_after)),
        np.concatenate((record.force_before, [record.final_force])),
    )


class _Beginning(NamedTuple):
    """Where the steady part begins (L_x), whether that is as late as it may be, and what of whole spacings lies before it."""

    at: float
    latest: bool = False
    before: float = 0.0


class _Stretch(NamedTuple):
    """What may be the steady part: from just after event `first` at `start` (L_x) to the last one at `end`."""

    first: int
    start: float
    end: float
    blocks: NDArray[np.float64]
    """Mean force in BLOCKS equal parts of it."""


def plateau_of(record: FrictionRecord) -> Plateau:
    """Find the steady part of `record`; the outcome is `NO_PLATEAU`, with advice, where there is none."""
    events = len(record.displacement)
    if events < 2 * FEWEST_EVENTS:
        return _refused(f"{events} events: a plateau needs at least {2 * FEWEST_EVENTS}; raise {_limit(record)}")
    whole = teeth(record)
    complaint = ""
    for begins in _beginnings(record, whole):
        first = int(np.searchsorted(record.displacement, begins.at))
        within = max(events - 1 - first, 0)
        if within < FEWEST_EVENTS:
            complaint = f"{within} events in the steady part: needs {FEWEST_EVENTS} or more; raise {_limit(record)}"
            continue
        start, end = float(record.displacement[first]), float(record.displacement[-1])
        stretch = _Stretch(first, start, end, whole.block_means(start, end, BLOCKS))
        complaint = _complaint(record, whole, begins, stretch)
        if not complaint:
            return _plateau(record, whole, stretch)
    return _refused(complaint)


def _complaint(record: FrictionRecord, whole: Teeth, begins: _Beginning, stretch: _Stretch) -> str:
    """What is wrong with calling the record steady in a stretch, with advice; empty if nothing is."""
    if begins.before >= LEAST_OVERLAP * record.spacing:
        wrong = _unlike(whole, stretch.start, stretch.end, min(begins.before, record.spacing))
    else:
        wrong = unsteadiness(stretch.blocks, latest=begins.latest)
    return f"the friction force still {wrong}; raise {_limit(record)}" if wrong else ""


def _limit(record: FrictionRecord) -> str:
    """The limit at which a record ended: one of displacement is reached between two events, that of events with the last one."""
    last = record.displacement[-1] if len(record.displacement) else -math.inf
    moved_on = (
        record.final_displacement - last > 1e-12 * record.final_displacement
    )  # beyond the rounding of a sum of steps
    return "limits.spacings or limits.displacement, which ended it" if moved_on else "limits.events"


def _plateau(record: FrictionRecord, whole: Teeth, stretch: _Stretch) -> Plateau:
    """What the record is in a stretch that is steady."""
    first, start, end, blocks = stretch
    last = len(record.displacement) - 1
    steady = Teeth(record.displacement[first:], record.force_after[first:last], record.force_before[first + 1 :])
    mean, std = _moments(steady)
    sampling = sampling_of(record, first, end - start)
    count = math.floor(sampling.spacings)
    spacings = whole.block_means(start, end, count) if count >= 2 else None
    of_length = sampling.of_length(blocks, mean_uncertainty(blocks), spacings)
    return Plateau(
        start=start,
        end=end,
        first_event=first,
        last_event=last,
        mean=mean / record.normal_load,
        std=std / record.normal_load,
        uncertainty=sampling.with_disorder(of_length, float(blocks.mean())) / record.normal_load,
        drawn=sampling.drawn,
        of_length=of_length / record.normal_load,
        peak=float(max(steady.start.max(), steady.end.max())) / record.normal_load,
        spacings=sampling.spacings,
    )


def sampling_of(record: FrictionRecord, first: int, length: float) -> Sampling:
    """What a stretch of a record that begins after event `first` and is so long (L_x) can know."""
    nodes = float(record.contact_size[first:].mean()) if len(record.contact_size) > first else float("nan")
    # Events and their distances are rounded: a stretch made to be whole spacings is.
    spacings = length / record.spacing
    whole = round(spacings)
    counted = float(whole) if whole and abs(spacings - whole) < WHOLE else spacings
    return Sampling(counted, nodes, record.residual_shear, record.spread, record.at_an_end, record.nodes_as_one)


def _beginnings(record: FrictionRecord, whole: Teeth) -> Iterator[_Beginning]:
    """Where the steady part may begin, the best first: as many whole spacings as there are, or fewer if the force changes."""
    end = float(record.displacement[-1])
    settled = (
        SETTLING * abs(record.final_force / record.initial_stiffness) if record.initial_stiffness > 0.0 else math.inf
    )
    spacings = (end - settled) / record.spacing
    count = math.floor(spacings) if spacings >= 1.0 else 0
    while count:
        begins = end - count * record.spacing
        yield _Beginning(begins, before=begins - settled)
        count //= 2
    if 0.5 <= spacings < 1.0:
        yield _Beginning(settled)
    if spacings < 0.5:
        kept_from = truncation(whole.block_means(0.0, record.final_displacement, BINS))
        yield _Beginning(record.final_displacement * kept_from / BINS, kept_from >= latest_truncation(BINS))


def _unlike(whole: Teeth, start: float, end: float, overlap: float) -> str:
    """What is wrong with calling whole spacings from `start` to `end` steady, as the end of a sentence; empty if nothing is.

    The force over the last stretch of them and over the one before them, so many spacings ago, are to be alike: the pin is
    where it was between the nodes.
    """
    now = whole.block_means(end - overlap, end, 8)
    change = now - whole.block_means(start - overlap, start, 8)
    share = float(change.mean()) / abs(float(now.mean())) if now.mean() else math.inf
    error = scatter(change) / math.sqrt(8)
    if abs(share) <= LARGEST_CHANGE or abs(float(change.mean())) <= SIGNIFICANT * error:
        return ""
    return f"{'rises' if share > 0.0 else 'falls'} by {abs(share):.1%} from one node spacing to the next"


def latest_truncation(count: int) -> int:
    """The last bin, of `count`, at which a steady part may start."""
    return int(count * (1.0 - LEAST_SHARE))


def truncation(bins: NDArray[np.float64]) -> int:
    """First bin of the steady part: the one that minimises the marginal standard error of what follows it."""
    centred = (bins - bins[-1])[::-1]
    kept = np.arange(1, len(bins) + 1)
    squares = (centred**2).cumsum() - centred.cumsum() ** 2 / kept
    return int((squares / kept**2)[::-1][: latest_truncation(len(bins)) + 1].argmin())


def mean_uncertainty(blocks: NDArray[np.float64]) -> float:
    """Largest standard error of the mean from 8, 16 and 32 blocks, given the means of 32: long correlation counts."""
    grouped = (blocks, *(blocks.reshape(count, -1).mean(axis=1) for count in (8, 16)))
    return max(scatter(means) / math.sqrt(len(means)) for means in grouped)


_PLACES: Final = (np.arange(8) - 3.5) / 8.0
"""Of eight equal parts of a stretch, in its lengths from its middle."""


def unsteadiness(blocks: NDArray[np.float64], latest: bool) -> str:
    """What is wrong with calling 32 block means steady, as the end of a sentence; empty if nothing is.

    latest: the truncation is as late as it may be, so that scatter does not excuse a change.
    """
    means = blocks.reshape(8, -1).mean(axis=1)
    mean, place = float(means.mean()), _PLACES
    change = float(place @ means / (place @ place))
    rest = means - mean - change * place
    error = float(np.sqrt(rest @ rest / 6.0 / (place @ place)))
    share = change / abs(mean) if mean else np.inf
    if abs(share) <= LARGEST_CHANGE or (abs(change) <= SIGNIFICANT * error and not latest):
        return ""
    return f"{'rises' if share > 0.0 else 'falls'} by {abs(share):.1%} along the best steady part"


def _moments(steady: Teeth) -> tuple[float, float]:
    """Mean and standard deviation of the force over displacement."""
    width = steady.edges[1:] - steady.edges[:-1]
    mean = float(width @ (steady.start + steady.end)) / (2.0 * float(width.sum()))
    low, high = steady.start - mean, steady.end - mean
    return mean, float(np.sqrt(width @ (low * low + low * high + high * high) / (3.0 * width.sum())))


def _refused(message: str) -> Plateau:
    nan = float("nan")
    return Plateau(nan, nan, nan, nan, nan, nan, nan, nan, 0, 0, nan, Outcome(Ending.NO_PLATEAU, message))
