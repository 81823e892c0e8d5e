"""Views of contacts: pressure and shear of the surface nodes, with the closed form of a half-plane."""

from typing import Any, Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from nanoslip.solver.contact.closed_forms import flat_punch_pressure, hertz
from nanoslip.study.dataset.access import Accessor
from nanoslip.study.figures.points import Columns, label, typeset
from nanoslip.study.figures.shared import COLORS
from nanoslip.study.figures.views.runs import Family, Run, thinned, views_of
from nanoslip.study.figures.views.view import Sort, register

_BESIDE: Final = 0.25
"""How far beside the contact a figure reaches, as a share of its width."""


def columns(dataset: xr.Dataset, run: Run) -> Columns:
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


def draw(axes: Any, table: Columns, style: dict[str, Any]) -> None:
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
    columns,
    draw,
    {"xlabel": typeset(label("x")), "ylabel": "traction, in $W/(L_xL_y)$"},
)
register(Sort("contacts", "Pressure and shear", lambda dataset: views_of(dataset, CONTACTS)))
