"""The continuum limit: steps, plateau, scatter and peaks of records on finer and finer surfaces."""

from collections.abc import Callable, Iterator
from typing import Final

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from power_law import PowerLaw, fit_power_law

from nanoslip.solver.view import with_error
from nanoslip.study.figures.points import typeset
from nanoslip.study.figures.shared import COLORS, CampaignFigure, Claim, column

STEP, SCATTER, EXCESS = "mean step (L_x)", "standard deviation over mean of F", "peak over plateau, less 1"
QUANTITIES: Final[dict[str, Callable[[xr.Dataset], xr.DataArray]]] = {
    STEP: lambda data: data["mean_step"],
    SCATTER: lambda data: data["plateau_std"] / data["plateau_mean"],
    EXCESS: lambda data: data["peak_friction"] / data["plateau_mean"] - 1.0,
}
"""Label -> what is followed to finer surfaces."""
FINE: Final = 4
"""The finest surfaces, whose own law tells whether a fall goes on."""
SURE: Final = 0.95
"""Confidence from which a fall counts as supported."""
SMOOTH: Final = 0.01
"""Peak over plateau, less 1, that a smooth record would stay below."""
_TICKS: Final = (0.01, 0.02, 0.05, 0.1)


def followed(dataset: xr.Dataset, label: str) -> tuple[xr.DataArray, xr.DataArray]:
    """One of `QUANTITIES` over n_x: the mean over starts and its standard error."""
    values = QUANTITIES[label](dataset.squeeze())
    return values.mean("start"), values.std("start", ddof=1) / values.count("start") ** 0.5


def law(dataset: xr.Dataset, label: str) -> PowerLaw:
    """The power of n_x - 1, the number of spacings, that a quantity follows."""
    means, errors = followed(dataset, label)
    return fit_power_law(means["n_x"].values - 1.0, means.values, errors.values)


def draw(dataset: xr.Dataset) -> Figure:
    """All quantities over the number of nodes, with their standard errors and laws: shares above, the step below."""
    with column(4.2) as figure:
        upper, lower = figure.subplots(2, 1, sharex=True)
        for label, axes, color in ((EXCESS, upper, COLORS[0]), (SCATTER, upper, COLORS[1]), (STEP, lower, COLORS[2])):
            (means, errors), fitted = followed(dataset, label), law(dataset, label)
            name = typeset(f"{label}: {fitted}")
            axes.errorbar(means["n_x"], means, errors, fmt="o", markersize=2.5, capsize=2, color=color, label=name)
            line = np.geomspace(float(means["n_x"].min()), float(means["n_x"].max()), 50)
            axes.plot(line, fitted.at(line - 1.0), color=color, linewidth=0.5)
            axes.set(xscale="log", yscale="log")
        upper.set_yticks(_TICKS, [f"{tick:g}" for tick in _TICKS])
        upper.minorticks_off()
        lower.set_xlabel("surface nodes $n_x$")
        lower.set_xticks(dataset["n_x"].values, [f"{n_x}" for n_x in dataset["n_x"].values])
        lower.minorticks_off()
        figure.legend(loc="outside upper center")
    return figure


def claims(dataset: xr.Dataset) -> Iterator[Claim]:
    """Exponents with 95 % intervals, the finest surface's values, and what they say of μ_s/μ_k."""
    for label in QUANTITIES:
        (means, errors), fitted = followed(dataset, label), law(dataset, label)
        last = f"{with_error(float(means[-1]), float(errors[-1]))} on the finest surface, from {dataset.sizes['start']} starts"
        remark = f"{last}; misfit of the law {100.0 * fitted.misfit:.2g} %"
        yield Claim(f"{label}: exponent of n_x - 1", "", str(fitted), remark)
    data = dataset.squeeze()
    share = data["plateau_mean"].mean("start") / float(data["intrinsic_friction"])
    yield Claim(
        "plateau/μ_i, coarsest → finest", "", _ends(share), f"the last refinement changes {_last_change(share)}"
    )
    ratio = (data["peak_friction"] / data["plateau_mean"]).mean("start")
    yield Claim("peak over plateau, coarsest → finest: does μ_s/μ_k → 1?", "", _ends(ratio), verdict(dataset))
    fine = dataset.isel(n_x=slice(-FINE, None))
    for label in (EXCESS, SCATTER) if fine.sizes["n_x"] > 2 else ():
        found = law(fine, label)
        remark = f"there too it falls with confidence {_percent(found.confidence_of_fall())}"
        yield Claim(f"{label}: exponent on the {fine.sizes['n_x']} finest surfaces", "", str(found), remark)


def verdict(dataset: xr.Dataset) -> str:
    """State if the peak's excess over the plateau falls, with which confidence, and at which size a record would be smooth."""
    excess = law(dataset, EXCESS)
    sure = excess.confidence_of_fall()
    if sure < SURE:
        return f"not supported: that the excess falls has confidence {_percent(sure)} only"
    spacings = (SMOOTH / excess.factor) ** (1.0 / excess.exponent)
    fall = f"a fall is supported, with confidence {_percent(sure)}; the limit is not seen"
    return f"{fall}: if the law goes on, the excess is {100.0 * SMOOTH:g} % at n_x = {spacings:.0e}"


def _percent(confidence: float) -> str:
    return f"{100.0 * confidence:.1f} %" if confidence < 0.9995 else "above 99.9 %"


def _ends(values: xr.DataArray) -> str:
    return f"{float(values[0]):.4g} → {float(values[-1]):.4g}"


def _last_change(share: xr.DataArray) -> str:
    return f"{100 * abs(float(share[-1] / share[-2]) - 1.0):.2g} %"


CONTINUUM: Final = CampaignFigure(
    "continuum",
    "The continuum limit",
    "Mean step, scatter and peak of records over two node spacings on a half-plane: means over starts, bars: their "
    "standard errors, lines: fitted power laws of the number of spacings. Points are weighted by their errors and by the "
    "law's misfit; exponents with 95 % intervals.",
    draw,
    claims,
)
