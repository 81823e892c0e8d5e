"""Shear of nodes over their limit while the pin slides: a locked lattice at the middle, with trains of full and empty nodes."""

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any, Final

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from nanoslip.solver.arrays import Floats
from nanoslip.solver.case import Case
from nanoslip.solver.contact.pin import node_friction
from nanoslip.solver.view import with_error
from nanoslip.study.figures.points import typeset
from nanoslip.study.figures.shared import DASHES, PAGE, CampaignFigure, Claim, Number, column, series_style, start_mean

TENTHS: Final = np.linspace(0.0, 1.0, 11)
"""Ends of the classes of shear over limit."""
MIDDLE: Final = (0.5, 0.6)
BETWEEN: Final = (0.1, 0.4)
DRAWN: Final[dict[str, Any]] = {"scheme": "half_plane", "n_x": 129, "spread": 0.0}
"""Contact whose successive events are drawn."""
HELD: Final = ("scheme", "n_x", "spread", "intrinsic_friction")
"""Parameters that fix the limits of nodes, with a seed."""


def over_limit(contact: xr.Dataset) -> tuple[Floats, Floats]:
    """Shear over limit of the nodes in contact, and their shares of the load; (nodes,) each."""
    touching = contact["pressure"].values > 0.0
    pressure, shear = (contact[name].values[touching] for name in ("pressure", "shear"))
    first = round((float(contact["x"].values[0]) + 0.5) * (int(contact["n_x"]) - 1))
    given = {name: contact[name].item() for name in HELD}
    seed = {"seed": int(contact["seed"])} if given["spread"] else {}
    limits = node_friction(Case.of({**given, **seed}), first)[: len(touching)][touching]
    return shear / (limits * pressure), pressure / pressure.sum()


def share(contact: xr.Dataset, low: float, high: float) -> float:
    """Share of the load on nodes whose shear is between these shares of their limit."""
    carried, load = over_limit(contact)
    return float(load[(carried >= low) & (carried < high)].sum())


def of_starts(dataset: xr.Dataset, event: int, low: float, high: float, **case: Any) -> Floats:
    """`share` of every start, (m,)."""
    contacts = (dataset.nanoslip.contact(event=event, start=start, **case) for start in dataset["start"].values)
    return np.array([share(contact, low, high) for contact in contacts])


def first_start(dataset: xr.Dataset) -> float:
    """The first start: its contacts stand for all where one is drawn."""
    return float(dataset["start"].values[0])


def events_of(dataset: xr.Dataset, **case: Any) -> list[int]:
    """Events after which a contact is seen."""
    return [
        int(event) for event in dataset.nanoslip.contact(start=first_start(dataset), **case)["event"].values.ravel()
    ]


def number(dataset: xr.Dataset, between: tuple[float, float], late: bool = False, **case: Any) -> Number:
    """Mean of a share over starts, with its ±, after the first or the last event at which contacts are seen."""
    event = events_of(dataset, **case)[-1 if late else 0]
    return start_mean(of_starts(dataset, event, *between, **case))


def contact_growth(dataset: xr.Dataset, **case: Any) -> Number:
    """By what share of them shear has added nodes to those that the load pressed down: mean over starts, with its ±."""
    event, added = events_of(dataset, **case)[-1], []
    for start in dataset["start"].values:
        touching = int((dataset.nanoslip.contact(event=event, start=start, **case)["pressure"] > 0.0).sum())
        added.append(touching / dataset["initial_contact_size"].sel(start=start, **case).item() - 1.0)
    return start_mean(np.array(added))


def cases_of(dataset: xr.Dataset) -> Iterator[dict[str, Any]]:
    """Each contact but for its start."""
    for scheme in dataset["scheme"].values.tolist():
        for n_x in dataset["n_x"].values.tolist():
            for spread in dataset["spread"].values.tolist():
                yield {"scheme": scheme, "n_x": n_x, "spread": spread}


