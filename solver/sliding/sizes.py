"""Distributions of event sizes: histograms, power laws, correlations of successive events."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import Field, dataclass, field, make_dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.arrays import Floats, Vector
from nanoslip.solver.ensemble import fewest_members, jackknife, mean_of
from nanoslip.solver.parameter import as_field, quantities, quantity
from nanoslip.solver.sliding import power_law
from nanoslip.solver.sliding.plateau import Plateau
from nanoslip.solver.sliding.record import FrictionRecord, event, require_record
from nanoslip.solver.view import Curve, OneLine, Picture, Viewed, with_error

# Sizes of the events of a friction record, and how successive events depend on each other.


ROUNDING_OF_FORCES = 1e-10
"""Force over the load, and energy over the square of the load, below which a difference is rounding: one node's force is
accurate to 1e-12 of the load."""
ALIKE_SIZES = 1e-9
"""Share of the largest size below which sizes do not differ for their ranks; a thousand times what rounding was seen to do."""
FEWEST_PAIRS = 10
"""Events below which no correlation is computed."""


_OF_RECORD = quantities(FrictionRecord)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class EventSizes(Viewed):
    """Sizes of each event of a record, arrays (e,); 0 is no size. Lengths in L_x, forces over W, energies in W·L_x."""

    slips: NDArray[np.int64] = as_field(_OF_RECORD["slips"])
    extent: NDArray[np.int32] = as_field(_OF_RECORD["extent"])
    drop: Vector = event(
        "drop of F/W in the event",
        "drop",
        symbol="ΔF/W",
        comment="event_force_before minus event_force_after; 0 within rounding",
    )
    """Fall of F/W; rises are 0."""
    energy: Vector = as_field(replace(_OF_RECORD["dissipated"], per=""))
    """Energy lost."""
    step: Vector = event("displacement to the next event", "step", measure="L_x")
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
    require_record(record)
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
    """Compute the sizes of a record's events from its columns (e,): displacement in L_x, fall of F/W, energy lost in W·L_x."""
    chosen = displacement >= beyond
    step = np.diff(displacement, append=math.nan)
    return EventSizes(
        slips=slips[chosen],
        extent=extent[chosen],
        drop=np.where(drop > ROUNDING_OF_FORCES, drop, 0.0)[chosen],
        energy=np.where(energy > ROUNDING_OF_FORCES * normal_load, energy, 0.0)[chosen],
        step=step[chosen],
    )


def pool_events(parts: list[EventSizes]) -> EventSizes:
    """Join the events of several records, such as the members of an ensemble, one record after the other."""
    return EventSizes(**{name: np.concatenate([getattr(part, name) for part in parts]) for name in DISCRETE})


def rank_correlation(first: Vector, second: Vector) -> float:
    """Spearman's coefficient of two columns, -1 to 1; NaN of fewer than FEWEST_PAIRS pairs, or where one does not vary.

    Of m independent pairs it is 0 with a standard error of 1/√(m - 1).
    """
    is_known = np.isfinite(first) & np.isfinite(second)
    if is_known.sum() < FEWEST_PAIRS:
        return math.nan
    one, other = _ranks(first[is_known]), _ranks(second[is_known])
    one, other = one - one.mean(), other - other.mean()
    scale = math.sqrt(float(one @ one) * float(other @ other))
    return float(one @ other) / scale if scale > 0.0 else math.nan


def _ranks(values: Vector) -> Vector:
    """Place of each value among all, from 1 on; equal ones, to within rounding, share the mean of theirs.

    A record repeats itself from spacing to spacing: which of two such events is the larger is decided by rounding.
    """
    order = np.argsort(values, kind="stable")
    step = np.diff(values[order], prepend=values[order[:1]])
    larger = step > ALIKE_SIZES * np.abs(values).max()
    group = np.cumsum(larger)
    counts = np.bincount(group)
    ranks = np.empty(len(values))
    # Of c equal values the last of which has rank r, the mean rank is r - (c - 1)/2.
    ranks[order] = (np.cumsum(counts) - (counts - 1) / 2.0)[group]
    return ranks


