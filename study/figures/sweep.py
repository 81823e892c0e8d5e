"""A variable over the axes of a campaign: lines, or a map of tiles, with a caption; in words where it does not differ."""

import itertools
import math
import textwrap
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import xarray as xr
from matplotlib import colormaps
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter
from matplotlib.transforms import offset_copy
from numpy.typing import NDArray

from nanoslip.solver.view import ROUNDING, with_error
from nanoslip.study.figures.points import (
    Floats,
    Points,
    UnknownNameError,
    axis_named,
    hyphenated,
    in_symbols,
    in_text,
    label,
    ordered,
    points_named,
    points_of,
    short,
    symbol,
    typeset,
    unevenness,
)
from nanoslip.study.figures.shared import (
    COLORS,
    REGIME_COLORS,
    WIDTH,
    View,
    column,
    edges,
    legend,
    resized,
    series_styles,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Assignment of coordinates to a figure: x axis, colours, panels. Those left over are held at one value.

MOST_HUES: Final = 6
"""Most lines in one panel that colours distinguish; more values make a map."""
MOST_PANELS: Final = 9
FILLED: Final = 0.5
"""Share of a full product from which a design counts as one; sparser ones are scattered."""


@dataclass(frozen=True, slots=True)
class Roles:
    """Coordinates by their place in a figure."""

    x: str
    hue: str = ""
    panels: tuple[str, ...] = ()
    held: Mapping[str, Any] = field(default_factory=dict)
    """Coordinates with too many values for panels, at the value that is shown."""
    mapped: bool = False
    """True if tiles are drawn: words, or many values of the hue, would make too many lines."""


def axis_sizes(points: Points) -> dict[str, int]:
    """Coordinate -> its number of values; numbers first, then by falling number."""
    counts = {name: len(set(values.tolist())) for name, values in points.axes.items()}
    return dict(sorted(counts.items(), key=lambda item: (points.axes[item[0]].dtype.kind in "OUb", -item[1])))


def together(points: Points, chosen: Collection[str] = ()) -> tuple[Points, str]:
    """Merge zipped coordinates to one, and return its name; unchanged, and "", if no single one distinguishes the cases.

    chosen: coordinates of which one is taken before others.
    """
    cases = len(set(zip(*(points.axes[name].tolist() for name in points.zipped), strict=True)))
    telling = [name for name, count in axis_sizes(points).items() if name in points.zipped and count == cases]
    wanted = [name for name in chosen if name in points.zipped] or telling[:1]
    if len(points.zipped) < 2 or len(wanted) != 1 or wanted[0] not in telling:
        return points, ""
    left_out = set(points.zipped) - set(wanted)
    return replace(points, axes={name: each for name, each in points.axes.items() if name not in left_out}), wanted[0]


def scattered(points: Points) -> bool:
    """True if the cases fill so little of the product of their coordinates that there are no lines to draw."""
    counts = axis_sizes(points)
    return len(counts) > 1 and len(points.values) < FILLED * math.prod(counts.values())


def roles_of(points: Points, x: str = "", hue: str = "") -> Roles:
    """Assign roles to all coordinates in which the cases differ: at least one. x, hue: chosen already.

    Raises ValueError if one is chosen twice, or the only one as hue.
    """
    counts = axis_sizes(points)
    left = [name for name in counts if name not in (x, hue)]
    if x == hue and x:
        raise ValueError(f"{x}: is x and hue: needs two axes")
    if not (x or left):
        raise ValueError(f"{hue}: the only axis: needs to be x, not hue")
    x = x or left.pop(0)
    hue = hue or (left.pop(0) if left else "")
    panels: list[str] = []
    held: dict[str, Any] = {}
    for name in left:
        if math.prod(counts[each] for each in (*panels, name)) <= MOST_PANELS:
            panels.append(name)
        else:
            values = values_of(points, name)
            held[name] = values[len(values) // 2]
    mapped = bool(hue) and (points.text or counts[hue] > MOST_HUES)
    return Roles(x, hue, tuple(panels), held, mapped)


def values_of(points: Points, name: str) -> list[Any]:
    """The values of a coordinate, as `ordered` has them."""
    return ordered(points.axes[name].tolist())


def held_at(points: Points, values: Mapping[str, Any]) -> Points:
    """The points with these values of coordinates."""
    chosen: NDArray[np.bool_] = np.ones(len(points.values), np.bool_)
    for name, value in values.items():
        chosen &= points.axes[name] == value
    return points.at(chosen)


# Positions of values along an axis: numbers on a linear or logarithmic scale, texts at equal distances.
#
# Beside a 0 such a scale is linear up to the smallest other number.

SPAN: Final = 8.0
"""Ratio of the largest to the smallest number from which a scale is logarithmic."""
CLOSE: Final = 30.0
"""Ratio of the largest to the smallest positive number above which the smallest is not visible beside a 0 on a linear scale."""
_TICKS: Final = 6
"""Values of a coordinate up to which each has its tick."""


def is_logarithmic(values: NDArray[Any]) -> bool:
    """True if numbers are positive, span at least the ratio `SPAN`, and lie more evenly in their logarithm."""
    numbers = np.unique(values[np.isfinite(values)])
    if len(numbers) < 2 or numbers[0] <= 0.0 or numbers[-1] < SPAN * numbers[0]:
        return False
    return len(numbers) == 2 or unevenness(np.log(numbers)) < unevenness(numbers)


def begins_with_zero(values: NDArray[Any]) -> bool:
    """True if numbers are a 0 and positive ones, the smallest of which would coincide with it on a linear scale."""
    numbers = np.unique(values[np.isfinite(values)])
    return len(numbers) > 2 and numbers[0] == 0.0 and bool(numbers[-1] > CLOSE * numbers[1])


def places_of(points: Points, name: str, chosen: Points) -> NDArray[Any]:
    """Positions of some of the points along a coordinate."""
    values = chosen.axes[name]
    if values.dtype.kind not in "Ob":
        return values
    order = values_of(points, name)
    return np.array([order.index(value) for value in values.tolist()], dtype=float)


def set_axis(axis: Any, points: Points, name: str) -> None:
    """Scale and ticks of an axis (matplotlib's) along which a coordinate runs."""
    values = values_of(points, name)
    if points.axes[name].dtype.kind in "Ob":
        axis.set_ticks(range(len(values)), list(map(in_text, values)))
        return
    if begins_with_zero(points.axes[name]):
        least, most = values[1], values[-1]
        room = max(math.log10(most / least) / len(values), 1.0)
        axis._set_axes_scale("symlog", linthresh=least, linscale=room)
    elif is_logarithmic(points.axes[name]):
        axis._set_axes_scale("log")
        if values[-1] < 100.0 * values[0]:
            set_few_ticks(axis)
    if len(values) <= _TICKS:
        axis.set_ticks(values, list(map(in_text, values)))
        axis.set_ticks([], minor=True)


def set_few_ticks(axis: Any) -> None:
    """Ticks of a logarithmic axis at 1, 2 and 5, as of powers of ten there would be one or two."""
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(lambda value, _: in_text(float(value)))
    axis.set_minor_formatter(NullFormatter())


# Panels of lines with error bars, a colour for each value of a second coordinate, or of tiles; or one for each coordinate.

FAILED: Final = "#c00000"
UNSURE: Final = "$?$"
"""Mark beside a point without a known uncertainty, which tables write as ± ?."""
SHORTEST: Final = 0.2
"""Share of a number at which its bar ends on a logarithmic axis, with an arrow, where it would go further down."""
MOST_COLUMNS: Final = 3
"""Panels side by side."""
LETTERS_UPWARDS: Final = 32
"""Most letters of an upright line beside a figure."""
LEGEND: Final = 0.35
"""Height of a legend, in inches."""


def panels_of(points: Points, roles: Roles) -> tuple[list[dict[str, Any]], int]:
    """The coordinates of each panel, and how many panels a row has: of several coordinates one runs along the rows."""
    values = {name: values_of(points, name) for name in roles.panels}
    names = sorted(values, key=lambda name: len(values[name]) if len(values[name]) <= MOST_COLUMNS else 0)
    panels = [dict(zip(names, each, strict=True)) for each in itertools.product(*(values[name] for name in names))]
    return panels, len(values[names[-1]]) if len(names) > 1 else columns_for(len(panels))


def columns_for(count: int) -> int:
    """Number of panels side by side, for this number of panels of one sort."""
    return 1 if count == 1 else 2 if count <= 4 else MOST_COLUMNS


def grid_of(figure: Figure, count: int, columns: int, **shared: Any) -> list[Any]:
    """Arrange `count` panels in rows of `columns`; several rows enlarge the figure."""
    rows = math.ceil(count / columns)
    figure.set_size_inches(WIDTH if columns < 3 else 1.5 * WIDTH, 2.5 if rows == 1 else 0.6 + 1.8 * rows)
    found = figure.subplots(rows, columns, squeeze=False, **shared).ravel().tolist()
    for spare in found[count:]:
        spare.set_visible(False)
    for lowest in found[:count][-columns:]:
        lowest.tick_params(labelbottom=True)
    return list(found[:count])


def figure_of(points: Points, roles: Roles, make: Callable[..., Figure] = Figure) -> Figure:
    """Lines over the first coordinate, or tiles over two, in a panel for each value of the others."""
    points = held_at(points, roles.held)
    draw: Callable[..., Any] = _draw_tiles if roles.mapped else _draw_lines
    with column(width=WIDTH, make=make) as figure:
        panels, columns = panels_of(points, roles)
        found = grid_of(figure, len(panels), columns, sharex=True, sharey=True)
        for axes, panel in zip(found, panels, strict=True):
            mesh = draw(axes, points, held_at(points, panel), roles)
            axes.set_title("\n".join(typeset(in_symbols({name: value})) for name, value in panel.items()))
        if roles.mapped:
            figure.supylabel(_lines(label(roles.hue)))
            if points.text:
                _legend_of_tiles(figure, names_of(points))
            else:
                figure.colorbar(mesh, ax=found, label=typeset(points.label))
        else:
            _finish(figure, points, typeset(short(roles.hue)) if roles.hue else "")
        figure.supxlabel(typeset(label(roles.x)))
    return figure


def draw_scattered(points: Points, make: Callable[..., Figure] = Figure) -> Figure:
    """One panel for each coordinate, each with all points: of a design that is no product."""
    names = list(axis_sizes(points))
    with column(width=WIDTH, make=make) as figure:
        for axes, name in zip(grid_of(figure, len(names), columns_for(len(names)), sharey=True), names, strict=True):
            x = places_of(points, name, points)
            steps = np.diff(x)
            one_way = bool((steps > 0).all() or (steps < 0).all())
            _draw_series(axes, points, points, x, next(series_styles()), line=one_way)
            set_axis(axes.xaxis, points, name)
            axes.set_xlabel(typeset(short(name)))
        _finish(figure, points)
    return figure


def _draw_lines(axes: Any, points: Points, here: Points, roles: Roles) -> None:
    """One line for each value of the hue, points alone over words."""
    line = points.axes[roles.x].dtype.kind not in "Ob"
    hues = [(in_text(value), {roles.hue: value}) for value in values_of(points, roles.hue)] if roles.hue else [("", {})]
    for style, (name, hue) in zip(series_styles(), hues, strict=False):
        series = held_at(here, hue)
        _draw_series(axes, points, series, places_of(points, roles.x, series), style, name, line)
    set_axis(axes.xaxis, points, roles.x)


def _draw_series(
    axes: Any, points: Points, series: Points, x: NDArray[Any], style: dict[str, Any], name: str = "", line: bool = True
) -> None:
    """Values with error bars, a question mark if unknown, hollow if flagged; crosses without a value."""
    color = style["color"]
    order = np.argsort(x, kind="stable")
    x, series = x[order], series.at(order)
    y, there = _heights(series, names_of(points)), series.there  # a line breaks at what is no number
    if series.text or len(set(x[there].tolist())) < there.sum() or not line:
        style = {**style, "linestyle": ""}
    errors, ends = np.nan_to_num(series.errors), far_below(points, series)
    lower = np.where(ends, (1.0 - SHORTEST) * np.nan_to_num(y), errors)
    axes.plot(x[ends], SHORTEST * y[ends], "v", markersize=2.6, color=color)
    bars = axes.errorbar(x, y, (lower, errors), markersize=2.8, capsize=1.6, label=name or None, **style)
    for bar in bars[2]:
        bar.set_linestyle("-")
    care = series.flagged & there
    axes.plot(x[care], y[care], style["marker"], markersize=2.0, color="white", zorder=5)
    beside = offset_copy(axes.transData, axes.figure, 3.5, 3.5, "points")
    look: dict[str, Any] = {"markersize": 3.6, "markeredgewidth": 0.3, "color": color, "linestyle": ""}
    marks = axes.plot(x[series.unsure], y[series.unsure], marker=UNSURE, clip_on=False, transform=beside, **look)
    bottom = np.full(int((~there).sum()), 0.02)
    crosses = axes.plot(x[~there], bottom, "x", color=FAILED, transform=axes.get_xaxis_transform(), zorder=6)
    for signs in (*marks, *crosses):
        signs.set_in_layout(False)


def far_below(points: Points, series: Points) -> NDArray[np.bool_]:
    """True if an error bar would stretch a logarithmic axis so far that nothing else is visible.

    points: all along that axis; series: the points to test.
    """
    if points.text or not is_logarithmic(points.values):
        return np.zeros(len(series.values), np.bool_)
    return np.asarray(series.there & (np.nan_to_num(series.errors) > (1.0 - SHORTEST) * series.values))


def _heights(points: Points, names: list[str]) -> Floats:
    """Numbers as they are; words by their places in a row of names; NaN where there is none."""
    if not points.text:
        return points.values
    order = {name: place for place, name in enumerate(names)}
    return np.array([order.get(value, np.nan) for value in points.values.tolist()], dtype=float)


def names_of(points: Points) -> list[str]:
    """The words that occur as values, each once. None of numbers."""
    if not points.text:
        return []
    return [name for name in dict.fromkeys(points.values.tolist()) if name]


def _named(figure: Figure, **look: Any) -> None:
    """A legend, if there is anything to be named, in room of its own above the panels."""
    if legend(figure, **look):
        figure.set_figheight(figure.get_figheight() + LEGEND)


def _lines(text: str) -> str:
    """A label that stands upright, in lines that the lowest figure has room for."""
    return "\n".join(typeset(line) for line in textwrap.wrap(text, LETTERS_UPWARDS, break_on_hyphens=False))


def _finish(figure: Figure, points: Points, title: str = "") -> None:
    """Scale and label of the y axis, and the legend with its title."""
    for axes in figure.axes:
        if points.text:
            names = names_of(points)
            axes.set_yticks(range(len(names)), [*map(hyphenated, names)])
            axes.set_ylim(-0.5, len(names) - 0.5)
        elif is_logarithmic(points.values):
            axes.set_yscale("log")
    figure.supylabel(_lines(points.label))
    _named(figure, title=title)


# Tiles.

LETTERS_OF_TILES: Final = 56
"""Letters of a legend that stand side by side above a figure: more would be cut off at its sides."""
MOST_VECTOR: Final = 500
"""Tiles up to which they stay shapes; more are an image inside the picture."""
MOST_SIGNS: Final = 2500
"""Tiles of a panel up to which each has room for a sign; among more the signs would hide them."""


def is_crowded(points: Points, roles: Roles) -> bool:
    """True if there are too many tiles for signs on them: doubtful tiles are hatched then, those without a value white."""
    counts = axis_sizes(points)
    return counts[roles.x] * counts[roles.hue] > MOST_SIGNS


def _draw_tiles(axes: Any, points: Points, here: Points, roles: Roles) -> Any:
    """A tile for each case, coloured by its value.

    Crosses are cases without one, dots those to be taken with care. Very many have none.
    """
    names = names_of(points)
    x, y = places_of(points, roles.x, here), places_of(points, roles.hue, here)
    columns, rows = (np.unique(places_of(points, name, points)) for name in (roles.x, roles.hue))

    def tiles(values: NDArray[Any], otherwise: float) -> Floats:
        """(rows, columns)"""
        found = np.full((len(rows), len(columns)), otherwise)
        found[np.searchsorted(rows, y), np.searchsorted(columns, x)] = values
        return found

    axes.grid(visible=False)
    for axis, name in ((axes.xaxis, roles.x), (axes.yaxis, roles.hue)):
        set_axis(axis, points, name)
    ends = [edges(values, axis) for values, axis in ((columns, axes.xaxis), (rows, axes.yaxis))]
    rasterized = len(rows) * len(columns) > MOST_VECTOR
    look: dict[str, Any] = {"rasterized": rasterized, "edgecolors": "face", "linewidth": 0.3}
    if here.differing:  # drawn without hairlines between the shapes
        look |= {"alpha": tiles(here.shares, 1.0), "edgecolors": "none", "rasterized": True}
    mesh = axes.pcolormesh(*ends, tiles(_heights(here, names), np.nan), **look, **_colors(points, names))
    care = here.flagged & here.there
    axes.set(xlim=ends[0][[0, -1]], ylim=ends[1][[0, -1]])
    for border in border_of(points, here, roles):
        axes.plot(*border, color="black", linewidth=1.2)
    if is_crowded(points, roles):
        inside = tiles(care, 0.0)
        if 0.0 < inside.mean() < 1.0:
            axes.contourf(columns, rows, inside, levels=[0.5, 1.5], colors="none", hatches=["//"])
        return mesh
    axes.plot(x[~here.there], y[~here.there], "x", markersize=4, color=FAILED)
    axes.plot(x[care], y[care], "o", markersize=2.4, color="white", markeredgecolor="black", markeredgewidth=0.4)
    return mesh


def border_of(points: Points, here: Points, roles: Roles) -> Iterator[tuple[Floats, Floats]]:
    """Line over a map of regimes above which the pin no longer sticks, if it is known: places along both axes.

    It is that of the stage's velocity, or else of the spring; each place has the mean of its drives.
    """
    for axis in (each for each in here.critical if each in (roles.x, roles.hue)):
        known = np.isfinite(here.critical[axis])
        if points.axes[axis].dtype.kind not in "Ob" and known.any():
            places = places_of(points, roles.x if axis == roles.hue else roles.hue, here)[known]
            along, which = np.unique(places, return_inverse=True)
            means = np.exp(np.bincount(which, np.log(here.critical[axis][known])) / np.bincount(which))
            yield (along, means) if axis == roles.hue else (means, along)
            return


def _colors(points: Points, names: list[str]) -> dict[str, Any]:
    if names:
        return {"cmap": ListedColormap(_palette(names)), "vmin": -0.5, "vmax": len(names) - 0.5}
    if is_logarithmic(points.values):
        return {"cmap": "viridis", "norm": "log"}
    return {"cmap": "viridis", "vmin": np.nanmin(points.values), "vmax": np.nanmax(points.values)}


def _palette(names: Sequence[str]) -> list[Any]:
    """A colour of each word, all different: regimes have their own; words can be more than there are in `COLORS`."""
    if set(names) <= REGIME_COLORS.keys():
        return [REGIME_COLORS[name] for name in names]
    count = len(names)
    return list(COLORS[:count] if count <= len(COLORS) else colormaps["turbo"](np.linspace(0.05, 0.95, count)))


def _legend_of_tiles(figure: Figure, names: list[str]) -> None:
    for color, name in zip(_palette(names), names, strict=True):
        figure.axes[0].plot([], [], "s", color=color, label=hyphenated(name))
    beside = LETTERS_OF_TILES // (max(map(len, names)) + len("■   "))
    _named(figure, ncols=max(min(len(names), beside), 1))


# Numbers that need no figure, told in one sentence: the same in all cases, known of one case only, or of none.


def differs(points: Points) -> bool:
    """True if a figure shows a difference: two values that differ by more than rounding."""
    values = points.values[points.there] if points.axes else points.values[:0]
    if points.text or not len(values):
        return len(set(values.tolist())) > 1
    return bool(np.ptp(values) > ROUNDING * np.abs(values).max())


def in_words(found: Sequence[Points]) -> Iterator[str]:
    """Sentences on numbers that do not differ, one each, and one sentence that names all numbers that no case has."""
    for points in found:
        if points.there.any():
            yield f"{sentence(points.label)}: {_value(points)}{_where(points)}{_care(points)}."
    unknown = [points.label for points in found if not points.there.any()]
    if unknown:
        yield f"Not known of any case: {', '.join(unknown)}."


def sentence(text: str) -> str:
    """A text that begins with a capital letter, or with a symbol as it is."""
    return text[0].upper() + text[1:] if text[0].isascii() else text


def _value(points: Points) -> str:
    first = int(np.flatnonzero(points.there)[0])
    value = points.values[first]
    if points.text:
        return hyphenated(value)
    return with_error(float(value), float(points.errors[first])) if points.stated else f"{value:.5g}"


def _care(points: Points) -> str:
    """List the doubtful values, which are hollow points in a figure."""
    flagged, known = int((points.flagged & points.there).sum()), int(points.there.sum())
    which = "" if flagged == known else f"{flagged} of them "
    return f"; {which}to be taken with care" if flagged else ""


def _where(points: Points) -> str:
    """Describe the cases that share a value, if all cases with a value do."""
    known, count = int(points.there.sum()), len(points.values)
    if count == 1:
        return ""
    if known == count:
        return " in all cases"
    if known > 1:
        return f" in all cases that have it, {known} of {count}"
    place = {name: values[points.there].tolist()[0] for name, values in points.axes.items()}
    return f" at {in_symbols(place)}, the only one of {count} that has it" if place else ""


# The answer of a campaign: its numbers over its axes, drawn as the design asks for.

OBSERVED: Final = (
    ("regime", ""),
    ("slips_exponent", ""),
    ("slips_goodness", ""),
    ("plateau_mean", "intrinsic_friction"),
    ("static_friction", "intrinsic_friction"),
    ("kinetic_friction", "intrinsic_friction"),
    ("mean_step", ""),
    ("contact_half_width", ""),
)
"""Variables of records and drives with their divisors, if these vary; first the ones that a campaign requests on purpose."""
LOOPED: Final = (("loss_per_cycle", ""), ("turn_friction", "intrinsic_friction"), ("secant_stiffness", ""))
"""Variables of loops with their divisors; their closure is of one draw, and is not drawn."""
PRESSED: Final = (("contact_half_width", ""), ("maximum_pressure", ""), ("approach", ""))
"""Variables drawn for a contact at rest."""


def answers(dataset: xr.Dataset) -> Iterator[View | str]:
    """A figure for each number that differs between cases, none of a single case; the others in words."""
    asked = list(_observed(dataset))
    yield from (view_of(points) for points in asked if differs(points))
    yield from in_words([points for points in asked if not differs(points)])


def _observed(dataset: xr.Dataset) -> Iterator[Points]:
    sort = OBSERVED if "plateau_mean" in dataset else LOOPED if "loss_per_cycle" in dataset else PRESSED
    for name, over in sort:
        if name in dataset and (not over or over in dataset.variables):
            alike = not over or np.unique(dataset[over]).size == 1
            yield points_of(dataset, name, "" if alike else over)


def view_of(points: Points, x: str = "", hue: str = "") -> View:
    """The figure of some points. x, hue: coordinates that the caller chooses. Raises UnknownNameError if all are alike."""
    if not points.axes:
        raise UnknownNameError(f"{points.name}: all cases are alike: there is nothing to draw it against")
    drawn, kept = together(points, (x, hue))
    if scattered(drawn) and not x:
        against, draw = f"against {' and '.join(map(symbol, axis_sizes(drawn)))}", partial(draw_scattered, drawn)
        signs = f"{_without(points)}{_members(points)}{_marks(points)}"
    else:
        roles = roles_of(drawn, x, hue)
        against, draw = _against(roles), partial(figure_of, drawn, roles)
        signs = _seen(held_at(drawn, roles.held), roles)
    with_it = f" {' and '.join(map(symbol, points.zipped))} vary together." if kept else ""
    caption = f"{sentence(points.label)}, {against}.{with_it}{signs}"
    return View(points.name.replace("/", "_over_"), caption, draw, points.columns)


def _against(roles: Roles) -> str:
    """Title: y against x, and the values of axes that are not shown."""
    panels = f", one panel for each {' and '.join(map(symbol, roles.panels))}" if roles.panels else ""
    held = (
        f"; drawn for {in_symbols(dict(roles.held))} only, counts in this caption are for all cases"
        if roles.held
        else ""
    )
    if roles.mapped:
        return f"over {symbol(roles.x)} and {symbol(roles.hue)}{panels}{held}"
    hue = f", one colour for each {symbol(roles.hue)}" if roles.hue else ""
    return f"against {symbol(roles.x)}{hue}{panels}{held}"


def _seen(points: Points, roles: Roles) -> str:
    """Meaning of the signs drawn for these points."""
    if roles.mapped and is_crowded(points, roles):
        care = int((points.flagged & points.there).sum())
        where = "All" if care == points.there.sum() else f"{care} of {len(points.values)}, hatched,"
        hatched = f" {where} are to be taken with care." if care else ""
        return _without(points, "White") + _members(points) + hatched
    paler = ", the paler the fewer" if roles.mapped else ""
    mixed = f" Of members that differ: what most do{paler}." if points.differing else ""
    flagged = " Dots: to be taken with care." if points.flagged[points.there].any() else ""
    border = roles.mapped and any(border_of(points, points, roles))
    above = " Black line: above it the pin no longer sticks." if border else ""
    return mixed + above + _without(points) + _members(points) + (flagged if roles.mapped else _marks(points))


def _without(points: Points, sign: str = "Red crosses") -> str:
    missing = int((~points.there).sum())
    return f" {sign}: {missing} without a value." if missing else ""


def _marks(points: Points) -> str:
    """Meaning of bars, question marks and hollow points, if any."""
    bars = " Bars: its uncertainty, where larger than the point." if np.isfinite(points.errors).any() else ""
    if far_below(points, points).any():
        bars += f" Arrows: down to less than {SHORTEST:.0%} of the number."
    if unsure := int(points.unsure.sum()):
        bars += f" Question marks: ± not known of {unsure} of {len(points.values)} points."
    hollow = " Hollow: to be taken with care." if points.flagged[points.there].any() else ""
    return bars + hollow


def _members(points: Points) -> str:
    """Report the number of means over fewer members than the ensemble has; empty if none."""
    lacking = points.lacking & points.there
    if not lacking.any():
        return ""
    least = int(points.members[lacking].min())
    return (
        f" Of {int(lacking.sum())} of {len(points.values)} points some members have no value; the least have {least}."
    )


def figure(dataset: xr.Dataset, y: str, x: str = "", hue: str = "", **where: Any) -> "Axes":
    """Draw a number of a dataset over its axes, with its ±: lines, a map of tiles, or points, as `nanoslip figure` does.

    y: a variable, its symbol, or a ratio of two, as `plateau/mu_i`. x, hue: axes; others become panels. where: selected values.
    Returns the axes of matplotlib, known to pyplot (the first of several panels). Raises UnknownNameError.

    >>> import nanoslip
    >>> data = nanoslip.open("results/mine")  # doctest: +SKIP
    >>> axes = nanoslip.figure(data, "plateau/mu_i", hue="R", normal_load=1e-3)  # doctest: +SKIP
    """
    from matplotlib import pyplot  # noqa: PLC0415  a page is drawn without windows

    first: Axes = resized(view_named(dataset, y, x, hue, where).draw(make=pyplot.figure)).axes[0]
    return first


def view_named(dataset: xr.Dataset, y: str, x: str, hue: str, where: Mapping[str, Any]) -> View:
    """The view of a number over axes, by the words that people have for them. Raises UnknownNameError, ValueError."""
    points = points_named(dataset, y, where)
    return view_of(points, *(axis_named(points, dataset, word) if word else "" for word in (x, hue)))
