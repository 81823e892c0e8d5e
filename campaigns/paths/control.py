"""Shakedown of slabs with ends whose surface tilts less, and of slabs on which shear does not move it."""

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any, Final

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from nanoslip.study.figures.shared import DASHES, CampaignFigure, Claim, Number, column, series_style


def of_slab(dataset: xr.Dataset, aspect_ratio: float, coupling: bool) -> xr.Dataset:
    """Strokes of one slab, over their amplitude."""
    return dataset.squeeze().sel(aspect_ratio=aspect_ratio, coupling=coupling)


def shaken(dataset: xr.Dataset, aspect_ratio: float, coupling: bool) -> Number:
    """Share of strokes of all amplitudes and starts that lose nothing any more: no mean of alike, so without ±."""
    return Number(float(of_slab(dataset, aspect_ratio, coupling)["shaken_down"].mean()), 0.0)


def draw(dataset: xr.Dataset) -> Figure:
    """Share of starts that shake down over the amplitude."""
    with column() as figure:
        axes = figure.add_subplot()
        for number, height in enumerate(dataset["aspect_ratio"].values.tolist()):
            for dashes, coupling in zip(DASHES, (True, False), strict=False):
                found = of_slab(dataset, height, coupling)
                label = f"$L_z/L_x$ = {height:g}{'' if coupling else ', no coupling'}"
                axes.plot(
                    found["amplitude"], found["shaken_down"], label=label, **series_style(number, linestyle=dashes)
                )
        axes.set(
            xlabel="amplitude, in presliding lengths", ylabel="share of starts that shake down", ylim=(-0.05, 1.05)
        )
        axes.legend(fontsize=6)
    return figure


def claims(dataset: xr.Dataset) -> Iterator[Claim]:
    """Share that shakes down at each amplitude, and the loss of the last cycle over that of the first."""
    amplitudes = ", ".join(f"{amplitude:g}" for amplitude in dataset["amplitude"].values)
    for height in dataset["aspect_ratio"].values.tolist():
        for coupling in (True, False):
            found = of_slab(dataset, height, coupling)
            shares = ", ".join(f"{share:.2g}" for share in found["shaken_down"].values)
            left = found["loss_per_cycle"].values / np.maximum(found["first_loss"].values, np.finfo(float).tiny)
            name = f"L_z/L_x = {height:g}, {'coupled' if coupling else 'no coupling'}"
            yield Claim(name, shares, ", ".join(f"{each:.2g}" for each in left), f"at {amplitudes} d")


NUMBERS: Final[Mapping[str, Any]] = {
    "tall": partial(shaken, aspect_ratio=1.0, coupling=True),
    "flat": partial(shaken, aspect_ratio=0.25, coupling=True),
    "tall, no coupling": partial(shaken, aspect_ratio=1.0, coupling=False),
}
CONTROL: Final = CampaignFigure(
    "control",
    "What makes a slab with ends shake down",
    "Share of 16 starts whose loops lose nothing any more after eight cycles, on the paper's slab and on flatter ones of the "
    "same width, with and without coupling of shear and height.",
    draw,
    claims,
    ("", "share of starts that shake down", "loss per cycle over that of the first", ""),
)
