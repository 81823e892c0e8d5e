"""Plateau, fluctuation and micro slips of full stress drops over the nodes in contact, on a half-plane."""

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any, Final

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from nanoslip.solver.view import with_error
from nanoslip.study.figures.points import typeset
from nanoslip.study.figures.shared import CampaignFigure, Claim, Number, column, exponent, series_style, start_mean

FINE: Final = 3
"""The finest grids, whose own law tells if a fall goes on."""


def over_starts(dataset: xr.Dataset, name: str, n_x: int) -> Number:
    """Mean of one of `QUANTITIES` over starts on a grid, with its ±."""
    return start_mean(QUANTITIES[name](dataset.sel(n_x=n_x)).values.ravel())


def above_half(found: xr.Dataset) -> xr.DataArray:
    """c: plateau over μ_i, less a half."""
    return found["plateau_mean"] / found["intrinsic_friction"] - 0.5


QUANTITIES: Final[Mapping[str, Any]] = {
    "c": above_half,
    "fluctuation": lambda found: found["plateau_std"] / found["plateau_mean"],
    "micro slips": lambda found: found["micro_slips"],
}
"""Name -> what is followed to finer grids."""
LABELS: Final = {
    "c": "plateau/μ_i - 1/2",
    "fluctuation": "standard deviation of F over its mean",
    "micro slips": "micro slips before the pin runs off",
}


def grids(dataset: xr.Dataset) -> list[int]:
    """n_x of each grid, the coarsest first."""
    return [int(n_x) for n_x in dataset["n_x"].values]


def nodes_in_contact(dataset: xr.Dataset, n_x: int) -> float:
    """Nodes in initial contact, mean over starts."""
    return float(dataset["initial_contact_size"].sel(n_x=n_x).mean())


def law(dataset: xr.Dataset, name: str, finest: int = 0) -> Number:
    """Exponent of a quantity over the number of spacings, on all grids or on the finest few, with its ±."""
    values = [over_starts(dataset, name, n_x) for n_x in grids(dataset)[-finest:]]
    spacings = np.array(grids(dataset)[-finest:]) - 1.0
    return Number(*exponent(spacings, *np.array(values).T))


def draw(dataset: xr.Dataset) -> Figure:
    """Each quantity over the nodes in contact."""
    contact = [nodes_in_contact(dataset, n_x) for n_x in grids(dataset)]
    with column(4.6) as figure:
        for number, (axes, name) in enumerate(zip(figure.subplots(3, 1, sharex=True), QUANTITIES, strict=True)):
            values, errors = np.array([over_starts(dataset, name, n_x) for n_x in grids(dataset)]).T
            axes.errorbar(contact, values, errors, **series_style(number, capsize=1.5))
            axes.set(
                xscale="log",
                yscale="log",
                ylabel=typeset(LABELS[name].replace(" before", "\nbefore").replace(" of F", "\nof F")),
            )
        axes.set_xlabel("nodes in contact")
    return figure


def claims(dataset: xr.Dataset) -> Iterator[Claim]:
    """Every quantity on every grid, and exponents."""
    for n_x in grids(dataset):
        found = (with_error(*over_starts(dataset, name, n_x)) for name in QUANTITIES)
        yield Claim(f"n_x = {n_x}, {nodes_in_contact(dataset, n_x):.0f} nodes in contact", *found)
    yield Claim("exponent over the number of spacings", *(with_error(*law(dataset, name)) for name in QUANTITIES))
    fine = (with_error(*law(dataset, name, FINE)) for name in QUANTITIES)
    yield Claim(f"the same on the {FINE} finest grids", *fine)


NUMBERS: Final[Mapping[str, Any]] = {
    "c, coarsest": lambda dataset: over_starts(dataset, "c", grids(dataset)[0]),
    "c, finest": lambda dataset: over_starts(dataset, "c", grids(dataset)[-1]),
    "fluctuation: exponent on the finest": partial(law, name="fluctuation", finest=FINE),
    "micro slips: exponent": partial(law, name="micro slips"),
}
FINE_GRIDS: Final = CampaignFigure(
    "fine",
    "Plateau, fluctuation and micro slips over the nodes in contact",
    "A half-plane, full stress drops, records over two node spacings: means over 16 starts and their ±.",
    draw,
    claims,
    ("", "c = plateau/μ_i - 1/2", "fluctuation of F over its mean", "micro slips before the pin runs off"),
)
