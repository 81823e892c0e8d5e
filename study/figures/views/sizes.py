"""Views of events: how the sizes of the events of each case are distributed."""

from collections.abc import Iterator
from typing import Any, Final

import numpy as np
import xarray as xr

from nanoslip.solver.sliding.power_law import LEAST_TAIL, SIGNIFICANT, density
from nanoslip.solver.view import with_error
from nanoslip.study.dataset.access import Accessor
from nanoslip.study.figures.points import Columns, label, typeset
from nanoslip.study.figures.views.runs import Family, Need, Run, notes_of, views_of
from nanoslip.study.figures.views.view import Sort, View, register

FITTED: Final = ("exponent", "exponent_uncertainty", "cutoff", "tail", "goodness")
"""Of the power law of slips."""


def columns(dataset: xr.Dataset, run: Run) -> Columns:
    """Middles of bins, share of events per unit of size, and events in each bin, of all members together.

    Beside them the power law, NaN below its cut-off and where its goodness of fit refuses it, with its exponent and goodness.
    """
    found = Accessor(dataset).event_sizes("slips", **run.selection)
    middles, events = found["bin_middle"].values, found["bin_events"].values
    exponent, uncertainty, cutoff, tail, goodness = (float(found[f"slips_{name}"]) for name in FITTED)
    law = np.full(len(middles), np.nan)
    if goodness >= SIGNIFICANT and np.isfinite(exponent):
        there = middles >= cutoff
        law[there] = tail / events.sum() * density(middles[there], exponent, cutoff, True)
    return {
        "event_slips": middles,
        "density": found["bin_density"].values,
        "events": events,
        "power_law": law,
        "exponent": np.full(len(middles), exponent),
        "exponent_uncertainty": np.full(len(middles), uncertainty),
        "goodness": np.full(len(middles), goodness),
    }


def draw(axes: Any, table: Columns, style: dict[str, Any]) -> None:
    """The distribution as points joined by lines, the power law dashed and named by its exponent."""
    if np.isfinite(table["power_law"]).any():
        named = f"τ = {with_error(float(table['exponent'][0]), float(table['exponent_uncertainty'][0]))}"
        style = style | {"label": f"{style['label']}: {named}" if "label" in style else named}
    axes.plot(table["event_slips"], table["density"], "o-", markersize=2, linewidth=0.5, **style)
    axes.plot(table["event_slips"], table["power_law"], "--", linewidth=1.4, color=style["color"])


SIZES: Final = Family(
    "sizes",
    "event_sizes",
    "Distribution of the node slips of an event, on all members' plateaus together, in bins of equal ratio; dashed: the "
    f"power law of exponent -τ of the largest, where its goodness of fit is {SIGNIFICANT:g} or more",
    columns,
    draw,
    {"xlabel": typeset(label("event_slips")), "ylabel": "share of events", "xscale": "log", "yscale": "log"},
    Need("sized_events", LEAST_TAIL, f"they have fewer than {LEAST_TAIL} events on the plateaus of enough members"),
    of_all=True,
)


def views(dataset: xr.Dataset) -> Iterator[View]:
    """One figure of several cases; none where the events are not counted."""
    yield from (view for view in views_of(dataset, SIZES) if not view.place)


register(Sort("sizes", "Sizes of events", views, lambda dataset: notes_of(dataset, SIZES)))