def densities(dataset: xr.Dataset, **case: Any) -> Floats:
    """Share of the load in each of `TENTHS`, mean over starts, (10,)."""
    event, found = events_of(dataset, **case)[0], []
    for start in dataset["start"].values:
        carried, load = over_limit(dataset.nanoslip.contact(event=event, start=start, **case))
        inside = np.clip(carried, 0.0, 1.0)  # 1 but for rounding belongs to the last class
        found.append(np.histogram(inside, TENTHS, weights=load)[0])
    return np.asarray(np.mean(found, axis=0))


def draw(dataset: xr.Dataset) -> Figure:
    """Left: shares of the load over shear over limit; right: shear over limit of each node, event by event, of one start."""
    n_x = min(DRAWN["n_x"], int(dataset["n_x"].values[-1]))
    case = {**DRAWN, "n_x": n_x}
    with column(3.0, PAGE) as figure:
        left, right = figure.subplots(1, 2, width_ratios=(2, 3))
        for color, scheme in enumerate(dataset["scheme"].values.tolist()):
            for dashes, spread in zip(DASHES, dataset["spread"].values.tolist(), strict=False):
                shares = densities(dataset, scheme=scheme, n_x=n_x, spread=spread)
                label = f"{scheme}, spread {spread:g}"
                left.stairs(shares, TENTHS, color=series_style(color)["color"], linestyle=dashes, label=label)
        left.axhline(0.1, color="0.5", linestyle=":", label="evenly")
        left.set(xlabel=typeset("shear over limit"), ylabel="share of the load")
        figure.legend(*left.get_legend_handles_labels(), loc="outside upper center", ncols=5)
        first = first_start(dataset)
        frames = [
            dataset.nanoslip.contact(event=event, start=first, **case) for event in events_of(dataset, **case)[:-1]
        ]
        picture = np.full((len(frames), n_x), np.nan)
        for row, contact in enumerate(frames):
            touching = np.flatnonzero(contact["pressure"].values > 0.0)
            picture[row, touching] = over_limit(contact)[0]
        touched = np.flatnonzero(np.isfinite(picture).any(axis=0))
        nodes = np.arange(touched[0], touched[-1] + 2) - 0.5
        shown = right.pcolormesh(
            nodes, np.arange(len(frames) + 1) - 0.5, picture[:, touched[0] : touched[-1] + 1], vmin=0, vmax=1
        )
        figure.colorbar(shown, ax=right, label=typeset("shear over limit"))
        right.set(xlabel="node", ylabel="event")
        right.grid(visible=False)
    return figure


def claims(dataset: xr.Dataset) -> Iterator[Claim]:
    """Shares of the load in the middle and between, soon and late."""
    for case in cases_of(dataset):
        soon, late = (with_error(*number(dataset, MIDDLE, late=late, **case)) for late in (False, True))
        between = with_error(*number(dataset, BETWEEN, **case))
        yield Claim(f"{case['scheme']}, n_x = {case['n_x']}, spread {case['spread']:g}", soon, between, late)


NUMBERS: Final[Mapping[str, Any]] = {
    f"{scheme}, spread {spread:g}: {label}": partial(
        number, between=between, late=late, scheme=scheme, n_x=129, spread=spread
    )
    for scheme in ("half_plane", "biquadratic")
    for spread in (0.0, 0.1)
    for label, between, late in (("middle", MIDDLE, False), ("between", BETWEEN, False), ("middle, late", MIDDLE, True))
} | {
    f"{scheme}: area": partial(contact_growth, scheme=scheme, n_x=129, spread=0.0)
    for scheme in ("half_plane", "biquadratic")
}
SHARES: Final = CampaignFigure(
    "shares",
    "What nodes carry of their limit, in plane strain",
    "Left: share of the load on nodes by their shear over limit, at 129 nodes, means over 16 starts. Right: shear over limit of "
    "every node of one start, event by event (half-plane, equal nodes): a lattice near one half, and trains of full and empty "
    "nodes. Table: means over "
    "16 starts and their ±; late: 2000 events later.",
    draw,
    claims,
    ("share of the load on nodes that carry", "0.5 to 0.6 of their limit", "0.1 to 0.4", "0.5 to 0.6, late"),
)
