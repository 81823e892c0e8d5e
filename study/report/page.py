"""One HTML page that answers a campaign's question: how its cases ended, figures, a table, then what is behind the numbers.

Everything is inside: figures as SVG with their numbers as CSV, style and script. It works without the script.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import jinja2
import xarray as xr
from markupsafe import Markup, escape

from study.dataset.members import means_of, modelled
from study.figures.shared.files import write_files
from study.figures.sweep.label import SYMBOL
from study.figures.views.catalogue import SORTS
from study.figures.views.choice import spread
from study.figures.views.view import Sort
from study.report import overview
from study.report.common import said_once
from study.report.journal import cost, run_table
from study.report.picture import Picture, picture
from study.report.summary import MOST_ROWS, flag_summary, left_out_summary, scalar_table, short_summary
from study.results import attempts as runs
from study.results.attempts import Run

FILE: Final = "report.html"
MOST_SINGLE: Final = 24
"""The most figures of single records, drives, … that a page shows."""
FEW_SINGLE: Final = 6
"""Small figures that find room below a large one of half the page's width."""
_THINNED: Final = ("records", "drives")
"""What the names of figures begin with whose lines are thinned."""
_ELSEWHERE: Final = ("title", "manifest", "manifest_front", "manifest_table", "manifest_roughness")
"""Attributes that the page shows above, or that are too long to be shown."""


@dataclass(frozen=True, slots=True)
class Section:
    """The figures of one sort: large ones, and single cases behind small ones."""

    title: str
    large: tuple[Picture, ...]
    single: tuple[Picture, ...]
    notes: tuple[str, ...]
    """Sentences on what is not drawn."""

    @property
    def narrow(self) -> bool:
        """Whether half of a broad page is enough for its large figures."""
        return len(self.large) <= 1


def placed(sections: Sequence[Section]) -> list[tuple[str, Section]]:
    """Sections with their places on a broad page: a `half` beside the next one, or `alone` without one.

    A section of `many` small figures has them beside and below its large one; one of several large figures, "", goes all across.
    """
    found: list[tuple[str, Section]] = []
    for section in sections:
        if not section.narrow:
            found.append(("", section))
        elif len(section.single) > FEW_SINGLE:
            found.append(("many", section))
        elif found and found[-1][0] == "alone":
            found[-1:] = [("half", found[-1][1]), ("half", section)]
        else:
            found.append(("alone", section))
    return found


def write(dataset: xr.Dataset, out: Path) -> Path:
    """Write the page of a dataset into a folder, with the runs that are written down there. Raises StoreError."""
    path = out / FILE
    write_files({path: page(dataset, runs.read(out)).encode()})
    return path


def page(dataset: xr.Dataset, journal: Sequence[Run]) -> str:
    """The page as HTML. journal: the runs that computed its results, as far as they are known."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("study.report"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["lowered"] = lowered
    sections = tuple(found for sort in SORTS.values() if (found := section(dataset, sort)))
    table, alike = said_once(scalar_table(dataset))
    return environment.get_template("report.html.j2").render(
        title=dataset.attrs["title"],
        manifest=dataset.attrs.get("manifest", ""),
        attributes={name: value for name, value in dataset.attrs.items() if name not in _ELSEWHERE},
        endings=overview.endings(dataset),
        regimes=overview.regimes(dataset),
        flags=[*left_out_summary(dataset), *short_summary(dataset), *flag_summary(dataset)],
        facts={
            "Cost": [cost(journal)],
            "Accuracy": list(overview.accuracy(dataset)),
            "Scales": list(overview.scales(dataset)),
            "Not shown": list(_not_shown(dataset, sections, len(table.rows))),
        },
        sections=placed(sections),
        table=table,
        alike=[*alike, *filter(None, [means_of(dataset), modelled(dataset)])],
        runs=run_table(journal),
    )


def lowered(text: str) -> Markup:
    """Text with the subscripts of its symbols lowered, as HTML."""
    return Markup(SYMBOL.sub(r"\1<sub>\2</sub>", str(escape(text))))


def section(dataset: xr.Dataset, sort: Sort) -> Section | None:
    """The figures of a sort, and notes on those left out; None where a dataset has neither."""
    views, notes = list(sort.views(dataset)), list(sort.notes(dataset))
    if not views and not notes:
        return None
    single = [view for view in views if view.place]
    chosen = spread([view.place for view in single], MOST_SINGLE)
    if left := len(single) - len(chosen):
        notes.append(
            f"{len(chosen)} of {len(single)} single cases are drawn small, spread over all axes; {left} are not shown."
        )
    large = tuple(picture(view) for view in views if not view.place)
    return Section(sort.title, large, tuple(picture(single[position]) for position in chosen), tuple(notes))


def _not_shown(dataset: xr.Dataset, sections: Sequence[Section], rows: int) -> Iterator[str]:
    yield from overview.left_out(dataset)
    if rows > MOST_ROWS:
        yield f"Table: the first {MOST_ROWS} cases; the dataset has all."
    if any(picture.name.startswith(_THINNED) for section in sections for picture in section.large):
        yield "Lines of many points are thinned to what can be seen, in figures and their CSV."
