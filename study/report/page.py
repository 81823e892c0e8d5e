"""One HTML page for a campaign: outcomes, figures, a table, then costs and errors.

Everything is inside: figures as SVG with their numbers as CSV, style and script. It works without the script.
"""

import base64
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final, NamedTuple

import jinja2
import xarray as xr
from markupsafe import Markup, escape

from nanoslip.solver.case import parameters_of_a_case
from nanoslip.study.dataset import variables
from nanoslip.study.dataset.compare import values
from nanoslip.study.dataset.units import read_scales, readable
from nanoslip.study.figures.answer import capitalize_text
from nanoslip.study.figures.points import SYMBOL
from nanoslip.study.figures.shared import COLORS, Sort, View, format_csv, image
from nanoslip.study.figures.views import SORTS
from nanoslip.study.inference.pictures import SENSITIVITY
from nanoslip.study.manifest.manifest import drive_parameters, drive_sizes
from nanoslip.study.manifest.parameters import FILE_KEYS, si_line, span
from nanoslip.study.report import summary
from nanoslip.study.results import attempts as runs
from nanoslip.study.results.attempts import RunRecord
from nanoslip.study.results.store import write_files

# The runs that computed a dataset, for its page: their time in a sentence.


def cost(runs: Sequence[RunRecord]) -> str:
    """Time and processes of all runs of a campaign, in a sentence."""
    ended = [run for run in runs if run.ended]
    if not ended:
        return "Not known: nothing beside the dataset says what its runs took."
    wall = sum(run.wall_seconds for run in ended)
    core = sum(run.core_seconds for run in ended)
    processor = sum(run.processor_seconds for run in ended)
    most = max(run.processes for run in ended)
    processes = "one process" if most == 1 else f"up to {most} processes"
    times = f"{len(ended)} runs" if len(ended) > 1 else "one run"
    tasks = sum(run.done + run.failed for run in ended)
    # A run of an older version has no processor time.
    share = f", of which {_time(processor)} of processor time" if processor > 0.0 else ""
    missing = len(runs) - len(ended)
    further = f" {missing} more did not come to their end." if missing else ""
    return f"{_time(wall)} in {times} with {processes}; {tasks} tasks took {_time(core)}{share}.{further}"


def _time(seconds: float) -> str:
    for unit, size in (("h", 3600.0), ("min", 60.0)):
        if seconds >= 2 * size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds:.3g} s"


# Notes on the numbers of a page: sizes in SI, and effects left out.


def sizes_in_si(dataset: xr.Dataset) -> Iterator[str]:
    """The sizes of cases and of their results in SI, a line each; none if a dataset does not state its scales."""
    scales = read_scales(dataset.attrs)
    if scales is None:
        return
    parameters = {name: values(dataset, name) for name in parameters_of_a_case()}
    sizes_of_cases = {name: sizes for name, sizes in parameters.items() if sizes}
    yield si_line(scales, {}, sizes_of_cases)
    drives = {name: values(dataset, name) for name in drive_parameters()}
    sizes_of_drives = drive_sizes(drives)
    if sizes_of_drives:
        yield capitalize_text(f"drive: {', '.join(sizes_of_drives)}")
    for name in ("final_displacement_si", "mean_step_si", "surface_stiffness_si"):
        if name in dataset and bool(dataset[name].notnull().any()):
            sizes = dataset[name]
            unit = readable(sizes.attrs["units"])
            meaning = capitalize_text(sizes.attrs["long_name"])
            yield f"{meaning}: {span([float(sizes.min()), float(sizes.max())], unit)}"


def missing_groups(dataset: xr.Dataset) -> Iterator[str]:
    """Groups of runs and fits that the dataset does not have, a line each."""
    kept = {"record_id": ("Friction records", "plateau_mean"), "trajectory_id": ("Motions of pins", "drive_outcome")}
    for group, (words, asked) in kept.items():
        if asked in dataset and group not in dataset:
            yield f"{words} are not kept ([outputs] of the campaign): there are no figures of single cases."
    if "record_id" in dataset and "slips_exponent" not in dataset:
        yield "Distributions of event sizes are not computed: [outputs] statistics of the campaign."


# A figure as part of a page: an SVG that follows the page's light or dark colours, and its numbers as a link to a file.

DARK: Final = ("#389de3", "#ff987f", "#85e872", "#fff0c0", "#68519b", "#797979")
"""The colours of lines on a dark page, in the order of COLORS."""
_INK: Final = (("#000000", "ink", "#e6e6e6"), ("#ffffff", "paper", "#16181c"), ("#c00000", "bad", "#ff6b6b"))
"""Colour on a light page, its name, colour on a dark page."""


class PageFigure(NamedTuple):
    """One figure of a page. source and data: the drawing and its numbers, as addresses that hold them. width, height: pixels."""

    name: str
    caption: str
    source: str
    width: int
    height: int
    data: str


def picture(view: View) -> PageFigure:
    """Draw a view for a page."""
    figure = view.draw()
    svg = theme_svg(image(figure, "svg").decode())
    source = address(svg, "image/svg+xml")
    # CSS has 96 pixels in an inch.
    width, height = (round(96 * inches) for inches in figure.get_size_inches())
    data = address(format_csv(view.columns()), "text/csv")
    return PageFigure(view.name, view.caption, source, width, height, data)


