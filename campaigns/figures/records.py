"""Figures 6 and 7 (§3.2): friction force against pin displacement, and how far the pin moves from event to event."""

from collections.abc import Iterator
from typing import Final

import numpy as np
import paper
import xarray as xr
from matplotlib.figure import Figure

from nanoslip.solver.arrays import Floats
from nanoslip.study.dataset.access import Accessor
from nanoslip.study.figures.shared import COLORS, CampaignFigure, Claim, column, start_statistics

_FRICTIONS = (0.25, 0.5)


def every_start(dataset: xr.Dataset, name: str, intrinsic_friction: float = 0.5) -> Floats:
    """A scalar of every start, (m,)."""
    return np.asarray(dataset[name].sel(intrinsic_friction=intrinsic_friction).values, dtype=float).ravel()


def sawtooth(dataset: xr.Dataset, intrinsic_friction: float, begin: float) -> tuple[Floats, Floats]:
    """δ_p/L_x and F/W of one record as a line: both sides of every drop."""
    line = Accessor(dataset).teeth(intrinsic_friction=intrinsic_friction, start=begin)
    return line["displacement"].values, line["friction_force"].values


def draw_records(dataset: xr.Dataset) -> Figure:
    """One record of each intrinsic friction in colour, the other starts behind it in grey."""
    with column() as figure:
        axes = figure.add_subplot()
        for color, friction in zip(COLORS, reversed(_FRICTIONS), strict=False):
            for begin in dataset["start"].values[1:]:
                x, y = sawtooth(dataset, friction, float(begin))
                axes.plot(1e3 * x, y, color="0.8", linewidth=0.3, zorder=1, rasterized=True)
            x, y = sawtooth(dataset, friction, 0)
            axes.plot(1e3 * x, y, color=color, linewidth=0.5, label=f"$\\mu_i$ = {friction:g}")
            axes.axhline(paper.PLATEAU_SHARE.value * friction, color=color, linestyle=":", zorder=2)
        axes.annotate("56 % of $\\mu_i$", (2.0, 0.56 * 0.5), (1.9, 0.31), fontsize=7)
        axes.set(xlabel="pin displacement $\\delta_p/L_x$ ($10^{-3}$)", ylabel="friction force $F/W$", ylim=(0, 0.34))
        axes.legend(loc="lower right")
    return figure


def claims_of_records(dataset: xr.Dataset) -> Iterator[Claim]:
    """Every number of §3.2.1 and §3.2.2, over starts."""
    for friction in reversed(_FRICTIONS):
        share = every_start(dataset, "plateau_mean", friction) / friction
        yield paper.compared(paper.PLATEAU_SHARE, share, _SHARE, f"plateau/μ_i, μ_i = {friction:g}")
    yield paper.compared(paper.PLATEAU, every_start(dataset, "plateau_mean", 0.5), _PLATEAU, "plateau, μ_i = 0.5")
    for stated, name, why in (
        (paper.SLIPS, "slips", _SLIPS),
        (paper.RELEASES, "releases", _RELEASES),
        (paper.TOUCHES, "touches", ""),
    ):
        yield paper.compared(stated, every_start(dataset, name, 0.5), why, f"{stated.meaning}, μ_i = 0.5")
    for stated, friction in ((paper.DISPLACEMENT_HALF, 0.5), (paper.DISPLACEMENT_QUARTER, 0.25)):
        yield paper.compared(stated, every_start(dataset, "final_displacement", friction), _DISPLACEMENT, digits=3)
    for friction in reversed(_FRICTIONS):
        spans = start_statistics(every_start(dataset, "record_spacings", friction), 2)
        yield Claim(f"node spacings of a record, μ_i = {friction:g}", "", spans, _SPANS)


_SHARE = "0.573 at W = 1e-4, the other reading of the scene; the paper's own μ_k = 0.267 is 0.534 μ_i"
_PLATEAU = "the paper's value is at its first peak"
_SLIPS = "the rest are touches"
_RELEASES = "impossible if μ_i p limits |shear|: it is reached before p reaches 0"
_DISPLACEMENT = (
    "depends on load and support; the paper's two are probably exchanged: here the larger μ_i slides further"
)
_SPANS = "the surface pattern repeats every spacing"


def draw_steps(dataset: xr.Dataset) -> Figure:
    """δ_p of every event, and their sum; the steps on a logarithmic axis."""
    run = Accessor(dataset).record(intrinsic_friction=0.5, start=0.0)
    displacement = run["displacement"].values
    steps = np.diff(displacement, prepend=0.0)
    with column() as figure:
        axes = figure.add_subplot()
        axes.semilogy(np.arange(1, len(steps) + 1), steps, ".", markersize=1.2, color=COLORS[0])
        axes.set(xlabel="event", ylabel="step per event $\\Delta\\delta_p/L_x$")
        axes.yaxis.label.set_color(COLORS[0])
        total = axes.twinx()
        total.grid(visible=False)
        total.plot(np.arange(1, len(steps) + 1), 1e3 * displacement, color=COLORS[1])
        total.set_ylabel("$\\delta_p/L_x$ ($10^{-3}$)", color=COLORS[1])
    return figure


def claims_of_steps(dataset: xr.Dataset) -> Iterator[Claim]:
    """Claims of §3.2.2 on single steps, with L_x = 1 mm."""
    nanometres = 1e9 * every_start(dataset, "mean_step_si", 0.5)
    yield Claim(paper.STEP.meaning, str(paper.STEP), start_statistics(nanometres), _STEP)
    below = [_share_below_a_nanometre(dataset, float(begin)) for begin in dataset["start"].values]
    yield Claim("share of steps below 1 nm", "many (§3.2.2)", start_statistics(np.array(below), 3), "")


def _share_below_a_nanometre(dataset: xr.Dataset, begin: float) -> float:
    run = Accessor(dataset).record(intrinsic_friction=0.5, start=begin)
    steps = np.diff(run["displacement"].values, prepend=0.0) * dataset.attrs["slab_width"]
    return float(np.mean(steps < 1e-9))


_STEP = "0.9e-3 over 2000 events is 0.45 nm; the displacement above is longer, and with it the mean step"

FIG6: Final = CampaignFigure(
    "fig6",
    "Figure 6: friction force against pin displacement",
    "Friction records of 2000 events at 129 nodes and R/L_x = 200. Colour: the pin comes down on the slab's middle. Grey: "
    "other starts within a node spacing. Dotted: the paper's 56 % of μ_i.",
    draw_records,
    claims_of_records,
)
FIG7: Final = CampaignFigure(
    "fig7",
    "Figure 7: pin displacement for each event",
    "Step per event (points, left) and displacement (line, right) of one record of 2000 events at μ_i = 0.5. Divide by a "
    "million to read a slab of 1 mm in nanometres.",
    draw_steps,
    claims_of_steps,
)
