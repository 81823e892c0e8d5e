"""How the sizes of events are distributed: an elastic slab against chains of blocks on springs."""

from collections.abc import Iterator
from typing import Final

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray

from solver.sliding.distributions.histogram import logarithmic_histogram
from solver.sliding.distributions.size_distribution import GUTENBERG_RICHTER, MEAN_FIELD
from study.dataset.access.accessor import Accessor
from study.figures.shared.canvas import COLORS, column
from study.figures.shared.claims import Claim
from study.figures.shared.figure import CampaignFigure, register

Floats = NDArray[np.float64]
SIZES: Final = {
    "slips": ("node slips in an event", MEAN_FIELD, "mean field"),
    "energy": ("energy lost in an event, in $W L_x$", GUTENBERG_RICHTER, "Gutenberg-Richter"),
}
"""Size -> its label, and the exponent and name of its reference line."""


NO_POWER_LAW: Final = 0.1
"""Goodness of fit below which sizes are no power law, whatever exponent fits them best."""


def name_of(case: xr.Dataset) -> str:
    """What a case is called: its scheme, of a chain with the ratio of its springs."""
    scheme = str(case["scheme"].item())
    return scheme if scheme != "chain" else f"chain, $k_c/k_l$ = {float(case['coupling_stiffness']):g}"


def steady(dataset: xr.Dataset, number: int, size: str) -> Floats | NDArray[np.int64]:
    """A size of all events of one case's steady part, (e,), those of 0 included."""
    run = Accessor(dataset).record(case=number)
    later = run["displacement"].values >= float(run["plateau_start"])
    column_of = {"slips": "event_slips", "energy": "event_dissipated"}[size]
    return np.asarray(run[column_of].values[later])


def draw(dataset: xr.Dataset) -> Figure:
    """Densities of slips and energies of every case, with their reference lines."""
    with column(4.6) as figure:
        for axes, (size, (label, exponent, reference)) in zip(figure.subplots(2, 1), SIZES.items(), strict=True):
            highest: tuple[float, float] = (1.0, 0.0)
            for color, number in zip(COLORS, dataset["case"].values, strict=False):
                found = logarithmic_histogram(steady(dataset, int(number), size), discrete=size == "slips")
                seen = found.counts > 0
                name = name_of(dataset.sel(case=number))
                axes.plot(
                    found.middles[seen],
                    found.density[seen],
                    "o-",
                    markersize=1.8,
                    linewidth=0.5,
                    color=color,
                    label=name,
                )
                highest = max(highest, (found.middles[seen][0], found.density[seen][0]), key=lambda place: place[1])
            line = np.geomspace(highest[0], 1e3 * highest[0], 2)
            axes.plot(
                line,
                highest[1] * (line / highest[0]) ** -exponent,
                ":",
                color="0.3",
                label=f"{reference}: {exponent:.3g}",
            )
            axes.set(xscale="log", yscale="log", xlabel=label, ylabel="density")
        figure.axes[0].legend(fontsize=6)
        figure.axes[1].legend(handles=figure.axes[1].lines[-1:], fontsize=6)
    return figure


def claims(dataset: xr.Dataset) -> Iterator[Claim]:
    """Exponent, cut-off, fit and preferred law of every size of every case, and what successive events know of each other."""
    for number in dataset["case"].values:
        here = dataset.sel(case=number).squeeze()
        name = name_of(here).replace("$", "")
        for size in SIZES:
            exponent, error = float(here[f"{size}_exponent"]), float(here[f"{size}_exponent_uncertainty"])
            found = f"{exponent:.3g} ± {error:.1g} from {float(here[f'{size}_cutoff']):.2g} on"
            goodness = float(here[f"{size}_goodness"])
            verdict = "no power law: " if goodness < NO_POWER_LAW else ""
            law = f"{verdict}goodness {goodness:.2g}; nearest law: {here[f'{size}_preferred'].item()}"
            _, reference, who = SIZES[size]
            yield Claim(f"{name}: {size}", f"{reference:.3g} ({who})", found, law)
        waits = f"{float(here['step_variation']):.3g} (1: at random)"
        linked = f"rank correlation of drop and next step {float(here['drop_step_correlation']):.2g}"
        yield Claim(f"{name}: scatter over mean of steps between events", "", waits, linked)


def draw_map(dataset: xr.Dataset) -> Figure:
    """Slips of each surface node of every case, over its place in the slab."""
    with column() as figure:
        axes = figure.add_subplot()
        for color, number in zip(COLORS, dataset["case"].values, strict=False):
            run = Accessor(dataset).record(case=int(number))
            slips = run["record_node_slips"].values
            share = slips / slips.sum()
            axes.plot(
                run["record_node_x"].values,
                100.0 * share,
                linewidth=0.6,
                color=color,
                label=name_of(dataset.sel(case=number)),
            )
        axes.set(xlabel="surface node, $x/L_x$", ylabel="share of all slips (%)")
        axes.legend(fontsize=6)
    return figure


def claims_of_map(dataset: xr.Dataset) -> Iterator[Claim]:
    """How much of the contact's slip lies in its front half."""
    for number in dataset["case"].values:
        run = Accessor(dataset).record(case=int(number))
        x, slips = run["record_node_x"].values, run["record_node_slips"].values
        middle = float((x * slips).sum() / slips.sum())
        found = f"{100.0 * float(slips[x > 0.0].sum() / slips.sum()):.3g} % ahead of the slab's middle"
        name = name_of(dataset.sel(case=number)).replace("$", "")
        yield Claim(
            name,
            "",
            found,
            f"{int(slips.sum())} slips of {int((slips > 0).sum())} nodes, on average at {middle:.2g} L_x",
        )


register(
    CampaignFigure(
        "sizes",
        "figures/chain",
        "Sizes of events: slab against chain of blocks",
        "Densities of the sizes of events on the plateau, in bins of equal ratio, of an elastic slab and of blocks on springs "
        "that hand on more and more of their force. Dotted: mean-field avalanches, and Gutenberg and Richter's law. ± is "
        "the standard error of a tail's exponent as if events were independent, which they are not.",
        draw,
        lambda dataset: tuple(claims(dataset)),
        ("", "reference", "exponent", "remark"),
    )
)
register(
    CampaignFigure(
        "nodes",
        "figures/chain",
        "Where nodes slip",
        "Share of all slips of a record at each surface node, of an elastic slab and of chains of blocks.",
        draw_map,
        lambda dataset: tuple(claims_of_map(dataset)),
        ("", "", "found", "remark"),
    )
)
