"""Friction force of a resting pin while its load is doubled and lowered, over the force before: it remembers the lowest load."""

from collections.abc import Iterator
from typing import Final

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from nanoslip.solver.arrays import Floats
from nanoslip.solver.ensemble import mean_of
from nanoslip.solver.view import ROUNDING, with_error
from nanoslip.study.figures.shared import CampaignFigure, Claim, column, series_style

VISITED: Final = ("W", "2W", "W", "0.8W", "W")
"""Load at the end of each leg."""


def kept(dataset: xr.Dataset, scheme: str, n_x: int) -> Floats:
    """Force at the end of each leg over that before the first change of load, (starts, legs)."""
    forces = [
        dataset.nanoslip.path(scheme=scheme, n_x=n_x, start=start)["leg_last_friction"].values
        for start in dataset["start"].values
    ]
    return np.array([force / force[0] for force in forces])


def claims(dataset: xr.Dataset) -> Iterator[Claim]:
    """What is left of the force after each pulse, by scheme and for all grids."""
    grids = dataset["n_x"].values.tolist()
    for scheme in dataset["scheme"].values.tolist():
        found = {n_x: kept(dataset, scheme, n_x) for n_x in grids}
        for first, last, pulse in ((0, 2, "W → 2W → W"), (2, 4, "W → 0.8W → W")):
            shown = "; ".join(_left(each[:, first], each[:, last]) for each in found.values())
            yield Claim(f"{scheme}: F after {pulse}, over F before", "", shown, f"n_x = {', '.join(map(str, grids))}")


def _left(before: Floats, after: Floats) -> str:
    """Mean of the share that is left, and its ±; without ± where it is the same for all starts."""
    share = mean_of(after / before)
    unsure = share.uncertainty > ROUNDING
    return with_error(float(share.mean), float(share.uncertainty)) if unsure else f"{share.mean:.4f}"


def draw(dataset: xr.Dataset) -> Figure:
    """Force over that before, leg by leg, on the finest grid."""
    n_x = int(dataset["n_x"].values[-1])
    with column() as figure:
        axes = figure.add_subplot()
        for number, scheme in enumerate(dataset["scheme"].values.tolist()):
            found = mean_of(kept(dataset, scheme, n_x).T)
            axes.errorbar(
                range(len(VISITED)), found.mean, found.uncertainty, label=scheme, **series_style(number, capsize=1.5)
            )
        axes.set_xticks(range(len(VISITED)), VISITED)
        axes.set(xlabel="load visited", ylabel="F over F before")
        axes.legend()
    return figure


PULSE: Final = CampaignFigure(
    "pulse",
    "Friction remembers the lowest load",
    "Friction force of a pin that slid by three presliding lengths and rests, while its load is doubled and back, "
    "then lowered by a fifth and back, over the force before: means over 16 starts and their ±, on the finest grid.",
    draw,
    claims,
)
