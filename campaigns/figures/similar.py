"""F/W depends on W·R, not on R alone; displacements scale with W (§3.2.2)."""

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any, Final

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from nanoslip.solver.view import with_error
from nanoslip.study.figures.points import typeset
from nanoslip.study.figures.shared import COLORS, PAGE, CampaignFigure, Claim, Number, column, start_mean


def of_products(dataset: xr.Dataset) -> dict[float, list[dict[str, float]]]:
    """W·R in G·L_x²·L_y -> both contacts that have it, the larger load first; the larger product first."""
    loads, radii = (dataset[name].values.tolist() for name in ("normal_load", "radius"))
    contacts = [{"normal_load": load, "radius": radius} for load in loads for radius in radii]
    found: dict[float, list[dict[str, float]]] = {}
    for contact in sorted(contacts, key=lambda each: -each["normal_load"]):
        product = float(f"{contact['normal_load'] * contact['radius']:.6g}")
        found.setdefault(product, []).append(contact)
    return {product: found[product] for product in sorted(found, reverse=True) if len(found[product]) > 1}


def of_starts(dataset: xr.Dataset, variable: str, contact: dict[str, float]) -> Number:
    """Mean of a variable over starts, with its ±; a displacement over the load."""
    unit = contact["normal_load"] if variable == "final_displacement" else 1.0
    return start_mean(dataset[variable].sel(contact).values.ravel() / unit)


def ratio(dataset: xr.Dataset, variable: str, place: int) -> Number:
    """A variable at the smaller load over that at the larger one, of one product by its place, with its ±."""
    larger, smaller = list(of_products(dataset).values())[place]
    below, above = (of_starts(dataset, variable, contact) for contact in (larger, smaller))
    quotient = above.value / below.value
    return Number(quotient, quotient * float(np.hypot(above.error / above.value, below.error / below.value)))


def draw(dataset: xr.Dataset) -> Figure:
    """F/W over displacement over W, of the first start: a panel for each product."""
    with column(2.4, PAGE) as figure:
        products = of_products(dataset)
        panels = figure.subplots(1, len(products), sharey=True)
        for axes, (product, contacts) in zip(panels, products.items(), strict=True):
            for color, contact in zip(COLORS, contacts, strict=False):
                line = dataset.nanoslip.teeth(start=float(dataset["start"][0]), **contact)
                label = typeset(f"W = {contact['normal_load']:g}, R = {contact['radius']:g}")
                x = line["displacement"].values / contact["normal_load"]
                axes.plot(x, line["friction_force"].values, color=color, linewidth=0.6, label=label)
            axes.set(title=typeset(f"W·R = {product:g} G·L_x²·L_y"), xlabel=typeset("displacement δ_p·G·L_y/W"))
            axes.legend(loc="lower right")
        panels[0].set_ylabel("F/W")
    return figure


def claims(dataset: xr.Dataset) -> Iterator[Claim]:
    """Plateau and displacement over load of each contact."""
    for product, contacts in of_products(dataset).items():
        for contact in contacts:
            plateau, way = (
                with_error(*of_starts(dataset, name, contact)) for name in ("plateau_mean", "final_displacement")
            )
            yield Claim(
                f"W·R = {product:g}: W = {contact['normal_load']:g}, R = {contact['radius']:g}", "", plateau, way
            )


NUMBERS: Final[Mapping[str, Any]] = {
    "plateau, wide": partial(ratio, variable="plateau_mean", place=0),
    "plateau, narrow": partial(ratio, variable="plateau_mean", place=1),
    "displacement over load, wide": partial(ratio, variable="final_displacement", place=0),
    "displacement over load, narrow": partial(ratio, variable="final_displacement", place=1),
}
SIMILAR: Final = CampaignFigure(
    "similar",
    "Friction over load, by the product of load and radius",
    "Records of 2000 events of the paper's slab, the first of 16 starts: contacts of one product W·R are equally wide, and all "
    "displacements scale with W. The table has means over 16 starts and their ±.",
    draw,
    claims,
    ("", "", "plateau F/W", "displacement over 2000 events, in W/(G·L_y)"),
)
