"""Map of friction: plateau, μ_s, μ_k and the paper's drive over intrinsic friction, load, radius and height of the slab."""

from collections.abc import Iterator
from typing import Any, Final

import numpy as np
import xarray as xr
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from tiles import counted, panels, regime_legend, regime_tiles

from nanoslip.study.figures.shared import PAGE, CampaignFigure, Claim, column, edges, start_statistics

SHARES: Final = {"plateau_mean": "plateau", "static_friction": "μ_s", "kinetic_friction": "μ_k"}
"""Variable -> its symbol; it is looked at as a share of μ_i."""
AXES: Final = ("intrinsic_friction", "radius", "aspect_ratio", "normal_load")
LOADS: Final = 1e3
"""Loads are drawn in 1e-3 G·L_x·L_y."""


def share_of(dataset: xr.Dataset, name: str) -> xr.DataArray:
    """A coefficient over μ_i, NaN where it was not measured or the contact has a validity flag."""
    return (dataset[name] / dataset["intrinsic_friction"]).where(dataset["validity_flags"] == 0).squeeze()


def draw_share(dataset: xr.Dataset, name: str, label: str) -> Figure:
    """One coefficient as a share of μ_i over load and μ_i, a panel for each height and radius."""
    share = share_of(dataset, name)
    norm = Normalize(float(share.min()), float(share.max()))
    with column(6.0, PAGE) as figure:
        for axes, here in _panels(figure, dataset):
            values = share.sel(here).transpose("intrinsic_friction", "normal_load").values
            load, friction = LOADS * dataset["normal_load"], dataset["intrinsic_friction"]
            axes.set_facecolor("0.85")
            axes.pcolormesh(edges(load.values, axes.xaxis), edges(friction.values, axes.yaxis), values, norm=norm)
        figure.colorbar(ScalarMappable(norm), ax=figure.axes, label=label, location="top", shrink=0.5, aspect=40)
    return figure


def draw_drive(dataset: xr.Dataset) -> Figure:
    """Draw the regimes of the paper's drive over load and μ_i, a panel for each height and radius."""
    with column(6.0, PAGE) as figure:
        for axes, here in _panels(figure, dataset):
            load, friction = LOADS * dataset["normal_load"], dataset["intrinsic_friction"]
            regime_tiles(axes, load, friction, dataset["regime"].squeeze().sel(here))
        regime_legend(figure)
    return figure


def _panels(figure: Figure, dataset: xr.Dataset) -> Iterator[tuple[Any, dict[str, Any]]]:
    """Panels of every height and radius over a logarithmic axis of loads."""
    labels = ("$L_z/L_x$ = {:g}", "$R/L_x$ = {:g}")
    loads = LOADS * dataset["normal_load"].values
    for axes, here in panels(figure, dataset["aspect_ratio"], dataset["radius"], labels):
        axes.set(xscale="log")
        yield axes, here
        axes.set_xticks(loads, [f"{load:g}" for load in loads])
        axes.minorticks_off()
    figure.supxlabel("normal load ($10^{-3} G L_x L_y$)")
    figure.supylabel("intrinsic friction $\\mu_i$")


def claims_of_share(dataset: xr.Dataset, name: str) -> Iterator[Claim]:
    """A share of μ_i over all cases, its means at the ends of each axis, and how much of its variance lies along it."""
    share = share_of(dataset, name)
    unflagged = f"{int(np.isfinite(share).sum())} of {share.size} cases without a flag"
    yield Claim(f"{SHARES[name]}/μ_i", "", start_statistics(share.values, 3), unflagged)
    for axis in AXES:
        along = share.mean([other for other in AXES if other != axis])
        first, last = along[axis].values[[0, -1]]
        part = f"{100.0 * float(along.var() / share.var()):.2g} % of the variance"
        means = f"{float(along[0]):.3g} → {float(along[-1]):.3g}"
        yield Claim(f"   mean, {axis} = {first:g} → {last:g}", "", means, part)


def _claims_of_plateau(dataset: xr.Dataset) -> Iterator[Claim]:
    yield from claims_of_share(dataset, "plateau_mean")
    kinetic = share_of(dataset, "kinetic_friction")
    ratio = kinetic / share_of(dataset, "plateau_mean")
    cases = f"{int(np.isfinite(ratio).sum())} cases: a map of μ_k looks the same"
    yield Claim("μ_k over the plateau", "", start_statistics(ratio.values), cases)


def _claims_of_drive(dataset: xr.Dataset) -> Iterator[Claim]:
    regime = dataset["regime"].squeeze()
    without = int((regime == "").sum())
    yield Claim("all drives", "", counted(regime), f"{without} without regime")
    for axis in AXES:
        for value in dataset[axis].values:
            here = regime.sel({axis: value})
            yield Claim(f"{axis} = {value:g}", "", counted(here), f"{int((here == '').sum())} without")


_WHERE: Final = "over load and μ_i, for every slab height (rows) and radius (columns)"
_GREY: Final = "Grey: no value, or a contact with validity flags."

FRICTION: Final = CampaignFigure(
    "friction",
    "Map of the plateau over intrinsic friction, load, radius and slab height",
    f"Plateau as a share of μ_i {_WHERE}. {_GREY}",
    lambda dataset: draw_share(dataset, "plateau_mean", "plateau$/\\mu_i$"),
    _claims_of_plateau,
)
FRICTION_STATIC: Final = CampaignFigure(
    "friction_static",
    "Map of static friction over intrinsic friction, load, radius and slab height",
    f"μ_s of the paper's drive as a share of μ_i {_WHERE}. {_GREY}",
    lambda dataset: draw_share(dataset, "static_friction", "$\\mu_s/\\mu_i$"),
    lambda dataset: claims_of_share(dataset, "static_friction"),
)
FRICTION_DRIVE: Final = CampaignFigure(
    "friction_drive",
    "Map of regimes of the paper's drive",
    f"Regime of the paper's drive {_WHERE}. White: no plateau, or the drive ended early. "
    "Flagged contacts are included.",
    draw_drive,
    _claims_of_drive,
)
