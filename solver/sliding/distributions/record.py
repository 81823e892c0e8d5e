"""The statistics of one record's events as numbers of a dataset: a distribution of each size, and their correlations."""

import math
from dataclasses import Field, field, make_dataclass
from typing import Any, Final

import numpy as np

from solver.quantity import quantity
from solver.sliding.distributions.between_starts import BY_RANGE, uncertainty_of_tail
from solver.sliding.distributions.comparison import LAWS, SIGNIFICANT
from solver.sliding.distributions.events import DISCRETE, EventSizes, event_sizes, rank_correlation
from solver.sliding.distributions.goodness import DRAWS
from solver.sliding.distributions.power_law import EXPONENTS
from solver.sliding.distributions.scaling import NOWHERE
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
    of = f"of {meaning}"
    declared: dict[str, tuple[str, dict[str, Any]]] = {
        "exponent": (
            f"power-law exponent of {size}",
            {
                "symbol": "τ",
                "uncertainty": error,
                "ensemble": "fitted",
                "comment": _joined(
                    of, _REFERENCE.get(size, ""), f"NaN outside of {EXPONENTS[0]:.0f} to {EXPONENTS[1]:g}"
                ),
            },
        ),
        "exponent_uncertainty": (
            "error of that exponent",
            {
                "comment": f"standard deviation between starts, from repeated fits; NaN where {size}_goodness is below "
                f"{SIGNIFICANT:g}: then it is no power law"
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
                "ensemble": "own",
                "comment": "a probability: of a rival that its better fit is chance, of the power law that its next rival's is",
            },
        ),
    }
    return _fields(size, declared)


def _of_range(size: str, meaning: str) -> list[tuple[str, Any, Field[Any]]]:
    """The fields of one size's scaling range."""
    of, kind, words = f"of {meaning}", f"{size} scaling range", "longest interval that a power law describes"
    declared: dict[str, tuple[str, dict[str, Any]]] = {
        "exponent": (
            f"{size} scaling exponent",
            {
                "symbol": "τ",
                "uncertainty": f"{size}_scaling_exponent_uncertainty",
                "ensemble": "independent",
                "comment": f"{of}; the range is the {words}; NaN where there is none",
            },
        ),
        "exponent_uncertainty": (
            "error of that exponent",
            {"comment": f"standard deviation between starts: {BY_RANGE:g} errors of the fit"},
        ),
        "first": (f"lower end of {kind}", {"comment": of}),
        "last": (f"upper end of {kind}", {"comment": of}),
        "decades": (f"decades of {kind}", {"comment": "log10 of upper over lower end; 0 where there is none"}),
        "events": (f"events in {kind}", {}),
        "goodness": (f"goodness of fit in {kind}", {"comment": "as the tail's; 0.1 or more"}),
    }
    return _fields(f"{size}_scaling", declared)


def _fields(size: str, declared: dict[str, tuple[str, dict[str, Any]]]) -> list[tuple[str, Any, Field[Any]]]:
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
        *(each for size, meaning in SIZES.items() for each in (*_of_size(size, meaning), *_of_range(size, meaning))),
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
        names = ("exponent", "exponent_uncertainty", "cutoff", "tail", "goodness", "preferred", "preferred_chance")
        found |= {f"{size}_{name}": getattr(fit, name) for name in names}
        found[f"{size}_exponent_uncertainty"] = (
            math.nan
            if fit.goodness < SIGNIFICANT
            else uncertainty_of_tail(getattr(sizes, size), discrete, fit.exponent, fit.exponent_uncertainty)
        )
        scaling = fit.scaling or NOWHERE
        scaling = scaling._replace(exponent_uncertainty=BY_RANGE * scaling.exponent_uncertainty)
        found |= {f"{size}_scaling_{name}": value for name, value in scaling._asdict().items()}
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
