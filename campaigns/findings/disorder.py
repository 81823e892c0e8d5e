"""Plateau over the spread of the nodes' μ_i: a ball, and cylinders with as many nodes across the contact or in it."""

import math
from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any, Final

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from nanoslip.solver.view import with_error
from nanoslip.study.figures.points import typeset
from nanoslip.study.figures.shared import CampaignFigure, Claim, Number, column, series_style


def bodies(dataset: xr.Dataset) -> dict[str, xr.Dataset]:
    """Name of a contact -> its cases, over spread; the ball first, then cylinders by their nodes."""
    found = dataset.squeeze()
    wholes = {(scheme, n_x): each for scheme, one in found.groupby("scheme") for n_x, each in one.groupby("n_x")}
    named = {}
    for (scheme, n_x), each in sorted(wholes.items(), key=lambda item: (item[0][0] != "half_space", item[0][1])):
        across = round(2.0 * float(each["contact_half_width"].mean()) * (n_x - 1))
        nodes = f"{float(each['initial_contact_size'].mean()):.0f} nodes"
        named[f"ball, {nodes}, {across} across" if scheme == "half_space" else f"cylinder, {nodes}"] = each.sortby(
            "spread"
        )
    return named


def rise(found: xr.Dataset, spread: float) -> Number:
    """Plateau of nodes of this spread over that of equal nodes, less 1, with its ±."""
    equal, other = (found.isel(case=int(np.argmin(np.abs(found["spread"].values - each)))) for each in (0.0, spread))
    ratio = float(other["plateau_mean"] / equal["plateau_mean"])
    shares = [float(each["plateau_mean_uncertainty"] / each["plateau_mean"]) for each in (equal, other)]
    return Number(ratio - 1.0, ratio * math.hypot(*shares))


def rise_of(dataset: xr.Dataset, body: int, spread: float) -> Number:
    """The rise of one of the contacts, by its place among them."""
    return rise(list(bodies(dataset).values())[body], spread)


def draw(dataset: xr.Dataset) -> Figure:
    """Plateau/μ_i over the spread, a line for each contact."""
    with column() as figure:
        axes = figure.add_subplot()
        for number, (name, found) in enumerate(bodies(dataset).items()):
            ratio, error = found["plateau_ratio"].values, found["plateau_ratio_uncertainty"].values
            axes.errorbar(found["spread"].values, ratio, error, label=name, **series_style(number, capsize=1.5))
        axes.set(xlabel=typeset("spread of μ_i over the nodes"), ylabel=typeset("plateau/μ_i"))
        axes.legend()
    return figure


def claims(dataset: xr.Dataset) -> Iterator[Claim]:
    """Plateau of equal nodes, and its rise by each spread."""
    for name, found in bodies(dataset).items():
        first = found.isel(case=0)
        plateau = with_error(float(first["plateau_ratio"]), float(first["plateau_ratio_uncertainty"]))
        yield Claim(f"{name}: plateau/μ_i of equal nodes", "", plateau)
        for spread in found["spread"].values[1:]:
            yield Claim(f"{name}: rise by a spread of {spread:g}", "", with_error(*rise(found, spread)))


NUMBERS: Final[Mapping[str, Any]] = {
    f"{name}, spread {spread:g}": partial(rise_of, body=body, spread=spread)
    for body, name in enumerate(("ball", "cylinder, as many across", "cylinder, as many nodes"))
    for spread in (0.1, 0.3)
}
DISORDER: Final = CampaignFigure(
    "disorder",
    "What disorder of the nodes does to the plateau",
    "Plateau/μ_i over the standard deviation of the nodes' μ_i, by its mean: means over 16 starts and their ±. A ball, and "
    "cylinders with as many nodes across the contact and as many nodes in it; ν = 1/3, full stress drops.",
    draw,
    claims,
)
