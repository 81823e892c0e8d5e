"""Shared by all figures: drawing surface, tables of claims or numbers, and closed-form stick-slip of a drive."""

import io
import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import cycle
from pathlib import Path
from typing import Any, Final, NamedTuple

import matplotlib as mpl
import numpy as np
import xarray as xr
from cycler import cycler
from matplotlib import style
from matplotlib.backend_bases import get_registered_canvas_class
from matplotlib.figure import Figure
from numpy.typing import NDArray

from nanoslip.solver.arrays import Floats
from nanoslip.solver.drive import Drive, Scales
from nanoslip.solver.dynamics.regime import REGIMES
from nanoslip.solver.dynamics.stick_slip import stick_slip
from nanoslip.solver.ensemble import mean_of, student
from nanoslip.solver.outcome import InvalidInput
from nanoslip.solver.parameter import SHARED_ERROR
from nanoslip.solver.view import round_with_error
from nanoslip.study.dataset.units import read_scales
from nanoslip.study.figures.points import DrawnColumns, sort_values
from nanoslip.study.measured.columns import rows_as_csv

# A table of claims: the paper's statement, the dataset's number, and why the two differ.


class Claim(NamedTuple):
    """One number or statement of the paper beside the dataset's."""

    meaning: str
    paper: str
    found: str
    remark: str = ""
    """Reason of the difference, or the meaning of agreement."""


HEADER: Final = ("", "paper", "found", "remark")


def claim_rows(claims: Iterable[Sequence[str]], header: Sequence[str] = HEADER) -> list[tuple[str, ...]]:
    """The header and the rows of claims, without columns that are empty."""
    columns = list(zip(header, *claims, strict=True))
    # The first column has the meanings, whose title is empty.
    first, *others = columns
    kept = [first, *(column for column in others if any(column[1:]))]
    return list(zip(*kept, strict=True))


def table(claims: Iterable[Sequence[str]], header: Sequence[str] = HEADER) -> str:
    """Claims as a Markdown table, without columns that are empty."""
    head, *body = claim_rows(claims, header)
    rule = ("---",) * len(head)
    return "\n".join(map(_table_line, [head, rule, *body]))


def _table_line(cells: Sequence[str]) -> str:
    """Cells as a line of a Markdown table."""
    # A bar inside a cell would end it.
    escaped = [cell.replace("|", "\\|") for cell in cells]
    return f"| {' | '.join(escaped)} |"


class Number(NamedTuple):
    """A number of a dataset, and its ±."""

    value: float
    error: float


def start_mean(values: Any) -> Number:
    """The mean of a number over starts, and its ±."""
    mean = mean_of(np.asarray(values, float))
    return Number(float(mean.mean), float(mean.uncertainty))


def error_over_starts(cases: xr.Dataset, name: str) -> Floats:
    """Error of a number over starts alone: without what all of them share, as the length of their records.

    For numbers that are compared with each other at one length.
    """
    whole, shared = cases[f"{name}_uncertainty"].values, cases[f"{name}{SHARED_ERROR}"].values
    starts: Floats = np.sqrt(np.maximum(whole**2 - shared**2, 0.0))
    return starts


def average(numbers: Sequence[Number]) -> Number:
    """The mean of independent numbers."""
    values, errors = np.array(numbers).T
    # Independent errors add in squares.
    error = float(np.hypot.reduce(errors)) / len(numbers)
    return Number(float(values.mean()), error)


def start_statistics(values: NDArray[np.float64], digits: int = 4, scale: float = 1.0) -> str:
    """Mean, standard deviation and range of a number over the starts (any shape) of an ensemble; NaN do not count."""
    finite = scale * values[np.isfinite(values)]
    if not len(finite):
        return "in no start"
    low, high = finite.min(), finite.max()
    if low == high:
        return f"{low:.{digits}g} from every start" if len(finite) > 1 else f"{low:.{digits}g}"
    mean, deviation = round_with_error(finite.mean(), finite.std(ddof=1))
    return f"{mean} (s.d. {deviation}, {low:.{digits}g} to {high:.{digits}g})"


