"""Energy lost by strokes with Coulomb friction on a half-plane, beside Mindlin's closed form."""

from collections.abc import Iterator
from typing import Final

import numpy as np
import xarray as xr
from loss import SMALL, draw_loss, exponent_of, mindlin
from matplotlib.figure import Figure

from nanoslip.study.figures.shared import CampaignFigure, Claim, column, series_style


def claims(dataset: xr.Dataset) -> Iterator[Claim]:
    """Exponent and loss over the closed form, by grid."""
    for n_x in dataset["n_x"].values.tolist():
        found = dataset.squeeze().sel(n_x=n_x)
        small = found["amplitude"].values < SMALL
        form = mindlin(found)
        slope, _ = np.polyfit(np.log(found["amplitude"].values[small]), np.log(form[small]), 1)
        name = f"n_x = {n_x}: exponent of the loss up to amplitude {SMALL:g}"
        yield Claim(name, f"{slope:.3f}", exponent_of(found))
        ratios = found["loss_per_cycle"].values / form
        yield Claim(
            f"n_x = {n_x}: loss over Mindlin's", "1", f"{ratios.min():.2f} to {ratios.max():.2f}", "with coupling"
        )


def draw(dataset: xr.Dataset) -> Figure:
    """Loss over amplitude of each grid, with Mindlin's closed form."""
    with column(2.7) as figure:
        axes = figure.add_subplot()
        for number, n_x in enumerate(dataset["n_x"].values.tolist()):
            found = dataset.squeeze().sel(n_x=n_x)
            draw_loss(axes, found, f"n_x = {n_x}", series_style(number, linestyle="none"))
        axes.plot(found["amplitude"], mindlin(found), "k:", linewidth=1.2, label="Mindlin's closed form")
        axes.legend()
    return figure


COULOMB: Final = CampaignFigure(
    "coulomb",
    "Energy lost by strokes with Coulomb friction",
    "Energy lost in a cycle over its amplitude, with Coulomb friction on a half-plane: means over 16 starts and their ±; "
    "dotted: Mindlin's closed form, without coupling.",
    draw,
    claims,
    ("", "Mindlin", "found", "remark"),
)
