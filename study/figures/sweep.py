"""A variable over the axes of a campaign: its points, which axis goes where, and the drawing."""

import itertools
import math
from collections.abc import Iterator, Sequence
from typing import Any, Final

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.transforms import offset_copy
from numpy.typing import NDArray

from nanoslip.study.dataset.variables import commonest
from nanoslip.study.figures.points import (
    Points,
    Roles,
    counts_of,
    held_at,
    in_text,
    label,
    short,
    typeset,
    values_of,
    words,
)
from nanoslip.study.figures.shared import COLORS, column

# Positions of values along an axis: numbers on a linear or logarithmic scale, texts at equal distances.
#
# Beside a 0 such a scale is linear up to the smallest other number.

SPAN: Final = 8.0
"""Ratio of the largest to the smallest number from which a scale is logarithmic."""
CLOSE: Final = 30.0
"""Ratio of the largest to the smallest positive number from which that one could not be told from a 0 on a linear scale."""
_TICKS: Final = 6
"""Values of a coordinate up to which each has its tick."""


def is_logarithmic(values: NDArray[Any]) -> bool:
    """Whether numbers are positive, span at least the ratio `SPAN`, and lie more evenly in their logarithm."""
    numbers = np.unique(values[np.isfinite(values)])
    if len(numbers) < 2 or numbers[0] <= 0.0 or numbers[-1] < SPAN * numbers[0]:
        return False
    return len(numbers) == 2 or _unevenness(np.log(numbers)) < _unevenness(numbers)


def begins_with_zero(values: NDArray[Any]) -> bool:
    """Whether numbers are a 0 and positive ones of which the smallest would lie on it, were the scale linear."""
    numbers = np.unique(values[np.isfinite(values)])
    return len(numbers) > 2 and numbers[0] == 0.0 and bool(numbers[-1] > CLOSE * numbers[1])


def _unevenness(numbers: NDArray[Any]) -> float:
    steps = np.diff(numbers)
    return float(np.std(steps) / np.mean(steps))


def places_of(points: Points, name: str, chosen: Points) -> NDArray[Any]:
    """Where some of the points lie along a coordinate."""
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
    if len(values) <= _TICKS:
        axis.set_ticks(values, list(map(in_text, values)))
        axis.set_ticks([], minor=True)


# Numbers over one coordinate with error bars: a colour for each value of a second one, panels for the rest.

WIDTH: Final = 4.0
"""Of a figure on a page, in inches."""
FAILED: Final = "#c00000"
UNSURE: Final = "$?$"
"""Mark beside a point without a known uncertainty, which tables write as ± ?."""
SHORTEST: Final = 0.2
"""Share of a number at which its bar ends on a logarithmic axis, with an arrow, where it would go further down."""
MOST_COLUMNS: Final = 3
"""Panels side by side."""


def panels_of(points: Points, roles: Roles) -> tuple[list[dict[str, Any]], int]:
    """The coordinates of each panel, and how many panels a row has: of several coordinates one runs along the rows."""
    values = {name: values_of(points, name) for name in roles.panels}
    names = sorted(values, key=lambda name: len(values[name]) if len(values[name]) <= MOST_COLUMNS else 0)
    panels = [dict(zip(names, each, strict=True)) for each in itertools.product(*(values[name] for name in names))]
    return panels, len(values[names[-1]]) if len(names) > 1 else columns_for(len(panels))


def columns_for(count: int) -> int:
    """How many of so many panels of one sort stand side by side."""
    return 1 if count == 1 else 2 if count <= 4 else MOST_COLUMNS


def title_of(panel: dict[str, Any]) -> str:
    """The coordinates of a panel, a line each."""
    return "\n".join(typeset(words({name: value})) for name, value in panel.items())


