"""Friction drop of a slider over its load, and its regime over load, stiffness and velocity."""

from collections.abc import Iterator
from typing import Any, Final

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from tiles import counted, panels, regime_legend, regime_tiles

from nanoslip.study.dataset.units import format_value
from nanoslip.study.figures.points import typeset
from nanoslip.study.figures.shared import PAGE, CampaignFigure, Claim, column, series_style


def load_of(dataset: xr.Dataset) -> Any:
    """W of the slider in N, over its contacts."""
    attrs = dataset.attrs
    unit = attrs["shear_modulus"] * attrs["slab_width"] * attrs["slab_depth"]
    return float(dataset["normal_load"].values.item()) * unit * dataset["contacts"].values


def drop_of(dataset: xr.Dataset) -> xr.DataArray:
    """μ_s/μ_k - 1 of the drives at the lowest velocity, over loads, contacts and stiffness."""
    slow = dataset.squeeze().isel(stage_velocity=0)
    ratio: xr.DataArray = slow["static_friction"] / slow["kinetic_friction"]
    return ratio - 1.0


def draw_drop(dataset: xr.Dataset) -> Figure:
    """Excess of the highest force over the load, and the friction drop of driven sliders."""
    found, load, drop = dataset.squeeze(), load_of(dataset), drop_of(dataset)
    with column(3.2, PAGE) as figure:
        left, right = figure.subplots(1, 2, sharex=True)
        for number, way in enumerate(found["loads"].values):
            here = found.sel(loads=way)
            excess = here["static_excess"]
            left.errorbar(
                load,
                excess,
                here["static_excess_uncertainty"],
                label=f"{way} loads",
                **series_style(number, capsize=1.5),
            )
            for line, stiffness in zip(("-", "--", ":"), found["spring_stiffness"].values, strict=False):
                name = f"{way} loads, k = {format_value(stiffness)} N/m"
                right.plot(
                    load,
                    drop.sel(loads=way, spring_stiffness=stiffness),
                    label=name,
                    **series_style(number, linestyle=line),
                )
        first = float(found["static_excess"].isel(loads=0, contacts=0))
        left.plot(load, first / np.sqrt(found["contacts"]), "k:", linewidth=0.8, label="$W^{-1/2}$")
        left.set(xscale="log", yscale="log", xlabel=typeset("load W (N)"), ylabel=typeset("excess F_max/F - 1"))
        right.set(xlabel=typeset("load W (N)"), ylabel=typeset("friction drop μ_s/μ_k - 1"))
        right.axhline(0.0, color="black", linewidth=0.6)
        left.legend()
        right.legend()
    return figure


def claims_of_drop(dataset: xr.Dataset) -> Iterator[Claim]:
    """Excess and friction drop at the lowest and the highest load."""
    found, load, drop = dataset.squeeze(), load_of(dataset), drop_of(dataset)
    for way in found["loads"].values:
        here = found.sel(loads=way)
        ends = [
            f"{float(here['static_excess'][at]):.4f} ± {float(here['static_excess_uncertainty'][at]):.4f}"
            for at in (0, -1)
        ]
        yield Claim(f"{way} loads: highest force over plateau, less 1", "", " to ".join(ends), _loads(load, 0, -1))
        for stiffness in found["spring_stiffness"].values:
            line = drop.sel(loads=way, spring_stiffness=stiffness).values
            known = np.flatnonzero(np.isfinite(line))
            if known.size:
                said = f"{line[known[0]]:.4f} to {line[known[-1]]:.4f}"
                where = _loads(load, known[0], known[-1])
                yield Claim(f"   k = {format_value(stiffness)} N/m, lowest V_o: μ_s/μ_k - 1", "", said, where)


def _loads(load: Any, first: int, last: int) -> str:
    return f"at W = {load[first]:g} to {load[last]:g} N"


DROP: Final = CampaignFigure(
    "slider_drop",
    "Friction drop of a slider over its load",
    "Left: highest force of the quasi-static record over its plateau, less 1, over the load of a slider whose contacts carry "
    "100 N each: means over 4 sliders and their ±. Right: static over kinetic friction, less 1, of the same sliders on springs, "
    "at the lowest velocity. Their nodes' μ_i differ by 10 %.",
    draw_drop,
    claims_of_drop,
)


def draw_regimes(dataset: xr.Dataset) -> Figure:
    """Regime over load and velocity, a panel for each stiffness and way to share the load."""
    found, load = dataset.squeeze(), load_of(dataset)
    regime = found["regime"].assign_coords(contacts=load)
    velocity = 1e3 * found["stage_velocity"]
    with column(4.2, PAGE) as figure:
        labels = ("{} loads", "$k$ = {:.0e} N/m")
        for axes, here in panels(figure, found["loads"], found["spring_stiffness"], labels):
            axes.set(xscale="log", yscale="log")
            regime_tiles(axes, regime["contacts"], velocity, regime.sel(here))
        figure.supxlabel("load $W$ (N)")
        figure.supylabel("stage velocity $V_o$ (mm/s)")
        regime_legend(figure)
    return figure


def claims_of_regimes(dataset: xr.Dataset) -> Iterator[Claim]:
    """Count the drives of each regime for each number of contacts."""
    regime = dataset["regime"].squeeze()
    for contacts, load in zip(regime["contacts"].values, load_of(dataset), strict=True):
        yield Claim(f"N = {contacts}, W = {load:g} N", "", counted(regime.sel(contacts=contacts)), "")


REGIMES: Final = CampaignFigure(
    "slider_regimes",
    "Map of stick-slip over load, stiffness and velocity",
    "Regime of a slider with 100 N on each contact, by stiffness of the spring (columns) and distribution of loads (rows). "
    "White: the drive ended early, or sliders differ. With a soft spring the travel is too short to load the slider, so it "
    "sticks.",
    draw_regimes,
    claims_of_regimes,
)
