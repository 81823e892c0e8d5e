"""Views of friction records: F/W against the displacement of the pin."""

from typing import Any, Final

import xarray as xr

from nanoslip.study.dataset.access import Accessor
from nanoslip.study.figures.points import Columns, label, typeset
from nanoslip.study.figures.views.runs import Family, Need, Run, notes_of, thinned, views_of
from nanoslip.study.figures.views.view import Sort, register


def columns(dataset: xr.Dataset, run: Run) -> Columns:
    """Displacement and F/W of a record, both sides of each drop, thinned to what can be seen."""
    line = Accessor(dataset).teeth(**run.selection)
    x, force = line["displacement"].values, line["friction_force"].values
    seen = thinned(x, force)
    return {"displacement": x[seen], "friction_force": force[seen]}


def draw(axes: Any, table: Columns, style: dict[str, Any]) -> None:
    """The record as a line."""
    axes.plot(table["displacement"], table["friction_force"], linewidth=0.6, **style)


RECORDS: Final = Family(
    "records",
    "record",
    "Friction force over load against pin displacement",
    columns,
    draw,
    {"xlabel": typeset(label("displacement")), "ylabel": "friction force over load $F/W$"},
    Need("events", 1, "they have no events"),
)
register(
    Sort(
        "records",
        "Friction records",
        lambda dataset: views_of(dataset, RECORDS),
        lambda dataset: notes_of(dataset, RECORDS),
    )
)
