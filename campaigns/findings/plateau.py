"""Plateau over the shear that slips leave: (1 + r)/2 and a small part, in plane strain and under a ball."""

from collections.abc import Iterator, Mapping
from typing import Any, Final

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from nanoslip.solver.view import with_error
from nanoslip.study.figures.points import typeset
from nanoslip.study.figures.shared import COLORS, CampaignFigure, Claim, Number, average, column, series_style

BALL: Final = "half_space"


def above(found: xr.Dataset) -> xr.DataArray:
    """The plateau over μ_i, less (1 + r)/2: the mean of what a node carries before and after a slip."""
    return found["plateau_ratio"] - (1.0 + found["residual_shear"]) / 2.0


def of_schemes(dataset: xr.Dataset) -> dict[str, xr.Dataset]:
    """Scheme -> its cases."""
    return {str(name): found for name, found in dataset.squeeze().groupby("scheme")}


def part(found: xr.Dataset) -> Number:
    """c of plateau/μ_i = (1 + r)/2 + c(1 - r) by least squares, with its ±."""
    room, error = 1.0 - found["residual_shear"].values, found["plateau_ratio_uncertainty"].values
    return Number(
        float(above(found).values @ room / (room @ room)), float(np.hypot.reduce(room * error) / (room @ room))
    )


def part_in_plane_strain(dataset: xr.Dataset) -> Number:
    """Mean of c over the schemes in plane strain."""
    parts = [part(found) for name, found in of_schemes(dataset).items() if name != BALL]
    return average(parts)


def part_under_a_ball(dataset: xr.Dataset) -> Number:
    """c of the half-space."""
    return part(of_schemes(dataset)[BALL])


def misfit(dataset: xr.Dataset) -> Number:
    """Largest distance of a plateau over μ_i from its line, with the ± of that plateau."""
    misses = []
    for found in of_schemes(dataset).values():
        off = np.abs(above(found).values - part(found).value * (1.0 - found["residual_shear"].values))
        misses.append(max(zip(off.tolist(), found["plateau_ratio_uncertainty"].values.tolist(), strict=True)))
    return Number(*max(misses))


def draw(dataset: xr.Dataset) -> Figure:
    """The part above (1 + r)/2 over r, with its line, a color for each scheme."""
    with column() as figure:
        axes = figure.add_subplot()
        for number, (name, found) in enumerate(of_schemes(dataset).items()):
            r, error = found["residual_shear"].values, found["plateau_ratio_uncertainty"].values
            axes.errorbar(r, above(found).values, error, label=name, **series_style(number, linestyle=""))
            axes.plot([0.0, 1.0], [part(found).value, 0.0], color=COLORS[number])
        axes.set(xlabel=typeset("residual shear r"), ylabel=typeset("plateau/μ_i - (1 + r)/2"))
        axes.legend()
    return figure


def claims(dataset: xr.Dataset) -> Iterator[Claim]:
    """c of each scheme."""
    for name, found in of_schemes(dataset).items():
        nodes = f"{float(found['initial_contact_size'][0]):.0f} nodes in contact"
        yield Claim(f"{name}: c in plateau/μ_i = (1 + r)/2 + c(1 - r)", "", with_error(*part(found)), nodes)


NUMBERS: Final[Mapping[str, Any]] = {
    "c in plane strain": part_in_plane_strain,
    "c under a ball": part_under_a_ball,
    "misfit": misfit,
}
PLATEAU: Final = CampaignFigure(
    "plateau",
    "The plateau over the shear that slips leave",
    "Plateau/μ_i minus (1 + r)/2, the mean of a node's shear before and after a slip, over r = residual_shear: means over 8 "
    "starts and their ±. Lines: c(1 - r).",
    draw,
    claims,
)