def grid_of(figure: Figure, count: int, columns: int, **shared: Any) -> list[Any]:
    """So many panels in rows of so many; a larger figure where there are several."""
    rows = math.ceil(count / columns)
    figure.set_size_inches(WIDTH if columns < 3 else 1.5 * WIDTH, 2.5 if rows == 1 else 0.6 + 1.8 * rows)
    found = figure.subplots(rows, columns, squeeze=False, **shared).ravel().tolist()
    for spare in found[count:]:
        spare.set_visible(False)
    for lowest in found[:count][-columns:]:
        lowest.tick_params(labelbottom=True)
    return list(found[:count])


def draw_lines(points: Points, roles: Roles) -> Figure:
    """One line for each value of the hue, in each panel, points alone over words.

    Crosses at the bottom are without a value, question marks without a known uncertainty.
    """
    points = held_at(points, roles.held)
    line = "" if points.axes[roles.x].dtype.kind in "Ob" else "-"
    with column(width=WIDTH) as figure:
        panels, columns = panels_of(points, roles)
        for axes, panel in zip(grid_of(figure, len(panels), columns, sharex=True, sharey=True), panels, strict=True):
            here = held_at(points, panel)
            for color, (name, series) in zip(itertools.cycle(COLORS), _series(here, points, roles), strict=False):
                _draw_series(axes, points, series, places_of(points, roles.x, series), color, name, line)
            set_axis(axes.xaxis, points, roles.x)
            axes.set_title(title_of(panel))
        _finish(figure, points)
        figure.supxlabel(typeset(label(roles.x)), fontsize=8)
        title = typeset(short(roles.hue)) if roles.hue else ""
        _legend(figure, title)
    return figure


def draw_scattered(points: Points) -> Figure:
    """One panel for each coordinate, each with all points: of a design that is no product."""
    names = list(counts_of(points))
    with column(width=WIDTH) as figure:
        for axes, name in zip(grid_of(figure, len(names), columns_for(len(names)), sharey=True), names, strict=True):
            x = places_of(points, name, points)
            _draw_series(axes, points, points, x, COLORS[0], "", line="-" if _monotonic(x) else "")
            set_axis(axes.xaxis, points, name)
            axes.set_xlabel(typeset(short(name)))
        _finish(figure, points)
        _legend(figure, "")
    return figure


def _series(here: Points, points: Points, roles: Roles) -> Iterator[tuple[str, Points]]:
    if not roles.hue:
        yield "", here
        return
    for value in values_of(points, roles.hue):
        yield in_text(value), held_at(here, {roles.hue: value})


def _draw_series(axes: Any, points: Points, series: Points, x: Any, color: str, name: str, line: str = "-") -> None:
    """Values with error bars, a question mark where these are not known, hollow where flagged; crosses without a value."""
    order = np.argsort(x, kind="stable")
    x, series = x[order], series.at(order)
    there = series.there
    heights = np.full(len(x), np.nan)  # a line breaks at what is no number
    heights[there] = y = _heights(points, series.values[there])
    line = "" if series.text or len(set(x[there].tolist())) < there.sum() else line
    errors = np.nan_to_num(series.errors)
    ends = far_below(points, series)
    lower = np.where(ends, (1.0 - SHORTEST) * np.nan_to_num(heights), errors)
    axes.plot(x[ends], SHORTEST * heights[ends], "v", markersize=2.6, color=color)
    axes.errorbar(
        x, heights, (lower, errors), fmt=f"{line}o", markersize=2.6, capsize=1.6, color=color, label=name or None
    )
    care = series.flagged[there]
    axes.plot(x[there][care], y[care], "o", markersize=2.0, color="white", zorder=5)
    unsure = series.unsure[there]
    beside = offset_copy(axes.transData, axes.figure, 3.5, 3.5, "points")
    look = {
        "marker": UNSURE,
        "markersize": 3.6,
        "markeredgewidth": 0.3,
        "color": color,
        "clip_on": False,
        "transform": beside,
    }
    axes.plot(x[there][unsure], y[unsure], linestyle="", **look)[0].set_in_layout(False)
    bottom = np.full(int((~there).sum()), 0.02)
    crosses = axes.plot(x[~there], bottom, "x", color=FAILED, transform=axes.get_xaxis_transform(), zorder=6)
    crosses[0].set_in_layout(False)


