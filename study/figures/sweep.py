"""Drawings of a variable over the axes of a campaign: panels of lines with error bars, or a map of tiles."""

import itertools
import math
import textwrap
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.transforms import offset_copy
from numpy.typing import NDArray

from nanoslip.solver.arrays import Floats
from nanoslip.study.dataset.units import hyphenate, label_in_symbols
from nanoslip.study.figures.points import VELOCITY, Points, format_in_figure, typeset
from nanoslip.study.figures.roles import (
    Roles,
    axis_positions,
    axis_sizes,
    axis_values,
    is_logarithmic,
    select_points,
    set_axis,
)
from nanoslip.study.figures.shared import COLORS, REGIME_COLORS, WIDTH, column, edges, legend, series_styles

# Panels of lines with error bars, a colour for each value of a second coordinate, or of tiles; or one for each coordinate.

FAILED_COLOR: Final = "#c00000"
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


def make_panels(points: Points, roles: Roles) -> tuple[list[dict[str, Any]], int]:
    """The coordinates of each panel, and how many panels a row has: of several coordinates one runs along the rows."""
    values = {name: axis_values(points, name) for name in roles.panels}
    counts = {name: len(values[name]) for name in roles.panels}
    # The rows run along the coordinate with most values that still fit side by side, so that a column is one value.
    fitting = {name: count if count <= MOST_COLUMNS else 0 for name, count in counts.items()}
    names = sorted(counts, key=fitting.__getitem__)
    combinations = itertools.product(*(values[name] for name in names))
    panels = [dict(zip(names, combination, strict=True)) for combination in combinations]
    columns = panel_columns(len(panels))
    if len(names) > 1:
        columns = counts[names[-1]]
    return panels, columns


def panel_columns(count: int) -> int:
    """Number of panels side by side, for a total of `count` panels."""
    if count == 1:
        return 1
    return 2 if count <= 4 else MOST_COLUMNS


def arrange_panels(figure: Figure, count: int, columns: int, **shared: Any) -> list[Any]:
    """Arrange `count` panels in rows of `columns`; several rows enlarge the figure."""
    rows = math.ceil(count / columns)
    width = WIDTH if columns < 3 else 1.5 * WIDTH
    height = 2.5 if rows == 1 else 0.6 + 1.8 * rows
    figure.set_size_inches(width, height)
    axes = figure.subplots(rows, columns, squeeze=False, **shared)
    grid = axes.ravel().tolist()
    panels, spares = grid[:count], grid[count:]
    for spare in spares:
        spare.set_visible(False)
    # Shared axes hide the labels of all rows but the last, which may be shorter than the others.
    for lowest in panels[-columns:]:
        lowest.tick_params(labelbottom=True)
    return list(panels)


def draw_over_axes(points: Points, roles: Roles, make: Callable[..., Figure] = Figure) -> Figure:
    """Lines over the first coordinate, or tiles over two, in a panel for each value of the others."""
    points = select_points(points, roles.held)
    draw: Callable[..., Any] = _draw_tiles if roles.mapped else _draw_lines
    with column(width=WIDTH, make=make) as figure:
        panels, columns = make_panels(points, roles)
        grid = arrange_panels(figure, len(panels), columns, sharex=True, sharey=True)
        for axes, panel in zip(grid, panels, strict=True):
            mesh = draw(axes, points, select_points(points, panel), roles)
            titles = [label_in_symbols({name: value}, points.units) for name, value in panel.items()]
            axes.set_title("\n".join(map(typeset, titles)))
        if roles.mapped:
            figure.supylabel(_lines(points.axis_label(roles.hue)))
        if roles.mapped and points.text:
            _legend_of_tiles(figure, distinct_words(points))
        elif roles.mapped:
            # Colours of all panels have one scale, so one bar serves for all.
            figure.colorbar(mesh, ax=grid, label=typeset(points.label))
        else:
            title = typeset(points.axis_symbol(roles.hue)) if roles.hue else ""
            _finish(figure, points, title)
        figure.supxlabel(typeset(points.axis_label(roles.x)))
    return figure


