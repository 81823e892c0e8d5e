"""Numbers over one coordinate with error bars: a colour for each value of a second one, panels for the rest."""

import itertools
import math
from collections.abc import Iterator
from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure
from matplotlib.transforms import offset_copy
from numpy.typing import NDArray

from nanoslip.study.dataset.ragged import commonest
from nanoslip.study.figures.shared.canvas import COLORS, column
from nanoslip.study.figures.sweep.label import label, said, short, typeset, words
from nanoslip.study.figures.sweep.points import Points
from nanoslip.study.figures.sweep.roles import Roles, counts_of, held_at, values_of
from nanoslip.study.figures.sweep.scale import is_logarithmic, places_of, set_axis

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
        yield said(value), held_at(here, {roles.hue: value})


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
