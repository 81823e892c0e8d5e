"""The continuum limit: steps, plateau, scatter and peaks of records on finer and finer surfaces."""

from collections.abc import Callable, Iterator
from typing import Final

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from study.figures.shared.canvas import column
from study.figures.shared.claims import Claim
from study.figures.shared.figure import CampaignFigure, register
from study.figures.shared.power_law import PowerLaw, fit_power_law

STEP, SCATTER, EXCESS = "mean step (L_x)", "standard deviation over mean of F", "peak over plateau, less 1"
QUANTITIES: Final[dict[str, Callable[[xr.Dataset], xr.DataArray]]] = {
    STEP: lambda data: data["mean_step"],
    SCATTER: lambda data: data["plateau_std"] / data["plateau_mean"],
    EXCESS: lambda data: data["peak_friction"] / data["plateau_mean"] - 1.0,
}
"""Label -> what is followed to finer surfaces."""


def followed(dataset: xr.Dataset, label: str) -> xr.DataArray:
    """One of `QUANTITIES` over n_x: the mean over starts."""
    return QUANTITIES[label](dataset.squeeze()).mean("member")


def law(dataset: xr.Dataset, label: str) -> PowerLaw:
    """The power of n_x - 1, the number of spacings, that a quantity follows."""
    values = followed(dataset, label)
    return fit_power_law(values["n_x"].values - 1.0, values.values)


def draw(dataset: xr.Dataset) -> Figure:
    """All quantities over the number of nodes, with their laws."""
    with column(3.0) as figure:
        axes = figure.add_subplot()
        for label in QUANTITIES:
            values, fitted = followed(dataset, label), law(dataset, label)
            name = f"{label}: {fitted.exponent:.2f} ± {fitted.exponent_interval:.2f}"
            points = axes.plot(values["n_x"], values, "o", markersize=3, label=name)
            line = np.geomspace(float(values["n_x"].min()), float(values["n_x"].max()), 50)
            axes.plot(line, fitted.at(line - 1.0), color=points[0].get_color(), linewidth=0.5)
        axes.set(xscale="log", yscale="log", xlabel="surface nodes $n_x$")
        axes.set_xticks(dataset["n_x"].values, [f"{n_x}" for n_x in dataset["n_x"].values])
        axes.minorticks_off()
        figure.legend(loc="outside upper center", fontsize=6.5)
    return figure


def claims(dataset: xr.Dataset) -> Iterator[Claim]:
    """Exponents with 95 % intervals, the finest surface's values, and what they say of μ_s/μ_k."""
    for label in QUANTITIES:
        last = float(followed(dataset, label)[-1])
        found = str(law(dataset, label))
        remark = f"{last:.3g} on the finest surface, from {dataset.sizes['member']} starts"
        yield Claim(f"{label}: exponent of n_x - 1", "", found, remark)
    data = dataset.squeeze()
    share = data["plateau_mean"].mean("member") / float(data["intrinsic_friction"])
    found = f"{float(share[0]):.4g} → {float(share[-1]):.4g}"
    yield Claim("plateau/μ_i, coarsest → finest", "", found, f"the last refinement changes {_last_change(share)}")
    ratio = (data["peak_friction"] / data["plateau_mean"]).mean("member")
    excess = law(dataset, EXCESS)
    falls = excess.exponent + excess.exponent_interval < 0.0
    remark = "its excess falls, slowly: see the exponent" if falls else "no fall beyond its scatter on these grids"
    found = f"{float(ratio[0]):.4g} → {float(ratio[-1]):.4g}"
    yield Claim("peak over plateau, coarsest → finest: does μ_s/μ_k → 1?", "", found, remark)


def _last_change(share: xr.DataArray) -> str:
    return f"{100 * abs(float(share[-1] / share[-2]) - 1.0):.2g} %"


register(
    CampaignFigure(
        "continuum",
        "figures/continuum",
        "The continuum limit",
        "Mean step, scatter and peak of records over two node spacings on a half-plane, with fitted power laws of the "
        "number of spacings (± is half of the 95 % interval of the line). Few starts: what the peak does is not settled.",
        draw,
        lambda dataset: tuple(claims(dataset)),
        ("", "", "found", "remark"),
    )
)
