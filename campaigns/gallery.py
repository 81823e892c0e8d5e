"""A gallery for each folder of figures below ROOT (`nanoslip figure --all --into ROOT`): `python campaigns/gallery.py ROOT`."""

import sys
from pathlib import Path
from typing import Final

from nanoslip.study.figures.gallery import list_shipped_figures, place
from nanoslip.study.figures.shared import CampaignFigure
from nanoslip.study.results.store import write_files

INDEX: Final = "README.md"
"""The gallery of a folder."""


def write_indexes(root: Path) -> list[Path]:
    """Write the gallery of each folder below a root: all figures that were drawn there, in their order. Raises StoreError.

    A figure whose campaign lies in no folder has its own page alone.
    """
    drawn: dict[Path, list[str]] = {}
    for figure in list_shipped_figures().values():
        folder = place(figure, root)
        if folder != root and (folder / f"{figure.name}.md").exists():
            drawn.setdefault(folder, []).append(_entry(figure))
    pages = {folder / INDEX: "\n\n".join([_head(folder), *texts]) for folder, texts in drawn.items()}
    write_files({path: f"{text}\n".encode() for path, text in pages.items()})
    return list(pages)


def _entry(figure: CampaignFigure) -> str:
    """A figure in its gallery: title and picture lead to its page."""
    page = f"{figure.name}.md"
    return f"## [{figure.title}]({page})\n\n[![{figure.name}]({figure.name}.png)]({page})"


def _head(folder: Path) -> str:
    """Heading of a gallery, what its figures mean together, and the ways to those of other folders and to figures in none."""
    shipped = list_shipped_figures()
    known = {INDEX, *(f"{name}.md" for name in shipped)}
    first = [f"[{_title(path)}]({path.name})" for path in sorted(folder.glob("*.md")) if path.name not in known]
    begin = f"\n\nSummary: {', '.join(first)}." if first else ""
    places = {place(figure, Path()): f"{figure.name}.md" for figure in shipped.values()}
    pages = [
        (where / (INDEX if where.name else alone)).as_posix()
        for where, alone in places.items()
        if where.name != folder.name
    ]
    others = ", ".join(f"[{page}](../{page})" for page in pages)
    return f"""# {folder.name.capitalize()}{begin}

Each title links to the numbers. `nanoslip figure NAME` draws a figure, `make figures FIGURES=campaigns` writes this page.
Brackets: standard deviation (s.d.) and range over starts. See also {others}."""


def _title(page: Path) -> str:
    return page.read_text("utf-8").partition("\n")[0].removeprefix("# ")


if __name__ == "__main__":
    write_indexes(Path(sys.argv[1]))
