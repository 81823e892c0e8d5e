"""Figures that a dataset calls for, by sort: its answer; contacts, drives, sizes of events, the inside of the slab, records."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, partial
from typing import Any, Final

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray

from nanoslip.solver.contact.closed_forms import HertzContact, MindlinLoops, smooth_contact
from nanoslip.solver.drive import Scales
from nanoslip.solver.slab import SCHEMES
from nanoslip.solver.sliding.power_law import LEAST_TAIL, SIGNIFICANT, density
from nanoslip.solver.view import with_error
from nanoslip.study.dataset.access import Accessor, run_id_name
from nanoslip.study.dataset.file import read_groups
from nanoslip.study.dataset.table import CaseRows, case_rows
from nanoslip.study.dataset.units import (
    is_given_in_si,
    label,
    label_in_symbols,
    read_scales,
    readable,
    si_factor,
    si_name,
)
from nanoslip.study.dataset.variables import MEASURES, SI, are_means
from nanoslip.study.figures.answer import answers, make_view
from nanoslip.study.figures.points import DrawnColumns, differing_axes, read_points, typeset
from nanoslip.study.figures.roles import assign_roles, is_scattered
from nanoslip.study.figures.shared import COLORS, WIDTH, Sort, View, best_fit_motion, column, legend, spread
from nanoslip.study.manifest.parameters import axis_unit

# Runs of a dataset (records, trajectories, contacts) as views: of many a few, spread over all axes.

HEIGHT: Final = 2.3
"""Height of a figure without its legend, in inches."""
LEGEND_LINE: Final = 0.15
"""Height of a line of a legend, in inches."""
LONG_NAME: Final = 30
"""Characters from which a name gets a separate line."""
MOST_RUNS: Final = len(COLORS)
"""Most runs that are drawn; more are thinned, spread over all axes."""


@dataclass(frozen=True, slots=True)
class RunNeed:
    """Condition to draw a run of a case: a lower bound on a number of the case."""

    variable: str
    least: float
    otherwise: str
    """Remark on runs without it: `they have no events`."""


@dataclass(frozen=True, slots=True, eq=False)
class DrawnRun:
    """One run of a group."""

    number: int
    label: dict[str, Any]
    """The coordinates in which its case differs from the others."""
    selection: dict[str, Any]
    """Selection for the accessor."""
    load: float = math.nan
    """Load of all contacts, in units of the scales."""


@dataclass(frozen=True, slots=True)
class DrawnAxis:
    """The numbers along an axis of a figure."""

    label: str
    """Meaning and unit, where numbers are in units of the scales."""
    columns: tuple[str, ...] = ()
    measure: str = ""
    """Measure of the columns, as L_x, or `W` of forces over load; or their unit in SI; empty of pure numbers."""
    meaning: str = ""
    """Label without a unit, where numbers are in SI."""

    def to_si(self, scales: Scales | None, load: float) -> float:
        """Factor to SI of the columns. load: W of the case in N. scales: None if numbers stay in units of these."""
        if scales is None or not self.is_converted:
            return 1.0
        return load if self.measure == FORCE else float(si_factor(scales, self.measure, load))

    @property
    def is_converted(self) -> bool:
        """True if the columns are in units of the scales."""
        return self.measure in (FORCE, *MEASURES)

    def unit(self, in_si: bool) -> str:
        """Unit of the columns in SI; empty if they are in units of the scales, or pure numbers."""
        if not self.is_converted:
            return self.measure
        return {FORCE: "N", **MEASURES}[self.measure] if in_si else ""


FORCE: Final = "W"
"""Measure of forces over the load of their case."""


@dataclass(frozen=True, slots=True)
class RunFamily:
    """Runs that are drawn alike."""

    name: str
    title: str
    """Title of their section of a page."""
    group: str
    """Group of the dataset."""
    caption: str
    columns: Callable[[xr.Dataset, DrawnRun], DrawnColumns]
    """The drawn numbers of a run."""
    draw: Callable[[Any, DrawnColumns, dict[str, Any]], None]
    """Draws one run on axes of matplotlib, with the settings of its main line."""
    x: "DrawnAxis"
    y: "DrawnAxis"
    axes: dict[str, Any] = field(default_factory=dict)
    """Scales."""
    color: "DrawnAxis | None" = None
    """Numbers that colours show."""
    need: RunNeed | None = None
    """Condition without which a figure would be empty."""
    of_all: bool = False
    """True if a run comprises all members of an ensemble, not only the first."""
    together: bool = True
    """True if several runs share a figure; else each run has a separate figure."""
    height: float = HEIGHT


def _total_loads(rows: CaseRows) -> NDArray[np.float64]:
    """(rows,) Load of all contacts of each case, in units of the scales; NaN in a dataset without loads."""
    if not rows.has("normal_load"):
        return np.full(len(rows), np.nan)
    contacts = rows.values("contacts") if rows.has("contacts") else 1.0
    return np.asarray(rows.values("normal_load") * contacts)


def list_runs(dataset: xr.Dataset, group: str, need: RunNeed | None = None) -> list[DrawnRun]:
    """The runs of a group, each once, though several cases share it; none if the dataset has no such group.

    need: runs of cases that lack it are left out.
    """
    if f"{group}_id" not in dataset or group not in read_groups(dataset):
        return []
    rows = case_rows(dataset, run_id_name(dataset, group))
    ids = rows.values(f"{group}_id").tolist()
    labels, positions = differing_axes(rows), rows.positions
    loads = _total_loads(rows)
    # Each run once, in the order of cases.
    names = dict.fromkeys(ids)
    distinct = [name for name in names if isinstance(name, str) and name]
    enough = np.ones(len(ids), np.bool_)
    if need and need.variable in dataset:
        enough = rows.values(need.variable) >= need.least
    runs = []
    # Numbers count all runs, also those that are left out: a figure keeps its name whatever a need demands.
    for number, name in enumerate(distinct, 1):
        row = ids.index(name)
        if enough[row]:
            # A slice, not an element: `tolist` of it has Python's own types, which labels are written with.
            label = {axis: values[row : row + 1].tolist()[0] for axis, values in labels.items()}
            selection = {dim: dataset[dim].values[places[row]] for dim, places in positions.items()}
            load = float(loads[row])
            runs.append(DrawnRun(number, label, selection, load))
    return runs


def draw_runs(dataset: xr.Dataset, family: RunFamily) -> Iterator[View | str]:
    """Figures of a few runs; and how many are not drawn, and why."""
    caption = family.caption
    if are_means(dataset) and not family.of_all:
        caption += ", of the first member"
    runs = list_runs(dataset, family.group, family.need)
    positions = spread([run.label for run in runs], MOST_RUNS)
    shown = [runs[position] for position in positions]
    counted = "all" if len(shown) == len(runs) else f"{len(shown)} of {len(runs)}, spread over all axes"
    scales = read_scales(dataset.attrs) if is_given_in_si(dataset) else None
    # Kept once computed: a figure shows a run, and a file holds its numbers.
    numbers = cache(partial(_columns_to_draw, family, dataset, scales))
    in_file = partial(_rename_sizes, family, numbers) if scales else numbers
    if family.together and len(shown) > 1:
        draw = partial(_draw_together, family, numbers, shown, scales is not None)
        columns = partial(_join_columns, in_file, shown)
        yield View(f"{family.name}_together", f"{caption}: {counted}.", draw, columns)
    else:
        for run in shown:
            which = f": {label_in_symbols(run.label)}" if run.label else ""
            draw = partial(_draw_together, family, numbers, [run], scales is not None)
            yield View(f"{family.name}_{run.number}", f"{caption}{which}.", draw, partial(in_file, run))
        if len(shown) < len(runs):
            yield f"Drawn: {counted}."
    if family.need:
        every = len(list_runs(dataset, family.group))
        yield from _remark_on_missing(family.need, len(runs), every)


FARTHEST_DRAWN: Final = 1e150
"""Largest number in a figure: squares and widths of larger numbers overflow in matplotlib."""


def _columns_to_draw(family: RunFamily, dataset: xr.Dataset, scales: Scales | None, run: DrawnRun) -> DrawnColumns:
    """Columns of a run, NaN where a number is too large to be drawn: somebody has put it into the file.

    scales: to have them in SI.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        columns = dict(family.columns(dataset, run))
        load = run.load * (scales.force if scales else 1.0)
        for axis in _all_axes(family):
            factor = axis.to_si(scales, load)
            for name in axis.columns:
                columns[name] = columns[name] * factor
    return {name: _drawable(values) for name, values in columns.items()}


