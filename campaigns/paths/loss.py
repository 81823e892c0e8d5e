"""Energy lost by strokes with full stress drops, over their amplitude and over cycles; slabs with ends shake down."""

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any, Final

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from nanoslip.solver.contact.closed_forms import MindlinLoops
from nanoslip.solver.view import with_error
from nanoslip.study.figures.points import typeset
from nanoslip.study.figures.shared import DASHES, PAGE, CampaignFigure, Claim, Number, column, exponent, series_style

SMALL: Final = 0.5
"""Amplitude in presliding lengths up to which exponents are fitted."""
SHOWN: Final = 0.3
"""Amplitude whose cycles are drawn."""


def exponent_of(found: xr.Dataset) -> str:
    """Exponent of the loss over small amplitudes, ± its error. found: over amplitude."""
    small = found.sel(amplitude=found["amplitude"].values[found["amplitude"].values < SMALL])
    loss, error = small["loss_per_cycle"].values, small["loss_per_cycle_uncertainty"].values
    return with_error(*exponent(small["amplitude"].values, loss, error))


def mindlin(found: xr.Dataset) -> Any:
    """Mindlin's closed form with the same K, in W·L_x, over amplitude."""
    friction, load, poisson = (float(found[name]) for name in ("intrinsic_friction", "normal_load", "poisson"))
    numbers = zip(found["amplitude"].values, found["path_stiffness"].values, strict=True)
    forms = ((amplitude, MindlinLoops(stiffness, poisson, friction * load)) for amplitude, stiffness in numbers)
    return np.array([float(form.loss(share * form.bearing / form.stiffness)) / load for share, form in forms])


def claims(dataset: xr.Dataset) -> Iterator[Claim]:
    """Exponents, loss over the closed form and over that of the first cycle; or which amplitudes shake down."""
    for scheme in dataset["scheme"].values.tolist():
        for n_x in dataset["n_x"].values.tolist():
            found, name = dataset.squeeze().sel(scheme=scheme, n_x=n_x), f"{scheme}, n_x = {n_x}"
            amplitude, shaken = found["amplitude"].values, found["shaken_down"].values
            if (shaken > 0.5).any():
                most, least = amplitude[shaken > 0.5].max(), amplitude[shaken == 0.0].min()
                yield Claim(f"{name}: shaken down", "nothing", f"up to amplitude {most:g}, from {least:g} on not")
                continue
            ratios, later = (
                found["loss_per_cycle"].values / mindlin(found),
                found["loss_per_cycle"] / found["first_loss"],
            )
            near = f"{ratios.min():.2f} to {ratios.max():.2f} times Mindlin's"
            yield Claim(f"{name}: exponent of the loss up to amplitude {SMALL:g}", "", exponent_of(found), near)
            most = f"at amplitudes {amplitude[0]:g} to {amplitude[-1]:g}"
            yield Claim(
                f"{name}: loss over that of the first cycle", "", f"{later.min():.2f} to {later.max():.2f}", most
            )


def draw(dataset: xr.Dataset) -> Figure:
    """Loss over amplitude on the finest grid, with Mindlin's closed form; loss of each cycle of one start."""
    finest = dataset["n_x"].values[-1]
    with column(2.7, PAGE) as figure:
        left, right = figure.subplots(1, 2)
        for number, scheme in enumerate(dataset["scheme"].values.tolist()):
            found = dataset.squeeze().sel(scheme=scheme, n_x=finest)
            style = series_style(number, linestyle=DASHES[number])
            draw_loss(left, found.isel(amplitude=np.flatnonzero(found["shaken_down"].values == 0.0)), scheme, style)
            line = dataset.nanoslip.path(scheme=scheme, n_x=finest, amplitude=SHOWN)
            lost = line["leg_loss"].values[-2 * int(line["cycles"]) :].reshape(-1, 2).sum(axis=1)
            right.plot(np.arange(1, len(lost) + 1), lost, **style)
        left.plot(found["amplitude"], mindlin(found), "k:", linewidth=1.2, label="Mindlin's closed form")
        right.set(yscale="log", xlabel=f"cycle, at amplitude {SHOWN:g}", ylabel=typeset("loss in W·L_x"))
        figure.legend(*left.get_legend_handles_labels(), loc="outside upper center", ncols=4)
    return figure


def draw_loss(axes: Any, found: xr.Dataset, name: str, style: dict[str, Any]) -> None:
    """Loss over amplitude with its ±."""
    loss, error = found["loss_per_cycle"], found["loss_per_cycle_uncertainty"].fillna(0.0)
    axes.errorbar(found["amplitude"], loss, error, label=name, **style)
    axes.set(xscale="log", yscale="log", xlabel="amplitude, in presliding lengths", ylabel=typeset("loss in W·L_x"))


def shaken(dataset: xr.Dataset, ends: bool) -> Number:
    """Share of small strokes that lose nothing any more, on slabs with ends or without."""
    found = dataset.squeeze()
    schemes = [name for name in found["scheme"].values.tolist() if (name == "biquadratic") == ends]
    small = found["amplitude"].values[found["amplitude"].values < SMALL]
    return Number(float(found["shaken_down"].sel(scheme=schemes, amplitude=small).mean()), 0.0)


NUMBERS: Final[Mapping[str, Any]] = {
    "shaken down, ends": partial(shaken, ends=True),
    "shaken down, no ends": partial(shaken, ends=False),
}
LOSS: Final = CampaignFigure(
    "loss",
    "Energy lost by strokes",
    "Left: energy lost in a cycle over its amplitude, means over 16 starts and their ±, on the finest grid, without cases "
    "that shake down; dotted: Mindlin's closed form for Coulomb friction on a half-plane without coupling. Right: energy "
    "lost in each cycle of one start.",
    draw,
    claims,
    ("", "Eq. 13-15", "found", ""),
)
