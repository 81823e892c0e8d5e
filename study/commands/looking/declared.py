"""Arguments and help of the commands that show results; the code of each is in the file of its name."""

from pathlib import Path
from typing import Final

import click

from study.commands.shared.arguments import CAMPAIGN, OUT
from study.commands.shared.group import cli
from study.commands.shared.lazy import work

FORMATS: Final = ("pdf", "svg", "png")
"""Of pictures; study.figures.shared.canvas knows how to write them."""
RESULTS: Final = Path("results")
PARAMETERS = click.argument("parameters", nargs=-1, metavar="[KEY=VALUE]...")
PICTURE = click.option(
    "-o", "--picture", type=click.Path(path_type=Path), help="Draw into this file (.png, .pdf, .svg), not in text."
)


@cli.command()
@CAMPAIGN
@OUT
def report(**given: object) -> None:
    """Write the HTML page of a collected CAMPAIGN."""
    work("looking.report", **given)


@cli.command()
@click.argument("names", nargs=-1, metavar="[CAMPAIGN | NAME]...")
@click.option("--all", "everything", is_flag=True, help="Every shipped figure, and pages of them.")
@click.option(
    "--format",
    "formats",
    multiple=True,
    type=click.Choice(FORMATS),
    default=FORMATS,
    help="Formats of shipped figures [default: all]",
)
@click.option(
    "--into",
    type=click.Path(path_type=Path),
    default=RESULTS,
    show_default=True,
    help="Folder of shipped figures, which lie below it as campaigns do: fig5 in figures, regimes in maps.",
)
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    help="Folder of CAMPAIGN's results; of shipped figures: with one for each campaign, figures/records for example  "
    f"[default: results/<campaign>; {RESULTS}]",
)
@click.option("--y", default="", metavar="NUMBER", help="Variable of CAMPAIGN, or ratio of two, that is drawn.")
@click.option("--x", default="", metavar="AXIS", help="What it is drawn against [default: the axis of most values]")
@click.option("--hue", default="", metavar="AXIS", help="What has a colour for each value [default: the next axis]")
@click.option("-o", "--output", type=click.Path(path_type=Path), help="File of that figure: .pdf, .svg or .png.")
@click.option("--csv", "table", is_flag=True, help="The numbers that are drawn, too, in a file beside it.")
def figure(**given: object) -> None:
    """Draw a number of CAMPAIGN over its axes, or shipped figures.

    CAMPAIGN has been run, or is a file results.nc. Variables are those of `nanoslip describe`, or as equations call them; axes
    left over are panels, members of an ensemble mean and standard error:

    nanoslip figure campaigns/mine.toml --y plateau/mu_i -o mine.pdf

    Without --y, NAMEs are shipped figures, which are drawn with tables of what the paper says and what is found. What is not
    computed yet is computed in this process. Each folder gets a page of all its figures. Without anything they are listed.
    """
    work("looking.figure", **given)


@cli.command("show")
@CAMPAIGN
@PARAMETERS
@OUT
@PICTURE
def show_case(**given: object) -> None:
    """Show one case of CAMPAIGN: its numbers and a small plot.

    CAMPAIGN is a campaign file or its name, a dataset (results.nc) or the folder it is in. KEY=VALUE single out the case by its
    parameters, exactly. A campaign's dataset is taken, or its finished results where it has none yet. Members of an ensemble
    are one case unless member=NUMBER is given; drives are rows of a table unless one is singled out.

    Example: nanoslip show campaigns/mine.toml intrinsic_friction=0.5 normal_load=1e-3
    """
    work("looking.show", **given)


@cli.command("try")
@PARAMETERS
@click.option("--contact", is_flag=True, help="Press the pin down only.")
@click.option(
    "--drive", is_flag=True, help="Pull the pin by the paper's drive too; a key of [[drives]] does so by itself."
)
@PICTURE
def try_case(**given: object) -> None:
    """Compute one case now and show it; nothing is kept.

    KEY=VALUE are keys of a campaign's tables of parameters, [scales], [ensemble], [outputs] and [[drives]]; the rest has its
    default: the paper's case at 129 nodes, over two node spacings.

    Example: nanoslip try radius=50 normal_load=1e-3
    """
    work("looking.try", **given)


@cli.command()
@CAMPAIGN
@click.argument("selection", nargs=-1, metavar="[KEY=VALUE]...")
@click.option(
    "--events",
    default="0:200:40",
    show_default=True,
    help="Events after which the contact is shown, as first:last:step or 0,5,12; 0 is initial contact.",
)
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    default=Path("frames.png"),
    show_default=True,
    help="A strip (.png, .pdf, .svg) or a film (.gif, .mp4).",
)
def frames(**given: object) -> None:
    """Show one case of CAMPAIGN at work, event by event.

    Pressure, shear, slip and F/W are computed again from the campaign file; no results are needed. KEY=VALUE single out the
    case by its axes.

    nanoslip frames smoke intrinsic_friction=0.5 --events 0:200:10 -o pin.gif
    """
    work("looking.frames", **given)
