"""Figures that a dataset calls for, by sort: contacts, drives, sizes of events, the inside of the slab, records."""

from collections.abc import Iterator
from typing import Any, Final

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray

from nanoslip.solver.contact.closed_forms import flat_punch_pressure, hertz
from nanoslip.solver.sliding.power_law import LEAST_TAIL, SIGNIFICANT, density
from nanoslip.solver.view import with_error
from nanoslip.study.dataset.access import Accessor
from nanoslip.study.figures.points import Columns, label, typeset, words
from nanoslip.study.figures.shared import COLORS, column, fitted, scales_of
from nanoslip.study.figures.sweep import WIDTH
from nanoslip.study.figures.view import (
    Family,
    Need,
    Run,
    Sort,
    View,
    answers,
    notes,
    notes_of,
    runs_of,
    thinned,
    views_of,
)

# Views of contacts: pressure and shear of the surface nodes, with the closed form of a half-plane.

_BESIDE: Final = 0.25
"""How far beside the contact a figure reaches, as a share of its width."""


def contact_columns(dataset: xr.Dataset, run: Run) -> Columns:
    """Event, x, pressure, shear and the half-plane's pressure at initial contact, of the nodes in contact and a few more.

    Of many nodes those are left that can be told apart: where pressure or shear is least or largest nearby.
    """
    seen = Accessor(dataset).contact(**run.selection)
    seen = seen if "event" in seen.dims else seen.expand_dims("event")
    events, x = np.atleast_1d(seen["event"].values), seen["x"].values
    pressure, shear = (np.atleast_2d(seen[name].values) for name in ("pressure", "shear"))
    near = _near(x, pressure)
    x, pressure, shear = x[near], pressure[:, near], shear[:, near]
    shown = [np.union1d(thinned(x, p), thinned(x, q)) for p, q in zip(pressure, shear, strict=True)]
    theory = half_plane(seen, x)
    return {
        "event": np.repeat(events, [len(nodes) for nodes in shown]),
        "x": np.concatenate([x[nodes] for nodes in shown]),
        "pressure": np.concatenate([p[nodes] for p, nodes in zip(pressure, shown, strict=True)]),
        "shear": np.concatenate([q[nodes] for q, nodes in zip(shear, shown, strict=True)]),
        "half_plane_pressure": np.concatenate([theory[nodes] for nodes in shown]),
    }


