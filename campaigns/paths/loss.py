"""Energy lost by strokes over their amplitude and over cycles: full stress drops, Coulomb friction, slabs with ends."""

from collections.abc import Iterator
from typing import Any, Final

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from nanoslip.solver.contact.closed_forms import MindlinLoops
from nanoslip.solver.view import with_error
from nanoslip.study.figures.points import typeset
from nanoslip.study.figures.shared import COLORS, DASHES, MARKERS, PAGE, CampaignFigure, Claim, column, exponent

SMALL: Final = 0.5
"""Amplitude in presliding lengths up to which exponents are fitted."""
SHOWN: Final = 0.3
"""Amplitude whose cycles are drawn."""


def cases_of(dataset: xr.Dataset, scheme: str, residual: float, n_x: int) -> xr.Dataset:
    """The cases of a scheme, slip rule and grid, by rising amplitude."""
    where = (dataset["scheme"] == scheme) & (dataset["residual_shear"] == residual) & (dataset["n_x"] == n_x)
    found = dataset.isel(case=np.flatnonzero(where.values))
    return found.isel(case=np.argsort(found["amplitude"].values))


def series(dataset: xr.Dataset) -> Iterator[tuple[str, float, int]]:
    """Scheme, slip rule and grid of all cases, in their order."""
    names = ("scheme", "residual_shear", "n_x")
    yield from dict.fromkeys(zip(*(dataset[name].values.tolist() for name in names), strict=True))


def title(scheme: str, residual: float, n_x: int) -> str:
    """A series in words."""
    return f"{scheme}, {'Coulomb' if residual == 1.0 else 'full drop'}, n_x = {n_x}"


def exponent_of(found: xr.Dataset) -> tuple[float, float]:
    """Exponent of the loss over small amplitudes, and its ±."""
    small = found.isel(case=np.flatnonzero(found["amplitude"].values < SMALL))
    loss, error = small["loss_per_cycle"].values, small["loss_per_cycle_uncertainty"].values
    return exponent(small["amplitude"].values, loss, np.where(np.isfinite(error), error, 1e-3 * loss))


def over_mindlin(found: xr.Dataset) -> Any:
    """Loss over Mindlin's closed form with the same K, (cases,)."""
    numbers = (
        found[name].values
        for name in ("amplitude", "path_stiffness", "intrinsic_friction", "normal_load", "loss_per_cycle")
    )
    share = [
        loss
        * load
        / MindlinLoops(stiffness, found["poisson"].item(), friction * load).loss(
            amplitude * friction * load / stiffness
        )
        for amplitude, stiffness, friction, load, loss in zip(*np.broadcast_arrays(*numbers), strict=True)
    ]
    return np.array(share, float)


def claims(dataset: xr.Dataset) -> Iterator[Claim]:
    """Exponents, loss over the closed form, what later cycles lose of the first, and which amplitudes shake down."""
    for scheme, residual, n_x in series(dataset):
        found, name = cases_of(dataset, scheme, residual, n_x), title(scheme, residual, n_x)
        amplitude, shaken = found["amplitude"].values, found["shaken_down"].values
        if shaken.any():
            most, least = amplitude[shaken > 0.5].max(), amplitude[shaken == 0.0].min()
            remark = "the shaken down lose nothing from cycle to cycle"
            yield Claim(f"{name}: shaken down", "", f"up to amplitude {most:g}, from {least:g} on not", remark)
            continue
        slope, error = exponent_of(found)
        ratios = over_mindlin(found)
        near = f"{ratios.min():.2f} to {ratios.max():.2f} of the closed form"
        yield Claim(f"{name}: exponent of the loss up to amplitude {SMALL:g}", "", with_error(slope, error), near)
        later = found["loss_per_cycle"].values / found["first_loss"].values
        yield Claim(f"{name}: loss of later cycles over the first", "", f"{later.min():.2f} to {later.max():.2f}")


def draw(dataset: xr.Dataset) -> Figure:
    """Loss over amplitude on the finest grids, with Mindlin's closed form; loss of each cycle of one start."""
    finest: dict[tuple[str, float], int] = {}
    for scheme, residual, n_x in series(dataset):
        finest[scheme, residual] = max(finest.get((scheme, residual), 0), n_x)
    with column(2.9, PAGE) as figure:
        left, right = figure.subplots(1, 2)
        for number, ((scheme, residual), n_x) in enumerate(finest.items()):
            found = cases_of(dataset, scheme, residual, n_x)
            style = {"color": COLORS[number], "linestyle": DASHES[number], "marker": MARKERS[number], "markersize": 3}
            amplitude, loss, error = (
                found[name].values for name in ("amplitude", "loss_per_cycle", "loss_per_cycle_uncertainty")
            )
            there = found["shaken_down"].values == 0.0
            bars = np.nan_to_num(error)[there]
            left.errorbar(amplitude[there], loss[there], bars, label=title(scheme, residual, n_x), **style)
            if residual == 1.0:
                form = loss / over_mindlin(found)
                left.plot(amplitude, form, "k:", linewidth=1.2, label="Mindlin's closed form")
                continue
            line = dataset.nanoslip.path(scheme=scheme, residual_shear=residual, n_x=n_x, amplitude=SHOWN)
            lost = line["leg_loss"].values[-2 * int(line["cycles"]) :].reshape(-1, 2).sum(axis=1)
            right.plot(np.arange(1, len(lost) + 1), np.maximum(lost, 1e-18), **style)
        left.set(
            xscale="log",
            yscale="log",
            xlabel="amplitude, in presliding lengths",
            ylabel=typeset("loss per cycle in W·L_x"),
        )
        right.set(yscale="log", xlabel=f"cycle, at amplitude {SHOWN:g}", ylabel=typeset("loss in W·L_x"))
        figure.legend(*left.get_legend_handles_labels(), loc="outside upper center", ncols=2)
    return figure


LOSS: Final = CampaignFigure(
    "loss",
    "Energy lost by strokes",
    "Left: energy lost in a cycle over its amplitude, means over 16 starts and their ±, on the finest grid of each "
    "series, without cases that shake down; dotted: Mindlin's closed form for Coulomb friction on a half-plane "
    "without coupling. Right: energy lost in each cycle of one start.",
    draw,
    claims,
)
FIGURES: Final = (LOSS,)
