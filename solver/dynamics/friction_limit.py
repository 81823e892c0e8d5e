"""The friction limit F̃(x) of a moving pin (§2.2.2): straight teeth of a friction record, its steady part extended periodically.

Teeth from δ_p = 0 to the plateau's end, then the plateau's again and again; the junction is one more jump. Behind the start,
F̃(-x) = F̃(x): initial contact has no preferred direction. Negative limits of initial contact are 0, as Eq. 13 needs.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.arrays import Floats
from nanoslip.solver.drive import ProfileShape
from nanoslip.solver.outcome import Ending, InvalidInput, SolverError
from nanoslip.solver.sliding.plateau import Plateau, Teeth, teeth
from nanoslip.solver.sliding.record import FrictionRecord

COARSE: Final = 64
"""Coarse teeth in a node spacing, at the most; a record of it has hundreds to thousands."""


class NoPlateauError(SolverError):
    """The friction record has no steady part that could repeat."""

    ending = Ending.NO_PLATEAU


@dataclass(frozen=True, slots=True, eq=False)
class FrictionLimit:
    """F̃(x) as n teeth, tooth i from edges[i] to edges[i + 1], repeating from tooth `periodic_from` on.

    edges: (n + 1,), L_x, increasing from 0. force: (n,), F̃ at each tooth's left edge, G·L_x·L_y. slope: (n,), G·L_y.
    Raises InvalidInput for teeth that do not fit together or reach below 0.
    """

    edges: Floats
    force: Floats
    slope: Floats
    periodic_from: int

    def __post_init__(self) -> None:
        count = len(self.force)
        if count < 1 or self.edges.shape != (count + 1,) or self.slope.shape != (count,):
            counts = {"edges": len(self.edges), "slopes": len(self.slope)}
            raise InvalidInput("teeth", count, "n ≥ 1 teeth, n + 1 edges, n slopes", counts)
        if not 0 <= self.periodic_from < count:
            raise InvalidInput("periodic_from", self.periodic_from, f"one of the {count} teeth")
        if self.edges[0] != 0.0 or not np.all(np.diff(self.edges) > 0.0) or not math.isfinite(self.edges[-1]):
            raise InvalidInput("edges", need="finite positions that increase from 0")
        ends = self.force + self.slope * np.diff(self.edges)
        lowest = min(self.force.min(), ends.min())
        if not (np.isfinite(self.force).all() and np.isfinite(self.slope).all()):
            raise InvalidInput("force, slope", need="finite numbers")
        if not lowest >= -1e-12 * self.force.max():  # rounding of slope × width may end a tooth just below 0
            raise InvalidInput("force", float(lowest), "a friction limit of at least 0 everywhere")

    @property
    def period(self) -> float:
        """Length of the stretch that repeats, in L_x."""
        return float(self.edges[-1] - self.edges[self.periodic_from])

    @property
    def steady_force(self) -> float:
        """Mean of F̃ over one period, in G·L_x·L_y."""
        width, middle = self._period_teeth()
        return float(width @ middle / width.sum())

    @property
    def lowest_force(self) -> float:
        """Least F̃ over one period, in G·L_x·L_y."""
        width, middle = self._period_teeth()
        half_rise = 0.5 * self.slope[self.periodic_from :] * width
        return float(np.min(middle - np.abs(half_rise)))

    @property
    def uneven_work(self) -> float:
        """Largest work of F̃ less its mean, from any tooth of a period to any other, in G·L_x²·L_y."""
        # The work from one place to another is a difference of two sums up to them: the largest is the sums'
        # range. A whole period adds nothing.
        width, middle = self._period_teeth()
        return float(np.ptp(np.cumsum(width * (middle - self.steady_force))))

    def _period_teeth(self) -> tuple[Floats, Floats]:
        """Width and mean force of each tooth of a period."""
        repeats = slice(self.periodic_from, None)
        width = np.diff(self.edges[repeats])
        return width, self.force[repeats] + 0.5 * self.slope[repeats] * width

    def limit(self, x: Floats) -> Floats:
        """F̃ at each x, in G·L_x·L_y; at a jump, the value to its right (left of 0: to its left)."""
        far = np.abs(x)
        start = self.edges[self.periodic_from]
        repeated = start + np.mod(far - start, self.period)
        far = np.where(far < self.edges[-1], far, repeated)
        tooth = np.searchsorted(self.edges, far, side="right") - 1
        tooth = np.clip(tooth, 0, len(self.force) - 1)
        return np.asarray(self.force[tooth] + self.slope[tooth] * (far - self.edges[tooth]))


def sawtooth(record: FrictionRecord, plateau: Plateau) -> FrictionLimit:
    """F̃ with both sides of every drop: each tooth rises from the force after one event to the force before the next.

    Raises NoPlateauError if the record has no plateau.
    """
    return _periodic(teeth(record), plateau)


def linear(record: FrictionRecord, plateau: Plateau) -> FrictionLimit:
    """F̃ by linear interpolation of the force *after* each event: continuous, peaks cut off (the junction still jumps).

    Raises NoPlateauError if the record has no plateau.
    """
    record_teeth = teeth(record)
    # Each tooth ends where the next one starts.
    ends = np.append(record_teeth.start[1:], record_teeth.end[-1])
    return _periodic(Teeth(record_teeth.edges, record_teeth.start, ends), plateau)


def coarse(record: FrictionRecord, plateau: Plateau) -> FrictionLimit:
    """Group the teeth of the sawtooth F̃, at most 64 in a node spacing, keeping mean and maximum.

    A pin stops at a maximum of the limit, and its work follows from the mean. Teeth much shorter than the drop of force over k
    matter through these two only. Raises NoPlateauError without a plateau.
    """
    fine = sawtooth(record, plateau)
    ends = fine.force + fine.slope * np.diff(fine.edges)
    flat_teeth = Teeth(fine.edges, fine.force, ends)
    fewer, periodic_from = merge_teeth(flat_teeth, fine.periodic_from, record.spacing / COARSE)
    slopes = (fewer.end - fewer.start) / np.diff(fewer.edges)
    return FrictionLimit(fewer.edges, fewer.start, slopes, periodic_from)


def mean(record: FrictionRecord, plateau: Plateau) -> FrictionLimit:
    """Friction limit F̃ that equals the plateau's mean everywhere, from the first position on.

    No static excess is made up: with surface compliance the contact is an elastic, perfectly plastic element.
    Raises NoPlateauError if the record has no plateau.
    """
    _need(plateau)
    force = np.array([plateau.mean * record.normal_load])
    return FrictionLimit(np.array([0.0, 1.0]), force, np.zeros(1), periodic_from=0)


PROFILE_SHAPES: dict[ProfileShape, Callable[[FrictionRecord, Plateau], FrictionLimit]] = {
    "sawtooth": sawtooth,
    "linear": linear,
    "coarse": coarse,
    "mean": mean,
}
"""Shape of F̃ by the word in `profile` of a `Drive`."""


def merge_teeth(teeth: Teeth, stays: int, shortest: float) -> tuple[Teeth, int]:
    """The teeth that begin in one stretch of length `shortest` (L_x) as one, and the place of the edge that stays.

    A new tooth has their length, mean and highest force, which is at its end; if it would begin below zero, it begins at zero
    and ends at twice the mean. A single tooth is unchanged. stays: number of an edge that no tooth crosses.
    """
    before = _edges_kept(teeth.edges[: stays + 1], shortest)
    after = stays + _edges_kept(teeth.edges[stays:], shortest)
    kept = np.union1d(before, after)
    first = kept[:-1]
    width = np.diff(teeth.edges)
    work = np.add.reduceat(0.5 * width * (teeth.start + teeth.end), first)
    mean = work / np.add.reduceat(width, first)
    highest = np.maximum.reduceat(np.maximum(teeth.start, teeth.end), first)
    # A straight tooth with this mean that ends at the highest force.
    merged_start = np.maximum(2.0 * mean - highest, 0.0)
    merged_end = 2.0 * mean - merged_start
    alone = np.diff(kept) == 1
    start = np.where(alone, teeth.start[first], merged_start)
    end = np.where(alone, teeth.end[first], merged_end)
    return Teeth(teeth.edges[kept], start, end), int(np.searchsorted(kept, stays))


def _edges_kept(edges: Floats, shortest: float) -> NDArray[np.intp]:
    """Numbers of the edges that remain: the first edge in each stretch of length `shortest`, and the last edge."""
    stretch = np.floor((edges - edges[0]) / shortest)
    is_first = np.diff(stretch, prepend=-1.0) != 0.0
    return np.union1d(np.flatnonzero(is_first), len(edges) - 1)


def make_friction_limit(record: FrictionRecord, plateau: Plateau, shape: ProfileShape) -> FrictionLimit:
    """F̃ in this shape (`PROFILE_SHAPES`). Raises NoPlateauError if the record has no plateau."""
    return PROFILE_SHAPES[shape](record, plateau)


def _need(plateau: Plateau) -> None:
    if not plateau.outcome.ok:
        raise NoPlateauError(f"the friction record has none to repeat: {plateau.outcome.message}")


def _periodic(record_teeth: Teeth, plateau: Plateau) -> FrictionLimit:
    _need(plateau)
    count = plateau.last_event + 1
    edges = record_teeth.edges[: count + 1]
    # Initial contact may leave a force against the drag; Eq. 13 knows only limits of at least 0.
    start = np.maximum(record_teeth.start[:count], 0.0)
    end = np.maximum(record_teeth.end[:count], 0.0)
    slopes = (end - start) / np.diff(edges)
    return FrictionLimit(edges, start, slopes, periodic_from=plateau.first_event + 1)
