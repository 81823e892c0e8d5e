"""Figures of inference: bars of Sobol' indices with their intervals; contours of the parameters that agree."""

import itertools
from collections.abc import Iterator
from functools import partial
from typing import Any, Final

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from nanoslip.solver.arrays import Floats
from nanoslip.study.dataset.units import label, symbol_and_unit
from nanoslip.study.figures.points import DrawnColumns, read_points, typeset
from nanoslip.study.figures.roles import set_few_ticks
from nanoslip.study.figures.shared import COLORS, PAGE, WIDTH, Sort, View, column, legend
from nanoslip.study.inference.fit import LEVELS, Fit, Range
from nanoslip.study.inference.sensitivity import Sensitivity, caution, sensitivity
from nanoslip.study.manifest.parameters import names_by_word

# Bars of sensitivity, for the command and for the page of a campaign.

FEWEST_AXES: Final = 3
"""Number of axes from which a page shows indices; for two axes a map shows the dependence."""
NUMBERS: Final = (
    ("static_friction", "kinetic_friction"),
    ("plateau_mean",),
    ("contact_half_width", "maximum_pressure"),
)
"""The numbers that a page shows it of: the first group of which a dataset has any."""
ON_PAGE: Final = 512
"""Values that a page's surrogate is made of, so that the page takes seconds."""


def bars(answer: Sensitivity) -> Figure:
    """First-order and total indices of each axis, with their intervals."""
    with column(0.9 + 0.36 * len(answer.axes), WIDTH) as figure:
        axes = figure.add_subplot()
        rows = np.arange(len(answer.axes))
        for shift, color, name, values in (
            (-0.19, COLORS[0], "alone", answer.first),
            (0.19, COLORS[3], "in all", answer.total),
        ):
            middle, low, high = values.T
            reach = np.clip([middle - low, high - middle], 0.0, None)
            axes.barh(rows + shift, middle, 0.34, color=color, label=name)
            axes.errorbar(middle, rows + shift, xerr=reach, fmt="none", ecolor="#555555", capsize=1.6)
        axes.set_yticks(rows, [typeset(symbol_and_unit(name)) for name in answer.axes])
        axes.set(xlim=(0.0, 1.05), xlabel=typeset(f"share of the variance of {symbol_and_unit(answer.of)}"))
        axes.invert_yaxis()
        axes.grid(visible=False, axis="y")
        legend(figure)
    return figure


def index_table(answer: Sensitivity) -> DrawnColumns:
    """The indices as a table."""
    columns: dict[str, Any] = {"axis": np.array(answer.axes, dtype=object)}
    for kind, shares in {"first": answer.first, "total": answer.total}.items():
        for end, values in zip(_ENDS, shares.T, strict=True):
            columns[f"{kind}{end}"] = values
    return columns


_ENDS: Final = ("", "_low", "_high")


def sensitivity_view(answer: Sensitivity) -> View:
    """The bars with their caption."""
    caption = (
        f"Share of the variance of {label(answer.of)} that each parameter has alone (first-order Sobol' index), and in all, "
        f"together with others (total index), with intervals of 95 %. {caution(answer)}"
    )
    name = f"sensitivity_{answer.of.replace('/', '_over_')}"
    return View(name, caption, partial(bars, answer), partial(index_table, answer))


def _draw_index_bars(dataset: xr.Dataset) -> Iterator[View | str]:
    """Bars for each number on the page, or why they are unknown; none with fewer than three axes."""
    names = next((group for group in NUMBERS if group[0] in dataset), ())
    for name in names:
        if name in dataset and len(read_points(dataset, name).axes) >= FEWEST_AXES:
            answer = sensitivity(dataset, name, ON_PAGE)
            yield caution(answer) if answer.unknown else sensitivity_view(answer)


SENSITIVITY: Final = Sort("sensitivity", "What matters", _draw_index_bars)

# The set of parameters that agrees with measured numbers.

FINE: Final = 48
"""Places along each axis of a panel."""
BEHIND: Final = 96
"""Values of the other parameters that a panel of two parameters tries at each place; the best agreement counts."""
_SHADES: Final = ("#0b5394", "#9fc5e8")
"""Shades of the sets at 68 and 95 %."""


