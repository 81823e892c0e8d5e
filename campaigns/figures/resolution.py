"""Figure 8 (§3.2.3): the mean step per event against the number of surface nodes, for two radii."""

from collections.abc import Iterator, Mapping
from typing import Any, Final

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from power_law import PowerLaw, fit_power_law

from nanoslip.study.figures.shared import CampaignFigure, Claim, Number, average, column


def step_law(dataset: xr.Dataset, radius: float) -> PowerLaw:
    """Mean step per event over starts as a power of n_x - 1, the number of spacings."""
    means = dataset["mean_step"].sel(radius=radius).squeeze()
    return fit_power_law(means["n_x"].values - 1.0, means.values)


def draw(dataset: xr.Dataset) -> Figure:
    """Means with their ±, and the fitted laws."""
    with column() as figure:
        axes = figure.add_subplot()
        for radius in dataset["radius"].values:
            means = dataset["mean_step"].sel(radius=radius).squeeze()
            spread = dataset["mean_step_uncertainty"].sel(radius=radius).squeeze()
            law = step_law(dataset, float(radius))
            exponent = str(law).replace("±", "\\pm")
            label = f"$R/L_x$ = {radius:g}: $(n_x - 1)^{{{exponent}}}$"
            points = axes.errorbar(means["n_x"], means, spread, fmt="o", markersize=3, capsize=2, label=label)
            line = np.geomspace(float(means["n_x"].min()), float(means["n_x"].max()), 50)
            axes.plot(line, law.at(line - 1.0), color=points[0].get_color(), linewidth=0.6)
        axes.set(xscale="log", yscale="log", xlabel="surface nodes $n_x$", ylabel="mean step per event, in $L_x$")
        axes.set_xticks(dataset["n_x"].values, [f"{n_x}" for n_x in dataset["n_x"].values])
        axes.minorticks_off()
        axes.legend()
    return figure


def claims(dataset: xr.Dataset) -> Iterator[Claim]:
    """The exponents with their 95 % intervals, and what one step is in nanometres."""
    for radius in dataset["radius"].values:
        law = step_law(dataset, float(radius))
        yield Claim(f"exponent of mean step, R/L_x = {radius:g}", "a power law (§3.2.3)", str(law), _EXPONENT)
    finest = dataset["mean_step"].isel(n_x=-1).squeeze()
    for radius in dataset["radius"].values:
        step = float(finest.sel(radius=radius)) * dataset.attrs["slab_width"] * 1e9
        yield Claim(f"mean step at n_x = {int(finest['n_x'])}, R/L_x = {radius:g}, nm", "→ 0", f"{step:.3g}", _LIMIT)


def exponent(dataset: xr.Dataset) -> Number:
    """Exponent of the mean step over the spacings, mean over the radii, with its interval of 95 %."""
    laws = [step_law(dataset, float(radius)) for radius in dataset["radius"].values]
    return average([Number(law.exponent, law.exponent_interval) for law in laws])


def fall_of_plateau(dataset: xr.Dataset) -> Number:
    """Plateau of the finest grid over that of the coarsest, the blunter pin, with its ±."""
    found = dataset.squeeze().isel(radius=-1).isel(n_x=[0, -1])
    plateau, error = (found[name].values for name in ("plateau_mean", "plateau_mean_uncertainty"))
    ratio = float(plateau[1] / plateau[0])
    return Number(ratio, ratio * float(np.hypot(*(error / plateau))))


NUMBERS: Final[Mapping[str, Any]] = {
    "exponent of the mean step": exponent,
    "finest plateau over coarsest": fall_of_plateau,
}
_EXPONENT = "95 % interval; the paper gives no exponent"
_LIMIT = "the step falls with every refinement: no end of the law on these grids"

FIG8: Final = CampaignFigure(
    "fig8",
    "Figure 8: mean step per event against surface nodes",
    "Mean over four starts, bars: ±, lines: fitted power laws. Records span two node spacings.",
    draw,
    claims,
)
