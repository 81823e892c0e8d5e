"""How sizes of events are distributed: power law, goodness and rivals in one value; those of a record, with its correlations."""

import math
from collections.abc import Iterator
from dataclasses import Field, dataclass, field, make_dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from solver.quantity import quantity
from solver.sliding.distributions.events import DISCRETE, EventSizes, event_sizes, rank_correlation
from solver.sliding.distributions.power_law import (
    DRAWS,
    EXPONENTS,
    SIGNIFICANT,
    exponent_in_range,
    fitted_power_law,
    goodness_of_fit,
    sorted_sizes,
)
from solver.sliding.distributions.rivals import LAWS, Comparison, comparisons, preferred
from solver.sliding.plateau import Plateau
from solver.sliding.record import FrictionRecord
from solver.view import OneLine

MEAN_FIELD = 1.5
"""Exponent of avalanche sizes where every node loads all others alike (mean field, a critical branching process)."""
GUTENBERG_RICHTER = 5.0 / 3.0
"""Exponent of the released moment, or energy, where magnitudes follow Gutenberg and Richter's law with b = 1: 1 + 2b/3."""


@dataclass(frozen=True, slots=True, repr=False)
class SizeDistribution(OneLine):
    """How sizes are distributed; what too few sizes cannot say is NaN, and `preferred` None.

    Reference lines: MEAN_FIELD for slips, GUTENBERG_RICHTER for energies.
    """

    count: int
    """Sizes above 0."""
    mean: float
    largest: float
    exponent: float
    """τ of the density x^-τ from the cut-off on; NaN at the bounds of what is looked for, EXPONENTS."""
    exponent_fit_error: float
    """Standard error of the fit alone: sizes taken as independent, the cut-off as given."""
    cutoff: float
    """Size from which on the power law is nearest to the sizes."""
    tail: int
    """Sizes from the cut-off on."""
    distance: float
    """Of Kolmogorov and Smirnov, between sizes and power law from the cut-off on."""
    goodness: float
    """Share of samples of the power law that are further from their fit: below 0.1 it is no power law."""
    preferred: str | None
    """One of rivals.LAWS."""
    preferred_chance: float
    """Probability that chance decides that preference; see rivals.preferred."""
    comparisons: tuple[Comparison, ...]
    """Every rival against the power law."""

    def _facts(self) -> Iterator[str]:
        yield f"{self.count} sizes to {self.largest:.4g}"
        if self.tail:
            found = f"{self.exponent:.3g}" if math.isfinite(self.exponent) else "at a bound"
            yield f"exponent {found} from {self.cutoff:.4g} on"
            yield f"goodness {self.goodness:.2g}{', no power law' if self.goodness < SIGNIFICANT else ''}"
        yield f"preferred: {self.preferred or 'none'}"


def size_distribution(
    sizes: NDArray[np.float64] | NDArray[np.int64], *, discrete: bool, draws: int = DRAWS
) -> SizeDistribution:
    """The distribution of sizes, of one record or of many put together, in any order; those not above 0 are left out.

    discrete: whole numbers, such as slips. draws: samples for the goodness of fit; of 0 it is NaN.
    """
    sample = sorted_sizes(sizes, discrete)
    count, law = len(sample.values), fitted_power_law(sample)
    mean = float(sample.values.mean()) if count else math.nan
    largest = float(sample.values[-1]) if count else math.nan
    if law is None:
        nothing = (math.nan, math.nan, math.nan, 0, math.nan, math.nan, None, math.nan, ())
        return SizeDistribution(count, mean, largest, *nothing)
    rivals = comparisons(sample, law)
    goodness = goodness_of_fit(sample, law, draws)
    exponent = exponent_in_range(law)
    law = law._replace(exponent=exponent, fit_error=law.fit_error if math.isfinite(exponent) else math.nan)
    return SizeDistribution(count, mean, largest, *law, goodness, *preferred(rivals), rivals)


SIZES: Final = {
    "slips": "node slips per event",
    "extent": "nodes that slip per event",
    "drop": "falls of F/W per event",
    "energy": "energies lost per event, in W·L_x",
    "step": "displacements to the next event, in L_x",
}
"""Size -> what is distributed."""
_REFERENCE: Final = {
    "slips": "mean-field avalanches have 3/2",
    "energy": "Gutenberg and Richter's law with b = 1 has 5/3",
}


_NUMBERS: Final = ("exponent", "exponent_fit_error", "cutoff", "tail", "goodness", "preferred", "preferred_chance")
"""What a dataset has of a SizeDistribution."""


