"""Friction of a pin pulled over its contact, which remembers the way, less that over its record: the same 32 starts."""

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any, Final

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from nanoslip.solver.view import with_error
from nanoslip.study.figures.points import typeset
from nanoslip.study.figures.shared import CampaignFigure, Claim, Number, column, series_style, start_mean

SPEEDS: Final = {"": "2 mm/s", ", slow": "0.5 mm/s"}
"""What follows a drive's name -> velocity of its stage."""
LABELS: Final = {
    "static_friction": "μ_s",
    "kinetic_friction": "μ_k",
    "macroscopic_slips": "macroscopic slips",
    "time_stuck": "share of time stuck",
}
"""Variable -> its label."""


def pairs(dataset: xr.Dataset, name: str) -> dict[str, Any]:
    """Scheme and velocity -> a number of each start, (2, starts): over the record, over the contact."""
    found = dataset.squeeze()[name]
    return {
        f"{scheme}, {label}": found.sel(scheme=scheme, drive=[f"record{speed}", f"contact{speed}"])
        .transpose("drive", "start")
        .values.astype(float)
        for scheme in dataset["scheme"].values.tolist()
        for speed, label in SPEEDS.items()
    }


def change(both: Any) -> Number:
    """Change by memory, mean over the starts, with its ±."""
    return start_mean(both[1] - both[0])


def largest_share(dataset: xr.Dataset, name: str) -> Number:
    """The largest change of all drives, over the number itself."""
    changes = [(change(both), float(np.nanmean(both[0]))) for both in pairs(dataset, name).values()]
    found, whole = max(changes, key=lambda each: abs(each[0].value / each[1]))
    return Number(found.value / whole, found.error / whole)


def mean_change(dataset: xr.Dataset, name: str) -> Number:
    """Mean of the changes of all drives."""
    return start_mean(np.concatenate([both[1] - both[0] for both in pairs(dataset, name).values()]))


def draw(dataset: xr.Dataset) -> Figure:
    """μ_k and μ_s of every start over the contact, over those over the record."""
    with column(4.0) as figure:
        for axes, (name, label) in zip(figure.subplots(2, 1), list(LABELS.items())[:2], strict=True):
            for number, (drive, (record, contact)) in enumerate(pairs(dataset, name).items()):
                axes.plot(record, contact, label=drive, **series_style(number, linestyle=""))
            axes.axline((float(record[0]),) * 2, slope=1.0, linestyle=":", color="0.5")
            axes.set(xlabel=typeset(f"{label} over the record"), ylabel=typeset(f"{label} over the contact"))
        figure.axes[0].legend()
    return figure


def claims(dataset: xr.Dataset) -> Iterator[Claim]:
    """Each number over the record, and its change by memory."""
    for name, label in LABELS.items():
        for drive, both in pairs(dataset, name).items():
            yield Claim(f"{drive}: {label}", with_error(*start_mean(both[0])), with_error(*change(both)))


NUMBERS: Final[Mapping[str, Any]] = {
    "largest change of μ_k": partial(largest_share, name="kinetic_friction"),
    "largest change of μ_s": partial(largest_share, name="static_friction"),
    "more macroscopic slips": partial(mean_change, name="macroscopic_slips"),
}
MEMORY: Final = CampaignFigure(
    "memory",
    "A driven pin with and without memory",
    "Coefficients of each start: the pin pulled over its contact, which remembers the way, over those of the pin pulled over its "
    "record by Eq. 13-15. Table: means over 32 starts and their ±.",
    draw,
    claims,
    ("", "over the record", "memory changes it by", ""),
)