def draw_scattered(points: Points, make: Callable[..., Figure] = Figure) -> Figure:
    """One panel for each coordinate, each with all points: of a design that is no product."""
    names = list(axis_sizes(points))
    with column(width=WIDTH, make=make) as figure:
        columns = panel_columns(len(names))
        panels = arrange_panels(figure, len(names), columns, sharey=True)
        for axes, name in zip(panels, names, strict=True):
            x = axis_positions(points, name, points)
            steps = np.diff(x)
            # Points that are not in the order of this coordinate would be joined to a tangle.
            rises, falls = bool((steps > 0).all()), bool((steps < 0).all())
            style = next(series_styles())
            _draw_series(axes, points, points, x, style, line=rises or falls)
            set_axis(axes.xaxis, points, name)
            axes.set_xlabel(typeset(points.axis_symbol(name)))
        _finish(figure, points)
    return figure


def _draw_lines(axes: Any, points: Points, here: Points, roles: Roles) -> None:
    """One line for each value of the hue, points alone over words."""
    line = points.axes[roles.x].dtype.kind not in "Ob"
    hues: list[dict[str, Any]] = [{}]
    if roles.hue:
        values = axis_values(points, roles.hue)
        hues = [{roles.hue: value} for value in values]
    for style, hue in zip(series_styles(), hues, strict=False):
        series = select_points(here, hue)
        x = axis_positions(points, roles.x, series)
        name = "".join(map(format_in_figure, hue.values()))
        _draw_series(axes, points, series, x, style, name, line)
    set_axis(axes.xaxis, points, roles.x)


def _draw_series(
    axes: Any, points: Points, series: Points, x: NDArray[Any], style: dict[str, Any], name: str = "", line: bool = True
) -> None:
    """Values with error bars, a question mark if unknown, hollow if flagged; crosses without a value."""
    # Lines join points in the order of the axis; a stable sort keeps that of the cases at one
    # place.
    order = np.argsort(x, kind="stable")
    x, series = x[order], series.select(order)
    # A line breaks at a missing value, which is NaN here.
    y = _heights(series, distinct_words(points))
    places = x[series.there]
    # A line through several points at one place would only go up and down there.
    distinct = len(set(places.tolist())) == len(places)
    if series.text or not distinct or not line:
        style = {**style, "linestyle": ""}
    errors, ends = np.nan_to_num(series.errors), far_below(points, series)
    shortened = (1.0 - SHORTEST) * np.nan_to_num(y)
    lower = np.where(ends, shortened, errors)
    arrow = {"markersize": 2.6, "color": style["color"]}
    axes.plot(x[ends], SHORTEST * y[ends], "v", **arrow)
    look = {"markersize": 2.8, "capsize": 1.6, "label": name or None, **style}
    bars = axes.errorbar(x, y, (lower, errors), **look)
    # The bars of a dashed line would be dashed, too.
    for bar in bars[2]:
        bar.set_linestyle("-")
    if np.isfinite(series.closed_form).any():
        color = style["color"]
        axes.plot(x, series.closed_form, ":", linewidth=1.2, color=color)
    _draw_signs(axes, series, x, y, style)


def _draw_signs(axes: Any, series: Points, x: NDArray[Any], y: Floats, style: dict[str, Any]) -> None:
    """A white middle for values to be taken with care, a question mark for unknown errors, a cross for no value."""
    care, missing = series.flagged & series.there, ~series.there
    white: dict[str, Any] = {"markersize": 2.0, "color": "white", "zorder": 5}
    axes.plot(x[care], y[care], style["marker"], **white)
    # Beside its point by a distance on paper, whatever the scales of the axes.
    beside = offset_copy(axes.transData, axes.figure, 3.5, 3.5, "points")
    look: dict[str, Any] = {"markersize": 3.6, "markeredgewidth": 0.3, "color": style["color"]}
    look |= {"marker": UNSURE, "linestyle": "", "clip_on": False, "transform": beside}
    marks = axes.plot(x[series.unsure], y[series.unsure], **look)
    # Within the frame, just above its lower edge: a missing value has no height of its own.
    bottom = np.full(int(missing.sum()), 0.02)
    frame = axes.get_xaxis_transform()
    cross: dict[str, Any] = {"color": FAILED_COLOR, "transform": frame, "zorder": 6}
    crosses = axes.plot(x[missing], bottom, "x", **cross)
    # Signs that stick out of the axes must not make these smaller.
    for signs in (*marks, *crosses):
        signs.set_in_layout(False)