def _all_axes(family: RunFamily) -> tuple[DrawnAxis, ...]:
    axes = (family.x, family.y)
    return (*axes, family.color) if family.color else axes


def _rename_sizes(family: RunFamily, numbers: Callable[[DrawnRun], DrawnColumns], run: DrawnRun) -> DrawnColumns:
    """Columns of a run; columns in SI have names that say so."""
    converted = {name for axis in _all_axes(family) if axis.is_converted for name in axis.columns}
    return {f"{name}{SI}" if name in converted else name: values for name, values in numbers(run).items()}


def _drawable(values: NDArray[Any]) -> NDArray[Any]:
    if values.dtype.kind != "f":
        return values
    return np.where(np.abs(values) <= FARTHEST_DRAWN, values, np.nan)


def _remark_on_missing(need: RunNeed, drawable: int, every: int) -> Iterator[str]:
    """Remark on runs that lack what a figure needs; none if all have it."""
    if drawable == 0 < every:
        yield f"None of {every} is drawn: {need.otherwise}."
    elif drawable < every:
        yield f"{every - drawable} of {every} are not drawn: {need.otherwise}."


def thin_line(x: NDArray[Any], y: NDArray[Any], bins: int = 300) -> NDArray[np.int64]:
    """Select points of a line that keep its look: the lowest and the highest in each bin of x, and the ends.

    x: (n,), rising. Returns rising indices; all where there are few.
    """
    if len(x) <= 2 * bins:
        return np.arange(len(x))
    # Without its ends, so that the last point lies in the last bin and not behind it.
    bin_edges = np.linspace(x[0], x[-1], bins + 1)
    inner_edges = bin_edges[1:-1]
    bin_of_point = np.digitize(x, inner_edges)
    # Bin by bin, in each from the lowest to the highest.
    order = np.lexsort((y, bin_of_point))
    is_first = np.diff(bin_of_point[order], prepend=-1)
    firsts = np.flatnonzero(is_first)
    lasts = np.append(firsts[1:], len(x)) - 1
    ends = [0, len(x) - 1]
    shown = np.concatenate((order[firsts], order[lasts], ends))
    return np.unique(shown)


