"""Views of events: how the sizes of the events of each record are distributed."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, Final

import numpy as np
import xarray as xr

from solver.sliding.distributions.histogram import logarithmic_histogram
from solver.view import with_error
from study.dataset.access.accessor import Accessor
from study.figures.sweep.label import label, typeset
from study.figures.sweep.points import Columns
from study.figures.views.runs import Family, Need, Run, notes_of, views_of
from study.figures.views.view import Sort, View, register

FEWEST: Final = 100
"""Events of a record below which their distribution is not drawn."""
SCALING: Final = "slips_scaling"
"""What the variables of the scaling range of slips begin with."""
FITTED: Final = ("exponent", "exponent_uncertainty", "first", "last", "events")
"""And what they end with."""


def columns(dataset: xr.Dataset, run: Run) -> Columns:
    """Middles of bins, share of events per unit of size, and events in each bin; of the plateau where there is one.

    Beside them the power law of the scaling range, NaN outside of it, and its exponent with its uncertainty.
    """
    record = Accessor(dataset).record(**run.selection)
    start = float(record["plateau_start"]) if "plateau_start" in record else np.nan
    later = record["displacement"].values >= start if np.isfinite(start) else slice(None)
    found = logarithmic_histogram(record["event_slips"].values[later], discrete=True)
    seen = found.counts > 0
    middles = found.middles[seen]
    exponent, error, first, last, inside = (_scalar(record, f"{SCALING}_{name}") for name in FITTED)
    whole = np.arange(first, last + 1.0) if np.isfinite(exponent) else np.empty(0)
    share = inside / found.counts.sum() / np.sum(whole**-exponent) if len(whole) else np.nan
    law = np.where((middles >= first) & (middles <= last), share * middles**-exponent, np.nan)
    return {
        "event_slips": middles,
        "density": found.density[seen],
        "events": found.counts[seen],
        "power_law": law,
        "exponent": np.full(len(middles), exponent),
        "exponent_uncertainty": np.full(len(middles), error),
    }


def _scalar(record: xr.Dataset, name: str) -> float:
    return float(record[name]) if name in record else np.nan


def draw(axes: Any, table: Columns, style: dict[str, Any]) -> None:
    """The distribution as points joined by lines, the power law dashed and named by its exponent."""
    exponent, error = table["exponent"][:1], table["exponent_uncertainty"][:1]
    if np.isfinite(exponent).all():
        named = f"τ = {with_error(float(exponent[0]), float(error[0]))}"
        style = style | {"label": f"{style['label']}: {named}" if "label" in style else named}
    axes.plot(table["event_slips"], table["density"], "o-", markersize=2, linewidth=0.5, **style)
    axes.plot(table["event_slips"], table["power_law"], "--", linewidth=1.4, color=style["color"])


SIZES: Final = Family(
    "sizes",
    "record",
    "Distribution of the node slips of an event, on the plateau, in bins of equal ratio",
    columns,
    draw,
    {"xlabel": typeset(label("event_slips")), "ylabel": "share of events", "xscale": "log", "yscale": "log"},
    Need("events", FEWEST, f"they have fewer than {FEWEST} events"),
)


WITH_LAWS: Final = replace(
    SIZES, caption=f"{SIZES.caption}; dashed: the power law of exponent -τ in its scaling range, where there is one"
)


def views(dataset: xr.Dataset) -> Iterator[View]:
    """One figure of several records; none where the events are not counted."""
    if "events" in dataset:
        family = WITH_LAWS if f"{SCALING}_exponent" in dataset else SIZES
        yield from (view for view in views_of(dataset, family) if not view.place)


register(Sort("sizes", "Sizes of events", views, lambda dataset: notes_of(dataset, SIZES)))
