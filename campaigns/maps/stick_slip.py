"""Map of stick-slip: where a driven pin sticks, slips and slides, over stiffness, velocity, damping and mass."""

import math
from collections.abc import Iterator
from typing import Final

import xarray as xr
from matplotlib.figure import Figure
from tiles import counted, panels, regime_legend, regime_tiles

from nanoslip.study.figures.shared import PAGE, CampaignFigure, Claim, campaign_scales, column

PARTS: Final = {"damping_ratio": ("ζ", ""), "pin_mass": ("m", " kg")}
"""Parameter of the panels -> its symbol and unit in the table."""


def critical_velocity(dataset: xr.Dataset) -> xr.DataArray:
    """V_c (m/s) above which a pin with constant μ_s and μ_k slides on after its first slip, over k, ζ and m.

    Such a pin, released at μ_s, comes to rest again where (μ_s - μ_k) W/√(km) exceeds V_o √(e^(4πζ) - 1), for small ζ.
    """
    stiffness, mass, damping = dataset["spring_stiffness"], dataset["pin_mass"], dataset["damping_ratio"]
    force = _excess(dataset) * float(dataset["normal_load"]) * campaign_scales(dataset).force
    return force / ((math.e ** (4.0 * math.pi * damping) - 1.0) * stiffness * mass) ** 0.5


def _excess(dataset: xr.Dataset) -> float:
    """μ_s - μ_k, the median of all drives."""
    return float((dataset["static_friction"] - dataset["kinetic_friction"]).median())


def draw(dataset: xr.Dataset) -> Figure:
    """Regime over stiffness and velocity, a panel for each mass and damping ratio; line: V_c."""
    regime, critical = dataset["regime"].squeeze(), critical_velocity(dataset)
    velocity = 1e3 * dataset["stage_velocity"]
    labels = ("$m$ = {:g} kg", "$\\zeta$ = {:g}")
    with column(5.6, PAGE) as figure:
        for axes, here in panels(figure, dataset["pin_mass"], dataset["damping_ratio"], labels):
            axes.set(xscale="log", yscale="log")
            regime_tiles(axes, dataset["spring_stiffness"], velocity, regime.sel(here))
            ends = axes.get_ylim()
            line = 1e3 * critical.sel(here)
            axes.plot(line["spring_stiffness"], line, "--", color="black")
            axes.set_ylim(ends)
        figure.supxlabel("spring stiffness $k$ (N/m)")
        figure.supylabel("stage velocity $V_o$ (mm/s)")
        regime_legend(figure)
    return figure


def claims(dataset: xr.Dataset) -> Iterator[Claim]:
    """Count the drives of each regime for each damping ratio and mass, and the cases in which V_c predicts stick-slip."""
    regime = dataset["regime"].squeeze()
    foretold = (dataset["stage_velocity"] < critical_velocity(dataset)).broadcast_like(regime)
    right = (regime == "stick_slip") == foretold
    decided = (regime == "stick_slip") | (regime == "slides")
    for name, (symbol, unit) in PARTS.items():
        for value in dataset[name].values:
            here = {name: value}
            share = 100.0 * float(right.where(decided).sel(here).mean())
            said = f"V_c predicts the regime in {share:.3g} % of {int(decided.sel(here).sum())}"
            yield Claim(f"{symbol} = {value:g}{unit}", "", counted(regime.sel(here)), said)
    yield Claim(
        "μ_s - μ_k, median of all drives", "", f"{_excess(dataset):.3g}", "in V_c = (μ_s - μ_k)W/√((e^(4πζ) - 1)km)"
    )
    follows = (regime == "micro_slip").any(("stage_velocity", "damping_ratio"))
    stiffness = follows["spring_stiffness"].where(follows).min("spring_stiffness")
    found = ", ".join(f"{float(least):.2g}" if least > 0.0 else "none" for least in stiffness)
    masses = ", ".join(f"{mass:g}" for mass in stiffness["pin_mass"].values)
    yield Claim("lowest k with micro slip, N/m", "", found, f"m = {masses} kg, at any velocity and damping ratio")


REGIMES: Final = CampaignFigure(
    "regimes",
    "Map of stick-slip over stiffness, velocity, damping and mass",
    "Regime of a pin over one friction record, by mass (rows) and damping ratio (columns). Dashed: the velocity "
    "above which a pin with constant μ_s and μ_k slides on after its first slip.",
    draw,
    claims,
)