def theme_svg(svg: str) -> str:
    """An SVG whose lines, text and background follow `prefers-color-scheme`."""
    pairs = zip(COLORS, DARK, strict=True)
    numbered = enumerate(pairs)
    lines = ((light, f"c{number}", dark) for number, (light, dark) in numbered)
    colors = [*_INK, *lines]
    # Matplotlib writes colours as attributes and in styles; a variable of CSS can change with the reader's setting.
    for light, name, _ in colors:
        svg = re.sub(rf"((?:fill|stroke): ?){light}", rf"\1var(--{name})", svg)
    lights = "".join(f"--{name}:{light};" for light, name, _ in colors)
    darks = "".join(f"--{name}:{dark};" for _, name, dark in colors)
    style = f"svg{{{lights}fill:var(--ink)}}@media(prefers-color-scheme:dark){{svg{{{darks}}}}}"
    # Where nothing is drawn the page's own background shows.
    style += "#patch_1 path{fill:none!important}"
    # An XML declaration inside a page is an error.
    start = svg.index("<svg")
    head, _, rest = svg[start:].partition(">")
    return f"{head}><style>{style}</style>{rest}"


def address(text: str, kind: str) -> str:
    """Text as an address that holds it, of this media type."""
    return f"data:{kind};base64,{base64.b64encode(text.encode()).decode()}"


FILE: Final = "report.html"
LONG: Final = 40
"""Letters of an outcome that a line has room for."""
_THINNED: Final = ("records", "drives")
"""Prefixes of the names of figures whose lines are thinned."""
_ELSEWHERE: Final = ("title", "manifest", *(f"manifest_{key}" for key in FILE_KEYS))
"""Attributes that the page shows above, or that are too long to be shown."""


class Section(NamedTuple):
    """The figures of the same sort."""

    title: str
    pictures: tuple[PageFigure, ...]
    notes: tuple[str, ...]
    """Sentences on omitted figures."""


def place_sections(sections: Sequence[Section]) -> list[tuple[str, Section]]:
    """Sections with their places on a broad page: a `half` beside the next one, `alone` without one, "" across."""
    placed: list[tuple[str, Section]] = []
    for section in sections:
        if len(section.pictures) > 1:
            placed.append(("", section))
        elif placed and placed[-1][0] == "alone":
            _, neighbour = placed.pop()
            placed += [("half", neighbour), ("half", section)]
        else:
            placed.append(("alone", section))
    return placed


def write_page(dataset: xr.Dataset, out: Path, answer: str = "") -> Path:
    """Write the page of a dataset into a folder, with the runs that are written down there. Raises StoreError."""
    path = out / FILE
    text = page(dataset, runs.read_runs(out), answer)
    write_files({path: text.encode()})
    return path


def page(dataset: xr.Dataset, journal: Sequence[RunRecord], answer: str = "") -> str:
    """The page as HTML. journal: the runs that computed its results, as far as they are known. answer: its first sentence."""
    sorts = (SENSITIVITY, *SORTS.values())
    candidates = (section(dataset, sort) for sort in sorts)
    sections = list(filter(None, candidates))
    titles = [section.title for section in sections]
    cases = summary.scalar_table(dataset, scales=read_scales(dataset.attrs))
    table, alike = summary.factor_out_columns(cases)
    facts = {
        "Cost": [cost(journal)],
        "In SI": list(sizes_in_si(dataset)),
        "Not shown": list(_not_shown(dataset, sections, len(table.rows))),
    }
    # Where a value is not known the template is to fail, so every name has one, if need be an empty one.
    contents = {
        "title": dataset.attrs["title"],
        "answer": answer,
        "titles": (*titles, "Cases", "About these numbers", "Campaign", "Provenance"),
        "long": LONG,
        "manifest": dataset.attrs.get("manifest", ""),
        "attributes": {name: value for name, value in dataset.attrs.items() if name not in _ELSEWHERE},
        "endings": summary.endings(dataset),
        "failures": summary.failure_summary(dataset).values(),
        "drives": summary.drive_summary(dataset),
        "flags": summary.cautions(dataset),
        "facts": facts,
        "sections": place_sections(sections),
        "table": table,
        "alike": [*alike, *filter(None, [variables.explain_means(dataset, cases.names)])],
    }
    return _template().render(contents)


def _template() -> jinja2.Template:
    """The template of a page: text is escaped, and a name that it does not know is an error."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("nanoslip.study.report"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["lowered"] = lower_subscripts
    environment.filters["slug"] = lambda title: title.lower().replace(" ", "-")
    return environment.get_template("report.html.j2")


def lower_subscripts(text: str) -> Markup:
    """Text with the subscripts of its symbols lowered, as HTML."""
    return Markup(SYMBOL.sub(r"\1<sub>\2</sub>", str(escape(text))))


def section(dataset: xr.Dataset, sort: Sort) -> Section | None:
    """The figures of a sort, and notes on omitted figures; None if a dataset has neither."""
    contents = list(sort.of(dataset))
    if not contents:
        return None
    pictures = tuple(picture(view) for view in contents if isinstance(view, View))
    notes = tuple(sentence for sentence in contents if isinstance(sentence, str))
    return Section(sort.title, pictures, notes)


def _not_shown(dataset: xr.Dataset, sections: Sequence[Section], rows: int) -> Iterator[str]:
    yield from missing_groups(dataset)
    if rows > summary.MOST_ROWS:
        yield f"Table: the first {summary.MOST_ROWS} cases; the dataset has all."
    names = (figure.name for section in sections for figure in section.pictures)
    if any(name.startswith(_THINNED) for name in names):
        yield "Lines of many points are thinned to what can be seen, in figures and their CSV."
