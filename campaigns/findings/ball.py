"""Plateau of a ball over the nodes in contact, for several Poisson's ratios."""

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any, Final

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from nanoslip.solver.view import with_error
from nanoslip.study.figures.points import typeset
from nanoslip.study.figures.shared import CampaignFigure, Claim, Number, column, series_style

TICKS: Final = (50, 100, 200, 400)


def plateau(found: xr.Dataset) -> Number:
    """Plateau/μ_i of a case, with its ±."""
    return Number(float(found["plateau_ratio"]), float(found["plateau_ratio_uncertainty"]))


def finest(dataset: xr.Dataset, poisson: int) -> Number:
    """Plateau/μ_i on the finest grid, by the place of ν among the values."""
    return plateau(dataset.squeeze().isel(n_x=-1, poisson=poisson))


def rise(dataset: xr.Dataset) -> Number:
    """Plateau on the coarsest grid over that on the finest at the largest ν, less 1, with its ±."""
    few, many = (plateau(dataset.squeeze().isel(n_x=each, poisson=-1)) for each in (0, -1))
    ratio = few.value / many.value
    return Number(ratio - 1.0, ratio * float(np.hypot(few.error / few.value, many.error / many.value)))


def draw(dataset: xr.Dataset) -> Figure:
    """Plateau/μ_i over the nodes in contact, a line for each ν."""
    with column() as figure:
        axes = figure.add_subplot()
        for number, nu in enumerate(dataset["poisson"].values):
            one = dataset.squeeze().sel(poisson=nu)
            ratio, error = one["plateau_ratio"].values, one["plateau_ratio_uncertainty"].values
            line = series_style(number, capsize=1.5)
            axes.errorbar(one["initial_contact_size"].values, ratio, error, label=typeset(f"ν = {nu:.3g}"), **line)
        axes.set(xscale="log", xlabel="nodes in contact", ylabel=typeset("plateau/μ_i"))
        axes.set_xticks(TICKS, [f"{nodes}" for nodes in TICKS])
        axes.minorticks_off()
        axes.legend()
    return figure


def claims(dataset: xr.Dataset) -> Iterator[Claim]:
    """Plateau/μ_i of each grid and ν, with the nodes in contact and the length of the steady part."""
    found = dataset.squeeze()
    for n_x in found["n_x"].values:
        for nu in found["poisson"].values:
            one = found.sel(n_x=n_x, poisson=nu)
            nodes, spacings = float(one["initial_contact_size"]), float(one["plateau_spacings"])
            remark = f"{nodes:.0f} nodes in contact, {spacings:.2g} node spacings"
            yield Claim(f"n_x = {n_x}, ν = {nu:.3g}", "", with_error(*plateau(one)), remark)


NUMBERS: Final[Mapping[str, Any]] = {
    **{f"finest, ν = {nu}": partial(finest, poisson=place) for place, nu in enumerate(("0", "1/3", "0.5"))},
    "coarsest over finest, ν = 0.5": rise,
}
BALL: Final = CampaignFigure(
    "ball",
    "The plateau of a ball over nodes in contact and Poisson's ratio",
    "Plateau/μ_i over the nodes in contact: means over 16 starts and their ±; full stress drops, 1 or 2 node spacings.",
    draw,
    claims,
    ("", "", "plateau/μ_i", "nodes, length"),
)
