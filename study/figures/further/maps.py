"""Maps: where a driven pin sticks, slips and slides, and how friction depends on what is pressed on what."""

import math
from collections.abc import Iterator
from typing import Any, Final

import numpy as np
import xarray as xr
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from numpy.typing import NDArray

from solver.drive import Scales
from solver.dynamics.regime import REGIMES
from study.figures.shared.canvas import COLORS, column
from study.figures.shared.claims import Claim
from study.figures.shared.figure import CampaignFigure, register

Floats = NDArray[np.float64]
_SHADES: Final = ListedColormap([COLORS[5], COLORS[1], COLORS[0], COLORS[3]])
SHARES: Final = {"plateau_mean": "plateau", "static_friction": "$\\mu_s$", "kinetic_friction": "$\\mu_k$"}
"""Variable -> its symbol; drawn as a share of μ_i."""


def critical_velocity(dataset: xr.Dataset) -> xr.DataArray:
    """V_c (m/s) above which a pin with constant μ_s and μ_k slides on after its first slip, over k, ζ and m.

    Such a pin, released at μ_s, comes to rest again where (μ_s - μ_k) W/√(km) exceeds V_o √(e^(4πζ) - 1), for small ζ.
    """
    scales = Scales(**{name: dataset.attrs[name] for name in ("slab_width", "slab_depth", "shear_modulus")})
    excess = float((dataset["static_friction"] - dataset["kinetic_friction"]).median())
    stiffness, mass, damping = dataset["spring_stiffness"], dataset["pin_mass"], dataset["damping_ratio"]
    force = excess * float(dataset["normal_load"]) * scales.force
    return force / ((math.e ** (4.0 * math.pi * damping) - 1.0) * stiffness * mass) ** 0.5


def codes(regime: xr.DataArray) -> Floats:
    """Numbers of the regimes in REGIMES, NaN where there is none."""
    numbers: dict[str, float] = {name: float(number) for number, name in enumerate(REGIMES)}
    return np.array([numbers.get(str(word), np.nan) for word in regime.values.ravel()]).reshape(regime.shape)


def draw_regimes(dataset: xr.Dataset) -> Figure:
    """Regime over stiffness and velocity, a panel for each damping ratio, at the largest mass; line: V_c."""
    heaviest = {"pin_mass": -1} if "pin_mass" in dataset.dims else {}
    here, critical = dataset.isel(heaviest).squeeze(), critical_velocity(dataset).isel(heaviest)
    with column(4.0) as figure:
        panels = figure.subplots(2, 2, sharex=True, sharey=True)
        for axes, damping in zip(panels.flat, dataset["damping_ratio"].values, strict=False):
            regime = here["regime"].sel(damping_ratio=damping).transpose("stage_velocity", "spring_stiffness")
            _tiles(axes, regime["spring_stiffness"], 1e3 * regime["stage_velocity"], codes(regime), len(REGIMES))
            line = critical.sel(damping_ratio=damping)
            axes.plot(line["spring_stiffness"], 1e3 * line, "--", color="black", label="$V_c$")
            velocities = 1e3 * regime["stage_velocity"].values
            axes.set(xscale="log", yscale="log", title=f"$\\zeta$ = {damping:g}", ylim=(velocities[0], velocities[-1]))
        for axes in panels.flat[dataset["damping_ratio"].size :]:
            axes.set_visible(False)
        figure.supxlabel("spring stiffness $k$ (N/m)", fontsize=8)
        figure.supylabel("stage velocity $V_o$ (mm/s)", fontsize=8)
        _legend(figure)
    return figure


def _tiles(axes: Any, x: Any, y: Any, numbers: Floats, count: int) -> None:
    axes.grid(visible=False)
    axes.pcolormesh(np.asarray(x), np.asarray(y), numbers, cmap=_SHADES, vmin=-0.5, vmax=count - 0.5, shading="nearest")


def _legend(figure: Figure) -> None:
    """The regimes' colours above all panels."""
    patches = [
        figure.axes[0].plot([], [], "s", color=_SHADES(number), label=name.replace("_", "-"))[0]
        for number, name in enumerate(REGIMES)
    ]
    figure.legend(handles=patches, loc="outside upper center", ncols=len(patches), fontsize=6.5)


