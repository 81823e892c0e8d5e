"""Motion of the pin over a record that repeats after 2000 events, beside one of eight node spacings: the same 16 starts."""

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any, Final

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from nanoslip.solver.view import with_error
from nanoslip.study.figures.points import typeset
from nanoslip.study.figures.shared import COLORS, CampaignFigure, Claim, Number, column, start_mean

KINDS: Final = {"static_friction": "μ_s", "kinetic_friction": "μ_k", "macroscopic_slips": "macroscopic slips"}
"""Variable -> its label."""


def of_starts(dataset: xr.Dataset, name: str) -> Any:
    """A number of each start: (2, starts), of the repeated record and of the long one."""
    return dataset.squeeze()[name].sortby("max_events").transpose("max_events", "start").values.astype(float)


def change(dataset: xr.Dataset, name: str) -> Number:
    """Change by the repetition, mean over the starts, with its ±."""
    short, long = of_starts(dataset, name)
    return start_mean(short - long)


def share(dataset: xr.Dataset, name: str) -> Number:
    """The change over the number of the long record."""
    whole = float(np.nanmean(of_starts(dataset, name)[1]))
    return Number(*(each / whole for each in change(dataset, name)))


def draw(dataset: xr.Dataset) -> Figure:
    """μ_s over μ_k of every start, and how many starts have so many macroscopic slips."""
    with column(4.0) as figure:
        upper, lower = figure.subplots(2, 1)
        kinetic, static, slips = (
            of_starts(dataset, name) for name in ("kinetic_friction", "static_friction", "macroscopic_slips")
        )
        counts = np.arange(slips.max() + 2)
        for number, label in enumerate(("2000 events, repeated", "eight node spacings")):
            upper.plot(kinetic[number], static[number], "o^"[number], color=COLORS[number], markersize=3, label=label)
            found = [np.count_nonzero(slips[number] == each) for each in counts]
            lower.bar(counts + 0.4 * number - 0.2, found, 0.4, color=COLORS[number])
            lower.plot(counts + 0.4 * number - 0.2, found, ".", color=COLORS[number], markersize=1)
        upper.set(xlabel=typeset("μ_k"), ylabel=typeset("μ_s"))
        lower.set(xlabel="macroscopic slips in 0.4 s", ylabel="starts")
        upper.legend()
    return figure


def claims(dataset: xr.Dataset) -> Iterator[Claim]:
    """Each number of both records, and the change."""
    for name, label in KINDS.items():
        short, long = (with_error(*start_mean(each)) for each in of_starts(dataset, name))
        yield Claim(label, short, long, with_error(*change(dataset, name)))


NUMBERS: Final[Mapping[str, Any]] = {
    "change of μ_s": partial(share, name="static_friction"),
    "change of μ_k": partial(share, name="kinetic_friction"),
    "more macroscopic slips": partial(change, name="macroscopic_slips"),
}
EXTENSION: Final = CampaignFigure(
    "extension",
    "What the repeated record does to the driven pin",
    "Coefficients of 16 starts (above), and numbers of starts with so many macroscopic slips (below): the paper's drive over a "
    "record of 2000 events that repeats, and over one of eight node spacings. Table: means over starts and their ±.",
    draw,
    claims,
    ("", "2000 events, repeated", "eight node spacings", "change"),
)
