"""The cases of the campaign that sets an elastic slab against chains of blocks: their names, and the sizes of their events."""

from collections.abc import Callable, Iterator
from typing import Final, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from nanoslip.solver.arrays import Floats
from nanoslip.solver.sliding.power_law import SIGNIFICANT, density
from nanoslip.solver.sliding.sizes import (
    DISCRETE,
    GUTENBERG_RICHTER,
    MEAN_FIELD,
    EventSizes,
    rank_correlation,
    sizes_of_columns,
)
from nanoslip.solver.view import with_error
from nanoslip.study.dataset.access import Accessor
from nanoslip.study.figures.shared import COLORS, CampaignFigure, Claim, column


def names(dataset: xr.Dataset) -> dict[int, str]:
    """Number of each case -> `slab`, or what a chain's springs are; as mathematics of matplotlib."""
    return {int(number): _name(dataset.sel(case=number)) for number in dataset["case"].values}


def _name(case: xr.Dataset) -> str:
    if str(case["scheme"].item()) != "chain":
        return "slab"
    return f"chain, $k_c/k_l$ = {float(case['coupling_stiffness']):g}"


def plain(name: str) -> str:
    """A name as text."""
    return name.replace("$", "")


def numbers_of(dataset: xr.Dataset, case: int) -> xr.Dataset:
    """The scalars of one case."""
    return dataset.sel(case=case).squeeze()


def steady(dataset: xr.Dataset, case: int) -> xr.Dataset:
    """The events of one case's steady part, those that its statistics are of."""
    run = Accessor(dataset).record(case=case)
    return run.isel(event=run["displacement"].values >= float(run["plateau_start"]))


def steady_sizes(dataset: xr.Dataset, case: int) -> EventSizes:
    """The sizes of the events of one case's steady part."""
    run = steady(dataset, case)

    def column(name: str) -> NDArray[np.float64]:
        return np.asarray(run[name].values)

    return sizes_of_columns(
        column("displacement"),
        run["event_slips"].values,
        run["event_extent"].values,
        column("event_force_before") - column("event_force_after"),
        column("event_dissipated"),
        float(run["normal_load"]),
        -np.inf,
    )


# How the sizes of events are distributed: an elastic slab against chains of blocks on springs.


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
    """True if the goodness of fit does not refuse the power law of a size."""
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
    """The power laws of the sizes of every case, and how the slab's events differ from those of blocks."""
    for number, name in names(dataset).items():
        for size, panel in PANELS.items():
            reference = f"{panel.exponent:.3g} ({panel.reference})" if panel.reference else ""
            found = Accessor(dataset).event_sizes(size, case=number)
            if _fits(found, size):
                yield Claim(f"{plain(name)}: {size}", reference, *_fit(found, size))
    for meaning, share in SHARES.items():
        shares = [f"{plain(name)}: {share(steady(dataset, number)):.2g} %" for number, name in names(dataset).items()]
        yield Claim(meaning, "", shares[0], "; ".join(shares[1:]))


def _fit(found: xr.Dataset, size: str) -> tuple[str, str]:
    """Exponent of a size, the share of events of its power law, and the law that fits best."""
    exponent, uncertainty, cutoff, tail, goodness = (
        float(found[f"{size}_{name}"]) for name in ("exponent", "exponent_uncertainty", "cutoff", "tail", "goodness")
    )
    return (
        with_error(exponent, uncertainty),
        f"from {_size(cutoff)}, goodness {goodness:.2g}, {100.0 * tail / float(found['bin_events'].sum()):.3g} %",
    )


def _size(value: float) -> str:
    return f"{value:.0f}" if value >= 1.0 else f"{value:.2g}"


def _share(chosen: NDArray[np.bool_]) -> float:
    return 100.0 * float(np.mean(chosen))


SHARES: Final[dict[str, Callable[[xr.Dataset], float]]] = {
    "events of one node": lambda run: _share(run["event_extent"].values == 1),
    "events with half of the contact slipping": lambda run: _share(
        2 * run["event_extent"].values >= run["event_contact_size"].values
    ),
    "share of slips in those": lambda run: 100.0 * _of_half(run, "event_slips"),
    "share of energy in those": lambda run: 100.0 * _of_half(run, "event_dissipated"),
}
"""Percentages that tell a slab from blocks."""


def _of_half(run: xr.Dataset, name: str) -> float:
    """Share of a column's sum in events in which half of the nodes in contact slip."""
    half = 2 * run["event_extent"].values >= run["event_contact_size"].values
    return float(run[name].values[half].sum() / run[name].values.sum())


SIZES: Final = CampaignFigure(
    "sizes",
    "Sizes of events: slab against chain of blocks",
    "Densities of event sizes on the plateaus of all starts, in logarithmic bins, of an elastic slab and of blocks on springs "
    "with increasing coupling. Broad, and in the table: power laws of the largest sizes with a goodness of fit of at least 0.1. "
    "Dotted: mean-field avalanches, and Gutenberg and Richter's law.",
    draw,
    claims,
    ("", "reference", "exponent", "cut-off, goodness, share of events"),
)


# Correlation of events with earlier events: an elastic slab against chains of blocks on springs.

LAGS: Final = np.array([1, 2, 3, 5, 7, 10, 20, 30, 50, 100, 200, 300])
"""Events apart."""
PARTS: Final = 32
"""Number of parts of a node spacing in which medians are taken."""
PAIRS: Final = {
    "slips_correlation": ("slips", "slips", "slips and slips"),
    "drop_correlation": ("drop", "drop", "drop and drop"),
    "step_correlation": ("step", "step", "step and step"),
    "drop_step_correlation": ("drop", "step", "drop and next step"),
}
"""Variable of the dataset, which is the one at lag 1 -> sizes of the earlier and the later event, and what they are called."""
BAND: Final = 1.96
"""Standard errors that hold 95 % of the coefficients of independent events."""


