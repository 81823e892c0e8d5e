"""Modulation of the plateau within one node spacing: a shorter record depends on the part of the spacing that the pin crosses."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from nanoslip.solver.arrays import Floats
from nanoslip.solver.sliding.plateau import Teeth
from nanoslip.study.dataset.access import Accessor
from nanoslip.study.figures.shared import CampaignFigure, Claim, column

BINS = 32
"""Parts of a node spacing."""


@dataclass(frozen=True, slots=True, eq=False)
class Modulation:
    """Mean friction force in parts of a node spacing, over its mean, for every whole spacing of every start."""

    phase: Floats
    """(b,) middle of each part, in node spacings from where the middle of the pin is over a node."""
    share: Floats
    """(s, b) force over its mean along the spacing, less 1."""
    nodes: float
    """Mean number of nodes in contact."""

    @property
    def amplitude(self) -> float:
        """Half of the difference between the highest and the lowest part, of the mean over all spacings."""
        return 0.5 * float(np.ptp(self.share.mean(axis=0)))

    @property
    def repeats(self) -> float:
        """Share of the variance within a spacing that is the same in every spacing."""
        return float(self.share.mean(axis=0).var() / self.share.var())


def modulation(dataset: xr.Dataset, normal_load: float) -> Modulation:
    """Cut the steady part of each start's record into whole spacings."""
    rows, nodes = [], []
    spacing = 1.0 / (int(dataset["n_x"].squeeze()) - 1)
    for start in dataset["start"].values.tolist():
        run = Accessor(dataset).record(normal_load=normal_load, start=start)
        displacement = run["displacement"].values
        teeth = Teeth(displacement, run["event_force_after"].values[:-1], run["event_force_before"].values[1:])
        begins = float(dataset["plateau_start"].sel(normal_load=normal_load, start=start).squeeze())
        first = (np.ceil(begins / spacing + start) - start) * spacing
        for turn in range(int((displacement[-1] - first) / spacing)):
            means = teeth.block_means(first + turn * spacing, first + (turn + 1) * spacing, BINS)
            rows.append(means / means.mean() - 1.0)
        nodes.append(float(run["event_contact_size"].values.mean()))
    return Modulation((np.arange(BINS) + 0.5) / BINS, np.array(rows), float(np.mean(nodes)))


def draw(dataset: xr.Dataset) -> Figure:
    """One line for each load: the mean over all spacings; band: the standard deviation between them."""
    with column() as figure:
        axes = figure.add_subplot()
        for load in dataset["normal_load"].values:
            found = modulation(dataset, float(load))
            mean, spread = 100.0 * found.share.mean(axis=0), 100.0 * found.share.std(axis=0)
            line = axes.plot(found.phase, mean, label=f"{found.nodes:.0f} nodes in contact")
            axes.fill_between(
                found.phase, mean - spread, mean + spread, color=line[0].get_color(), alpha=0.2, linewidth=0
            )
        axes.set(xlabel="pin over the nodes, in node spacings", ylabel="force over its mean (%)", xlim=(0, 1))
        axes.legend()
    return figure


def claims(dataset: xr.Dataset) -> Iterator[Claim]:
    """Amplitude for each load, and how it falls with the number of nodes."""
    for load in dataset["normal_load"].values:
        found = modulation(dataset, float(load))
        text = f"{100 * found.amplitude:.2g} % of the plateau; times nodes: {found.nodes * found.amplitude:.2g}"
        remark = (
            f"{100 * found.repeats:.0f} % of the variance within a spacing is the same in each of {len(found.share)}"
        )
        yield Claim(f"amplitude with {found.nodes:.0f} nodes in contact", "", text, remark)


MODULATION: Final = CampaignFigure(
    "modulation",
    "Modulation of the plateau over a node spacing",
    "Friction force in 32 parts of a node spacing over its mean along it, for three loads at 129 nodes. Lines: mean over all "
    "spacings of four starts; bands: standard deviation between spacings.",
    draw,
    claims,
)
