"""Figures of inference: bars of Sobol' indices with their intervals; contours of the parameters that agree."""

import itertools
from collections.abc import Iterator
from functools import partial
from typing import Any, Final

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

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
    both = {"first": answer.first, "total": answer.total}
    parts = {f"{kind}{end}": shares[:, place] for kind, shares in both.items() for place, end in enumerate(_ENDS)}
    return {"axis": np.array(answer.axes, dtype=object), **parts}


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
    grid = np.linspace(0.0, 1.0, FINE)
    u, v = (item.ravel() for item in np.meshgrid(grid, grid))
    others = fit.agreeing(LEVELS[-1]) if fit.reached else fit.best[None]
    count = min(len(others), BEHIND if len(fit.ranges) > 2 else 1)
    tried = others[np.linspace(0, len(others) - 1, count).astype(int)]
    places = np.repeat(tried[:, None, :], len(u), axis=1)
    places[:, :, first], places[:, :, second] = u, v
    least = fit.misfit(places.reshape(-1, len(fit.ranges))).reshape(len(tried), -1).min(axis=0)
    ranges = fit.ranges[first], fit.ranges[second]
    x, y = (item.at(grid) for item in ranges)
    levels = [0.0, *map(fit.limit, LEVELS)]
    axes.contourf(x, y, np.minimum(least, 1e6).reshape(FINE, FINE), levels=levels, colors=_SHADES)
    for item, shade in zip(LEVELS, _SHADES, strict=True):
        axes.plot([], [], "s", color=shade, label=f"agrees at {100 * item:.0f} %")
    points = [item.at(fit.computed.x[:, axis]) for item, axis in zip(ranges, (first, second), strict=True)]
    axes.plot(*points, ".", markersize=2.0, color="#555555", label="computed")
    best = [item.at(fit.best[axis : axis + 1]) for item, axis in zip(ranges, (first, second), strict=True)]
    axes.plot(*best, "*", markersize=7.0, color=COLORS[1], label="best" if fit.reached else "nearest")
    for name, parameter in zip("xy", ranges, strict=True):
        look = {
            "label": _label(parameter),
            "scale": "log" if parameter.logarithmic else "linear",
            "lim": (parameter.low, parameter.high),
        }
        axes.set(**{f"{name}{key}": value for key, value in look.items()})
        if parameter.logarithmic:
            set_few_ticks(getattr(axes, f"{name}axis"))


def _draw_parameter_fit(fit: Fit) -> Figure:
    """Draw a fit of a single parameter: each number over it, the measured number as a band, and the parameter's
    interval."""
    grid = np.linspace(0.0, 1.0, 4 * FINE)[:, None]
    means, errors = fit.predict(grid)
    x = fit.ranges[0].at(grid[:, 0])
    with column(0.4 + 1.9 * len(fit.targets), WIDTH) as figure:
        panels = figure.subplots(len(fit.targets), squeeze=False, sharex=True).ravel()
        for number, (axes, target) in enumerate(zip(panels, fit.targets, strict=True)):
            for level, shade in zip(LEVELS, _SHADES, strict=True):
                label_of = f"agrees at {100 * level:.0f} %"
                for ends in filter(None, fit.intervals(0, level)):
                    axes.axvspan(*ends, color=shade, alpha=0.35, label=label_of, linewidth=0.0)
                    label_of = ""
            low, high = target.value - target.error, target.value + target.error
            axes.axhspan(low, high, color=COLORS[3], alpha=0.3, label="measured")
            mean, error = means[:, number], errors[:, number]
            axes.plot(x, mean, color=COLORS[0])
            axes.fill_between(x, mean - 2.0 * error, mean + 2.0 * error, color=COLORS[0], alpha=0.2, linewidth=0.0)
            places, values = fit.ranges[0].at(fit.computed.x[:, 0]), fit.computed.values[:, number]
            axes.plot(places, values, ".", markersize=2.5, color="#555555", label="computed")
            axes.set(ylabel=target.name, xscale="log" if fit.ranges[0].logarithmic else "linear")
        panels[-1].set_xlabel(_label(fit.ranges[0]))
        legend(figure)
    return figure


def _label(parameter: Range) -> str:
    return typeset(label(names_by_word().get(parameter.name, parameter.name)))
