"""Views of events: how the sizes of the events of each record are distributed."""

from typing import Any, Final

import numpy as np
import xarray as xr

from solver.sliding.distributions.histogram import logarithmic_histogram
from study.dataset.access.accessor import Accessor
from study.figures.sweep.label import label
from study.figures.sweep.points import Columns
from study.figures.views.runs import Family, Need, Run, notes_of, views_of
from study.figures.views.view import Sort, register

FEWEST: Final = 100
"""Events of a record below which their distribution is not drawn."""


def columns(dataset: xr.Dataset, run: Run) -> Columns:
    """Middles of bins, share of events per unit of size, and events in each bin; of the plateau where there is one."""
    record = Accessor(dataset).record(**run.selection)
    start = float(record["plateau_start"]) if "plateau_start" in record else np.nan
    later = record["displacement"].values >= start if np.isfinite(start) else slice(None)
    found = logarithmic_histogram(record["event_slips"].values[later], discrete=True)
    seen = found.counts > 0
    return {"event_slips": found.middles[seen], "density": found.density[seen], "events": found.counts[seen]}


def draw(axes: Any, table: Columns, style: dict[str, Any]) -> None:
    """The distribution as points joined by lines."""
    axes.plot(table["event_slips"], table["density"], "o-", markersize=2, linewidth=0.5, **style)


SIZES: Final = Family(
    "sizes",
    "record",
    "Distribution of the node slips of an event, on the plateau, in bins of equal ratio",
    columns,
    draw,
    {"xlabel": label("event_slips"), "ylabel": "share of events", "xscale": "log", "yscale": "log"},
    Need("events", FEWEST, f"they have fewer than {FEWEST} events"),
)


def views(dataset: xr.Dataset) -> Any:
    """One figure of several records; none where the events are not counted."""
    if "events" in dataset:
        yield from (view for view in views_of(dataset, SIZES) if not view.place)


register(Sort("sizes", "Sizes of events", views, lambda dataset: notes_of(dataset, SIZES)))
