"""How the sizes of events are distributed: an elastic slab against chains of blocks on springs."""

from collections.abc import Callable, Iterator
from typing import Final, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from nanoslip.solver.sliding.power_law import SIGNIFICANT, density
from nanoslip.solver.sliding.sizes import DISCRETE, GUTENBERG_RICHTER, MEAN_FIELD
from nanoslip.solver.view import with_error
from nanoslip.study.dataset.access import Accessor
from nanoslip.study.figures.further.chains import CAMPAIGN, names, plain, steady
from nanoslip.study.figures.shared import COLORS, CampaignFigure, Claim, column, register


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
BROAD: Final = 3.0
"""Width of the line of a power law."""


def draw(dataset: xr.Dataset) -> Figure:
    """Densities of all sizes of every case, their power laws, and reference lines."""
    with column(5.4) as figure:
        grid = figure.subplots(3, 2)
        panels = dict(zip(PANELS, grid.flat, strict=False))
        for color, (number, name) in zip(COLORS, names(dataset).items(), strict=False):
            for size, axes in panels.items():
                found = Accessor(dataset).event_sizes(size, case=number)
                style = {"markersize": 1.2, "linewidth": 0.5, "color": color, "label": name}
                axes.plot(found["bin_middle"], found["bin_density"], "o-", **style)
                _draw_law(axes, found, size, color)
        for size, axes in panels.items():
            _draw_reference(axes, PANELS[size])
            axes.set(xscale="log", yscale="log", xlabel=PANELS[size].label)
            axes.tick_params(labelsize=5.5)
        for axes in grid[:, 0]:
            axes.set_ylabel("density")
        grid.flat[-1].set_visible(False)
        figure.legend(
            handles=panels["slips"].get_legend_handles_labels()[0][: len(names(dataset))],
            loc="lower right",
            fontsize=6.5,
        )
    return figure


def _draw_law(axes: Axes, found: xr.Dataset, size: str, color: str) -> None:
    """The power law of a size from its cut-off to the last bin, unless it is refused."""
    exponent, cutoff, tail = (float(found[f"{size}_{name}"]) for name in ("exponent", "cutoff", "tail"))
    if _fits(found, size):
        ends = np.array([cutoff, float(found["bin_middle"][-1])])
        line = tail / float(found["bin_events"].sum()) * density(ends, exponent, cutoff, DISCRETE[size])
        axes.plot(ends, line, "-", linewidth=BROAD, alpha=0.35, color=color, zorder=1, label="_")


def _fits(found: xr.Dataset, size: str) -> bool:
    """Whether a size has a power law that its goodness of fit does not refuse."""
    return bool(found[f"{size}_goodness"] >= SIGNIFICANT and np.isfinite(found[f"{size}_exponent"]))


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
    """The power law of every size of every case, and how the slab's events differ from those of blocks."""
    for number, name in names(dataset).items():
        for size, panel in PANELS.items():
            reference = f"{panel.exponent:.3g} ({panel.reference})" if panel.reference else ""
            found = Accessor(dataset).event_sizes(size, case=number)
            yield Claim(f"{plain(name)}: {size}", reference, *_fit(found, size))
    for meaning, share in SHARES.items():
        shares = [f"{plain(name)}: {share(steady(dataset, number)):.2g} %" for number, name in names(dataset).items()]
        yield Claim(meaning, "", shares[0], "; ".join(shares[1:]))


def _fit(found: xr.Dataset, size: str) -> tuple[str, str]:
    """Exponent of a size, unless its power law is refused; the share of events that that is of, and the law that fits best."""
    exponent, uncertainty, cutoff, tail, goodness = (
        float(found[f"{size}_{name}"]) for name in ("exponent", "exponent_uncertainty", "cutoff", "tail", "goodness")
    )
    preferred = str(found[f"{size}_preferred"].item())
    return (
        with_error(exponent, uncertainty) if _fits(found, size) else "no power law",
        f"from {_size(cutoff)} on, goodness {goodness:.2g}, {100.0 * tail / float(found['bin_events'].sum()):.3g} % of the "
        f"events; preferred: {LAW_WORDS.get(preferred, preferred)}",
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
        "Densities of the sizes of events on the plateaus of all starts together, in bins of equal ratio, of an elastic slab "
        "and of blocks on springs that hand on more and more of their force. Broad: power laws of the largest sizes, where "
        "their goodness of fit is 0.1 or more. Dotted: mean-field avalanches, and Gutenberg and Richter's law.",
        draw,
        claims,
        ("", "reference", "exponent", "remark"),
    )
)