def far_below(points: Points, series: Points) -> NDArray[np.bool_]:
    """Where a bar would reach so far down an axis without a 0 that nothing else could be seen.

    points: all that stand along that axis; series: those of which it is asked.
    """
    if points.text or not is_logarithmic(points.values):
        return np.zeros(len(series.values), np.bool_)
    return np.asarray(series.there & (np.nan_to_num(series.errors) > (1.0 - SHORTEST) * series.values))


def _monotonic(x: NDArray[Any]) -> bool:
    """Whether a list of cases goes along a coordinate one way."""
    steps = np.diff(x)
    return bool((steps > 0).all() or (steps < 0).all())


def _heights(points: Points, values: NDArray[Any]) -> NDArray[np.float64]:
    """Numbers as they are; words in a row, in the order in which all points have them."""
    if not points.text:
        return values.astype(float)
    names = names_of(points)
    return np.array([names.index(commonest(value)[0]) for value in values.tolist()], dtype=float)


def names_of(points: Points) -> list[str]:
    """The words that occur as values, each once; of members that differ the commonest."""
    return [name for name in dict.fromkeys(commonest(value)[0] for value in points.values.tolist()) if name]


def _finish(figure: Figure, points: Points) -> None:
    for axes in figure.axes:
        if points.text:
            names = names_of(points)
            axes.set_yticks(range(len(names)), [name.replace("_", "-") for name in names])
            axes.set_ylim(-0.5, len(names) - 0.5)
        elif is_logarithmic(points.values):
            axes.set_yscale("log")
    figure.supylabel(typeset(points.label), fontsize=8)


def _legend(figure: Figure, title: str) -> None:
    handles, names = figure.axes[0].get_legend_handles_labels()
    if handles:
        figure.legend(
            handles, names, title=title, title_fontsize=7, loc="outside upper center", ncols=min(len(names), 6)
        )


# Numbers or words over two coordinates as a map of tiles, panels for the rest.

Floats = NDArray[np.float64]
LETTERS_OF_TILES: Final = 56
"""Letters of a legend that stand side by side above a figure: more would be cut off at its sides."""
MOST_VECTOR: Final = 500
"""Tiles up to which they stay shapes; more are an image inside the picture."""
MOST_SIGNS: Final = 2500
"""Tiles of a panel up to which each has room for a sign; among more the signs would hide them."""


def is_crowded(points: Points, roles: Roles) -> bool:
    """Whether tiles are too many for signs on them: those to be taken with care are hatched then, those without a value white."""
    counts = counts_of(points)
    return counts[roles.x] * counts[roles.hue] > MOST_SIGNS


def draw_tiles(points: Points, roles: Roles) -> Figure:
    """A tile for each case, coloured by its value.

    Crosses are cases without one, dots those to be taken with care, stars regimes with teeth left out. Very many have none.
    """
    points = held_at(points, roles.held)
    names = names_of(points) if points.text else []
    with column(width=WIDTH) as figure:
        panels, columns = panels_of(points, roles)
        found = grid_of(figure, len(panels), columns, sharex=True, sharey=True)
        for axes, panel in zip(found, panels, strict=True):
            mesh = _draw_panel(axes, points, held_at(points, panel), roles, names)
            axes.set_title(title_of(panel))
        if names:
            _legend_of_tiles(figure, names)
        else:
            figure.colorbar(mesh, ax=found, label=typeset(points.label))
        figure.supxlabel(typeset(label(roles.x)), fontsize=8)
        figure.supylabel(typeset(label(roles.hue)), fontsize=8)
    return figure


