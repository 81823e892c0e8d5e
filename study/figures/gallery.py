"""Figures as files: the picture in the formats of journals, its table as Markdown, and a page for each folder of campaigns."""

from collections.abc import Iterable, Sequence
from pathlib import Path

import xarray as xr

from study.figures.shared.canvas import image
from study.figures.shared.claims import table
from study.figures.shared.figure import FIGURES, CampaignFigure
from study.figures.shared.files import write_files

INDEX = "README.md"
"""The page of all figures of a folder."""


def place(figure: CampaignFigure, root: Path) -> Path:
    """The folder of a figure's files: as its campaign lies below `campaigns`, so it lies below the root."""
    return (root / figure.campaign).parent


def write(figure: CampaignFigure, dataset: xr.Dataset, root: Path, formats: Sequence[str]) -> list[Path]:
    """Draw a figure of its campaign's dataset into its place below a root; returns the files, the table last.

    formats: of study.figures.shared.canvas.FORMATS. Raises StoreError.
    """
    folder, drawn = place(figure, root), figure.draw(dataset)
    files = {folder / f"{figure.name}.{form}": image(drawn, form) for form in formats}
    files[folder / f"{figure.name}.md"] = _page(figure, dataset).encode()
    write_files(files)
    return list(files)


def write_indexes(root: Path) -> list[Path]:
    """Write the page of each folder below a root: all figures that were drawn there, in their order. Raises StoreError.

    A figure whose campaign lies in no folder has its own page alone.
    """
    drawn: dict[Path, list[str]] = {}
    for figure in FIGURES.values():
        folder = place(figure, root)
        page = folder / f"{figure.name}.md"
        if folder != root and page.exists():
            drawn.setdefault(folder, []).append(page.read_text("utf-8"))
    pages = {folder / INDEX: "\n".join([_head(folder.name), *texts]).encode() for folder, texts in drawn.items()}
    write_files(pages)
    return list(pages)


def _head(folder: str) -> str:
    others = ", ".join(f"[{name}](../{name})" for name in _other_pages(folder))
    return f"""# {folder.capitalize()}

Written by `make figures FIGURES=campaigns`. `nanoslip figure NAME` draws one of them, as PDF, SVG and PNG. Numbers with ± are
means and standard deviations over starts of the pin within a node spacing, with their ranges in brackets, where nothing else is
said. Beside these: {others}.
"""


def _other_pages(folder: str) -> list[str]:
    """The pages of the other folders, and of figures that lie in none, seen from the folder of all."""
    places = {place(figure, Path()): f"{figure.name}.md" for figure in FIGURES.values()}
    return [
        (where / (INDEX if where.name else alone)).as_posix() for where, alone in places.items() if where.name != folder
    ]


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