def exponent(at: Any, values: Any, errors: Any) -> tuple[float, float]:
    """Fit the exponent of a power law, and its ±; each value is weighted by its relative ±."""
    x, y = np.log(at), np.log(values)
    # The ± of a logarithm is the relative ±.
    weight = (values / errors) ** 2
    total = weight.sum()
    # About their weighted means slope and intercept have independent errors.
    x0, y0 = (weight @ x) / total, (weight @ y) / total
    square = weight @ (x - x0) ** 2
    product = weight @ ((x - x0) * (y - y0))
    slope = float(product / square)
    residuals = y - y0 - slope * (x - x0)
    # Two of the degrees of freedom are slope and intercept.
    scatter = float(weight @ residuals**2) / (len(x) - 2)
    # A scatter below 1 is luck: the ± of the values is known, and the slope is no better than they allow.
    error = np.sqrt(max(scatter, 1.0) / square)
    return slope, float(student(len(x) - 1) * error)


# A drawing surface at the width of a journal's column, and its files: the same dataset gives the same bytes.

COLUMN: Final = 3.35
"""Width of a journal's column, in inches (85 mm)."""
PAGE: Final = 7.0
"""Width of both columns, in inches (178 mm)."""
WIDTH: Final = 4.0
"""Width of a figure on a page of a dataset, in inches."""
COLORS: Final = ("#004580", "#d64a30", "#1e6d00", "#e0ab2c", "#4a0d55", "#969696")
"""Colors of lines, in their order; distinct in grey, too, by steps of 10 or more of their lightness L*."""
MARKERS: Final = ("o", "s", "^", "D", "v", "P")
DASHES: Final = ("-", "--", "-.", ":", (0, (8, 2)), (0, (8, 2, 1, 2, 1, 2)))
_COLORS_OF_REGIMES: Final = [COLORS[number] for number in (5, 1, 0, 3)]
REGIME_COLORS: Final[dict[str, str]] = dict(zip(REGIMES, _COLORS_OF_REGIMES, strict=True))
"""Color of each regime of a driven pin, in every figure."""

FIGURE_SETTINGS: Final[dict[Any, Any]] = {
    "font.size": 8.0,
    "figure.labelsize": 8.0,
    "axes.titlesize": 8.0,
    "axes.prop_cycle": cycler(color=COLORS),
    "xtick.labelsize": 7.0,
    "ytick.labelsize": 7.0,
    "legend.fontsize": 7.0,
    "legend.title_fontsize": 7.0,
    "legend.columnspacing": 1.0,
    "legend.handletextpad": 0.4,
    "legend.frameon": False,
    "lines.linewidth": 0.8,
    "axes.linewidth": 0.6,
    "axes.grid": True,
    "grid.alpha": 0.25,
    "grid.linewidth": 0.4,
    # TrueType: journals refuse matplotlib's Type 3 fonts, and text stays text.
    "pdf.fonttype": 42,
    # Otherwise names of clipping paths in an SVG are random.
    "svg.hashsalt": "nanoslip",
}
"""Settings of matplotlib for figures. One that the user has changed (matplotlibrc, a style sheet, `rcParams`) stays as it is."""
_FORMATS: Final[dict[str, dict[str, Any]]] = {
    # Matplotlib writes the time and its version: without them equal numbers give equal bytes.
    "pdf": {"metadata": {"CreationDate": None, "Producer": None, "Creator": "nanoslip"}},
    "svg": {"metadata": {"Date": None, "Creator": "nanoslip"}},
    "png": {"metadata": {"Software": None}, "dpi": 200},
}
FORMATS: Final = tuple(_FORMATS)


def file_format(path: Path, allowed: Sequence[str] = FORMATS) -> str:
    """Format by the ending of a file's name, in small or large letters. Raises InvalidInput."""
    form = path.suffix.removeprefix(".").lower()
    if form not in allowed:
        endings = ", ".join(f".{suffix}" for suffix in allowed)
        raise InvalidInput(f"{path}: needs a name that ends in {endings}")
    return form


def look() -> dict[Any, Any]:
    """The settings of `FIGURE_SETTINGS` that the user has left at matplotlib's own."""
    defaults = mpl.rcParamsDefault
    return {name: value for name, value in FIGURE_SETTINGS.items() if mpl.rcParams[name] == defaults[name]}


@contextmanager
def column(height: float = 2.4, width: float = COLUMN, make: Callable[..., Figure] = Figure) -> Iterator[Figure]:
    """An empty figure of this size in inches, to be drawn on inside the block. make: pyplot's `figure` gives it a window."""
    with mpl.rc_context(look()):
        yield make(figsize=(width, height), layout="constrained")


