"""Numbers or words over two coordinates as a map of tiles, panels for the rest."""

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from numpy.typing import NDArray

from nanoslip.study.dataset.ragged import commonest
from nanoslip.study.figures.shared.canvas import COLORS, column
from nanoslip.study.figures.sweep.label import label, typeset
from nanoslip.study.figures.sweep.lines import FAILED, WIDTH, grid_of, names_of, panels_of, title_of
from nanoslip.study.figures.sweep.points import Points
from nanoslip.study.figures.sweep.roles import Roles, counts_of, held_at
from nanoslip.study.figures.sweep.scale import is_logarithmic, places_of, set_axis

Floats = NDArray[np.float64]
LETTERS: Final = 56
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
            _legend(figure, names)
        else:
            figure.colorbar(mesh, ax=found, label=typeset(points.label))
        figure.supxlabel(typeset(label(roles.x)), fontsize=8)
        figure.supylabel(typeset(label(roles.hue)), fontsize=8)
    return figure


def _draw_panel(axes: Any, points: Points, here: Points, roles: Roles, names: list[str]) -> Any:
    x, y = places_of(points, roles.x, here), places_of(points, roles.hue, here)
    columns, rows = (np.unique(places_of(points, name, points)) for name in (roles.x, roles.hue))
    tiles = np.full((len(rows), len(columns)), np.nan)
    tiles[np.searchsorted(rows, y), np.searchsorted(columns, x)] = _numbers(here, names)
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


def _numbers(here: Points, names: list[str]) -> Floats:
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


def _legend(figure: Figure, names: list[str]) -> None:
    patches = [
        figure.axes[0].plot([], [], "s", color=color, label=name.replace("_", "-"))[0]
        for color, name in zip(_palette(len(names)), names, strict=True)
    ]
    beside = LETTERS // (max(map(len, names)) + len("■   "))
    figure.legend(handles=patches, loc="outside upper center", ncols=max(min(len(names), beside), 1))
