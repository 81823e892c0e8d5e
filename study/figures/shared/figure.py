"""What a figure of this package is: a campaign that comes with nanoslip, a drawing of its dataset, and a table of claims."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Final

import xarray as xr
from matplotlib.figure import Figure

from nanoslip.study.figures.shared.claims import HEADER, Claim


@dataclass(frozen=True, slots=True)
class CampaignFigure:
    """A figure of one shipped campaign."""

    name: str
    campaign: str
    """Name of the campaign, as `nanoslip campaigns` lists it."""
    title: str
    caption: str
    draw: Callable[[xr.Dataset], Figure]
    claims: Callable[[xr.Dataset], Iterable[Claim]]
    """What stands below it; the remarks hold for the campaign as it comes with nanoslip."""
    header: tuple[str, ...] = HEADER


FIGURES: Final[dict[str, CampaignFigure]] = {}
"""Every figure by name, in the order of their chapters (see nanoslip.study.figures.catalogue)."""


def register(figure: CampaignFigure) -> CampaignFigure:
    """Add a figure: from then on the command and the gallery know it."""
    FIGURES[figure.name] = figure
    return figure
