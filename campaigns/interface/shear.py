"""Plateau and highest force of a slider over the shear that slips leave, by intrinsic friction, spread and number of contacts."""

from collections.abc import Iterator
from typing import Final

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from nanoslip.study.figures.points import typeset
from nanoslip.study.figures.shared import PAGE, CampaignFigure, Claim, column, exponent, series_style

LINES: Final = ("-", "--")
"""Line styles of the spreads."""


def plateau_above_ends(dataset: xr.Dataset) -> xr.DataArray:
    """The plateau over μ_i, less (1 + r)/2: the mean of what a node carries before and after a slip."""
    found = dataset.squeeze()
    share: xr.DataArray = found["plateau_mean"] / found["intrinsic_friction"]
    return share - (1.0 + found["residual_shear"]) / 2.0


def draw(dataset: xr.Dataset) -> Figure:
    """Draw the plateau less the mean of a slip's ends, and the excess: over residual shear, then over the contacts."""
    found, above = dataset.squeeze(), plateau_above_ends(dataset)
    most = {"contacts": found["contacts"].values[-1]}
    with column(3.0, PAGE) as figure:
        left, middle, right = figure.subplots(1, 3)
        for line, spread in zip(LINES, found["spread"].values, strict=True):
            for number, friction in enumerate(found["intrinsic_friction"].values):
                here = {"spread": spread, "intrinsic_friction": friction}
                style = series_style(number, linestyle=line, label=f"$\\mu_i$ = {friction:g}, spread {spread:g}")
                left.plot(found["residual_shear"], above.sel(here | most), **style)
                excess = found["static_excess"].sel(here)
                middle.plot(found["residual_shear"], excess.sel(most), **style)
                right.plot(found["contacts"], excess.sel(residual_shear=0.0), **style)
        left.set(xlabel=typeset("residual shear r"), ylabel=typeset("plateau/μ_i - (1 + r)/2"), ylim=(0.0, None))
        middle.set(xlabel=typeset("residual shear r"), ylabel=typeset("excess F_max/F - 1"), yscale="log")
        middle.set_title(f"N = {most['contacts']:g}")
        right.set(xlabel="contacts N", xscale="log", yscale="log", title="r = 0")
        figure.legend(*left.get_legend_handles_labels(), loc="outside upper center", ncols=4)
    return figure


def claims(dataset: xr.Dataset) -> Iterator[Claim]:
    """The line through the plateaus, and what is left of the excess at the most contacts."""
    found, above = dataset.squeeze(), plateau_above_ends(dataset)
    contacts = found["contacts"].values
    room = 1.0 - found["residual_shear"]
    for spread in found["spread"].values:
        here = above.sel(spread=spread, contacts=contacts[-1])
        slope = float((here * room).sum() / (room**2 * xr.ones_like(here)).sum())
        off = float(np.abs(here - slope * room).max())
        yield Claim(
            f"spread {spread:g}: c in plateau/μ_i = (1 + r)/2 + c(1 - r)",
            "",
            f"{slope:.4f}",
            f"at most {off:.4f} off, at all r and μ_i, N = {contacts[-1]}",
        )
    for spread in found["spread"].values:
        for friction in found["intrinsic_friction"].values:
            one = found.sel(spread=spread, intrinsic_friction=friction, residual_shear=0.0)
            values, errors = one["static_excess"].values, one["static_excess_uncertainty"].values
            slope, doubt = exponent(contacts, values, errors)
            yield Claim(
                f"spread {spread:g}, μ_i = {friction:g}: exponent of the excess over N",
                "",
                f"{slope:.3f} ± {doubt:.3f}",
                f"{values[-1]:.4f} ± {errors[-1]:.4f} at N = {contacts[-1]}, r = 0",
            )
        left = found["static_excess"].sel(spread=spread, contacts=contacts[-1])
        falls = (left.isel(residual_shear=-1) / left.isel(residual_shear=0)).values
        last = float(found["residual_shear"][-1])
        share = ", ".join(f"{each:.2g}" for each in falls)
        yield Claim(f"   excess at r = {last:g} over that at r = 0", "", share, "for each μ_i, lowest first")


SHEAR: Final = CampaignFigure(
    "shear",
    "Many contacts, and residual shear",
    "Left: plateau/μ_i of a slider minus (1 + r)/2, the mean of a node's shear before and after a slip, over r = residual_shear. "
    "Middle: highest force over plateau, minus 1. Right: the same over the number of contacts. Initial contact: stick; solid: "
    "equal nodes, dashed: spread 10 %.",
    draw,
    claims,
)
