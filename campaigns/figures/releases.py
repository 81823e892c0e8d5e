"""Events triggered by a release over a small strength that needs no pressure, beside the paper's 44 (§3.2.1)."""

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any, Final

import numpy as np
import paper
import xarray as xr
from matplotlib.figure import Figure

from nanoslip.solver.arrays import Floats
from nanoslip.solver.view import with_error
from nanoslip.study.figures.points import typeset
from nanoslip.study.figures.shared import (
    CampaignFigure,
    Claim,
    Number,
    column,
    series_style,
    start_mean,
    start_statistics,
)

READINGS: Final[Mapping[float, str]] = {1e-3: "A: L_x = 1 mm", 1e-4: "B: L_x = 1 cm"}
"""Load -> reading of the paper's scene that has it."""


def of_starts(dataset: xr.Dataset, variable: str, load: float, strength: float) -> Floats:
    """A variable of every start, (m,)."""
    return np.asarray(dataset[variable].sel(normal_load=load, strength=strength).values, float).ravel()


def share_of_limit(dataset: xr.Dataset, load: float, strength: float) -> float:
    """The strength over the mean limit by pressure, μ_i·W/area, mean over starts."""
    width = float(of_starts(dataset, "initial_contact_size", load, strength).mean()) / (int(dataset["n_x"].item()) - 1)
    return strength * width / (float(dataset["intrinsic_friction"].item()) * load)


def plateau(dataset: xr.Dataset, load: float, strength: float) -> Floats:
    """Plateau over μ_i of every start, (m,)."""
    return of_starts(dataset, "plateau_ratio", load, strength)


def releases(dataset: xr.Dataset, load: float, strength: float) -> Number:
    """Mean of the events triggered by a release over starts, with its ±."""
    return start_mean(of_starts(dataset, "releases", load, strength))


def change_of_plateau(dataset: xr.Dataset, load: float) -> Number:
    """Plateau over μ_i with the largest strength less that without, mean over starts, with its ±."""
    strengths = dataset["strength"].values
    with_strength, without = (plateau(dataset, load, strength) for strength in (strengths[-1], strengths[0]))
    return start_mean(with_strength - without)


def draw(dataset: xr.Dataset) -> Figure:
    """Releases of single starts and their mean over the strength, a colour for each reading."""
    with column() as figure:
        axes = figure.add_subplot()
        for number, load in enumerate(READINGS):
            strengths = [strength for strength in dataset["strength"].values.tolist() if strength > 0.0]
            shares = [share_of_limit(dataset, load, strength) for strength in strengths]
            counts = [of_starts(dataset, "releases", load, strength) for strength in strengths]
            look = series_style(number)
            for share, count in zip(shares, counts, strict=True):
                axes.plot(np.full(len(count), share), count, color=look["color"], marker=".", linestyle="", alpha=0.3)
            axes.plot(shares, [count.mean() for count in counts], label=READINGS[load], **look)
        axes.axhline(paper.RELEASES.value, color="0.5", linestyle=":", label="the paper")
        axes.set(xscale="log", xlabel=typeset("strength over the mean limit"), ylabel="events triggered by a release")
        axes.set_yscale("symlog", linthresh=1.0)
        axes.set_ylim(bottom=0.0)
        figure.legend(*axes.get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return figure


def claims(dataset: xr.Dataset) -> Iterator[Claim]:
    """Triggers of 2000 events, and the plateau, of each reading and strength."""
    for load, reading in READINGS.items():
        for strength in dataset["strength"].values.tolist():
            share = share_of_limit(dataset, load, strength)
            others = (of_starts(dataset, name, load, strength) for name in ("slips", "touches"))
            slips, touches = (with_error(*start_mean(counts)) for counts in others)
            released = start_statistics(of_starts(dataset, "releases", load, strength), 3)
            ratio = with_error(*start_mean(plateau(dataset, load, strength)))
            yield Claim(f"{reading}, strength {share:.1e} of the mean limit", f"{slips}, {touches}", released, ratio)


NUMBERS: Final[Mapping[str, Any]] = {
    **{
        f"{reading[0]}: {strength:g}": partial(releases, load=load, strength=strength)
        for load, reading in READINGS.items()
        for strength in (0.0, 1e-7)
    },
    **{f"{reading[0]}: change of plateau": partial(change_of_plateau, load=load) for load, reading in READINGS.items()},
}
RELEASES: Final = CampaignFigure(
    "releases",
    "Releases that come with a small strength",
    "Events of 2000 that a release triggers, over a strength that needs no pressure, as a share of the mean limit "
    "μ_i·W/area: means over 16 starts, and single starts (dots). The paper prints 1952 slips, 44 releases and 4 touches.",
    draw,
    claims,
    ("", "slips, touches", "releases", "plateau/μ_i"),
)