# Distribution of event sizes: power law and goodness of the sizes of all members of an ensemble together.

Values = Floats | NDArray[np.int64]

MEAN_FIELD = 1.5
"""Exponent of avalanche sizes where every node loads all others alike (mean field, a critical branching process)."""
GUTENBERG_RICHTER = 5.0 / 3.0
"""Exponent of the released moment, or energy, where magnitudes follow Gutenberg and Richter's law with b = 1: 1 + 2b/3."""


@dataclass(frozen=True, slots=True, repr=False)
class SizeDistribution(OneLine):
    """Distribution of sizes; with too few sizes or members numbers are NaN.

    Reference lines: MEAN_FIELD for slips, GUTENBERG_RICHTER for energies.
    """

    count: int
    """Sizes above 0; none of too few members."""
    mean: float
    largest: float
    exponent: float
    """Exponent τ of the density x^-τ from the cut-off on; NaN at the bounds of the search, EXPONENTS."""
    exponent_uncertainty: float
    """Uncertainty ± of the exponent, by the jackknife over members; NaN for one member, or if a subset has no power law."""
    exponent_members: int
    """Members that have sizes; there is an exponent where they are enough."""
    cutoff: float
    """Size from which on the power law is nearest to the sizes."""
    tail: int
    """Sizes from the cut-off on."""
    distance: float
    """Kolmogorov-Smirnov distance between sizes and power law from the cut-off on."""
    goodness: float
    """Share of samples of the power law that are further from their fit: below 0.1 it is no power law."""

    def _facts(self) -> Iterator[str]:
        yield f"{self.count} sizes to {self.largest:.4g}"
        if self.tail:
            is_known = math.isfinite(self.exponent)
            exponent = with_error(self.exponent, self.exponent_uncertainty) if is_known else "at a bound"
            yield f"exponent {exponent} from {self.cutoff:.4g} on"
            yield f"goodness {self.goodness:.2g}{', no power law' if self.goodness < power_law.SIGNIFICANT else ''}"


def size_distribution(*members: Values, discrete: bool, draws: int = power_law.DRAWS) -> SizeDistribution:
    """The distribution of the sizes of all members together, each in any order; sizes not above 0 are left out.

    All numbers are NaN if too few members have sizes (`fewest_members`). discrete: whole numbers, such as slips.
    draws: samples for the goodness of fit, which is NaN for 0.
    """
    member_sizes, sample = _pool_sizes(members, discrete)
    count, law = len(sample.values), power_law.find_power_law(sample)
    mean = float(sample.values.mean()) if count else math.nan
    largest = float(sample.values[-1]) if count else math.nan
    if law is None:
        nothing = (math.nan, math.nan, len(member_sizes), math.nan, 0, math.nan, math.nan)
        return SizeDistribution(count, mean, largest, *nothing)
    goodness = power_law.goodness_of_fit(sample, law, draws)
    exponent = exponent_over_members(member_sizes, law.exponent, discrete)
    return SizeDistribution(count, mean, largest, *exponent, *law[1:], goodness)


def _pool_sizes(members: Sequence[Values], discrete: bool) -> tuple[list[Floats], power_law.SizeSample]:
    """Sizes of each member with sizes, and of all together; empty if too few members have sizes."""
    member_sizes = [values for sizes in members if len(values := power_law.sort_sizes(sizes, discrete).values)]
    enough = len(member_sizes) >= fewest_members(len(members))
    together = np.concatenate([np.empty(0), *member_sizes]) if enough else np.empty(0)
    return member_sizes, power_law.sort_sizes(together, discrete)


