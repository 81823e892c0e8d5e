"""How the sizes of events are distributed: an elastic slab against chains of blocks on springs."""

from collections.abc import Callable, Iterator
from typing import Final, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from solver.sliding.distributions.events import DISCRETE
from solver.sliding.distributions.histogram import Histogram, logarithmic_histogram
from solver.sliding.distributions.size_distribution import GUTENBERG_RICHTER, MEAN_FIELD
from solver.view import with_error
from study.figures.further.chains import CAMPAIGN, names, numbers_of, plain, steady, steady_sizes
from study.figures.shared.canvas import COLORS, column
from study.figures.shared.claims import Claim
from study.figures.shared.figure import CampaignFigure, register

Floats = NDArray[np.float64]


class Panel(NamedTuple):
    """A size: its label, and the exponent and name of its reference line."""

    label: str
    exponent: float = np.nan
    reference: str = ""


PANELS: Final = {
    "slips": Panel("node slips", MEAN_FIELD, "mean field"),
    "extent": Panel("nodes that slip"),
    "drop": Panel("fall of $F/W$"),
    "energy": Panel("energy lost, in $W L_x$", GUTENBERG_RICHTER, "Gutenberg-Richter"),
    "step": Panel("step to the next, in $L_x$"),
}
LAW_WORDS: Final = {"lognormal": "log-normal", "power_law": "power law", "truncated_power_law": "x^-τ exp(-λx)"}
"""Law that a tail prefers -> what a reader calls it."""
LEAST_DECADES: Final = 1.0
"""Below, a scaling range is not drawn."""


def draw(dataset: xr.Dataset) -> Figure:
    """Densities of all sizes of every case, the power laws that they support, and reference lines."""
    with column(5.4) as figure:
        grid = figure.subplots(3, 2)
        panels = dict(zip(PANELS, grid.flat, strict=False))
        for color, (number, name) in zip(COLORS, names(dataset).items(), strict=False):
            sizes, scalars = steady_sizes(dataset, number), numbers_of(dataset, number)
            for size, axes in panels.items():
                found = logarithmic_histogram(getattr(sizes, size), discrete=DISCRETE[size])
                seen = found.counts > 0
                style = {"markersize": 1.2, "linewidth": 0.5, "color": color, "label": name}
                axes.plot(found.middles[seen], found.density[seen], "o-", **style)
                _draw_scaling(axes, found, scalars, size, color)
        for size, axes in panels.items():
            _draw_reference(axes, PANELS[size])
            axes.set(xscale="log", yscale="log", xlabel=PANELS[size].label)
            axes.tick_params(labelsize=5.5)
        for axes in grid[:, 0]:
            axes.set_ylabel("density")
        grid.flat[-1].set_visible(False)
        figure.legend(handles=panels["slips"].lines[: len(names(dataset))], loc="lower right", fontsize=6.5)
    return figure


def _draw_scaling(axes: Axes, found: Histogram, scalars: xr.Dataset, size: str, color: str) -> None:
    """The power law of a scaling range, through the histogram's bins there."""
    if not float(scalars[f"{size}_scaling_decades"]) >= LEAST_DECADES:
        return
    exponent, first, last = (float(scalars[f"{size}_scaling_{name}"]) for name in ("exponent", "first", "last"))
    there = (found.middles >= first) & (found.middles <= last) & (found.counts > 0)
    height = np.log(found.density[there]) + exponent * np.log(found.middles[there])
    ends = np.array([first, last])
    line = np.exp(np.average(height, weights=found.counts[there])) * ends**-exponent
    axes.plot(ends, line, "-", linewidth=3.0, alpha=0.35, color=color, zorder=1, label="_")


def _draw_reference(axes: Axes, panel: Panel) -> None:
    """A line of the exponent that others found, above the data in the middle third of their sizes."""
    if not panel.reference:
        return
    x, y = (
        np.log10(np.concatenate([getattr(line, get)() for line in axes.lines])) for get in ("get_xdata", "get_ydata")
    )
    ends = x.min() + np.ptp(x) * np.array([1.0, 2.0]) / 3.0
    near = (x >= ends[0]) & (x <= ends[1])
    height = (y + panel.exponent * x)[near].max() + 0.7
    label = f"{panel.reference}: {panel.exponent:.3g}"
    axes.plot(10.0**ends, 10.0 ** (height - panel.exponent * ends), ":", color="0.3", label=label)
    axes.legend(handles=axes.lines[-1:], loc="lower left", fontsize=5, handlelength=1.5)