def at_lags(sizes: EventSizes, earlier: str, later: str, lags: NDArray[np.int64]) -> Floats:
    """Spearman's coefficient of a size and of one so many events later, (l,); a step follows its event, so it is one ahead."""
    first, second = (np.asarray(getattr(sizes, name), float) for name in (earlier, later))
    ahead = later == "step" and earlier != "step"
    count = len(first)
    return np.array([rank_correlation(first[: count - lag + ahead], second[lag - ahead :]) for lag in lags])


def draw_of_correlations(dataset: xr.Dataset) -> Figure:
    """Rank correlations over the lag, with the band of independent events of the shortest record."""
    with column(4.0) as figure:
        grid = figure.subplots(2, 2, sharex=True, sharey=True)
        fewest = np.inf
        for color, (number, name) in zip(COLORS, names(dataset).items(), strict=False):
            sizes = steady_sizes(dataset, number)
            lags = LAGS[len(sizes.slips) // 4 > LAGS]
            fewest = min(fewest, len(sizes.slips))
            for axes, (earlier, later, _) in zip(grid.flat, PAIRS.values(), strict=True):
                found = at_lags(sizes, earlier, later, lags)
                axes.plot(lags, found, "o-", markersize=1.5, linewidth=0.5, color=color, label=name)
        for axes, (_, _, label) in zip(grid.flat, PAIRS.values(), strict=True):
            band = BAND / np.sqrt(fewest - 1.0)
            axes.axhspan(-band, band, color="0.5", alpha=0.3, linewidth=0)
            axes.set_title(label, fontsize=7)
            axes.set_xscale("log")
        for axes in grid[1]:
            axes.set_xlabel("events apart")
        for axes in grid[:, 0]:
            axes.set_ylabel("rank correlation")
        figure.legend(handles=grid.flat[0].lines, loc="outside lower center", ncols=2, fontsize=6)
    return figure


def claims_of_correlations(dataset: xr.Dataset) -> Iterator[Claim]:
    """The correlations of successive events, and of the first start those of places one node spacing apart."""
    for number, name in names(dataset).items():
        scalars, run = numbers_of(dataset, number), steady(dataset, number)
        for variable, (_, _, label) in PAIRS.items():
            yield Claim(f"{plain(name)}: {label}", "", _stated(scalars, variable))
        yield Claim(f"{plain(name)}: scatter over mean of steps", "", _stated(scalars, "step_variation"))
        drops = steady_sizes(dataset, number).drop
        repeated = spacing_apart(run["displacement"].values, drops, 1.0 / (float(run["n_x"]) - 1.0))
        if np.isfinite(repeated):
            events = f"{float(scalars['events']) / float(scalars['record_spacings']):.0f} events"
            yield Claim(f"{plain(name)}: drop and drop a node spacing ({events}) on", "", f"{repeated:.2f}")


def _stated(scalars: xr.Dataset, variable: str) -> str:
    return with_error(float(scalars[variable]), float(scalars[f"{variable}_uncertainty"]))


def spacing_apart(displacement: Floats, size: Floats, spacing: float) -> float:
    """Spearman's coefficient of a size's medians in PARTS of a node spacing and one spacing on; NaN below two spacings."""
    part = ((displacement - displacement[0]) * PARTS / spacing).astype(int)
    if part[-1] < 2 * PARTS:
        return np.nan
    medians = np.array([np.median(size[part == each]) if each in part else np.nan for each in range(part[-1])])
    return rank_correlation(medians[:-PARTS], medians[PARTS:])


CORRELATIONS: Final = CampaignFigure(
    "correlations",
    "Correlation of successive events",
    "Rank correlations (Spearman) of event sizes over the number of events between them: slips, drops of F/W, displacements to "
    "the next event, and drop with the following displacement. Grey: 95 % interval for independent events. Drawn for one start; "
    "the table has means over all starts for successive events (scatter of random steps: 1). Correlations over hundreds of "
    "events come from slow changes along the surface.",
    draw_of_correlations,
    claims_of_correlations,
)


# Where nodes slip: an elastic slab against chains of blocks on springs.


def draw_of_nodes(dataset: xr.Dataset) -> Figure:
    """Slips of each surface node of every case, over its place in the slab."""
    with column() as figure:
        axes = figure.add_subplot()
        for color, (number, name) in zip(COLORS, names(dataset).items(), strict=False):
            run = Accessor(dataset).record(case=number)
            slips = run["record_node_slips"].values
            axes.plot(run["record_node_x"].values, 100.0 * slips / slips.sum(), linewidth=0.6, color=color, label=name)
        axes.set(xlabel="surface node, $x/L_x$", ylabel="share of all slips (%)")
        axes.legend(fontsize=6)
    return figure


def claims_of_nodes(dataset: xr.Dataset) -> Iterator[Claim]:
    """Report the share of the contact's slip that lies in its front half."""
    for number, name in names(dataset).items():
        run = Accessor(dataset).record(case=number)
        x, slips = run["record_node_x"].values, run["record_node_slips"].values
        middle = float((x * slips).sum() / slips.sum())
        found = f"{100.0 * float(slips[x > 0.0].sum() / slips.sum()):.3g} % ahead of the slab's middle"
        slipping = f"{int(slips.sum())} slips of {int((slips > 0).sum())} nodes, on average at {middle:.2g} L_x"
        yield Claim(plain(name), "", found, slipping)


NODES: Final = CampaignFigure(
    "nodes",
    "Where nodes slip",
    "Share of all slips of a record at each surface node, of an elastic slab and of chains of blocks.",
    draw_of_nodes,
    claims_of_nodes,
)
