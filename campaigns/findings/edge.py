"""Static excess of equal contacts over the spacing of nodes, beside that of slip weakening (Papangelo, Ciavarella, Barber, 2015).

A cylinder slides at its edges with the kinetic coefficient, |x| > c. Its stick zone ends in a singular shear, as the contact of
JKR does: with s = c/a, and K the stress intensity factor that the edge sustains,

    Q = μ_k W (1 - s²) + K √(π c)

The first node of the stick zone slips where the mean of K/√(2πr) over its width h, 2K/√(2πh), is what its limit leaves,
(μ_i - μ_k) p(c). So K = (μ_i - μ_k) p(c) √(πh/2), with Hertz's p(c) = 2W/(πa) √(1 - s²), and

    Q/(μ_k W) = 1 - s² + κ √(s (1 - s²)),    κ = (μ_i/μ_k - 1) √(2h/a)

and the largest of it over s is the static friction. For a small κ, the excess is 3 (κ/4)^(4/3), which falls as (h/a)^(2/3).
"""

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any, Final

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from nanoslip.solver.view import with_error
from nanoslip.study.figures.points import typeset
from nanoslip.study.figures.shared import (
    CampaignFigure,
    Claim,
    Number,
    column,
    error_over_starts,
    exponent,
    series_style,
)


def closed_form(spacing: float, kinetic: float) -> float:
    """Excess Q/(μ_k W) - 1. spacing: h/a; kinetic: μ_k/μ_i."""
    kappa = (1.0 / kinetic - 1.0) * np.sqrt(2.0 * spacing)
    s = np.linspace(0.0, 1.0, 20001)
    return float(np.max(-(s**2) + kappa * np.sqrt(s * (1.0 - s**2))))


def found(case: xr.Dataset) -> Number:
    """Static excess of a slider, with its ± over sliders: records are of one length."""
    return Number(float(case["static_excess"]), float(error_over_starts(case, "static_excess")))


def predicted(case: xr.Dataset) -> float:
    """The closed form with the case's plateau and half-width."""
    spacing = 1.0 / (int(case["n_x"]) - 1) / float(case["contact_half_width"])
    return closed_form(spacing, float(case["plateau_ratio"]))


def nodes_of(case: xr.Dataset) -> float:
    """Spacings across one contact."""
    return 2.0 * float(case["contact_half_width"]) * (int(case["n_x"]) - 1)


def cases_of(dataset: xr.Dataset, residual: float) -> list[xr.Dataset]:
    """Cases of a residual shear, from the coarsest grid to the finest."""
    chosen = dataset.squeeze().sel(residual_shear=residual)
    return [chosen.isel(n_x=place) for place in range(chosen.sizes["n_x"])]


def over_closed_form(dataset: xr.Dataset, n_x: int, residual: float) -> Number:
    """Excess over the closed form, with its ±."""
    case = dataset.squeeze().sel(n_x=n_x, residual_shear=residual)
    value, error = found(case)
    return Number(value / predicted(case), error / predicted(case))


MANY: Final = 30
"""Nodes across a contact from which exponents are fitted."""


def exponent_of(dataset: xr.Dataset, residual: float) -> Number:
    """Exponent of the excess over the number of spacings, where contacts have many nodes."""
    cases = [case for case in cases_of(dataset, residual) if nodes_of(case) > MANY]
    spacings = np.array([int(case["n_x"]) - 1 for case in cases])
    return Number(*exponent(spacings, *np.array([found(case) for case in cases]).T))


def draw(dataset: xr.Dataset) -> Figure:
    """Excess over the nodes in contact, with the closed form."""
    with column() as figure:
        axes = figure.add_subplot()
        for number, residual in enumerate(dataset["residual_shear"].values.tolist()):
            cases = cases_of(dataset, residual)
            nodes = [nodes_of(case) for case in cases]
            values, errors = np.array([found(case) for case in cases]).T
            style = series_style(number, linestyle="", capsize=1.5)
            axes.errorbar(nodes, values, errors, label=f"r = {residual:g}", **style)
            axes.plot(nodes, [predicted(case) for case in cases], color=style["color"])
        axes.set(xscale="log", yscale="log", xlabel="nodes across a contact", ylabel=typeset("excess F_max/F - 1"))
        axes.legend()
    return figure


def claims(dataset: xr.Dataset) -> Iterator[Claim]:
    """Excess of each case beside the closed form; exponents."""
    for residual in dataset["residual_shear"].values.tolist():
        for case in cases_of(dataset, residual):
            nodes = f"{nodes_of(case):.0f} nodes across a contact"
            name = f"r = {residual:g}, n_x = {int(case['n_x'])}"
            yield Claim(name, f"{predicted(case):.3g}", with_error(*found(case)), nodes)
        yield Claim(
            f"r = {residual:g}: exponent over the spacings, from {MANY} nodes on",
            "-0.67",
            with_error(*exponent_of(dataset, residual)),
        )


NUMBERS: Final[Mapping[str, Any]] = {
    **{
        f"over the closed form, n_x = {n_x}": partial(over_closed_form, n_x=n_x, residual=0.0)
        for n_x in (33, 65, 129, 257)
    },
    "exponent": partial(exponent_of, residual=0.0),
    "over the closed form, half drops": partial(over_closed_form, n_x=129, residual=0.5),
}
EDGE: Final = CampaignFigure(
    "edge",
    "Static excess over the spacing of nodes, beside a closed form",
    "Highest force over plateau, less 1, of 16 equal contacts that came down sticking: means over 4 sliders and their ±. "
    "Lines: slip weakening after Papangelo, Ciavarella and Barber (2015), with the node spacing as their length.",
    draw,
    claims,
    ("", "closed form", "found", ""),
)
