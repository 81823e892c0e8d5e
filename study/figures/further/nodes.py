"""Where nodes slip: an elastic slab against chains of blocks on springs."""

from collections.abc import Iterator

import xarray as xr
from matplotlib.figure import Figure

from nanoslip.study.dataset.access import Accessor
from nanoslip.study.figures.further.chains import CAMPAIGN, names, plain
from nanoslip.study.figures.shared import COLORS, WITHOUT_PAPER, CampaignFigure, Claim, column, register


def draw(dataset: xr.Dataset) -> Figure:
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


def claims(dataset: xr.Dataset) -> Iterator[Claim]:
    """How much of the contact's slip lies in its front half."""
    for number, name in names(dataset).items():
        run = Accessor(dataset).record(case=number)
        x, slips = run["record_node_x"].values, run["record_node_slips"].values
        middle = float((x * slips).sum() / slips.sum())
        found = f"{100.0 * float(slips[x > 0.0].sum() / slips.sum()):.3g} % ahead of the slab's middle"
        slipping = f"{int(slips.sum())} slips of {int((slips > 0).sum())} nodes, on average at {middle:.2g} L_x"
        yield Claim(plain(name), "", found, slipping)


register(
    CampaignFigure(
        "nodes",
        CAMPAIGN,
        "Where nodes slip",
        "Share of all slips of a record at each surface node, of an elastic slab and of chains of blocks.",
        draw,
        claims,
        WITHOUT_PAPER,
    )
)