def _join_columns(numbers: Callable[[DrawnRun], DrawnColumns], runs: Sequence[DrawnRun]) -> DrawnColumns:
    """The numbers of several runs one below the other, and beside them the case of each."""
    tables = []
    for run in runs:
        columns = dict(numbers(run))
        length = len(next(iter(columns.values())))
        case = np.full(length, label_in_symbols(run.label), dtype=object)
        tables.append({"case": case, **columns})
    parts = {name: [table[name] for table in tables] for name in tables[0]}
    return {name: np.concatenate(arrays) for name, arrays in parts.items()}


def _draw_together(
    family: RunFamily, numbers: Callable[[DrawnRun], DrawnColumns], runs: Sequence[DrawnRun], in_si: bool
) -> Figure:
    """Runs on one pair of axes; the figure grows by the legend of several. in_si: whether columns are in SI."""
    tables = [dict(numbers(run)) for run in runs]
    labels = [_scale_to_prefix(axis, tables, in_si) for axis in _all_axes(family)]
    with column(family.height, WIDTH) as figure:
        axes = figure.add_subplot()
        for color, run, table in zip(COLORS, runs, tables, strict=False):
            style = {"color": color}
            if len(runs) > 1:
                style["label"] = typeset(label_in_symbols(run.label))
            family.draw(axes, table, style)
        axes.set(xlabel=labels[0], ylabel=labels[1], **family.axes)
        if family.color:
            figure.axes[-1].set_ylabel(labels[2])
        _, names = axes.get_legend_handles_labels()
        if names:
            # Two long names side by side would be cut off at the figure's sides.
            columns = 1 if max(map(len, names)) > LONG_NAME else 2
            lines = math.ceil(len(names) / columns)
            figure.set_size_inches(WIDTH, family.height + LEGEND_LINE * lines)
            legend(figure, ncols=columns, markerscale=2.0)
    return figure