def exponent_over_members(members: Sequence[Floats], fitted: float, discrete: bool) -> tuple[float, float, int]:
    """The exponent fitted to all members together, its ± and their number; NaN at the bounds of the search."""
    if math.isnan(exponent := power_law.exponent_in_range(fitted)):
        return exponent, math.nan, len(members)
    # The cut-off is looked for without each member anew, as its choice is a part of the error: with that of all members as given
    # ± held in 57 to 69 of 100 ensembles of 2 to 16 members, so in 67 to 84.
    rest = (np.concatenate([np.empty(0), *members[:number], *members[number + 1 :]]) for number in range(len(members)))
    laws = [power_law.find_power_law(power_law.sort_sizes(sizes, discrete)) for sizes in rest]
    error = jackknife([power_law.exponent_in_range(law.exponent) if law else math.nan for law in laws])
    return exponent, error, len(members)


SIZES: Final = {
    "slips": "node slips per event",
    "extent": "nodes that slip per event",
    "drop": "falls of F/W per event",
    "energy": "energies lost per event, in W·L_x",
    "step": "displacements to the next event, in L_x",
}
"""Size -> meaning of the distributed quantity."""
_REFERENCE: Final = {
    "slips": "mean-field avalanches have 3/2",
    "energy": "Gutenberg and Richter's law with b = 1 has 5/3",
}


_NUMBERS: Final = ("exponent", "exponent_uncertainty", "exponent_members", "cutoff", "tail", "goodness")
"""Fields of a SizeDistribution that a result holds."""


def _size_fields(size: str, meaning: str) -> list[tuple[str, Any, Field[Any]]]:
    """The fields of a size: name, type, declaration."""
    of, reference = f"of {meaning}", f"; {_REFERENCE[size]}" if size in _REFERENCE else ""
    exponent = (
        f"{of}, from {size}_cutoff on, of all members together{reference}; no power law where {size}_goodness is below "
        f"{power_law.SIGNIFICANT:g}; NaN outside of {power_law.EXPONENTS[0]:.0f} to {power_law.EXPONENTS[1]:g}"
    )
    goodness = f"{of}; share of synthetic samples farther from the power law; below 0.1 it is rejected"
    return [
        *_declare_fields(f"{size}_exponent", f"power-law exponent of {size}", exponent, symbol="τ", ensemble=True),
        *_declare_fields(f"{size}_cutoff", f"lower cut-off of {size}", f"{of}; the power law begins there"),
        *_declare_fields(f"{size}_tail", f"events from {size}_cutoff on"),
        *_declare_fields(f"{size}_goodness", f"goodness of fit of {size}", goodness),
    ]


def _declare_fields(name: str, meaning: str, comment: str = "", **more: Any) -> list[tuple[str, Any, Field[Any]]]:
    """Declare a field and, if its dataset states a ±, the two numbers that accompany it."""
    beside = ("_uncertainty", "_members") if more.get("ensemble") else ()
    column = (name, Any, quantity(meaning, comment=comment, **more))
    return [column, *((name + end, Any, field()) for end in beside)]


_ALONE: Final = {
    "step_variation": ("variation of the step between events", "standard deviation over mean; 1 of events at random"),
    "slips_correlation": ("rank correlation of successive slips", "Spearman's; 0 of independent events"),
    "drop_correlation": ("rank correlation of successive drops", "Spearman's; 0 of independent events"),
    "step_correlation": ("rank correlation of successive steps", "Spearman's; 0 of independent events"),
    "drop_step_correlation": ("rank correlation of drop and next step", "Spearman's; 0 of independent events"),
}
"""Number of each member alone, whose mean is stated -> meaning and remark."""
_POOLED: Final = (
    "of the steady parts of all members together; 0 where fewer than half of them, or below three, have one"
)
EventDistributions: Any = make_dataclass(
    "EventDistributions",
    [
        *_declare_fields("sized_events", "events whose sizes are distributed", _POOLED),
        *(each for size, meaning in SIZES.items() for each in _size_fields(size, meaning)),
        *(each for name, stated in _ALONE.items() for each in _declare_fields(name, *stated, ensemble=True)),
    ],
    frozen=True,
    slots=True,
    namespace={
        "__doc__": "Distributions of the event sizes of all members, made of SIZES, and correlations; NaN of too few."
    },
)