@contextmanager
def read_style(sheet: str = "") -> Iterator[None]:
    """Settings of a style sheet, a file or one of matplotlib's by its name. Raises InvalidInput if there is none."""
    with mpl.rc_context():
        try:
            style.use(sheet or {})
        except OSError:
            names = ", ".join(style.available)
            raise InvalidInput(f"{sheet}: no style sheet: needs a file, or one of {names}") from None
        yield


def resize_figure(figure: Figure, size: Sequence[float] = ()) -> Figure:
    """Resize a figure to this size in inches; without a size to the user's settings, if any."""
    theirs = mpl.rcParams["figure.figsize"]
    if size or theirs != mpl.rcParamsDefault["figure.figsize"]:
        figure.set_size_inches(*(size or theirs))
    return figure


def series_style(number: int, **look: Any) -> dict[str, Any]:
    """Colour and marker of the series of this number, small, and other settings of its line."""
    return {"color": COLORS[number], "marker": MARKERS[number], "markersize": 3, **look}


def series_styles() -> Iterator[dict[str, Any]]:
    """Colour, marker and dashes of successive series, without end; the user's property cycle has precedence."""
    looks = zip(MARKERS, DASHES, strict=True)
    ours = ({"marker": marker, "linestyle": dashes} for marker, dashes in looks)
    theirs = mpl.rcParams["axes.prop_cycle"]
    pairs = zip(cycle(ours), cycle(theirs), strict=False)
    return ({**first, **then} for first, then in pairs)


def legend(figure: Figure, **look: Any) -> bool:
    """One legend for all axes, above them; whether anything has a name. look: settings of matplotlib's legend."""
    handles, names = figure.axes[0].get_legend_handles_labels()
    if handles:
        defaults = {"loc": "outside upper center", "ncols": min(len(names), 6)}
        figure.legend(handles, names, **{**defaults, **look})
    return bool(handles)


def image(figure: Figure, form: str) -> bytes:
    """The figure as a file in one of the `FORMATS`, without a time stamp."""
    settings, buffer, dpi = _FORMATS[form], io.BytesIO(), figure.dpi
    with mpl.rc_context(look()):
        canvas = get_registered_canvas_class(form)(figure)
        figure.dpi = settings.get("dpi", dpi)
        # Matplotlib's savefig would draw all of it first, for its layout alone.
        getattr(canvas, f"print_{form}")(buffer, metadata=settings["metadata"])
    # A window may show the same figure: it keeps its resolution.
    figure.dpi = dpi
    return buffer.getvalue()


def edges(places: NDArray[np.float64], axis: Any) -> NDArray[np.float64]:
    """(n + 1,) ends of n tiles: halfway between neighbours on the scale of their axis (matplotlib's)."""
    scale = axis.get_transform()
    middles = scale.transform(np.asarray(places, float))
    # A single tile has no neighbour: it is one unit of its scale wide.
    steps = np.ones(1)
    if len(middles) > 1:
        steps = np.diff(middles)
    # Beyond the ends the steps go on as next to them.
    before = middles[0] - steps[0]
    after = middles[-1] + steps[-1]
    places_and_neighbours = np.concatenate(([before], middles, [after]))
    halfway = 0.5 * (places_and_neighbours[1:] + places_and_neighbours[:-1])
    return np.asarray(scale.inverted().transform(halfway))


# A figure of one campaign, with a table of claims: a script beside its file, of the same name, defines them.


@dataclass(frozen=True, slots=True)
class CampaignFigure:
    """A figure of a campaign."""

    name: str
    title: str
    caption: str
    draw: Callable[[xr.Dataset], Figure]
    claims: Callable[[xr.Dataset], Iterable[Claim]]
    """Claims below the figure; the remarks hold for the campaign as its file is."""
    header: tuple[str, ...] = HEADER
    campaign: str = ""
    """Name of the campaign, as `nanoslip campaigns` lists it; set when the script is found."""


# A view is a figure that a dataset calls for, with its numbers; and which of many alike are shown.


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """Figure of a dataset, drawn on request."""

    name: str
    """Stem of a file's name."""
    caption: str
    """Description of the picture's content, for readers and as its alternative text."""
    draw: Callable[..., Figure]
    """`make` as of `column`."""
    columns: Callable[[], DrawnColumns]
    """The numbers that are drawn."""


@dataclass(frozen=True, slots=True)
class Sort:
    """Views of the same sort."""

    name: str
    title: str
    of: Callable[[xr.Dataset], Iterator[View | str]]
    """Views that a dataset calls for, and sentences on omitted views; none if it has no data for this sort."""


