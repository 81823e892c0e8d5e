"""Arguments and help of the commands that show results; the code of each is in the file of its name."""

from pathlib import Path
from typing import Final

import click

from nanoslip.study.commands.shared.arguments import CAMPAIGN, OUT, NewFile
from nanoslip.study.commands.shared.group import cli
from nanoslip.study.commands.shared.lazy import work

FORMATS: Final = ("pdf", "svg", "png")
"""Of pictures; nanoslip.study.figures.shared.canvas knows how to write them."""
RESULTS: Final = Path("results")
PARAMETERS = click.argument("parameters", nargs=-1, metavar="[KEY=VALUE]...")
PICTURE = click.option(
    "-o", "--picture", type=NewFile(path_type=Path), help="Draw a picture into this file (.png, .pdf, .svg) instead."
)


@cli.command()
@CAMPAIGN
@OUT
def report(**given: object) -> None:
    """Write the HTML page of a collected CAMPAIGN."""
    work("looking.report", **given)


@cli.command()
@click.argument("names", nargs=-1, metavar="[CAMPAIGN | NAME]...")
@click.option("--all", "everything", is_flag=True, help="Draw every shipped figure, and write pages of them.")
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
    help="Folder of shipped figures. Folders below it are those of their campaigns: fig5 in figures, regimes in maps.",
)
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    help="Folder of CAMPAIGN's results. Of shipped figures: the folder with a folder for each campaign, as figures/records  "
    f"[default: results/<campaign>; {RESULTS}]",
)
@click.option("--y", default="", metavar="NUMBER", help="Variable of CAMPAIGN to draw, or a ratio of two.")
@click.option("--x", default="", metavar="AXIS", help="Axis of CAMPAIGN along x [default: the one with most values]")
@click.option(
    "--hue", default="", metavar="AXIS", help="Axis of CAMPAIGN with a colour for each value [default: the next one]"
)
@click.option("-o", "--output", type=NewFile(path_type=Path), help="File of that figure: .pdf, .svg or .png.")
@click.option("--csv", "table", is_flag=True, help="Write the numbers that are drawn to a file beside it.")
def figure(**given: object) -> None:
    """Draw a variable of CAMPAIGN over its axes, or shipped figures.

    CAMPAIGN has been run, or is a file results.nc. Variables have the names of `nanoslip describe`, or symbols as in equations.
    Axes beyond x and colour become panels. Members of an ensemble are drawn as their mean and its ±.

    Example: nanoslip figure campaigns/mine.toml --y plateau/mu_i -o mine.pdf

    Without --y, NAMEs are shipped figures. Each is drawn with a table that compares the paper's numbers with those found. Cases
    that are not computed yet are computed in this process. Each folder gets a page of its figures. Without names they are listed.
    """
    work("looking.figure", **given)


@cli.command("show")
@CAMPAIGN
@PARAMETERS
@OUT
@PICTURE
def show_case(**given: object) -> None:
    """Show one case of CAMPAIGN: its numbers and a small plot.

    CAMPAIGN is a campaign file or its name, a dataset (results.nc) or the folder it is in. KEY=VALUE select the case by exact
    values of its parameters. A campaign without a dataset is shown from its finished results. Members of an ensemble are one
    case, unless member=NUMBER selects one. Drives are rows of a table, unless drive=NAME selects one.

    Example: nanoslip show campaigns/mine.toml intrinsic_friction=0.5 normal_load=1e-3
    """
    work("looking.show", **given)


@cli.command("try")
@PARAMETERS
@click.option("--contact", is_flag=True, help="Compute initial contact only.")
@click.option("--drive", is_flag=True, help="Pull the pin by the paper's drive, too. Any key of [[drives]] implies it.")
@PICTURE
def try_case(**given: object) -> None:
    """Compute one case now and show it; nothing is written to disk.

    KEY=VALUE are keys of a campaign's tables of parameters, [scales], [ensemble], [outputs] and [[drives]]. All others have
    their defaults: the paper's case at 129 nodes, over eight presliding lengths.

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
    type=NewFile(path_type=Path),
    default=Path("frames.png"),
    show_default=True,
    help="File to write: a strip (.png, .pdf, .svg) or a film (.gif, .mp4).",
)
def frames(**given: object) -> None:
    """Draw the contact of one case of CAMPAIGN, event by event.

    Pressure, shear, slip and F/W are computed from the campaign file; no results are needed. KEY=VALUE select the case by values
    on the campaign's axes.

    Example: nanoslip frames smoke intrinsic_friction=0.5 --events 0:200:10 -o pin.gif
    """
    work("looking.frames", **given)
