"""`nanoslip figure`: figures of the shipped campaigns, computed where they are not yet, with their tables."""

from pathlib import Path

import click

from study import api, shipped
from study.commands.shared.exits import Refusal
from study.commands.shared.refusals import refusals
from study.figures.catalogue import FIGURES
from study.figures.gallery import campaigns_of, write, write_indexes
from study.figures.shared.claims import as_row
from study.report.console import Table, print_table


def work(names: tuple[str, ...], everything: bool, formats: tuple[str, ...], into: Path, out: Path) -> None:
    """Compute what is missing of the figures' campaigns, draw them and print their tables."""
    if not (names or everything):
        _list()
        return
    if unknown := [name for name in names if name not in FIGURES]:
        raise Refusal(f"{unknown[0]}: no figure; there are {', '.join(FIGURES)}")
    with refusals():
        for campaign, figures in campaigns_of(FIGURES if everything else names).items():
            source = shipped.campaigns()[campaign]
            with api.run(source, out / campaign, progress=True) as dataset:
                for figure in figures:
                    written = write(figure, dataset, into, formats)
                    click.echo(figure.title)
                    print_table(Table(figure.header, tuple(map(as_row, figure.claims(dataset))), 3))
                    click.echo(f"written: {', '.join(map(str, written))}")
        for page in write_indexes(into):
            click.echo(f"written: {page}")


def _list() -> None:
    width = max(map(len, FIGURES))
    for name, figure in FIGURES.items():
        click.echo(f"{name:{width}}  {figure.title}")
    click.echo("nanoslip figure NAME draws one, nanoslip figure --all all of them")
