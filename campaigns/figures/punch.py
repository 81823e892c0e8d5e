"""Figure 5 (§3.1): the pressure of a frictionless flat punch against the closed form of a half-plane."""

from collections.abc import Iterator
from typing import Final

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from nanoslip.solver.arrays import Floats
from nanoslip.solver.contact.closed_forms import flat_punch_pressure
from nanoslip.study.dataset.access import Accessor
from nanoslip.study.figures.shared import COLORS, CampaignFigure, Claim, column

INNER: Final = 0.8
"""Share of the half-width within which pressures are compared: at the edges they are infinite."""
SHOWN: Final = 0.25
"""Half-width a/L_x of the punch that is drawn."""


def pressure(dataset: xr.Dataset, half_width: float, n_x: int, scheme: str) -> tuple[Floats, Floats]:
    """x/a of the nodes in contact, and their pressure as a share of W/a."""
    state = Accessor(dataset).contact(event=0, half_width=half_width, n_x=n_x, scheme=scheme)
    x, p = state["x"].values / half_width, state["pressure"].values * half_width
    return x[p > 0.0], p[p > 0.0]


def closed_form(x: Floats) -> Floats:
    """p·a/W of a half-plane at x/a, within the punch."""
    return flat_punch_pressure(x, 1.0, 1.0)


def draw(dataset: xr.Dataset) -> Figure:
    """Pressure of both schemes with the coarser grid, that of the finest one, and the closed form of a half-plane."""
    n_x = dataset["n_x"].values
    with column() as figure:
        axes = figure.add_subplot()
        fine = np.linspace(-0.995, 0.995, 400)
        axes.plot(fine, closed_form(fine), color="black", label="half-plane, closed form")
        axes.plot(*pressure(dataset, SHOWN, int(n_x[-1]), "galerkin"), ":", color="0.4", label=f"slab, {n_x[-1]} nodes")
        for scheme, mark, color in (("biquadratic", "o", COLORS[1]), ("galerkin", "x", COLORS[0])):
            x, p = pressure(dataset, SHOWN, int(n_x[0]), scheme)
            axes.plot(
                x, p, mark, markersize=2.5, markerfacecolor="none", color=color, label=f"{scheme}, {n_x[0]} nodes"
            )
        axes.set(xlabel="$x/a$", ylabel="pressure $p\\,a/W$", ylim=(0.0, 2.0))
        axes.legend(loc="upper center")
    return figure


def claims(dataset: xr.Dataset) -> Iterator[Claim]:
    """Root mean square misses of the closed form and of the finest grid, scheme by scheme and width by width."""
    coarse, finest = (int(n_x) for n_x in dataset["n_x"].values[[0, -1]])
    for half_width in dataset["half_width"].values:
        for scheme in ("biquadratic", "galerkin"):
            x, p = pressure(dataset, float(half_width), coarse, scheme)
            inner = np.abs(x) <= INNER
            exact = np.interp(x[inner], *pressure(dataset, float(half_width), finest, "galerkin"))
            plane, slab = (100.0 * _miss(p[inner], other) for other in (closed_form(x[inner]), exact))
            found = f"{plane:.2g} %, {slab:.2g} %"
            yield Claim(f"a/L_x = {half_width:g}, {scheme}", "close (§3.1)", found)


def _miss(found: Floats, other: Floats) -> float:
    return float(np.sqrt(np.mean((found / other - 1.0) ** 2)))


FIG5: Final = CampaignFigure(
    "fig5",
    "Figure 5: pressure under a flat punch",
    "Frictionless flat punch, a = L_x/4, on a slab with a frictionless base. Found: rms difference at n_x = 129, |x| ≤ 0.8a, "
    "from the half-plane and from galerkin at n_x = 1025. Most of the former is the slab's finite height. The paper gives no "
    "width.",
    draw,
    claims,
)