def claims(dataset: xr.Dataset) -> Iterator[Claim]:
    """The scaling range of every size of every case, and how the slab's events differ from those of blocks."""
    for number, name in names(dataset).items():
        scalars, sizes = numbers_of(dataset, number), steady_sizes(dataset, number)
        for size, panel in PANELS.items():
            reference = f"{panel.exponent:.3g} ({panel.reference})" if panel.reference else ""
            yield Claim(f"{plain(name)}: {size}", reference, *_scaling(scalars, size, getattr(sizes, size)))
    for meaning, share in SHARES.items():
        found = [f"{plain(name)}: {share(steady(dataset, number)):.2g} %" for number, name in names(dataset).items()]
        yield Claim(meaning, "", found[0], "; ".join(found[1:]))


def _scaling(scalars: xr.Dataset, size: str, values: Floats) -> tuple[str, str]:
    """What a size's scaling range says, how much of all values (e,) is in it, and which law is nearest to the largest sizes."""
    exponent, error, first, last, decades, goodness = (
        float(scalars[f"{size}_scaling_{name}"])
        for name in ("exponent", "exponent_uncertainty", "first", "last", "decades", "goodness")
    )
    preferred = str(scalars[f"{size}_preferred"].item())
    tail = f"from {_size(float(scalars[f'{size}_cutoff']))} on nearest to: {LAW_WORDS.get(preferred, preferred)}"
    if not decades:
        return "no power law", tail
    fit = f"{with_error(exponent, error)} from {_size(first)} to {_size(last)}"
    known = f"{decades:.2g} decades, goodness {goodness:.2g}, {_part(values, first, last)}"
    if decades < LEAST_DECADES:
        return "straight over no decade", f"longest: {fit}, {known}; {tail}"
    return fit, f"{known}; {tail}"


def _part(values: Floats, first: float, last: float) -> str:
    """Percentage of all values (e,) above 0 that are in a range, and of their sum."""
    values = values[values > 0.0]
    there = (values >= first) & (values <= last)
    return (
        f"{100.0 * there.mean():.2g} % of the events, {100.0 * values[there].sum() / values.sum():.2g} % of their sum"
    )


def _size(value: float) -> str:
    return f"{value:.0f}" if value >= 1.0 else f"{value:.2g}"


def _share(chosen: NDArray[np.bool_]) -> float:
    return 100.0 * float(np.mean(chosen))


SHARES: Final[dict[str, Callable[[xr.Dataset], float]]] = {
    "events in which one node slips": lambda run: _share(run["event_extent"].values == 1),
    "events in which half of the contact slips": lambda run: _share(
        2 * run["event_extent"].values >= run["event_contact_size"].values
    ),
    "slips that are in those": lambda run: 100.0 * _of_half(run, "event_slips"),
    "energy that is lost in those": lambda run: 100.0 * _of_half(run, "event_dissipated"),
}
"""Percentages that tell a slab from blocks."""


def _of_half(run: xr.Dataset, name: str) -> float:
    """Share of a column's sum in events in which half of the nodes in contact slip."""
    half = 2 * run["event_extent"].values >= run["event_contact_size"].values
    return float(run[name].values[half].sum() / run[name].values.sum())


register(
    CampaignFigure(
        "sizes",
        CAMPAIGN,
        "Sizes of events: slab against chain of blocks",
        "Densities of the sizes of events on the plateau, in bins of equal ratio, of an elastic slab and of blocks on springs "
        "that hand on more and more of their force. Broad: ranges of a decade or more that nothing tells from a power law; "
        "the middle of a wide log-normal is one, too. Dotted: mean-field avalanches, and Gutenberg and Richter's law. ± is "
        "the standard error as if events were independent, which they are not.",
        draw,
        claims,
        ("", "reference", "exponent", "remark"),
    )
)
