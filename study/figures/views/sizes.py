"""Views of events: how the sizes of the events of each record are distributed."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, Final

import numpy as np
import xarray as xr

from solver.sliding.distributions.power_law import SIGNIFICANT, density, logarithmic_histogram
from study.dataset.access.accessor import Accessor
from study.figures.sweep.label import label, typeset
from study.figures.sweep.points import Columns
from study.figures.views.runs import Family, Need, Run, notes_of, views_of
from study.figures.views.view import Sort, View, register

FEWEST: Final = 100
"""Events of a record below which their distribution is not drawn."""
FITTED: Final = ("slips_exponent", "slips_cutoff", "slips_tail", "slips_goodness")
"""The variables of the power law of slips."""


def columns(dataset: xr.Dataset, run: Run) -> Columns:
    """Middles of bins, share of events per unit of size, and events in each bin; of the plateau where there is one.

    Beside them the power law, NaN below its cut-off and where its goodness of fit refuses it, with its exponent and goodness.
    """
    record = Accessor(dataset).record(**run.selection)
    start = float(record["plateau_start"]) if "plateau_start" in record else np.nan
    later = record["displacement"].values >= start if np.isfinite(start) else slice(None)
    found = logarithmic_histogram(record["event_slips"].values[later], discrete=True)
    seen = found.counts > 0
    middles = found.middles[seen]
    exponent, cutoff, tail, goodness = (float(record[name]) if name in record else np.nan for name in FITTED)
    law = np.full(len(middles), np.nan)
    if goodness >= SIGNIFICANT and np.isfinite(exponent):
        there = middles >= cutoff
        law[there] = tail / found.counts.sum() * density(middles[there], exponent, cutoff, True)
    return {
        "event_slips": middles,
        "density": found.density[seen],
        "events": found.counts[seen],
        "power_law": law,
        "exponent": np.full(len(middles), exponent),
        "goodness": np.full(len(middles), goodness),
    }


def draw(axes: Any, table: Columns, style: dict[str, Any]) -> None:
    """The distribution as points joined by lines, the power law dashed and named by its exponent."""
    if np.isfinite(table["power_law"]).any():
        named = f"τ = {float(table['exponent'][0]):.3g}"
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
    SIZES,
    caption=f"{SIZES.caption}; dashed: the power law of exponent -τ of the largest, where its goodness of fit is {SIGNIFICANT:g} "
    "or more",
)


def views(dataset: xr.Dataset) -> Iterator[View]:
    """One figure of several records; none where the events are not counted."""
    if "events" in dataset:
        family = WITH_LAWS if FITTED[0] in dataset else SIZES
        yield from (view for view in views_of(dataset, family) if not view.place)


register(Sort("sizes", "Sizes of events", views, lambda dataset: notes_of(dataset, SIZES)))
