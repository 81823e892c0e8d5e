"""Shear of nodes over their limit while a ball slides: about evenly distributed."""

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any, Final

import xarray as xr
from matplotlib.figure import Figure
from shares import BETWEEN, MIDDLE, TENTHS, contact_growth, densities, number

from nanoslip.solver.view import with_error
from nanoslip.study.figures.points import typeset
from nanoslip.study.figures.shared import COLORS, CampaignFigure, Claim, column


def draw(dataset: xr.Dataset) -> Figure:
    """Shares of the load over shear over limit."""
    with column() as figure:
        axes = figure.add_subplot()
        for color, spread in zip(COLORS, dataset["spread"].values.tolist(), strict=False):
            axes.stairs(densities(dataset, spread=spread), TENTHS, color=color, label=f"spread {spread:g}")
        axes.axhline(0.1, color="0.5", linestyle=":", label="evenly")
        axes.set(xlabel=typeset("shear over limit"), ylabel="share of the load", ylim=(0.0, None))
        axes.legend()
    return figure


def claims(dataset: xr.Dataset) -> Iterator[Claim]:
    """Shares of the load in the middle and between."""
    for spread in dataset["spread"].values.tolist():
        middle, between = (with_error(*number(dataset, ends, spread=spread)) for ends in (MIDDLE, BETWEEN))
        yield Claim(f"half_space, spread {spread:g}", middle, between)


NUMBERS: Final[Mapping[str, Any]] = {
    "middle": partial(number, between=MIDDLE, spread=0.0),
    "between": partial(number, between=BETWEEN, spread=0.0),
    "area": partial(contact_growth, spread=0.0),
}
SHARES_BALL: Final = CampaignFigure(
    "shares_ball",
    "What nodes carry of their limit, under a ball",
    "Share of the load on nodes by their shear over limit, of a ball with 204 nodes in contact: means over 16 starts; in the "
    "table with their ±. Evenly it would be 0.1 and 0.3.",
    draw,
    claims,
    ("share of the load on nodes that carry", "0.5 to 0.6 of their limit", "0.1 to 0.4", ""),
)