def _scale_to_prefix(axis: DrawnAxis, tables: Sequence[dict[str, NDArray[Any]]], in_si: bool) -> str:
    """Scale the columns of an axis to the unit with the prefix that suits the largest number; return the axis label."""
    unit = axis.unit(in_si)
    if not unit:
        return typeset(axis.label)
    sizes = [np.abs(table[name]) for table in tables for name in axis.columns]
    finite = [size[np.isfinite(size)] for size in sizes]
    maxima = [float(size.max(initial=0.0)) for size in finite]
    largest = max(maxima, default=0.0)
    factor, name_of_unit = axis_unit(largest, readable(unit))
    for table in tables:
        for name in axis.columns:
            table[name] = table[name] * factor
    return typeset(f"{axis.meaning} ({name_of_unit})")


# Views of contacts: pressure and shear of the surface nodes, with the closed form of a half-plane.

_BESIDE: Final = 0.25
"""Margin of a figure beside the contact, as a share of the contact's width."""


def contact_columns(dataset: xr.Dataset, run: DrawnRun) -> DrawnColumns:
    """Event, x, pressure, shear and the half-plane's pressure at initial contact, of the nodes in contact and a few more.

    Many nodes are thinned to nodes with the least and largest pressure or shear nearby.
    """
    contact = Accessor(dataset).row(**run.selection)
    # The selection of a single event removes its dimension.
    if "event" not in contact.dims:
        contact = contact.expand_dims("event")
    x = contact["x"].values
    near = _is_near_contact(x, contact["pressure"].values)
    x = x[near]
    pressure = contact["pressure"].values[:, near]
    shear = contact["shear"].values[:, near]
    # Events are thinned one by one: a node that matters after one of them may be hidden after another.
    curves = zip(pressure, shear, strict=True)
    nodes = [np.union1d(thin_line(x, p), thin_line(x, q)) for p, q in curves]
    counts = [len(places) for places in nodes]
    event = np.repeat(np.arange(len(nodes)), counts)
    node = np.concatenate(nodes)
    ideal = half_plane(contact, x)
    return {
        "event": contact["event"].values[event],
        "x": x[node],
        "pressure": pressure[event, node],
        "shear": shear[event, node],
        "half_plane_pressure": ideal[node],
    }