def format_csv(columns: DrawnColumns) -> str:
    """Columns as CSV with a line of names; numbers have nine digits, missing ones are empty."""
    lists = [np.asarray(values).tolist() for values in columns.values()]
    columns_as_text = [map(_cell, cells) for cells in lists]
    rows = zip(*columns_as_text, strict=True)
    return rows_as_csv(itertools.chain([columns], rows))


def _cell(value: object) -> object:
    if not isinstance(value, float):
        return value
    return "" if math.isnan(value) else f"{value:.9g}"


# Choice of the few runs that are drawn of many, spread over the values of every axis.


def spread(places: Sequence[Mapping[str, Any]], most: int) -> list[int]:
    """Positions of at most `most` places, rising. Each axis is divided into parts, one for each value if possible.

    places: their coordinates; without any, along one axis in their order. A place costs 2^m for each place already taken that
    shares m parts with it, so single axes and pairs are balanced; of equals the nearest to its parts' middles is taken.
    """
    if len(places) <= most:
        return list(range(len(places)))
    columns: list[Sequence[Any]] = []
    for name in places[0]:
        columns.append([place[name] for place in places])
    if not columns:
        columns = [range(len(places))]
    shares = np.array([_axis_shares(values, most) for values in columns])
    parts = shares.astype(np.int64)
    distance = np.abs(shares % 1.0 - 0.5).sum(axis=0)
    cost = np.zeros(len(places))
    is_taken = np.zeros(len(places), np.bool_)
    for _ in range(most):
        # The last key comes first: a place is taken once.
        best = np.lexsort((distance, cost, is_taken))[0]
        is_taken[best] = True
        same_parts = parts == parts[:, best, None]
        shared_parts = same_parts.sum(axis=0)
        cost += 2.0**shared_parts
    return np.flatnonzero(is_taken).tolist()


def _axis_shares(values: Sequence[Any], most: int) -> Floats:
    """Positions of values along an axis that is divided into parts of length 1, at most `most`."""
    # By rank: each value has an equal share of the axis, however near the next one is.
    ranks = {value: rank for rank, value in enumerate(sort_values(values))}
    middles = np.array([ranks[value] for value in values]) + 0.5
    return middles / len(ranks) * min(len(ranks), most)


# The driven pin by Eq. 16-19 in SI, with given coefficients: what measured motion is compared with.

COEFFICIENTS = ("fitted_kinetic_friction", "fitted_static_friction", "fitted_later_static_friction")


@dataclass(frozen=True, slots=True, eq=False)
class ClosedForm:
    """Eq. 16-19 with given coefficients, in SI: time (s), position (m), velocity (m/s), spring force over W; each (n,)."""

    time: Floats
    position: Floats
    velocity: Floats
    spring_force: Floats


def campaign_scales(dataset: xr.Dataset) -> Scales:
    """The scales of a dataset of a shipped campaign, whose attributes state them."""
    scales = read_scales(dataset.attrs)
    assert scales is not None
    return scales


def analytic_motion(
    case: xr.Dataset, scales: Scales, time: Floats, kinetic: float, static: float, later_static: float
) -> ClosedForm:
    """The motion that Eq. 16-19 give at times (n,), in s from 0 on, for a case's drive with these coefficients."""
    names = ("spring_stiffness", "damping_ratio", "stage_velocity")
    parameters = {name: float(case[name]) for name in names}
    mass, load = float(case["pin_mass"]), float(case["normal_load"])
    duration = float(time[-1])
    drive = Drive.from_si(scales, mass, duration=duration, **parameters)
    unit = scales.time(mass)
    # Coefficients are over the load, forces of the solver in its own unit.
    limits = (kinetic * load, static * load, later_static * load)
    motion = stick_slip(time / unit, drive, *limits)
    position = scales.slab_width * motion.position
    velocity = scales.slab_width / unit * motion.velocity
    return ClosedForm(time, position, velocity, motion.spring_force / load)


def best_fit_motion(case: xr.Dataset, scales: Scales | None, time: Floats) -> ClosedForm | None:
    """Eq. 16-19 with the coefficients that fit a case's spring force best; None if nothing was fitted."""
    if scales is None or len(time) < 2:
        return None
    kinetic, static, later = (float(case.get(name, np.nan)) for name in COEFFICIENTS)
    if not np.isfinite(kinetic + static):
        return None
    # A single slip has no later one to fit: the pin sticks again as it did before.
    if np.isnan(later):
        later = static
    return analytic_motion(case, scales, time, kinetic, static, later)
