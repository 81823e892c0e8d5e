"""Views of driven pins: spring force against time, with Eq. 16-19 where they were fitted."""

from typing import Any, Final

import numpy as np
import xarray as xr

from nanoslip.study.dataset.access import Accessor
from nanoslip.study.figures.points import Columns
from nanoslip.study.figures.shared import fitted, scales_of
from nanoslip.study.figures.views.runs import Family, Run, thinned, views_of
from nanoslip.study.figures.views.view import Sort, register


def columns(dataset: xr.Dataset, run: Run) -> Columns:
    """Time (s), spring force over load, and the fitted one (NaN where nothing was fitted), thinned to what can be seen."""
    pulled = Accessor(dataset).trajectory(**run.selection)
    time, force = pulled["time"].values, pulled["sample_spring_force"].values
    model = fitted(pulled, scales_of(dataset.attrs), time)
    seen = thinned(time, force)
    fit = np.full(len(time), np.nan) if model is None else model.spring_force
    return {"time": time[seen], "spring_force": force[seen], "fitted_spring_force": fit[seen]}


def draw(axes: Any, table: Columns, style: dict[str, Any]) -> None:
    """Measured force as a line, the fitted one dashed on it."""
    time = 1e3 * table["time"]
    axes.plot(time, table["spring_force"], **style)
    axes.plot(time, table["fitted_spring_force"], "--", color="black", linewidth=0.5)


DRIVES: Final = Family(
    "drives",
    "trajectory",
    "Spring force over load against time; dashed: Eq. 16-19 with the coefficients that fit it best, where they were fitted",
    columns,
    draw,
    {"xlabel": "time (ms)", "ylabel": "spring force over load"},
)
register(Sort("drives", "Drives", lambda dataset: views_of(dataset, DRIVES)))