def contours(fit: Fit) -> Figure:
    """The set at 68 and 95 % in a panel for each pair of parameters, with the computed points and the best one."""
    if len(fit.ranges) == 1:
        return _draw_parameter_fit(fit)
    pairs = list(itertools.combinations(range(len(fit.ranges)), 2))
    columns = min(len(pairs), 3)
    rows = -(-len(pairs) // columns)
    with column(0.5 + 2.4 * rows, WIDTH if columns == 1 else PAGE) as figure:
        panels = figure.subplots(rows, columns, squeeze=False).ravel()
        for axes in panels[len(pairs) :]:
            axes.set_visible(False)
        for axes, pair in zip(panels, pairs, strict=False):
            _draw_pair(axes, fit, *pair)
        legend(figure)
    return figure


def _draw_pair(axes: Any, fit: Fit, first: int, second: int) -> None:
    """Draw the sets in the plane of two parameters, with the computed points and the best one."""
    grid = np.linspace(0.0, 1.0, FINE)
    ranges = fit.ranges[first], fit.ranges[second]
    x, y = (parameter.at(grid) for parameter in ranges)
    misfit = np.minimum(_least_misfit(fit, first, second, grid), 1e6)
    axes.contourf(x, y, misfit, levels=[0.0, *map(fit.limit, LEVELS)], colors=_SHADES)
    for level, shade in zip(LEVELS, _SHADES, strict=True):
        axes.plot([], [], "s", color=shade, label=_level_label(level))
    computed, best = fit.computed.x, fit.best[None]
    computed_at = ranges[0].at(computed[:, first]), ranges[1].at(computed[:, second])
    axes.plot(*computed_at, ".", markersize=2.0, color="#555555", label="computed")
    best_at = ranges[0].at(best[:, first]), ranges[1].at(best[:, second])
    best_label = "best" if fit.reached else "nearest"
    axes.plot(*best_at, "*", markersize=7.0, color=COLORS[1], label=best_label)
    across, up = ranges
    axes.set(xlabel=_label(across), xscale=_scale(across), xlim=(across.low, across.high))
    axes.set(ylabel=_label(up), yscale=_scale(up), ylim=(up.low, up.high))
    for axis, parameter in zip((axes.xaxis, axes.yaxis), ranges, strict=True):
        if parameter.logarithmic:
            set_few_ticks(axis)


def _least_misfit(fit: Fit, first: int, second: int, grid: Floats) -> Floats:
    """Best agreement (n, n) at each place of two parameters on a grid (n,), over the values of all others that are tried."""
    across, up = (places.ravel() for places in np.meshgrid(grid, grid))
    others = fit.agreeing(LEVELS[-1]) if fit.reached else fit.best[None]
    most = BEHIND if len(fit.ranges) > 2 else 1
    count = min(len(others), most)
    chosen = np.linspace(0, len(others) - 1, count).astype(int)
    places = np.repeat(others[chosen, None, :], len(across), axis=1)
    places[:, :, first], places[:, :, second] = across, up
    misfits = fit.misfit(places.reshape(-1, len(fit.ranges)))
    least: Floats = misfits.reshape(count, -1).min(axis=0)
    return least.reshape(len(grid), len(grid))


def _draw_parameter_fit(fit: Fit) -> Figure:
    """Draw a fit of a single parameter: each number over it, the measured number as a band, and the parameter's
    interval."""
    with column(0.4 + 1.9 * len(fit.targets), WIDTH) as figure:
        panels = figure.subplots(len(fit.targets), squeeze=False, sharex=True).ravel()
        for number, axes in enumerate(panels):
            _draw_target(axes, fit, number)
        panels[-1].set_xlabel(_label(fit.ranges[0]))
        legend(figure)
    return figure


def _draw_target(axes: Any, fit: Fit, number: int) -> None:
    """Draw one measured number over the only parameter of a fit."""
    parameter, target = fit.ranges[0], fit.targets[number]
    for level, shade in zip(LEVELS, _SHADES, strict=True):
        label_once = _level_label(level)
        for ends in filter(None, fit.intervals(0, level)):
            axes.axvspan(*ends, color=shade, alpha=0.35, label=label_once, linewidth=0.0)
            label_once = ""
    low, high = target.value - target.error, target.value + target.error
    axes.axhspan(low, high, color=COLORS[3], alpha=0.3, label="measured")
    grid = np.linspace(0.0, 1.0, 4 * FINE)[:, None]
    means, errors = fit.predict(grid)
    x, mean, error = parameter.at(grid[:, 0]), means[:, number], errors[:, number]
    axes.plot(x, mean, color=COLORS[0])
    axes.fill_between(x, mean - 2.0 * error, mean + 2.0 * error, color=COLORS[0], alpha=0.2, linewidth=0.0)
    places, values = parameter.at(fit.computed.x[:, 0]), fit.computed.values[:, number]
    axes.plot(places, values, ".", markersize=2.5, color="#555555", label="computed")
    axes.set(ylabel=target.name, xscale=_scale(parameter))


def _level_label(level: float) -> str:
    return f"agrees at {100 * level:.0f} %"


def _scale(parameter: Range) -> str:
    return "log" if parameter.logarithmic else "linear"


def _label(parameter: Range) -> str:
    return typeset(label(names_by_word().get(parameter.name, parameter.name)))
