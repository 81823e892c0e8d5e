"""Velocity of the stage above which the paper's pin no longer sticks, start by start."""

from collections.abc import Iterator, Mapping
from typing import Any, Final

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from nanoslip.solver.view import with_error
from nanoslip.study.figures.shared import CampaignFigure, Claim, Number, column, series_style, start_mean

VELOCITY: Final = "critical_velocity"
"""Variable of the velocity."""
OWN: Final = "stage_velocity"
"""Variable of the drive's own velocity."""


def of_starts(dataset: xr.Dataset, scheme: str) -> Any:
    """Critical velocity of each start; NaN: none is known."""
    return dataset.squeeze()[VELOCITY].sel(scheme=scheme).values


def over_own(dataset: xr.Dataset) -> Number:
    """Mean over the starts of all schemes of the critical velocity over the drive's own, with its ±; starts that know it."""
    values = np.concatenate([of_starts(dataset, scheme) for scheme in dataset["scheme"].values])
    return start_mean(values[np.isfinite(values)] / float(dataset[OWN]))


def draw(dataset: xr.Dataset) -> Figure:
    """Critical velocities of all starts, in their order, with the drive's own."""
    with column(2.2) as figure:
        axes = figure.subplots()
        for number, scheme in enumerate(dataset["scheme"].values.tolist()):
            values = np.sort(of_starts(dataset, scheme))
            shares = np.linspace(0.0, 1.0, len(values))
            axes.plot(shares, values, label=scheme, **series_style(number, linestyle=""))
        axes.axhline(float(dataset[OWN]), linestyle=":", color="0.5", label="the paper's")
        axes.set(ylabel="critical velocity (m/s)", yscale="log", xlabel="share of starts with less")
        axes.legend()
    return figure


def claims(dataset: xr.Dataset) -> Iterator[Claim]:
    """Means over the starts that have one, and their number."""
    for scheme in dataset["scheme"].values.tolist():
        values = of_starts(dataset, scheme)
        there = values[np.isfinite(values)]
        yield Claim(
            f"{scheme}: critical velocity of the stage (m/s)",
            f"{float(dataset[OWN]):g}",
            with_error(*start_mean(there)),
            f"{len(there)} of {len(values)} starts, {there.min():.2g} to {there.max():.2g}",
        )


NUMBERS: Final[Mapping[str, Any]] = {VELOCITY: over_own}
CRITICAL: Final = CampaignFigure(
    "critical",
    "Where stick-slip of the paper's pin stops",
    "Critical velocity at the paper's stiffness, of 16 starts of each slab, the smallest first. Dotted: the paper's velocity.",
    draw,
    claims,
    ("", "the paper's drive", "critical", ""),
)
