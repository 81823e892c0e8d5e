"""Figures of campaigns: found in the scripts beside them; as files, with pages of their tables."""

import math
import runpy
import sys
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import xarray as xr

from nanoslip.study.figures.shared import CampaignFigure, image, table
from nanoslip.study.results.store import StoreError
from nanoslip.study.shipped import campaign_files


@cache
def list_shipped_figures() -> dict[str, CampaignFigure]:
    """Name -> each figure of the campaigns that come with nanoslip: the paper's by their numbers, then the others."""
    figures: list[CampaignFigure] = []
    for name, path in campaign_files().items():
        figures += script_figures(path, name)
    return {figure.name: figure for figure in sorted(figures, key=_number)}


def script_figures(campaign: Path, name: str = "") -> tuple[CampaignFigure, ...]:
    """The figures that the script beside a campaign file defines; none if there is no script. It may import its neighbours.

    name: of the campaign; else its file's. Raises StoreError if the script fails or defines none.
    """
    script = campaign.with_suffix(".py")
    if not script.is_file():
        return ()
    try:
        values = execute_script(script).values()
        figures = [value for value in values if isinstance(value, CampaignFigure)]
    except Exception as error:
        # A script may be anybody's: whatever it raises is a fault of the file.
        raise StoreError(f"{script}: cannot be run: {type(error).__name__}: {error}") from error
    if not figures:
        raise StoreError(f"{script}: needs a variable that is a nanoslip.study.figures.shared.CampaignFigure")
    return tuple(replace(figure, campaign=name or campaign.stem) for figure in figures)


def execute_script(script: Path) -> dict[str, Any]:
    """Names that a script defines. Its imports of neighbours are private, as other folders may have files of the same names."""
    neighbours = {path.stem for path in script.parent.glob("*.py")}
    # Modules of the same names, loaded for another folder, stand aside meanwhile.
    loaded = neighbours & sys.modules.keys()
    others = {name: sys.modules.pop(name) for name in loaded}
    sys.path.insert(0, str(script.parent))
    try:
        return runpy.run_path(str(script))
    finally:
        sys.path.remove(str(script.parent))
        # Removed again, or the script of the next folder would get these.
        for name in neighbours:
            sys.modules.pop(name, None)
        sys.modules.update(others)


def _number(figure: CampaignFigure) -> float:
    number = figure.name.removeprefix("fig")
    return int(number) if number.isdigit() else math.inf


def place(figure: CampaignFigure, root: Path) -> Path:
    """The folder of a figure's files: as its campaign lies below `campaigns`, so it lies below the root."""
    return (root / figure.campaign).parent


def figure_paths(figure: CampaignFigure, dataset: xr.Dataset, root: Path, formats: Sequence[str]) -> dict[Path, bytes]:
    """The files of a figure of its campaign's dataset, in its place below a root: pictures, then its page.

    formats: of nanoslip.study.figures.shared.FORMATS.
    """
    folder, drawn = place(figure, root), figure.draw(dataset)
    # Pictures come first: nobody finds a page whose pictures are missing, if writing fails between them.
    files = {folder / f"{figure.name}.{form}": image(drawn, form) for form in formats}
    return files | {folder / f"{figure.name}.md": _page(figure, dataset).encode()}


def _page(figure: CampaignFigure, dataset: xr.Dataset) -> str:
    """Heading, picture, caption and claims, as Markdown."""
    picture = f"![{figure.title}]({figure.name}.png)"
    source = f"*{figure.caption}* Campaign: `{figure.campaign}`."
    claims = table(figure.claims(dataset), figure.header)
    return "\n\n".join((f"# {figure.title}", picture, source, claims)) + "\n"
