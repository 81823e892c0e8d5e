"""One moment on axes, and several of them as a strip: pressure within its friction limits, shear, slip, and F/W."""

from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure

from nanoslip.study.figures.frames.moments import Moment, Moments
from nanoslip.study.figures.shared.canvas import COLORS, column
from nanoslip.study.figures.sweep.label import typeset

MOST_IN_STRIP: Final = 10
"""Moments side by side, so that each is wide enough to be read."""
PRESSURE, SHEAR, MARK = COLORS[:3]


def strip(shown: Moments) -> Figure:
    """Moments side by side; below them the record, where each of them is a numbered point."""
    count = len(shown.moments)
    with column(4.2, max(3.35, 0.6 + 1.35 * count)) as figure:
        grid = figure.add_gridspec(3, count, height_ratios=(1.0, 0.6, 0.8))
        for number, moment in enumerate(shown.moments):
            upper, lower = (figure.add_subplot(grid[row, number]) for row in (0, 1))
            _draw_contact(upper, lower, shown, moment)
            upper.set_title(f"event {moment.event}")
            for axes in (upper, lower) if number else ():
                axes.set(ylabel="", yticklabels=[])
                axes.yaxis.get_offset_text().set_visible(False)
        _legend(figure)
        _draw_record(figure.add_subplot(grid[2, :]), shown, shown.moments)
    return figure


def draw_frame(figure: Figure, shown: Moments, moment: Moment) -> None:
    """Draw one moment of a film on an empty figure: the contact, and beside it the record with a point that moves."""
    grid = figure.add_gridspec(2, 2, height_ratios=(1.0, 0.6))
    upper, lower = (figure.add_subplot(grid[row, 0]) for row in (0, 1))
    _draw_contact(upper, lower, shown, moment)
    upper.set_title(f"event {moment.event}")
    _draw_record(figure.add_subplot(grid[:, 1]), shown, (moment,))
    _legend(figure)


def _draw_contact(upper: Any, lower: Any, shown: Moments, moment: Moment) -> None:
    """Tractions with the limits ±μ_i·p of shear, and slips; nodes that slipped since the moment before are marked."""
    upper.fill_between(
        shown.x, -moment.limit, moment.limit, color=SHEAR, alpha=0.15, linewidth=0.0, label=typeset("±μ_i·p")
    )
    upper.plot(shown.x, moment.pressure, ".-", color=PRESSURE, markersize=2.0, label="pressure p")
    upper.plot(shown.x, moment.shear, ".-", color=SHEAR, markersize=2.0, label="shear q")
    lower.plot(shown.x, moment.slip, ".-", color=PRESSURE, markersize=2.0)
    for axes, values in ((upper, moment.shear), (lower, moment.slip)):
        axes.plot(
            shown.x[moment.slipped],
            values[moment.slipped],
            "v",
            color=MARK,
            markersize=2.5,
            label="slipped since the picture before",
        )
    upper.set(
        xlim=_span(shown),
        ylim=_range(shown, "pressure", "shear", "limit"),
        ylabel=typeset("traction·L_x·L_y/W"),
        xticklabels=[],
    )
    lower.set(xlim=_span(shown), ylim=_range(shown, "slip"), xlabel=typeset("x/L_x"), ylabel=typeset("slip s/L_x"))
    lower.ticklabel_format(axis="y", scilimits=(0, 0))


def _draw_record(axes: Any, shown: Moments, marked: tuple[Moment, ...]) -> None:
    shown.record.plot(axes)
    axes.lines[0].set_color(COLORS[-1])
    axes.set(xlabel=typeset(axes.get_xlabel()), ylabel=typeset(axes.get_ylabel()))
    axes.ticklabel_format(axis="x", scilimits=(0, 0))
    axes.set(xlim=axes.get_xlim(), ylim=axes.get_ylim())  # a point moves no axis
    axes.plot(
        [each.displacement for each in marked], [each.friction for each in marked], "o", color=SHEAR, markersize=3.5
    )
    for each in marked if len(marked) > 1 else ():
        place = (each.displacement, each.friction)
        axes.annotate(f"{each.event}", place, (3, -8), textcoords="offset points", fontsize=6.0)


def _legend(figure: Figure) -> None:
    """One legend for all axes."""
    handles, labels = figure.axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(labels))


def _span(shown: Moments) -> tuple[float, float]:
    """The part of the surface that is ever in contact, and a little on either side."""
    ever = np.any([moment.pressure > 0.0 for moment in shown.moments], axis=0)
    first, last = shown.x[ever][[0, -1]]
    margin = 0.1 * (last - first) + 2.0 * (shown.x[1] - shown.x[0])
    return float(first - margin), float(last + margin)


def _range(shown: Moments, *names: str) -> tuple[float, float]:
    """Room for these arrays in all moments, and for limits of either sign."""
    signs = {"limit": (-1.0, 1.0)}
    parts = [
        sign * getattr(moment, name) for moment in shown.moments for name in names for sign in signs.get(name, (1.0,))
    ]
    values = np.concatenate(parts)
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    margin = 0.05 * (high - low) or 1.0
    return low - margin, high + margin
