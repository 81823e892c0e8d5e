"""Maps: tiles over two parameters in panels over two more, and the regimes of a driven pin as colours."""

from collections.abc import Iterator
from typing import Any, Final

import numpy as np
import xarray as xr
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure

from nanoslip.solver.arrays import Floats
from nanoslip.solver.dynamics.regime import REGIMES
from nanoslip.study.dataset.units import hyphenate
from nanoslip.study.figures.shared import REGIME_COLORS, edges

_SHADES: Final = ListedColormap(list(REGIME_COLORS.values()))


def panels(
    figure: Figure, rows: xr.DataArray, columns: xr.DataArray, labels: tuple[str, str]
) -> Iterator[tuple[Any, dict[str, Any]]]:
    """A panel for each pair of values of two coordinates, with the values to select; they stand right of rows and above columns.

    labels: formats of these values, of rows and of columns.
    """
    grid = figure.subplots(rows.size, columns.size, sharex=True, sharey=True, squeeze=False)
    for line, row in zip(grid, rows.values, strict=True):
        for axes, column in zip(line, columns.values, strict=True):
            axes.grid(visible=False)
            yield axes, {str(rows.name): row, str(columns.name): column}
        line[-1].text(1.04, 0.5, labels[0].format(row), rotation=-90, va="center", transform=line[-1].transAxes)
    for axes, column in zip(grid[0], columns.values, strict=True):
        axes.set_title(labels[1].format(column))


def regime_tiles(axes: Any, x: xr.DataArray, y: xr.DataArray, regime: xr.DataArray) -> None:
    """The regimes over two of their coordinates, which may be scaled, on axes whose scales are set."""
    numbers = codes(regime.transpose(*y.dims, *x.dims))
    ends = edges(x.values, axes.xaxis), edges(y.values, axes.yaxis)
    axes.pcolormesh(*ends, numbers, cmap=_SHADES, vmin=-0.5, vmax=len(REGIMES) - 0.5)


def codes(regime: xr.DataArray) -> Floats:
    """Numbers of the regimes in REGIMES, NaN where there is none."""
    numbers: dict[str, float] = {name: float(number) for number, name in enumerate(REGIMES)}
    return np.array([numbers.get(str(word), np.nan) for word in regime.values.ravel()]).reshape(regime.shape)


def regime_legend(figure: Figure) -> None:
    """The regimes' colours above all panels."""
    axes = figure.axes[0]
    patches = [
        axes.plot([], [], "s", color=_SHADES(number), label=hyphenate(name))[0] for number, name in enumerate(REGIMES)
    ]
    figure.legend(handles=patches, loc="outside upper center", ncols=len(patches))


def counted(regime: xr.DataArray) -> str:
    """Numbers of drives of each regime, in words."""
    found = {name: int((regime == name).sum()) for name in REGIMES}
    return ", ".join(f"{count} {hyphenate(name)}" for name, count in found.items() if count)
