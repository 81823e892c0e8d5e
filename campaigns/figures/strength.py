"""Friction over load of balls whose limit of shear has a part that needs no pressure, and a fit that finds both parts."""

from collections.abc import Iterator
from typing import Final, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from nanoslip.solver.arrays import Floats
from nanoslip.solver.view import with_error
from nanoslip.study.figures.points import typeset
from nanoslip.study.figures.shared import CampaignFigure, Claim, column, exponent, series_style


class Series(NamedTuple):
    """Balls that differ in their load alone."""

    name: str
    strength: float
    """In G."""
    friction: float
    """μ_i."""
    load: Floats
    """W/(G·L_x²)."""
    force: Floats
    """F, in the same unit."""
    error: Floats
    """Its ±."""
    area: Floats
    """πa², in L_x²."""


NAMES: Final = ("tip, μ_i alone", "tip, μ_i and a strength", "rubber, a strength alone")


def series_of(dataset: xr.Dataset) -> list[Series]:
    """The series of the campaign, in the order of NAMES, by load."""
    flat = dataset.squeeze()
    chosen = (
        (flat["strength"] == 0.0),
        (flat["strength"] > 0.0) & (flat["intrinsic_friction"] > 0.0),
        (flat["intrinsic_friction"] == 0.0),
    )
    return [_series(name, flat, which.values) for name, which in zip(NAMES, chosen, strict=True)]


def _series(name: str, flat: xr.Dataset, which: np.ndarray) -> Series:
    found = flat.isel({flat["strength"].dims[0]: np.flatnonzero(which)}).sortby("normal_load")
    load = found["normal_load"].values
    return Series(
        name,
        float(found["strength"][0]),
        float(found["intrinsic_friction"][0]),
        load,
        load * found["plateau_mean"].values,
        load * found["plateau_mean_uncertainty"].values,
        np.pi * found["contact_half_width"].values ** 2,
    )


class Fit(NamedTuple):
    """Strength and μ_i that a measured series of forces under several loads shows."""

    strength: float
    strength_error: float
    friction: float
    friction_error: float
    correlation: float


def fit_of(area: Floats, load: Floats, force: Floats, error: Floats, share: float) -> Fit:
    """Least squares, weighted by ±, of F = share·(τ_0·A + μ_i·W). share: of the limit that a plateau has, (1 + r)/2 and more."""
    design = share * np.column_stack((area, load)) / error[:, None]
    covariance = np.linalg.inv(design.T @ design)
    strength, friction = covariance @ design.T @ (force / error)
    errors = np.sqrt(np.diag(covariance))
    correlation = float(covariance[0, 1] / errors.prod())
    return Fit(float(strength), float(errors[0]), float(friction), float(errors[1]), correlation)


def share_of(amontons: Series) -> float:
    """Plateau over the limit, of the series without a strength."""
    return float(np.mean(amontons.force / (amontons.friction * amontons.load)))


NOISE: Final = 0.03
"""Relative error of each force of the made-up measurement."""


def measured(series: Series) -> tuple[Floats, Floats]:
    """Forces as somebody may measure them, with a scatter of NOISE, and their ±; the same ones every time."""
    scatter = np.random.default_rng(1).standard_normal(len(series.load))
    return series.force * (1.0 + NOISE * scatter), NOISE * series.force


def draw(dataset: xr.Dataset) -> Figure:
    """F/μ over load of the first load of each series, and F/W over its first; dotted: powers 1 and 2/3."""
    with column(4.6) as figure:
        above, below = figure.subplots(2, 1, sharex=True)
        for number, one in enumerate(series_of(dataset)):
            load = one.load / one.load[0]
            above.errorbar(
                load, one.force / one.force[0], one.error / one.force[0], label=one.name, **series_style(number)
            )
            share, error = one.force / one.load, one.error / one.load
            below.errorbar(load, share / share[0], error / share[0], **series_style(number))
        for power in (1.0, 2.0 / 3.0):
            above.plot(load, load**power, "k:", linewidth=0.8)
            below.plot(load, load ** (power - 1.0), "k:", linewidth=0.8)
        above.set(xscale="log", yscale="log", ylabel=typeset("F over F at the lowest load"))
        below.set(xscale="log", xlabel=typeset("load W over the lowest"), ylabel=typeset("F/W over F/W there"))
        below.set_xticks(load, [f"{each:.0f}" for each in load])
        below.minorticks_off()
        figure.legend(*above.get_legend_handles_labels(), loc="outside upper center", ncols=1)
    return figure


def claims(dataset: xr.Dataset) -> Iterator[Claim]:
    """Powers of the load, F over the limits, and what fits find of the known answer."""
    amontons, both, strong = found = series_of(dataset)
    for one, theory in zip(found, ("1", "2/3 to 1", "2/3"), strict=True):
        power, error = exponent(one.load, one.force, one.error)
        yield Claim(f"{one.name}: power of F over W", theory, with_error(power, error))
    share = share_of(amontons)
    yield Claim("plateau over μ_i·W, no strength", "", f"{share:.4f}", "share of the limit, r = 0")
    over = strong.force / (strong.strength * strong.area)
    yield Claim("plateau over τ_0·A, no μ_i", f"{share:.4f}", f"{over.min():.4f} to {over.max():.4f}", "A = πa²")
    crossing = both.load * (both.strength * both.area / (both.friction * both.load)) ** 3
    remark = f"loads are {both.load[0]:.2g} to {both.load[-1]:.2g}"
    yield Claim("W/(G·L_x²) at which both parts are equal", "", f"{crossing.mean():.3g}", remark)
    force, scatter = measured(both)
    for name, fit in (
        ("fit of computed forces", fit_of(both.area, both.load, both.force, both.error, share)),
        (f"fit with {NOISE:.0%} scatter", fit_of(both.area, both.load, force, scatter, share)),
    ):
        remark = f"correlation {fit.correlation:.3f}"
        yield Claim(f"{name}: τ_0/G", f"{both.strength:.5f}", with_error(fit.strength, fit.strength_error), remark)
        yield Claim(f"{name}: μ_i", f"{both.friction:g}", with_error(fit.friction, fit.friction_error), remark)


STRENGTH: Final = CampaignFigure(
    "strength",
    "A ball whose friction is not proportional to load",
    "Friction over load of a ball: with friction by pressure alone, with a strength that needs no pressure beside it, and with a "
    "strength alone; means over starts and their ±, over their values at the lowest load. Dotted: F ~ W and F ~ W^(2/3), as "
    "Hertz's area.",
    draw,
    claims,
    ("", "expected", "found", "remark"),
)
