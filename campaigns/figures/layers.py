"""Plateau, half-width and stiffness of a contact on an elastic layer, over Poisson's ratio and the layer's height."""

import csv
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np
import scipy
import xarray as xr
from matplotlib.figure import Figure

from nanoslip.solver.case import Case, Effects
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.validity import contact_half_width
from nanoslip.study.figures.points import typeset
from nanoslip.study.figures.shared import COLORS, CampaignFigure, Claim, column

HALF_WIDTH: Final = 0.2
"""Half-width of every contact without friction, in L_x."""
RATIOS: Final = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0)
"""Heights of the layer over the contact's half-width."""
POISSON: Final = {"strip": (0.0, 0.2, 0.3, 0.4, 0.45, 0.49, 0.5), "galerkin": (0.0, 0.2, 0.3)}
"""Poisson's ratios that each scheme is right at; a slab with ends is a layer up to RATIOS of 1 alone."""
COLUMNS: Final = ("scheme", "poisson", "aspect_ratio", "radius")
OBSERVABLES: Final = {
    "plateau_ratio": "plateau/μ_i",
    "contact_half_width": "half-width a/L_x",
    "surface_stiffness": "K/G",
}
"""Variable -> its label."""


def rows() -> Iterator[tuple[str, float, float, float]]:
    """The table of cases."""
    for scheme, every in POISSON.items():
        for poisson in every:
            for ratio in RATIOS if scheme == "strip" else RATIOS[:4]:
                height = ratio * HALF_WIDTH
                yield scheme, poisson, height, _radius(poisson, height)


def _radius(poisson: float, height: float) -> float:
    """Radius of the pin whose contact without friction has this half-width; to four digits."""
    slab, way = Slab(513, height, poisson, scheme="strip"), Effects(friction=False)
    compliance = surface_compliance(slab)

    def too_wide(logarithm: float) -> float:
        case = Case(slab=slab, radius=10.0**logarithm, normal_load=5e-4, effects=way)
        return contact_half_width(initial_contact(case, compliance)) - HALF_WIDTH

    return float(f"{10.0 ** float(scipy.optimize.brentq(too_wide, 1.0, 8.0, xtol=1e-5)):.4g}")


def of_scheme(dataset: xr.Dataset, scheme: str, poisson: float) -> xr.Dataset:
    """The cases of a scheme at this Poisson's ratio, by height."""
    flat = dataset.squeeze()
    chosen = (flat["scheme"] == scheme) & np.isclose(flat["poisson"], poisson)
    found = flat.isel({flat["poisson"].dims[0]: np.flatnonzero(chosen)})
    return found.sortby("aspect_ratio")


def value(found: xr.Dataset, name: str) -> tuple[Any, Any]:
    """An observable and its ±, each (heights,)."""
    uncertainty = f"{name}_uncertainty"
    return found[name].values, found[uncertainty].values if uncertainty in found else np.zeros(found[name].size)


def draw(dataset: xr.Dataset) -> Figure:
    """Each observable over height over half-width, a line for each Poisson's ratio; finite elements as circles."""
    with column(6.0) as figure:
        panels = figure.subplots(len(OBSERVABLES), 1, sharex=True)
        for axes, (name, label) in zip(panels, OBSERVABLES.items(), strict=True):
            for number, poisson in enumerate(POISSON["strip"]):
                color, found = COLORS[number % len(COLORS)], of_scheme(dataset, "strip", poisson)
                ratio, (values, errors) = found["aspect_ratio"] / HALF_WIDTH, value(found, name)
                line = "-" if poisson < 0.5 else "--"
                axes.errorbar(ratio, values, errors, fmt=line, capsize=1.5, color=color, label=f"ν = {poisson:g}")
                if poisson in POISSON["galerkin"]:
                    grid = of_scheme(dataset, "galerkin", poisson)
                    axes.plot(
                        grid["aspect_ratio"] / HALF_WIDTH, value(grid, name)[0], "o", color=color, fillstyle="none"
                    )
            axes.set(xscale="log", ylabel=typeset(label))
        panels[-1].set(xlabel=typeset("height over half-width, L_z/a"), yscale="log")
        panels[-1].set_xticks(RATIOS, [f"{ratio:g}" for ratio in RATIOS])
        panels[-1].minorticks_off()
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=4)
    return figure


def claims(dataset: xr.Dataset) -> Iterator[Claim]:
    """Report the range of plateaus and stiffness over ν and height, and where a grid agrees."""
    plateau = {poisson: value(of_scheme(dataset, "strip", poisson), "plateau_ratio") for poisson in POISSON["strip"]}
    for poisson, (values, errors) in plateau.items():
        remark = f"± at most {np.max(errors):.1g}"
        yield Claim(
            f"plateau/μ_i at ν = {poisson:g}, L_z/a from {RATIOS[0]:g} to {RATIOS[-1]:g}", "", _span(values), remark
        )
    for poisson in (POISSON["strip"][0], POISSON["strip"][-1]):
        stiffness, _ = value(of_scheme(dataset, "strip", poisson), "surface_stiffness")
        yield Claim(f"K/G at ν = {poisson:g}, thinnest → thickest", "", f"{stiffness[0]:.3g} → {stiffness[-1]:.3g}", "")
    for name in OBSERVABLES:
        change = [_beside_grid(dataset, name, poisson) for poisson in POISSON["galerkin"]]
        remark = f"ν up to {POISSON['galerkin'][-1]:g}, L_z/a up to {RATIOS[3]:g}: galerkin has sides"
        yield Claim(f"{OBSERVABLES[name]}, galerkin over strip, less 1", "", f"at most {max(change):.1%}", remark)


def _span(values: Any) -> str:
    return f"{np.min(values):.3f} to {np.max(values):.3f}"


def _beside_grid(dataset: xr.Dataset, name: str, poisson: float) -> float:
    strip, grid = (value(of_scheme(dataset, scheme, poisson), name)[0] for scheme in ("strip", "galerkin"))
    return float(np.abs(grid / strip[: len(grid)] - 1.0).max())


LAYERS: Final = CampaignFigure(
    "layers",
    "From incompressible films to half-spaces",
    "Plateau, half-width and stiffness of a contact on an elastic layer of height L_z, over L_z/a, for Poisson's ratios up to "
    "0.5: means over starts and their ±. Lines: scheme strip; circles: galerkin, a slab with sides. Half-width "
    "without friction: 0.2 L_x.",
    draw,
    claims,
)

if __name__ == "__main__":
    with Path(__file__).with_suffix(".csv").open("w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows([COLUMNS, *rows()])