def _draw_panel(axes: Any, points: Points, here: Points, roles: Roles, names: list[str]) -> Any:
    x, y = places_of(points, roles.x, here), places_of(points, roles.hue, here)
    columns, rows = (np.unique(places_of(points, name, points)) for name in (roles.x, roles.hue))
    tiles = np.full((len(rows), len(columns)), np.nan)
    tiles[np.searchsorted(rows, y), np.searchsorted(columns, x)] = _numbers_of_tiles(here, names)
    axes.grid(visible=False)
    for axis, name in ((axes.xaxis, roles.x), (axes.yaxis, roles.hue)):
        set_axis(axis, points, name)
    ends = [_edges(values, axis) for values, axis in ((columns, axes.xaxis), (rows, axes.yaxis))]
    look: dict[str, Any] = {"rasterized": tiles.size > MOST_VECTOR, "edgecolors": "face", "linewidth": 0.3}
    if names and (shares := _shares(here)).min(initial=1.0) < 1.0:
        shades = np.ones(tiles.shape)
        shades[np.searchsorted(rows, y), np.searchsorted(columns, x)] = shares
        look |= {"alpha": shades, "edgecolors": "none", "rasterized": True}  # without hairlines between the shapes
    mesh = axes.pcolormesh(*ends, tiles, **look, **_colors(points, names))
    care = here.flagged & here.there
    if is_crowded(points, roles):
        inside = np.zeros(tiles.shape)
        inside[np.searchsorted(rows, y), np.searchsorted(columns, x)] = care
        if 0.0 < inside.mean() < 1.0:
            axes.contourf(columns, rows, inside, levels=[0.5, 1.5], colors="none", hatches=["//"])
        return mesh
    axes.plot(x[~here.there], y[~here.there], "x", markersize=4, color=FAILED)
    axes.plot(x[care], y[care], "o", markersize=2.4, color="white", markeredgecolor="black", markeredgewidth=0.4)
    return mesh


def _numbers_of_tiles(here: Points, names: list[str]) -> Floats:
    if not here.text:
        return here.values
    return np.array([names.index(commonest(value)[0]) if value else np.nan for value in here.values.tolist()])


def _shares(here: Points) -> Floats:
    """How many of the members say what most of them say."""
    return np.array([commonest(value)[1] for value in here.values.tolist()])


def _colors(points: Points, names: list[str]) -> dict[str, Any]:
    if names:
        return {"cmap": ListedColormap(_palette(len(names))), "vmin": -0.5, "vmax": len(names) - 0.5}
    if is_logarithmic(points.values):
        return {"cmap": "viridis", "norm": "log"}
    return {"cmap": "viridis", "vmin": np.nanmin(points.values), "vmax": np.nanmax(points.values)}


def _palette(number: int) -> Sequence[Any]:
    """So many colours, each different: words can be more than there are in `COLORS`."""
    return COLORS[:number] if number <= len(COLORS) else list(colormaps["turbo"](np.linspace(0.05, 0.95, number)))


def _edges(places: Floats, axis: Any) -> Floats:
    """(n + 1,) ends of n tiles: halfway between neighbours on the scale of their axis (matplotlib's)."""
    scale = axis.get_transform()
    return np.asarray(scale.inverted().transform(_halfway(scale.transform(places.astype(float)))))


def _halfway(places: Floats) -> Floats:
    if len(places) == 1:
        return np.array([places[0] - 0.5, places[0] + 0.5])
    middles = 0.5 * (places[1:] + places[:-1])
    return np.concatenate(([2 * places[0] - middles[0]], middles, [2 * places[-1] - middles[-1]]))


def _legend_of_tiles(figure: Figure, names: list[str]) -> None:
    patches = [
        figure.axes[0].plot([], [], "s", color=color, label=name.replace("_", "-"))[0]
        for color, name in zip(_palette(len(names)), names, strict=True)
    ]
    beside = LETTERS_OF_TILES // (max(map(len, names)) + len("■   "))
    figure.legend(handles=patches, loc="outside upper center", ncols=max(min(len(names), beside), 1))