def half_plane(case: xr.Dataset, x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Pressure at x (n,) in W/(L_x·L_y) of a pin of this shape on a half-plane (half-space) without friction.

    Under a punch it is infinite at the edge (Boussinesq), where it is cut off. NaN of a scheme that is none.
    """
    scheme = str(case["scheme"].item()) if "scheme" in case else "half_plane"
    if scheme not in SCHEMES:
        return np.full(len(x), np.nan)
    layout = SCHEMES[scheme].LAYOUT
    contact = smooth_contact(layout)
    r = x
    # Of a plane of nodes these are the places of one row.
    if "y" in layout.AXES:
        across = float(case["y"].values[0])
        r = np.hypot(x, across)
    if str(case["pin"].item()) == "flat_punch":
        # Boussinesq's p = least/√(1 - (r/a)²): the integral over the strip, or the circle, has to be the load, here 1.
        a = float(case["half_width"])
        least = contact.punch_pressure(a)
        square = 1.0 - (r / a) ** 2
        root = np.sqrt(np.maximum(square, 0.0))
        # Cut off where 1 - (r/a)² falls below 1e-8: at the edge itself the pressure has no bound.
        outside = np.zeros(len(r))
        return np.divide(least, root, outside, where=root > 1e-4)
    # The ellipse or ellipsoid of Hertz's pressure has to bear the load, here 1.
    names = ("normal_load", "radius", "poisson")
    load, *shape = (float(case[name]) for name in names)
    a = contact.hertz(load, *shape)
    return HertzContact(a, contact.hertz_pressure(a)).pressure(r)


def draw_contacts(axes: Any, table: DrawnColumns, style: dict[str, Any]) -> None:
    """Pressure as dots, shear as a thin line, after each event; the half-plane's pressure dashed.

    Alone and after several events, each of them has its colour and its name.
    """
    events = dict.fromkeys(table["event"].tolist())
    told_apart = len(events) > 1 and "label" not in style
    for number, event in enumerate(events):
        of_event = table["event"] == event
        here = {name: values[of_event] for name, values in table.items()}
        if told_apart:
            style = {"color": COLORS[number % len(COLORS)], "label": f"after event {event}"}
        axes.plot(here["x"], here["pressure"], ".", markersize=2.5, **style)
        # One entry of the legend for each event or run: later lines have its colour and no label.
        style = {"color": style["color"]}
        if np.any(here["shear"]):
            axes.plot(here["x"], here["shear"], linewidth=0.5, **style)
    color = "black" if told_apart else style["color"]
    ideal = here["half_plane_pressure"]
    axes.plot(here["x"], ideal, "--", linewidth=0.6, color=color)


def _is_near_contact(x: NDArray[np.float64], pressure: NDArray[np.float64]) -> NDArray[np.bool_]:
    touching = x[(pressure > 0.0).any(axis=0)]
    if not len(touching):
        return np.ones(len(x), np.bool_)
    margin = _BESIDE * (touching[-1] - touching[0])
    first, last = touching[0] - margin, touching[-1] + margin
    return np.asarray((x >= first) & (x <= last))


CONTACT_VIEWS: Final = RunFamily(
    "contacts",
    "Pressure and shear",
    "contact",
    "Dots: pressure of the surface nodes; thin line: their shear, where there is any; dashed: pressure of the same pin on a "
    "half-plane without friction. Of more than 600 nodes those with the least and the most of their neighbourhood are drawn",
    contact_columns,
    draw_contacts,
    DrawnAxis(label("x"), ("x",), "L_x", "x from the slab's middle"),
    DrawnAxis("traction in W/(L_x·L_y)", ("pressure", "shear", "half_plane_pressure"), "W/(L_x·L_y)", "traction"),
)


# Views of driven pins: spring force against time, with Eq. 16-19 where they were fitted.


def drive_columns(dataset: xr.Dataset, run: DrawnRun) -> DrawnColumns:
    """Time (s), spring force over load, and the fitted force (NaN without a fit), thinned to the figure's
    resolution."""
    pulled = Accessor(dataset).trajectory(**run.selection)
    time, force = pulled["time"].values, pulled["sample_spring_force"].values
    model = best_fit_motion(pulled, read_scales(dataset.attrs), time)
    seen = thin_line(time, force)
    fit = np.full(len(time), np.nan)
    if model is not None:
        fit = model.spring_force
    return {"time": time[seen], "spring_force": force[seen], "fitted_spring_force": fit[seen]}


def draw_drives(axes: Any, table: DrawnColumns, style: dict[str, Any]) -> None:
    """Measured force as a line, the fitted one dashed on it."""
    time = table["time"]
    axes.plot(time, table["spring_force"], **style)
    fit = table["fitted_spring_force"]
    axes.plot(time, fit, "--", color="black", linewidth=0.5)


DRIVES: Final = RunFamily(
    "drives",
    "Drives",
    "trajectory",
    "Spring force against time; dashed: Eq. 16-19 with the coefficients that fit it best, where they were fitted",
    drive_columns,
    draw_drives,
    DrawnAxis("", ("time",), "s", "time"),
    DrawnAxis("spring force over load", ("spring_force", "fitted_spring_force"), FORCE, "spring force"),
)


# Views of stages that go to and fro: loops of spring force over the place of the stage, and of the pin.


def stage_columns(dataset: xr.Dataset, run: DrawnRun) -> DrawnColumns:
    """Place of the stage and of the pin (m), and spring force over load, along the last two cycles."""
    pulled = Accessor(dataset).trajectory(**run.selection)
    names = ("stage", "position", "spring_force")
    columns = {name: pulled[f"sample_{name}"].values for name in names}
    # A quarter of a cycle, then whole ones; the first ones are left out, as a pin just pressed down runs in.
    cycles = pulled.sizes["stage_leg"] // 2
    begin = 0
    if cycles > 1:
        steps = len(columns["stage"]) - 1
        # The last 8 of 4·cycles + 1 quarters.
        begin = steps - 8 * steps // (4 * cycles + 1)
    return {name: values[begin:] for name, values in columns.items()}


def draw_stages(axes: Any, table: DrawnColumns, style: dict[str, Any]) -> None:
    """Spring force over the stage as a line, over the pin as a thin one."""
    axes.plot(table["stage"], table["spring_force"], **style)
    thin = {"color": style["color"], "linewidth": 0.4}
    axes.plot(table["position"], table["spring_force"], **thin)


STAGES: Final = RunFamily(
    "stages",
    "Loops of the stage",
    "trajectory",
    "Spring force against the place of the stage, and against that of the pin (thin), along the last two cycles",
    stage_columns,
    draw_stages,
    DrawnAxis("", ("stage", "position"), "m", "place"),
    DrawnAxis("spring force over load", ("spring_force",), FORCE, "spring force"),
    need=RunNeed("loop_energy", -math.inf, "their stage keeps its direction, or they failed"),
)


def draw_stage_loops(dataset: xr.Dataset) -> Iterator[View | str]:
    """Loops of the drives whose stage goes to and fro, if there are any."""
    if STAGES.need is not None and STAGES.need.variable in dataset:
        yield from draw_runs(dataset, STAGES)


# Views of events: how the sizes of the events of each case are distributed.

FITTED: Final = ("exponent", "exponent_uncertainty", "goodness")
"""Fitted numbers of the power law of slips, in the table of a figure."""


def size_columns(dataset: xr.Dataset, run: DrawnRun) -> DrawnColumns:
    """Middles of bins, share of events per unit of size, and events in each bin, of all members together.

    Beside them the power law, NaN below its cut-off and where its goodness of fit refuses it, with its exponent and goodness.
    """
    sizes = Accessor(dataset).event_sizes("slips", **run.selection)
    middles, events = sizes["bin_middle"].values, sizes["bin_events"].values
    names = (*FITTED, "cutoff", "tail")
    fit = {name: float(sizes[f"slips_{name}"]) for name in names}
    law = np.full(len(middles), np.nan)
    if fit["goodness"] >= SIGNIFICANT and np.isfinite(fit["exponent"]):
        tail = middles >= fit["cutoff"]
        # The law is a density of the tail alone; the points are of all events.
        share = fit["tail"] / events.sum()
        of_tail = density(middles[tail], fit["exponent"], fit["cutoff"], True)
        law[tail] = share * of_tail
    columns = {"event_slips": middles, "density": sizes["bin_density"].values}
    columns |= {"events": events, "power_law": law}
    for name in FITTED:
        columns[name] = np.full(len(middles), fit[name])
    return columns


def draw_sizes(axes: Any, table: DrawnColumns, style: dict[str, Any]) -> None:
    """The distribution as points joined by lines, the power law dashed and named by its exponent."""
    if np.isfinite(table["power_law"]).any():
        exponent = float(table["exponent"][0])
        error = float(table["exponent_uncertainty"][0])
        label = f"τ = {with_error(exponent, error)}"
        if "label" in style:
            label = f"{style['label']}: {label}"
        style = {**style, "label": label}
    slips = table["event_slips"]
    axes.plot(slips, table["density"], "o-", markersize=2, linewidth=0.5, **style)
    axes.plot(slips, table["power_law"], "--", linewidth=1.4, color=style["color"])


SIZE_VIEWS: Final = RunFamily(
    "sizes",
    "Sizes of events",
    "event_sizes",
    "Distribution of the node slips of an event, on all members' plateaus together, in bins of equal ratio; dashed: the "
    f"power law of exponent -τ of the largest, where its goodness of fit is {SIGNIFICANT:g} or more",
    size_columns,
    draw_sizes,
    DrawnAxis(label("event_slips")),
    DrawnAxis("share of events"),
    {"xscale": "log", "yscale": "log"},
    need=RunNeed(
        "sized_events", LEAST_TAIL, f"they have fewer than {LEAST_TAIL} events on the plateaus of enough members"
    ),
    of_all=True,
)


# Views of the inside of slabs: a map of the largest shear stress under the pin.

SHADE_PERCENTILE: Final = 99.5
"""Percentile of the stress at which the colours end: at an edge of a punch it is infinite."""


def interior_columns(dataset: xr.Dataset, run: DrawnRun) -> DrawnColumns:
    """x, z (L_x), the three stresses and the largest shear stress, in W/(L_x·L_y), after the first event that is kept."""
    inside = Accessor(dataset).interior(**run.selection)
    if "event" in inside.dims:
        inside = inside.isel(event=0)
    names = ("x", "z", "stress_xx", "stress_zz", "stress_xz")
    columns = {name: inside[name].values for name in names}
    # The radius of Mohr's circle.
    half_difference = 0.5 * (columns["stress_xx"] - columns["stress_zz"])
    return {**columns, "largest_shear_stress": np.hypot(half_difference, columns["stress_xz"])}


def draw_interiors(axes: Any, table: DrawnColumns, style: dict[str, Any]) -> None:
    """Colours between the nodes, as an image inside the picture."""
    stress = table["largest_shear_stress"]
    axes.grid(visible=False)
    most = np.percentile(stress, SHADE_PERCENTILE)
    look = {"shading": "gouraud", "rasterized": True, "cmap": "magma"}
    # As vectors the triangles would make a page of tens of megabytes.
    mesh = axes.tripcolor(table["x"], table["z"], stress, vmin=0.0, vmax=most, **look)
    axes.figure.colorbar(mesh, ax=axes, extend="max")


INTERIORS: Final = RunFamily(
    "interior",
    "Inside of the slab",
    "interior",
    "Largest shear stress inside the slab",
    interior_columns,
    draw_interiors,
    DrawnAxis(label("x"), ("x",), "L_x", "x from the slab's middle"),
    DrawnAxis(label("z"), ("z",), "L_x", "depth z"),
    {"aspect": "equal"},
    DrawnAxis("largest shear stress in W/(L_x·L_y)", ("largest_shear_stress",), "W/(L_x·L_y)", "largest shear stress"),
    together=False,
    height=3.0,
)


# Views of friction records: F/W against the displacement of the pin.


def record_columns(dataset: xr.Dataset, run: DrawnRun) -> DrawnColumns:
    """Displacement and F/W of a record, both sides of each drop, thinned to the figure's resolution."""
    line = Accessor(dataset).teeth(**run.selection)
    x, force = line["displacement"].values, line["friction_force"].values
    seen = thin_line(x, force)
    return {"displacement": x[seen], "friction_force": force[seen]}


def draw_records(axes: Any, table: DrawnColumns, style: dict[str, Any]) -> None:
    """The record as a line."""
    axes.plot(table["displacement"], table["friction_force"], linewidth=0.6, **style)


RECORDS: Final = RunFamily(
    "records",
    "Friction records",
    "record",
    "Friction force over load against pin displacement",
    record_columns,
    draw_records,
    DrawnAxis(label("displacement"), ("displacement",), "L_x", "pin displacement δ_p"),
    DrawnAxis("friction force over load F/W"),
    need=RunNeed("events", 1, "they have no events"),
)


# Views of paths of pin and load: loops of F/W over displacement, loss over cycles, loss over amplitude with its closed form.


def path_columns(dataset: xr.Dataset, run: DrawnRun) -> DrawnColumns:
    """Displacement, F/W and leg of a path, each leg thinned to the figure's resolution."""
    line = Accessor(dataset).path(**run.selection)
    names = ("displacement", "friction", "leg")
    x, force, leg = (line[f"path_{name}"].values for name in names)
    numbers = np.unique(leg)
    legs = [np.flatnonzero(leg == number) for number in numbers]
    seen = [_leg_seen(x, force, places) for places in legs]
    # An empty array first, as there is nothing to join in a path without legs.
    shown = np.concatenate([np.arange(0), *seen])
    return {"displacement": x[shown], "friction_force": force[shown], "leg": leg[shown]}


def _leg_seen(x: NDArray[Any], force: NDArray[Any], here: NDArray[np.int64]) -> NDArray[np.int64]:
    """Points of a leg that keep its look, in their order."""
    # Bins need rising places, and every other leg goes back.
    rises = x[here[0]] <= x[here[-1]]
    forward = here if rises else here[::-1]
    seen = thin_line(x[forward], force[forward])
    return np.sort(forward[seen])


LOOPS: Final = RunFamily(
    "loops",
    "Loops",
    "path",
    "Friction force against pin displacement along the path",
    path_columns,
    draw_records,
    DrawnAxis(label("displacement"), ("displacement",), "L_x", "pin displacement δ_p"),
    DrawnAxis("friction force over load F/W", ("friction_force",), FORCE, "friction force F"),
)


def cycle_columns(dataset: xr.Dataset, run: DrawnRun) -> DrawnColumns:
    """Number of each cycle from 1, and the energy that it loses, in W·L_x."""
    path = Accessor(dataset).path(**run.selection)
    # A cycle is two legs; the first leg, up to the first turn, belongs to none.
    legs = 2 * int(path["cycles"])
    lost = path["leg_loss"].values[-legs:]
    complete = len(lost) // 2 * 2
    legs_of_cycles = lost[:complete].reshape(-1, 2)
    loss = legs_of_cycles.sum(axis=1)
    cycles = np.arange(1, len(loss) + 1)
    return {"cycle": cycles, "loss": loss}


def draw_cycles(axes: Any, table: DrawnColumns, style: dict[str, Any]) -> None:
    """Loss of each cycle as points joined by lines."""
    cycle, loss = table["cycle"], table["loss"]
    axes.plot(cycle, loss, "o-", markersize=2, linewidth=0.5, **style)


CYCLE_VIEWS: Final = RunFamily(
    "cycles",
    "Loss over cycles",
    "path",
    "Energy lost in each cycle",
    cycle_columns,
    draw_cycles,
    DrawnAxis("cycle"),
    DrawnAxis("energy lost in W·L_x", ("loss",), "W·L_x", "energy lost"),
    {"yscale": "log"},
    need=RunNeed("loss_per_cycle", -math.inf, "they have no cycles"),
)


def draw_answers(dataset: xr.Dataset) -> Iterator[View | str]:
    """The answers of a campaign; loss per cycle over amplitude has its closed form beside it."""
    for answer in answers(dataset):
        losses = None
        if isinstance(answer, View) and answer.name == si_name(dataset, "loss_per_cycle"):
            losses = _losses(dataset)
        yield losses or answer


def _losses(dataset: xr.Dataset) -> View | None:
    """Loss per cycle over amplitude, with Mindlin's closed form; None if cases are not lines over amplitude."""
    name = si_name(dataset, "loss_per_cycle")
    losses = read_points(dataset, name)
    closed_form = _mindlin(dataset)
    if name != "loss_per_cycle":
        # The closed form is in W·L_x: it takes the factor of each case that its number has.
        in_scales = read_points(dataset, "loss_per_cycle").values
        with np.errstate(invalid="ignore", divide="ignore"):
            closed_form = closed_form * losses.values / in_scales
    points = replace(losses, closed_form=closed_form)
    # A contact that is shaken down loses nothing, which has no place on a logarithmic axis.
    lossless = read_points(dataset, "shaken_down").values == 1.0
    points = points.select(~lossless)
    strokes = [si_name(dataset, name) for name in ("amplitude", "stroke")]
    along = [name for name in strokes if len(set(points.axes.get(name, ()))) > 1]
    # A closed form over the amplitude needs lines over the amplitude beside it.
    if not along or is_scattered(points) or assign_roles(points, along[0]).mapped:
        return None
    view = make_view(points, along[0])
    form = "Mindlin's closed form (Coulomb friction, half-plane without coupling), with the stiffness K of each case"
    caption = f"{view.caption} Dotted lines without marks: {form}."
    if lossless.any():
        caption += f" {lossless.sum()} shaken down, which lose nothing, not drawn."
    return replace(view, caption=caption)


def _mindlin(dataset: xr.Dataset) -> NDArray[np.float64]:
    """Closed form of the loss of each case, in W·L_x."""
    rows = case_rows(dataset, "loss_per_cycle")
    losses = []
    for amplitude, stiffness, poisson, friction, load in zip(
        rows.values("cycle_amplitude").tolist(),
        rows.values("path_stiffness").tolist(),
        # A chain has none.
        np.nan_to_num(rows.values("poisson")).tolist(),
        rows.values("intrinsic_friction").tolist(),
        rows.values("normal_load").tolist(),
        strict=True,
    ):
        loss = math.nan
        if stiffness > 0.0:
            # The amplitude is in μ_i·W/K, the closed form's in L_x.
            form = MindlinLoops(stiffness, poisson, friction * load)
            loss = float(form.loss(amplitude * form.bearing / stiffness)) / load
        losses.append(loss)
    return np.array(losses)


FAMILIES: Final = (CONTACT_VIEWS, DRIVES, SIZE_VIEWS, INTERIORS, RECORDS, LOOPS, CYCLE_VIEWS)
SORTS: Final = {
    "answer": Sort("answer", "Answer", draw_answers),
    STAGES.name: Sort(STAGES.name, STAGES.title, draw_stage_loops),
    **{family.name: Sort(family.name, family.title, partial(draw_runs, family=family)) for family in FAMILIES},
}
"""Every sort by name, in the order of a page."""