def _of_size(size: str, meaning: str) -> list[tuple[str, Any, Field[Any]]]:
    """The fields of one size: name, type, declaration."""
    of = f"of {meaning}"
    declared: dict[str, tuple[str, dict[str, Any]]] = {
        "exponent": (
            f"power-law exponent of {size}",
            {
                "symbol": "τ",
                "ensemble": True,
                "comment": _joined(
                    f"{of}, from {size}_cutoff on",
                    _REFERENCE.get(size, ""),
                    f"no power law where {size}_goodness is below {SIGNIFICANT:g}",
                    f"NaN outside of {EXPONENTS[0]:.0f} to {EXPONENTS[1]:g}",
                ),
            },
        ),
        "exponent_fit_error": (
            f"error of the fit of {size}_exponent",
            {
                "comment": "standard error of the fit alone: events taken as independent, the cut-off as given; "
                "the exponents of two starts may differ by more",
            },
        ),
        "cutoff": (f"lower cut-off of {size}", {"comment": f"{of}; the power law begins there"}),
        "tail": (f"events from {size}_cutoff on", {}),
        "goodness": (
            f"goodness of fit of {size}",
            {
                "comment": f"{of}; share of samples drawn from the power law that are further from it; below 0.1 it is none"
            },
        ),
        "preferred": (
            f"preferred law of {size}",
            {"words": LAWS, "comment": f"{of}; describes them best from the cut-off on"},
        ),
        "preferred_chance": (
            f"chance that decides {size}_preferred",
            {
                "comment": "a probability: of a rival that its better fit is chance, of the power law that its next rival's is",
            },
        ),
    }
    return [
        (f"{size}_{name}", Any, field(metadata=quantity(words, **more))) for name, (words, more) in declared.items()
    ]


def _joined(*parts: str) -> str:
    return "; ".join(part for part in parts if part)


def _alone(name: str, meaning: str, comment: str = "") -> tuple[str, Any, Field[Any]]:
    return (name, float, field(metadata=quantity(meaning, comment=comment)))


_INDEPENDENT: Final = "Spearman's; of m independent events 0 with a standard error of 1/√m"
EventDistributions: Any = make_dataclass(
    "EventDistributions",
    [
        _alone(
            "sized_events", "events whose sizes are distributed", "those of the steady part; of the record without one"
        ),
        *(each for size, meaning in SIZES.items() for each in _of_size(size, meaning)),
        _alone(
            "step_variation",
            "variation of the step between events",
            "standard deviation over mean; 1 of events at random",
        ),
        _alone("slips_correlation", "rank correlation of successive slips", _INDEPENDENT),
        _alone("drop_correlation", "rank correlation of successive drops", _INDEPENDENT),
        _alone("step_correlation", "rank correlation of successive steps", _INDEPENDENT),
        _alone(
            "drop_step_correlation",
            "rank correlation of drop and next step",
            _INDEPENDENT,
        ),
    ],
    frozen=True,
    slots=True,
    namespace={
        "__doc__": "Distributions and correlations of a record's event sizes, made of SIZES; NaN where there are too few."
    },
)


def event_distributions(record: FrictionRecord, plateau: Plateau, draws: int = DRAWS) -> Any:
    """The EventDistributions of a record: of its steady part, or of all of it where that was not found."""
    sizes = event_sizes(record, plateau.start if math.isfinite(plateau.start) else -math.inf)
    found: dict[str, Any] = {"sized_events": len(sizes.slips)}
    for size, discrete in DISCRETE.items():
        fit = size_distribution(getattr(sizes, size), discrete=discrete, draws=draws)
        found |= {f"{size}_{name}": getattr(fit, name) for name in _NUMBERS}
    return EventDistributions(**found, **_correlations(sizes))


def _correlations(sizes: EventSizes) -> dict[str, float]:
    steps = sizes.step[np.isfinite(sizes.step)]
    return {
        "step_variation": float(steps.std() / steps.mean()) if len(steps) > 1 else math.nan,
        "slips_correlation": rank_correlation(sizes.slips[:-1].astype(float), sizes.slips[1:].astype(float)),
        "drop_correlation": rank_correlation(sizes.drop[:-1], sizes.drop[1:]),
        "step_correlation": rank_correlation(sizes.step[:-1], sizes.step[1:]),
        "drop_step_correlation": rank_correlation(sizes.drop, sizes.step),
    }