@dataclass(frozen=True, slots=True, eq=False)
class SizeBins:
    """Sizes of all members in bins of equal ratio, one size after the other; empty bins are left out."""

    bin_of: NDArray[np.int8] = quantity(
        "size that is distributed", "", along="bin", codes=tuple(SIZES), dtype=np.int8, coordinate=True
    )
    bin_middle: Floats = quantity(
        "middle of the bin", along="bin", coordinate=True, comment="in the size's unit; geometric mean of its ends"
    )
    bin_density: Floats = quantity(
        "share of events per unit of size", along="bin", comment="of whole numbers, per number"
    )
    bin_events: NDArray[np.int64] = quantity("events in the bin", along="bin", dtype=np.int64, comment="of all members")


def event_distributions(
    members: Sequence[tuple[FrictionRecord, Plateau]], draws: int = power_law.DRAWS
) -> tuple[Any, SizeBins]:
    """The EventDistributions and SizeBins of an ensemble: of the steady parts of its usable records."""
    member_sizes = []
    for record, plateau in members:
        # No displacement is at least NaN: a record that is not usable gives no sizes.
        begins = plateau.start if record.outcome.usable else math.nan
        member_sizes.append(event_sizes(record, begins))
    counts = [len(sizes.slips) for sizes in member_sizes if len(sizes.slips)]
    are_enough = len(counts) >= fewest_members(len(member_sizes))
    answer: dict[str, Any] = {"sized_events": sum(counts) if are_enough else 0}
    for size, discrete in DISCRETE.items():
        samples = [getattr(sizes, size) for sizes in member_sizes]
        fit = size_distribution(*samples, discrete=discrete, draws=draws)
        answer |= {f"{size}_{name}": getattr(fit, name) for name in _NUMBERS}
    alone = [_alone(sizes) for sizes in member_sizes]
    for name in _ALONE:
        mean = mean_of(np.array([numbers[name] for numbers in alone]))
        answer[name] = float(mean.mean)
        answer[f"{name}_uncertainty"] = float(mean.uncertainty)
        answer[f"{name}_members"] = float(mean.members)
    return EventDistributions(**answer), _bins(member_sizes)


def _alone(sizes: EventSizes) -> dict[str, float]:
    # The last event has no step.
    steps = sizes.step[np.isfinite(sizes.step)]
    slips = sizes.slips.astype(float)
    variation = float(steps.std() / steps.mean()) if len(steps) > 1 else math.nan
    return {
        "step_variation": variation,
        "slips_correlation": rank_correlation(slips[:-1], slips[1:]),
        "drop_correlation": rank_correlation(sizes.drop[:-1], sizes.drop[1:]),
        "step_correlation": rank_correlation(sizes.step[:-1], sizes.step[1:]),
        "drop_step_correlation": rank_correlation(sizes.drop, sizes.step),
    }


def _bins(members: Sequence[EventSizes]) -> SizeBins:
    numbers, middles, densities, counts = [], [], [], []
    for number, size in enumerate(SIZES):
        values = [getattr(sizes, size) for sizes in members]
        _, sample = _pool_sizes(values, DISCRETE[size])
        bins = power_law.logarithmic_histogram(sample.values, discrete=sample.discrete)
        has_events = bins.counts > 0
        numbers.append(np.full(int(has_events.sum()), number, np.int8))
        middles.append(bins.middles[has_events])
        densities.append(bins.density[has_events])
        counts.append(bins.counts[has_events])
    return SizeBins(
        np.concatenate(numbers),
        np.concatenate(middles),
        np.concatenate(densities),
        np.concatenate(counts),
    )