def far_below(points: Points, series: Points) -> NDArray[np.bool_]:
    """True if an error bar would stretch a logarithmic axis so far that nothing else is visible.

    points: all along that axis; series: the points to test.
    """
    if points.text or not is_logarithmic(points.values):
        return np.zeros(len(series.values), np.bool_)
    far = np.nan_to_num(series.errors) > (1.0 - SHORTEST) * series.values
    return np.asarray(series.there & far)


def _heights(points: Points, names: list[str]) -> Floats:
    """Numbers as they are; words by their places in `names`; NaN for an empty word."""
    if not points.text:
        return points.values
    order = {name: place for place, name in enumerate(names)}
    values = points.values.tolist()
    places = [order.get(value, np.nan) for value in values]
    return np.array(places, dtype=float)


def distinct_words(points: Points) -> list[str]:
    """The words that occur as values, each once. None of numbers."""
    if not points.text:
        return []
    distinct = dict.fromkeys(points.values.tolist())
    return [name for name in distinct if name]


def _add_legend(figure: Figure, **look: Any) -> None:
    """Add a legend, if any line has a label, in extra space above the panels."""
    if legend(figure, **look):
        figure.set_figheight(figure.get_figheight() + LEGEND)


def _lines(text: str) -> str:
    """A label that stands upright, in lines that the lowest figure has room for."""
    lines = textwrap.wrap(text, LETTERS_UPWARDS, break_on_hyphens=False)
    return "\n".join(map(typeset, lines))


def _finish(figure: Figure, points: Points, title: str = "") -> None:
    """Scale and label of the y axis, and the legend with its title."""
    for axes in figure.axes:
        if points.text:
            names = distinct_words(points)
            words = list(map(hyphenate, names))
            axes.set_yticks(range(len(names)), words)
            axes.set_ylim(-0.5, len(names) - 0.5)
        elif is_logarithmic(points.values):
            axes.set_yscale("log")
    figure.supylabel(_lines(points.label))
    _add_legend(figure, title=title)


# Tiles.

LETTERS_OF_TILES: Final = 56
"""Letters of a legend that stand side by side above a figure: more would be cut off at its sides."""
MOST_VECTOR: Final = 500
"""Tiles up to which they stay shapes; more are an image inside the picture."""
MOST_SIGNS: Final = 2500
"""Tiles of a panel up to which each has room for a sign; among more the signs would hide them."""


def is_crowded(points: Points, roles: Roles) -> bool:
    """True if there are too many tiles for signs on them: then doubtful tiles are hatched, and tiles without a value
    are white."""
    counts = axis_sizes(points)
    return counts[roles.x] * counts[roles.hue] > MOST_SIGNS


def _draw_tiles(axes: Any, points: Points, here: Points, roles: Roles) -> Any:
    """A tile for each case, coloured by its value.

    Crosses are cases without a value, dots are flagged cases. Very many have none.
    """
    tiles = _tiles(points, here, roles)
    axes.grid(visible=False)
    set_axis(axes.xaxis, points, roles.x)
    set_axis(axes.yaxis, points, roles.hue)
    across = edges(tiles.columns, axes.xaxis)
    up = edges(tiles.rows, axes.yaxis)
    rasterized = len(tiles.rows) * len(tiles.columns) > MOST_VECTOR
    look: dict[str, Any] = {"rasterized": rasterized, "edgecolors": "face", "linewidth": 0.3}
    if here.differing:
        # Shapes that are pale would show the hairlines between them.
        paleness = tiles.fill(here.shares, 1.0)
        look |= {"alpha": paleness, "edgecolors": "none", "rasterized": True}
    names = distinct_words(points)
    values = tiles.fill(_heights(here, names), np.nan)
    look |= _colors(points, names)
    mesh = axes.pcolormesh(across, up, values, **look)
    ends = [0, -1]
    axes.set(xlim=across[ends], ylim=up[ends])
    for x, y in critical_border(points, here, roles):
        axes.plot(x, y, color="black", linewidth=1.2)
    if is_crowded(points, roles):
        _hatch_tiles(axes, tiles, here)
    else:
        _mark_tiles(axes, tiles, here)
    return mesh