def claims_of_regimes(dataset: xr.Dataset) -> Iterator[Claim]:
    """How many drives do what for each damping ratio, and how often V_c tells stick-slip from sliding."""
    regime = dataset["regime"].squeeze()
    critical, velocity = critical_velocity(dataset), dataset["stage_velocity"]
    for damping in dataset["damping_ratio"].values:
        here = regime.sel(damping_ratio=damping)
        found = ", ".join(f"{int((here == name).sum())} {name.replace('_', '-')}" for name in REGIMES)
        expected = (velocity < critical.sel(damping_ratio=damping)).broadcast_like(here).transpose(*here.dims)
        decided = (here == "stick_slip") | (here == "slides")
        right = ((here == "stick_slip") == expected) & decided
        share = 100.0 * float(right.sum()) / max(int(decided.sum()), 1)
        yield Claim(
            f"ζ = {damping:g}", "", found, f"V_c tells stick-slip from sliding in {share:.3g} % of {int(decided.sum())}"
        )
    excess = float((dataset["static_friction"] - dataset["kinetic_friction"]).median())
    yield Claim("μ_s - μ_k, median of all drives", "", f"{excess:.3g}", "in V_c = (μ_s - μ_k)W/√((e^(4πζ) - 1)km)")


def draw_friction(dataset: xr.Dataset) -> Figure:
    """Plateau, μ_s, μ_k as shares of μ_i, and the regime, over load and μ_i, at the smallest radius and the middle height."""
    here = dataset.isel(radius=0, aspect_ratio=dataset.sizes["aspect_ratio"] // 2).squeeze()
    with column(4.0) as figure:
        panels = figure.subplots(2, 2, sharex=True, sharey=True)
        load, friction = here["normal_load"], here["intrinsic_friction"]
        for axes, (name, symbol) in zip(panels.flat, SHARES.items(), strict=False):
            share = (here[name] / friction).where(here["validity_flags"] == 0)
            share = share.transpose("intrinsic_friction", "normal_load")
            axes.grid(visible=False)
            mesh = axes.pcolormesh(load, friction, share.values, shading="nearest")
            figure.colorbar(mesh, ax=axes)
            axes.set(xscale="log", title=f"{symbol}$/\\mu_i$")
            ends = load.values[[0, len(load) // 2, -1]]
            axes.set_xticks(ends, [f"{1e3 * end:g}" for end in ends])
            axes.minorticks_off()
        last = panels.flat[-1]
        _tiles(last, load, friction, codes(here["regime"].transpose("intrinsic_friction", "normal_load")), len(REGIMES))
        last.set_title("regime")
        figure.supxlabel("normal load ($10^{-3} G L_x L_y$)", fontsize=8)
        figure.supylabel("intrinsic friction $\\mu_i$", fontsize=8)
        _legend(figure)
    return figure


def claims_of_friction(dataset: xr.Dataset) -> Iterator[Claim]:
    """Each share of μ_i over all cases, and how much of its variance the mean along one axis explains."""
    axes = ("intrinsic_friction", "radius", "aspect_ratio", "normal_load")
    for name, symbol in SHARES.items():
        share = (dataset[name] / dataset["intrinsic_friction"]).where(dataset["validity_flags"] == 0).squeeze()
        found = f"{float(share.mean()):.3g} ± {float(share.std()):.2g} ({float(share.min()):.3g} to {float(share.max()):.3g})"
        total = float(share.var())
        parts = ", ".join(
            f"{axis}: {100 * float(share.mean([other for other in axes if other != axis]).var()) / total:.2g} %"
            for axis in axes
        )
        counted = f"of {int(np.isfinite(share).sum())} cases without a flag; variance along {parts}"
        yield Claim(f"{symbol.replace('$', '').replace(chr(92) + 'mu', 'μ')}/μ_i", "", found, counted)
    regime = dataset["regime"]
    counts = ", ".join(f"{int((regime == name).sum())} {name.replace('_', '-')}" for name in REGIMES)
    yield Claim("regime of the paper's drive", "", counts, f"{int((regime == '').sum())} without")


register(
    CampaignFigure(
        "regimes",
        "maps/stick_slip",
        "Map of stick-slip over stiffness, velocity and damping",
        "What a pin of the largest mass does over one friction record. Dashed: the velocity above which a pin with constant "
        "μ_s and μ_k would slide on after its first slip.",
        draw_regimes,
        lambda dataset: tuple(claims_of_regimes(dataset)),
        ("", "", "found", "remark"),
    )
)
register(
    CampaignFigure(
        "friction",
        "maps/friction",
        "Map of friction over load and intrinsic friction",
        "Plateau, μ_s and μ_k as shares of μ_i, and what the paper's drive does, at the smallest radius and the middle height. "
        "White: not measured, or a contact that says little (validity_flags).",
        draw_friction,
        lambda dataset: tuple(claims_of_friction(dataset)),
        ("", "", "found", "remark"),
    )
)
