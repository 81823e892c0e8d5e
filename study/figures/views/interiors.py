"""Views of the inside of slabs: a map of the largest shear stress under the pin."""

from collections.abc import Iterator
from typing import Final

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from nanoslip.study.dataset.access import Accessor
from nanoslip.study.figures.points import Columns, label, typeset, words
from nanoslip.study.figures.shared import column
from nanoslip.study.figures.sweep import WIDTH
from nanoslip.study.figures.views.runs import Run, runs_of
from nanoslip.study.figures.views.view import Sort, View, register

LARGEST: Final = 99.5
"""Percentile of the stress at which the colours end: at an edge of a punch it is infinite."""


def columns(dataset: xr.Dataset, run: Run) -> Columns:
    """x, z (L_x), the three stresses and the largest shear stress, in W/(L_x·L_y), after the first event that is kept."""
    seen = Accessor(dataset).interior(**run.selection)
    here = seen.isel(event=0) if "event" in seen.dims else seen
    xx, zz, xz = (here[f"stress_{name}"].values for name in ("xx", "zz", "xz"))
    return {
        "x": here["x"].values,
        "z": here["z"].values,
        "stress_xx": xx,
        "stress_zz": zz,
        "stress_xz": xz,
        "largest_shear_stress": np.hypot(0.5 * (xx - zz), xz),
    }


def draw(table: Columns) -> Figure:
    """Colours between the nodes, as an image inside the picture."""
    stress = table["largest_shear_stress"]
    with column(3.0, WIDTH) as figure:
        axes = figure.add_subplot(aspect="equal")
        axes.grid(visible=False)
        mesh = axes.tripcolor(
            table["x"],
            table["z"],
            stress,
            shading="gouraud",
            rasterized=True,
            cmap="magma",
            vmin=0.0,
            vmax=np.percentile(stress, LARGEST),
        )
        figure.colorbar(mesh, ax=axes, label="largest shear stress, in $W/(L_xL_y)$", extend="max")
        axes.set(xlabel=typeset(label("x")), ylabel=typeset(label("z")))
    return figure


def views(dataset: xr.Dataset) -> Iterator[View]:
    """A map for each case whose inside is kept."""
    runs = runs_of(dataset, "interior")
    for run in runs:
        caption = f"Largest shear stress inside the slab{': ' + words(run.label) if run.label else ''}."
        yield View(
            f"interior_{run.number}",
            caption,
            lambda run=run: draw(columns(dataset, run)),  # type: ignore[misc]
            lambda run=run: columns(dataset, run),  # type: ignore[misc]
            run.label if len(runs) > 1 else {},
        )


register(Sort("interiors", "Inside of the slab", views))