@dataclass(frozen=True, slots=True, eq=False)
class _Tiles:
    """Positions of cases, (n,), and the columns and rows of the tiles that they lie on."""

    x: Floats
    y: Floats
    columns: Floats
    rows: Floats

    def fill(self, values: NDArray[Any], otherwise: float) -> Floats:
        """(rows, columns) Values of the cases (n,), `otherwise` on tiles without a case."""
        shape = (len(self.rows), len(self.columns))
        array = np.full(shape, otherwise)
        row = np.searchsorted(self.rows, self.y)
        column = np.searchsorted(self.columns, self.x)
        array[row, column] = values
        return array


def _tiles(points: Points, here: Points, roles: Roles) -> _Tiles:
    # Columns and rows are those of all panels: a panel that lacks some has empty tiles there.
    x = axis_positions(points, roles.x, points)
    y = axis_positions(points, roles.hue, points)
    return _Tiles(
        x=axis_positions(points, roles.x, here),
        y=axis_positions(points, roles.hue, here),
        columns=np.unique(x),
        rows=np.unique(y),
    )


def _hatch_tiles(axes: Any, tiles: _Tiles, here: Points) -> None:
    """Hatch the tiles to be taken with care, unless that are all or none."""
    care = tiles.fill(here.flagged & here.there, 0.0)
    if 0.0 < care.mean() < 1.0:
        look: dict[str, Any] = {"levels": [0.5, 1.5], "colors": "none", "hatches": ["//"]}
        axes.contourf(tiles.columns, tiles.rows, care, **look)


def _mark_tiles(axes: Any, tiles: _Tiles, here: Points) -> None:
    """A cross on each tile without a value, a dot on each that is to be taken with care."""
    missing, care = ~here.there, here.flagged & here.there
    cross = {"markersize": 4, "color": FAILED_COLOR}
    axes.plot(tiles.x[missing], tiles.y[missing], "x", **cross)
    dot = {"markersize": 2.4, "color": "white", "markeredgecolor": "black", "markeredgewidth": 0.4}
    axes.plot(tiles.x[care], tiles.y[care], "o", **dot)


def critical_border(points: Points, here: Points, roles: Roles) -> Iterator[tuple[Floats, Floats]]:
    """Line over a map of regimes above whose velocity the pin no longer sticks, if it is known: places along both axes.

    Each place has the mean of its drives.
    """
    is_known = np.isfinite(here.critical_velocity)
    if VELOCITY not in (roles.x, roles.hue) or points.axes[VELOCITY].dtype.kind in "Ob" or not is_known.any():
        return
    other_axis = roles.x if roles.hue == VELOCITY else roles.hue
    places = axis_positions(points, other_axis, here)[is_known]
    distinct, numbers = np.unique(places, return_inverse=True)
    # Velocities lie on a logarithmic axis as a rule: their geometric mean is the middle there.
    sums = np.bincount(numbers, np.log(here.critical_velocity[is_known]))
    means = np.exp(sums / np.bincount(numbers))
    # Either axis of a map may be the velocity.
    yield (distinct, means) if roles.hue == VELOCITY else (means, distinct)


def _colors(points: Points, names: list[str]) -> dict[str, Any]:
    if names:
        palette = ListedColormap(_palette(names))
        return {"cmap": palette, "vmin": -0.5, "vmax": len(names) - 0.5}
    if is_logarithmic(points.values):
        return {"cmap": "viridis", "norm": "log"}
    least = np.nanmin(points.values)
    most = np.nanmax(points.values)
    return {"cmap": "viridis", "vmin": least, "vmax": most}


def _palette(names: Sequence[str]) -> list[Any]:
    """A colour of each word, all different: regimes have their own; words can be more than there are in `COLORS`."""
    if set(names) <= REGIME_COLORS.keys():
        return [REGIME_COLORS[name] for name in names]
    count = len(names)
    if count <= len(COLORS):
        return list(COLORS[:count])
    # Without its ends, whose colours are too dark to be told apart.
    return list(colormaps["turbo"](np.linspace(0.05, 0.95, count)))


def _legend_of_tiles(figure: Figure, names: list[str]) -> None:
    axes = figure.axes[0]
    for color, name in zip(_palette(names), names, strict=True):
        # An entry of the legend, which draws no point.
        axes.plot([], [], "s", color=color, label=hyphenate(name))
    widest = max(map(len, names))
    beside = LETTERS_OF_TILES // (widest + len("■   "))
    columns = min(len(names), beside)
    _add_legend(figure, ncols=max(columns, 1))
