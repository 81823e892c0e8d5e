"""The statistics of one record's events as numbers of a dataset: a distribution of each size, and their correlations."""

import math
from dataclasses import Field, field, make_dataclass
from typing import Any, Final

import numpy as np

from solver.quantity import quantity
from solver.sliding.distributions.comparison import LAWS
from solver.sliding.distributions.events import DISCRETE, EventSizes, event_sizes, rank_correlation
from solver.sliding.distributions.goodness import DRAWS
from solver.sliding.distributions.size_distribution import size_distribution
from solver.sliding.plateau import Plateau
from solver.sliding.record import FrictionRecord

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


def _of_size(size: str, meaning: str) -> list[tuple[str, Any, Field[Any]]]:
    """The fields of one size: name, type, declaration."""
    error = f"{size}_exponent_uncertainty"
    largest = "; of independent sizes, the cut-off given"
    declared: dict[str, tuple[str, dict[str, Any]]] = {
        "exponent": (
            f"exponent τ of the power law of {meaning}",
            {"uncertainty": error, "comment": _REFERENCE.get(size, "")},
        ),
        "exponent_uncertainty": (f"standard error of {size}_exponent{largest}", {}),
        "cutoff": (f"lower cut-off of the power law of {meaning}", {}),
        "tail": (f"events from {size}_cutoff on", {}),
        "goodness": (
            f"share of drawn samples of a power law that are further from it than {meaning}",
            {"comment": "below 0.1 they are no power law"},
        ),
        "preferred": (f"law that describes {meaning} best from the cut-off on", {"words": LAWS}),
        "preferred_chance": (
            f"probability that chance decides {size}_preferred",
            {"comment": "of a rival that its better fit is chance, of the power law that its nearest rival's is"},
        ),
    }
    return [
        (f"{size}_{name}", Any, field(metadata=quantity(words, **more))) for name, (words, more) in declared.items()
    ]


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
            "standard deviation over mean of the displacement to the next event",
            "1 of events at random",
        ),
        _alone("slips_correlation", "rank correlation of successive events' slips", _INDEPENDENT),
        _alone("drop_correlation", "rank correlation of successive falls of F/W", _INDEPENDENT),
        _alone("step_correlation", "rank correlation of successive displacements to the next event", _INDEPENDENT),
        _alone(
            "drop_step_correlation",
            "rank correlation of an event's fall of F/W and the displacement to the next",
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
        names = ("exponent", "exponent_uncertainty", "cutoff", "tail", "goodness", "preferred", "preferred_chance")
        found |= {f"{size}_{name}": getattr(fit, name) for name in names}
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
