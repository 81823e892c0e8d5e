"""Figures as files: the picture in the formats of journals, its table as Markdown, and one page of all figures."""

from collections.abc import Iterable, Sequence
from pathlib import Path

import xarray as xr

from study.figures.shared.canvas import image
from study.figures.shared.claims import table
from study.figures.shared.figure import FIGURES, CampaignFigure
from study.figures.shared.files import write_files

INDEX = "README.md"
"""The page of all figures."""


def write(figure: CampaignFigure, dataset: xr.Dataset, folder: Path, formats: Sequence[str]) -> list[Path]:
    """Draw a figure of its campaign's dataset into a folder; returns the files, the table last. Raises StoreError.

    formats: of study.figures.canvas.FORMATS.
    """
    drawn = figure.draw(dataset)
    files = {folder / f"{figure.name}.{form}": image(drawn, form) for form in formats}
    files[folder / f"{figure.name}.md"] = _page(figure, dataset).encode()
    write_files(files)
    return list(files)


def write_index(folder: Path) -> Path:
    """Write the page of all figures, each with its picture (PNG), caption and table, from the files in a folder."""
    tables = [(folder / f"{figure.name}.md").read_text("utf-8") for figure in FIGURES.values()]
    path = folder / INDEX
    write_files({path: "\n".join([_HEAD, *tables]).encode()})
    return path


_HEAD = """# Figures

Written by `make figures FIGURES=campaigns/figures`. `nanoslip figure NAME` draws one of them, as PDF, SVG and PNG. Numbers
are means ± standard deviations over starts of the pin within a node spacing, with their ranges in brackets.
"""


def _page(figure: CampaignFigure, dataset: xr.Dataset) -> str:
    """Heading, picture, caption and claims of a figure, as Markdown."""
    claims = table(figure.claims(dataset), figure.header)
    picture = f"![{figure.caption}]({figure.name}.png)"
    source = f"*{figure.caption}* Campaign: `{figure.campaign}`."
    return "\n\n".join((f"## {figure.title}", picture, source, claims)) + "\n"


def campaigns_of(names: Iterable[str]) -> dict[str, list[CampaignFigure]]:
    """Campaign -> its figures among those named, in their order."""
    found: dict[str, list[CampaignFigure]] = {}
    for name in names:
        found.setdefault(FIGURES[name].campaign, []).append(FIGURES[name])
    return found
