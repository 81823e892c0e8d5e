"""`nanoslip figure`: figures of the shipped campaigns, computed where they are not yet, with their tables."""

from pathlib import Path

import click

from study import api, shipped
from study.commands.shared.exits import Refusal
from study.commands.shared.refusals import refusals
from study.figures.catalogue import FIGURES
from study.figures.gallery import campaigns_of, write, write_index
from study.figures.shared.canvas import FORMATS
from study.figures.shared.claims import as_row
from study.report.console import Table, print_table


@click.command("figure")
@click.argument("names", nargs=-1, metavar="[NAME]...")
@click.option("--all", "everything", is_flag=True, help="Every figure, and a page of them.")
@click.option(
    "--format", "formats", multiple=True, type=click.Choice(FORMATS), help="Formats of the pictures [default: all]"
)
@click.option(
    "--into",
    type=click.Path(path_type=Path),
    default=Path("results/figures"),
    show_default=True,
    help="Folder of the figures.",
)
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    default=Path("results/figures"),
    show_default=True,
    help="Folder with a folder of results for each campaign.",
)
def command(names: tuple[str, ...], everything: bool, formats: tuple[str, ...], into: Path, out: Path) -> None:
    """Draw figures of shipped campaigns, with a table of what the paper says and what is found.

    What is not computed yet is computed in this process; without NAME the figures are listed.
    """
    if not (names or everything):
        _list()
        return
    if unknown := [name for name in names if name not in FIGURES]:
        raise Refusal(f"{unknown[0]}: no figure; there are {', '.join(FIGURES)}")
    with refusals():
        for campaign, figures in campaigns_of(FIGURES if everything else names).items():
            source = shipped.campaigns()[campaign]
            with api.run(source, out / source.stem, progress=True) as dataset:
                for figure in figures:
                    written = write(figure, dataset, into, formats or FORMATS)
                    click.echo(figure.title)
                    print_table(Table(figure.header, tuple(map(as_row, figure.claims(dataset)))))
                    click.echo(f"written: {', '.join(map(str, written))}")
        if everything:
            click.echo(f"written: {write_index(into)}")


def _list() -> None:
    width = max(map(len, FIGURES))
    for name, figure in FIGURES.items():
        click.echo(f"{name:{width}}  {figure.title}")
    click.echo("nanoslip figure NAME draws one, nanoslip figure --all all of them")
