"""Velocity of the stage and stiffness of the spring above which the paper's pin no longer sticks, start by start."""

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any, Final

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from nanoslip.solver.view import with_error
from nanoslip.study.figures.shared import CampaignFigure, Claim, Number, column, marked, number_of

OWN: Final = {
    "critical_velocity": ("stage_velocity", "velocity of the stage (m/s)"),
    "critical_stiffness": ("spring_stiffness", "stiffness of the spring (N/m)"),
}
"""Variable -> the drive's own value, and a label."""


def of_starts(dataset: xr.Dataset, scheme: str, name: str) -> Any:
    """A number of each start; NaN: none is known."""
    return dataset.squeeze()[name].sel(scheme=scheme).values


def over_own(dataset: xr.Dataset, name: str) -> Number:
    """Mean over the starts of all schemes of the critical value over the drive's own, with its ±; starts that know it."""
    values = np.concatenate([of_starts(dataset, scheme, name) for scheme in dataset["scheme"].values])
    return number_of(values[np.isfinite(values)] / float(dataset[OWN[name][0]]))


def draw(dataset: xr.Dataset) -> Figure:
    """Critical values of all starts, in their order, with the drive's own."""
    with column(4.0) as figure:
        for axes, (name, (own, label)) in zip(figure.subplots(2, 1, sharex=True), OWN.items(), strict=True):
            for number, scheme in enumerate(dataset["scheme"].values.tolist()):
                values = np.sort(of_starts(dataset, scheme, name))
                shares = np.linspace(0.0, 1.0, len(values))
                axes.plot(shares, values, label=scheme, **marked(number, linestyle=""))
            axes.axhline(float(dataset[own]), linestyle=":", color="0.5", label="the paper's")
            axes.set(ylabel=label, yscale="log")
        axes.set_xlabel("share of starts with less")
        figure.axes[0].legend()
    return figure


def claims(dataset: xr.Dataset) -> Iterator[Claim]:
    """Means over the starts that have one, and their number."""
    for name, (own, label) in OWN.items():
        for scheme in dataset["scheme"].values.tolist():
            values = of_starts(dataset, scheme, name)
            there = values[np.isfinite(values)]
            yield Claim(
                f"{scheme}: critical {label}",
                f"{float(dataset[own]):g}",
                with_error(*number_of(there)),
                f"{len(there)} of {len(values)} starts, {there.min():.2g} to {there.max():.2g}",
            )


NUMBERS: Final[Mapping[str, Any]] = {name: partial(over_own, name=name) for name in OWN}
CRITICAL: Final = CampaignFigure(
    "critical",
    "Where stick-slip of the paper's pin stops",
    "Critical velocity at the paper's stiffness, and critical stiffness at the paper's velocity, of 16 starts of each slab, the "
    "smallest first. Dotted: the paper's values.",
    draw,
    claims,
    ("", "the paper's drive", "critical", ""),
)
