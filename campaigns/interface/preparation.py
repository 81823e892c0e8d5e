"""Highest force over plateau of a slider, over the number of its contacts, by their making and the spread of their nodes."""

from collections.abc import Iterator
from typing import Any, Final

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from nanoslip.study.figures.points import typeset
from nanoslip.study.figures.shared import CampaignFigure, Claim, column, exponent, series_style

PANELS: Final = {"static_excess": "excess F_max/F - 1", "fluctuation": "fluctuation of F"}
"""Variable -> its label."""


def of_way(dataset: xr.Dataset, way: str, spread: float, name: str) -> tuple[Any, Any]:
    """A number of the slider and its ±, each over the numbers of contacts."""
    found = dataset.squeeze().sel(initial_contact=way, spread=spread)
    return found[name].values, found[f"{name}_uncertainty"].values


def draw(dataset: xr.Dataset) -> Figure:
    """Excess and fluctuation over the contacts: a column for each way to make them, a line for each spread."""
    ways, spreads, contacts = (dataset[name].values for name in ("initial_contact", "spread", "contacts"))
    with column(4.4) as figure:
        panels = figure.subplots(len(PANELS), len(ways), sharex=True, sharey="row")
        for row, (name, label) in zip(panels, PANELS.items(), strict=True):
            row[0].set_ylabel(typeset(label))
            for axes, way in zip(row, ways, strict=True):
                for number, spread in enumerate(spreads):
                    values, errors = of_way(dataset, way, spread, name)
                    axes.errorbar(
                        contacts, values, errors, label=f"spread {spread:g}", **series_style(number, capsize=1.5)
                    )
                first, _ = of_way(dataset, way, spreads[-1], name)
                axes.plot(contacts, first[0] / np.sqrt(contacts), "k:", linewidth=0.8, label="$N^{-1/2}$")
                axes.set(xscale="log", yscale="log")
        for axes, way in zip(panels[0], ways, strict=True):
            axes.set_title(way)
        for axes in panels[-1]:
            axes.set_xlabel("contacts N")
        figure.legend(*panels[0][0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return figure


def claims(dataset: xr.Dataset) -> Iterator[Claim]:
    """Exponents over the contacts, what is left at the most of them, and what spread does to the plateau."""
    contacts, spreads = dataset["contacts"].values, dataset["spread"].values
    for way in dataset["initial_contact"].values:
        for spread in spreads:
            values, errors = of_way(dataset, way, spread, "static_excess")
            slope, doubt = exponent(contacts, values, errors)
            rest = f"{values[-1]:.4f} ± {errors[-1]:.4f} at N = {contacts[-1]}"
            yield Claim(f"{way}, spread {spread:g}: exponent of the excess", "", f"{slope:.3f} ± {doubt:.3f}", rest)
    plateau, error = of_way(dataset, "stick", spreads[0], "plateau_mean")
    for spread in spreads[1:]:
        found, own = of_way(dataset, "stick", spread, "plateau_mean")
        rise, doubt = found[-1] / plateau[-1] - 1.0, np.hypot(own[-1] / found[-1], error[-1] / plateau[-1])
        yield Claim(
            f"plateau at spread {spread:g} over that of equal nodes, less 1", "", f"{rise:.4f} ± {doubt:.4f}", "stick"
        )


PREPARATION: Final = CampaignFigure(
    "preparation",
    "Static friction of many contacts",
    "Highest force over plateau, less 1, and standard deviation of the force on the plateau, of a rigid slider with N contacts: "
    "means over 8 interfaces and their ±. Columns: initial contact. Lines: spread of the nodes' μ_i. Dotted: average of "
    "independent contacts.",
    draw,
    claims,
)