def half_plane(case: xr.Dataset, x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Pressure at x (n,) in W/(L_x·L_y) that a pin of this shape has on a half-plane without friction."""
    if str(case["pin"].item()) == "flat_punch":
        half_width = float(case["half_width"])
        inside = np.abs(x) < half_width * (1.0 - 1e-9)
        return np.where(inside, flat_punch_pressure(np.where(inside, x, 0.0), half_width, 1.0), 0.0)
    load = float(case["normal_load"])
    return hertz(load, float(case["radius"]), float(case["poisson"])).pressure(x) / load


def draw_contacts(axes: Any, table: Columns, style: dict[str, Any]) -> None:
    """Pressure as dots, shear as a thin line, after each event; the half-plane's pressure dashed.

    Alone and after several events, each of them has its colour and its name.
    """
    events = dict.fromkeys(table["event"].tolist())
    told_apart = len(events) > 1 and "label" not in style
    for number, event in enumerate(events):
        here = {name: values[table["event"] == event] for name, values in table.items()}
        if told_apart:
            style = {"color": COLORS[number % len(COLORS)], "label": f"after event {event}"}
        axes.plot(here["x"], here["pressure"], ".", markersize=2.5, **style)
        style = {"color": style["color"]}
        if np.any(here["shear"]):
            axes.plot(here["x"], here["shear"], linewidth=0.5, **style)
    color = "black" if told_apart else style["color"]
    axes.plot(here["x"], here["half_plane_pressure"], "--", linewidth=0.6, color=color)


def _near(x: NDArray[np.float64], pressure: NDArray[np.float64]) -> NDArray[np.bool_]:
    touching = x[(pressure > 0.0).any(axis=0)]
    if not len(touching):
        return np.ones(len(x), np.bool_)
    margin = _BESIDE * (touching[-1] - touching[0])
    return np.asarray((x >= touching[0] - margin) & (x <= touching[-1] + margin))


CONTACTS: Final = Family(
    "contacts",
    "contact",
    "Dots: pressure of the surface nodes; thin line: their shear, where there is any; dashed: pressure of the same pin on a "
    "half-plane without friction. Of more than 600 nodes those with the least and the most of their neighbourhood are drawn",
    contact_columns,
    draw_contacts,
    {"xlabel": typeset(label("x")), "ylabel": "traction, in $W/(L_xL_y)$"},
)


# Views of driven pins: spring force against time, with Eq. 16-19 where they were fitted.


def drive_columns(dataset: xr.Dataset, run: Run) -> Columns:
    """Time (s), spring force over load, and the fitted one (NaN where nothing was fitted), thinned to what can be seen."""
    pulled = Accessor(dataset).trajectory(**run.selection)
    time, force = pulled["time"].values, pulled["sample_spring_force"].values
    model = fitted(pulled, scales_of(dataset.attrs), time)
    seen = thinned(time, force)
    fit = np.full(len(time), np.nan) if model is None else model.spring_force
    return {"time": time[seen], "spring_force": force[seen], "fitted_spring_force": fit[seen]}


def draw_drives(axes: Any, table: Columns, style: dict[str, Any]) -> None:
    """Measured force as a line, the fitted one dashed on it."""
    time = 1e3 * table["time"]
    axes.plot(time, table["spring_force"], **style)
    axes.plot(time, table["fitted_spring_force"], "--", color="black", linewidth=0.5)


DRIVES: Final = Family(
    "drives",
    "trajectory",
    "Spring force over load against time; dashed: Eq. 16-19 with the coefficients that fit it best, where they were fitted",
    drive_columns,
    draw_drives,
    {"xlabel": "time (ms)", "ylabel": "spring force over load"},
)


# Views of events: how the sizes of the events of each case are distributed.

FITTED: Final = ("exponent", "exponent_uncertainty", "cutoff", "tail", "goodness")
"""Of the power law of slips."""


def size_columns(dataset: xr.Dataset, run: Run) -> Columns:
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


def draw_sizes(axes: Any, table: Columns, style: dict[str, Any]) -> None:
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
    size_columns,
    draw_sizes,
    {"xlabel": typeset(label("event_slips")), "ylabel": "share of events", "xscale": "log", "yscale": "log"},
    Need("sized_events", LEAST_TAIL, f"they have fewer than {LEAST_TAIL} events on the plateaus of enough members"),
    of_all=True,
)


def size_views(dataset: xr.Dataset) -> Iterator[View]:
    """One figure of several cases; none where the events are not counted."""
    yield from (view for view in views_of(dataset, SIZES) if not view.place)


# Views of the inside of slabs: a map of the largest shear stress under the pin.

LARGEST: Final = 99.5
"""Percentile of the stress at which the colours end: at an edge of a punch it is infinite."""


def interior_columns(dataset: xr.Dataset, run: Run) -> Columns:
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


def draw_interiors(table: Columns) -> Figure:
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


def interior_views(dataset: xr.Dataset) -> Iterator[View]:
    """A map for each case whose inside is kept."""
    runs = runs_of(dataset, "interior")
    for run in runs:
        caption = f"Largest shear stress inside the slab{': ' + words(run.label) if run.label else ''}."
        yield View(
            f"interior_{run.number}",
            caption,
            lambda run=run: draw_interiors(interior_columns(dataset, run)),  # type: ignore[misc]
            lambda run=run: interior_columns(dataset, run),  # type: ignore[misc]
            run.label if len(runs) > 1 else {},
        )


# Views of friction records: F/W against the displacement of the pin.


def record_columns(dataset: xr.Dataset, run: Run) -> Columns:
    """Displacement and F/W of a record, both sides of each drop, thinned to what can be seen."""
    line = Accessor(dataset).teeth(**run.selection)
    x, force = line["displacement"].values, line["friction_force"].values
    seen = thinned(x, force)
    return {"displacement": x[seen], "friction_force": force[seen]}


def draw_records(axes: Any, table: Columns, style: dict[str, Any]) -> None:
    """The record as a line."""
    axes.plot(table["displacement"], table["friction_force"], linewidth=0.6, **style)


RECORDS: Final = Family(
    "records",
    "record",
    "Friction force over load against pin displacement",
    record_columns,
    draw_records,
    {"xlabel": typeset(label("displacement")), "ylabel": "friction force over load $F/W$"},
    Need("events", 1, "they have no events"),
)


SORTS: Final = {
    sort.name: sort
    for sort in (
        Sort("answer", "Answer", answers, notes),
        Sort("contacts", "Pressure and shear", lambda dataset: views_of(dataset, CONTACTS)),
        Sort("drives", "Drives", lambda dataset: views_of(dataset, DRIVES)),
        Sort("sizes", "Sizes of events", size_views, lambda dataset: notes_of(dataset, SIZES)),
        Sort("interiors", "Inside of the slab", interior_views),
        Sort(
            "records",
            "Friction records",
            lambda dataset: views_of(dataset, RECORDS),
            lambda dataset: notes_of(dataset, RECORDS),
        ),
    )
}
"""Every sort by name, in the order of a page."""
