"""Sensitivity of plateau, step and events to the grid: scheme, surface nodes, support and slip order."""

from collections.abc import Iterator
from typing import Any, Final

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from nanoslip.solver.view import with_error
from nanoslip.study.figures.shared import COLORS, CampaignFigure, Claim, column

DEFAULTS: Final = {"support": "bonded", "slip_order": "worst_first"}
MARKERS: Final = {"bonded": "o", "frictionless": "s", "right_side": "^"}
"""Support -> its sign."""
LINES: Final = {"worst_first": "-", "simultaneous": ":"}
"""Slip order -> its line."""


def draw(dataset: xr.Dataset) -> Figure:
    """Plateau over μ_i and mean step over n_x: colours are schemes, signs are supports, lines are slip orders."""
    data = dataset.squeeze()
    with column(4.6) as figure:
        upper, lower = figure.subplots(2, 1, sharex=True)
        for color, scheme in zip(COLORS, data["scheme"].values, strict=False):
            for support, marker in MARKERS.items():
                for order, line in LINES.items():
                    here = data.sel(scheme=scheme, support=support, slip_order=order)
                    look = {"color": color, "marker": marker, "linestyle": line, "markersize": 2.5, "linewidth": 0.6}
                    if bool(np.isfinite(here["plateau_ratio"]).any()):
                        upper.plot(here["n_x"], here["plateau_ratio"], **look)
                        lower.plot(here["n_x"], here["mean_step"], **look)
        lower.set(xscale="log", yscale="log", xlabel="surface nodes $n_x$", ylabel="mean step (in $L_x$)")
        lower.set_xticks(data["n_x"].values, [f"{n_x}" for n_x in data["n_x"].values])
        lower.minorticks_off()
        upper.set(ylabel="plateau $F/W$ over $\\mu_i$")
        _legend(figure, [str(scheme) for scheme in data["scheme"].values])
    return figure


def _legend(figure: Figure, schemes: list[str]) -> None:
    """Colours, signs and lines, in three columns above the panels."""
    axes = figure.axes[0]
    entries: list[tuple[str, dict[str, Any]]] = [
        (name, {"color": color}) for name, color in zip(schemes, COLORS, strict=False)
    ]
    entries += [
        (name, {"color": "0.3", "marker": sign, "linestyle": "", "markersize": 3}) for name, sign in MARKERS.items()
    ]
    entries += [(name, {"color": "0.3", "linestyle": line}) for name, line in LINES.items()]
    handles = [axes.plot([], [], label=name, **look)[0] for name, look in entries]
    figure.legend(handles=handles, loc="outside upper center", ncols=3, fontsize=6)


def claims(dataset: xr.Dataset) -> Iterator[Claim]:
    """Plateau and mean step of every scheme and n_x; how far support and slip order move them; kinds of events."""
    data = dataset.squeeze()
    usual = data.sel(DEFAULTS)
    for n_x in data["n_x"].values:
        cells = [_ratio(usual.sel(scheme=scheme, n_x=n_x)) for scheme in data["scheme"].values]
        yield Claim(f"plateau/μ_i, n_x = {n_x}", *cells)
    for n_x in data["n_x"].values:
        yield _row(f"   over supports and slip orders, n_x = {n_x}", data["plateau_ratio"].sel(n_x=n_x))
    for n_x in data["n_x"].values:
        yield _row(f"mean step, 1e-6 L_x, n_x = {n_x}", 1e6 * usual["mean_step"].sel(n_x=n_x))
    step = data["mean_step"]
    for support in list(MARKERS)[1:]:
        yield _row(f"   {support} over bonded", step.sel(support=support) / step.sel(support="bonded"))
    simultaneous = step.sel(slip_order="simultaneous") / step.sel(slip_order="worst_first")
    yield _row("   simultaneous over worst_first", simultaneous)
    events = data["slips"] + data["releases"] + data["touches"]
    for kind in ("slips", "releases", "touches"):
        yield _row(f"{kind}, % of all events", 100.0 * data[kind] / events)


def _row(meaning: str, values: xr.DataArray) -> Claim:
    """Least and largest of each scheme's values."""
    return Claim(meaning, *(_range(values.sel(scheme=scheme)) for scheme in values["scheme"].values))


def _ratio(case: xr.Dataset) -> str:
    return with_error(float(case["plateau_ratio"]), float(case["plateau_ratio_uncertainty"]))


def _range(values: xr.DataArray) -> str:
    """Least and largest of what is finite; a scheme that a support does not exist for has none."""
    found = values.values[np.isfinite(values.values)]
    if not len(found):
        return "no such support"
    low, high = f"{found.min():.3g}", f"{found.max():.3g}"
    return low if low == high else f"{low} to {high}"


SCHEMES: Final = CampaignFigure(
    "schemes",
    "How much do plateau, step and events depend on the grid?",
    "R/L_x = 200, μ_i = 0.5, records over two node spacings. Where no support and slip order are named, the slab is bonded "
    "and the worst offender slips first. A half-plane takes no support.",
    draw,
    claims,
    ("", "biquadratic", "galerkin", "half_plane"),
)
