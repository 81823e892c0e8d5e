"""`nanoslip figure`: a number of a campaign over its axes; figures of the shipped campaigns, with their tables."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from nanoslip.study import api, shipped
from nanoslip.study.commands.shared.exits import Refusal
from nanoslip.study.commands.shared.refusals import refusals
from nanoslip.study.commands.shared.sources import dataset_of
from nanoslip.study.figures.catalogue import FIGURES
from nanoslip.study.figures.gallery import campaigns_of, write, write_indexes
from nanoslip.study.figures.shared.canvas import FORMATS, format_of, image
from nanoslip.study.figures.shared.claims import as_row
from nanoslip.study.figures.shared.files import write_files
from nanoslip.study.figures.sweep.names import axis_named, points_named
from nanoslip.study.figures.views.answer import view_of
from nanoslip.study.figures.views.view import csv_of
from nanoslip.study.report.console import Table, print_entries, print_table, say, whole

RESULTS = Path("results")
"""Where the results of shipped figures are, each campaign's in a folder."""


def work(
    names: tuple[str, ...],
    everything: bool,
    formats: tuple[str, ...],
    into: Path,
    out: Path | None,
    y: str,
    x: str,
    hue: str,
    output: Path | None,
    table: bool,
) -> None:
    """Draw a number of a campaign's dataset where `y` names one, else named figures, computing what they lack."""
    if y:
        if everything or len(names) != 1:
            raise Refusal(f"--y {y}: needs one campaign, or a dataset (results.nc)")
        _draw_over_axes(Path(names[0]), out, (y, x, hue), output, table)
    elif x or hue or output or table:
        raise Refusal("--x, --hue, --output and --csv: need --y, the number that is drawn")
    elif names or everything:
        _draw_shipped(names, everything, formats, into, out or RESULTS)
    else:
        _list()


def _draw_over_axes(
    source: Path, out: Path | None, words: tuple[str, str, str], output: Path | None, table: bool
) -> None:
    with refusals(ValueError):
        form = format_of(output) if output else FORMATS[0]
    y, x, hue = words
    with refusals(ValueError), dataset_of(shipped.campaign_file(source), out) as dataset:
        with _named("--y", y):
            points = points_named(dataset, y)
        chosen = []
        for option, word in (("--x", x), ("--hue", hue)):
            with _named(option, word):
                chosen.append(axis_named(points, dataset, word) if word else "")
        if not points.axes:
            raise Refusal(f"{source}: all cases are alike: there is nothing to draw {y} against")
        view = view_of(points, *chosen)
        target = output or Path(f"{view.name}.{form}")
        files = {target: image(view.draw(), form)}
        if table:
            files[target.with_suffix(".csv")] = csv_of(view.columns()).encode()
        write_files(files)
    say(view.caption)
    _say_written(files)


@contextmanager
def _named(option: str, word: str) -> Iterator[None]:
    """Say in which option a word stands that means nothing. Raises Refusal."""
    try:
        yield
    except ValueError as error:
        said = str(error)
        raise Refusal(f"{option} {said}" if said.startswith(f"{word}: ") else f"{option} {word}: {said}") from None


def _draw_shipped(names: tuple[str, ...], everything: bool, formats: tuple[str, ...], into: Path, out: Path) -> None:
    if unknown := [name for name in names if name not in FIGURES]:
        there = ", ".join(FIGURES)
        raise Refusal(f"{unknown[0]}: no figure; there are {there}; a campaign of your own needs --y")
    with refusals():
        for campaign, figures in campaigns_of(FIGURES if everything else names).items():
            source = shipped.campaigns()[campaign]
            with api.run(source, out / campaign, progress=True) as dataset:
                for figure in figures:
                    written = write(figure, dataset, into, formats)
                    say(figure.title)
                    print_table(Table(figure.header, tuple(map(as_row, figure.claims(dataset))), 3, prose=True))
                    _say_written(written)
        _say_written(write_indexes(into))


def _list() -> None:
    print_entries({name: figure.title for name, figure in FIGURES.items()})
    say(f"{whole('nanoslip figure NAME')} draws one, {whole('nanoslip figure --all')} all of them")


def _say_written(files: Iterable[Path]) -> None:
    for path in files:
        say(whole(f"written: {path}"))
