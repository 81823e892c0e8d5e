"""The command line: every command with its arguments and its help. What a command does is in the file of its name."""

import atexit
import gc
import sys
from pathlib import Path
from typing import Final

import click

from study.commands.shared.arguments import CAMPAIGN, OUT, CampaignPath
from study.commands.shared.exits import ABORTED, show
from study.commands.shared.lazy import work
from study.execution.interruption import GRACE

FORMATS: Final = ("pdf", "svg", "png")
"""Of pictures; study.figures.shared.canvas knows how to write them."""
FIGURES: Final = Path("results/figures")


class Group(click.Group):
    """A group that lists its commands as they are declared: in the order of a campaign's life."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """The names of all commands."""
        return list(self.commands)


@click.group(cls=Group, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="nanoslip")
def cli() -> None:
    """A friction laboratory: from campaign files (TOML) to one labelled dataset each."""


@cli.command()
def campaigns() -> None:
    """List the campaigns that come with nanoslip.

    They are there to run by name or to copy.
    """
    work("campaigns")


@cli.command()
@CAMPAIGN
@OUT
def plan(campaign: Path, out: Path | None) -> None:
    """Show what CAMPAIGN would compute, less what is finished."""
    work("plan", campaign, out)


@cli.command()
@CAMPAIGN
@OUT
@click.option("--serial", is_flag=True, help="Compute in this process alone, without MPI.")
@click.option(
    "--grace", default=GRACE, show_default=True, help="Seconds that running tasks get to finish after a signal."
)
@click.option(
    "--recompute-foreign", is_flag=True, help="Compute again what other software computed (`nanoslip status` names it)."
)
def run(campaign: Path, out: Path | None, serial: bool, grace: float, recompute_foreign: bool) -> None:
    """Compute what is not finished of CAMPAIGN, then collect it.

    Under mpiexec or srun: with all ranks.
    """
    work("run", campaign, out, serial, grace, recompute_foreign)


@cli.command()
@CAMPAIGN
@OUT
def status(campaign: Path, out: Path | None) -> None:
    """Show how much of CAMPAIGN is finished."""
    work("status", campaign, out)


@cli.command()
@CAMPAIGN
@OUT
def collect(campaign: Path, out: Path | None) -> None:
    """Write the dataset of CAMPAIGN from the results that are there."""
    work("collect", campaign, out)


@cli.command()
@CAMPAIGN
@OUT
def report(campaign: Path, out: Path | None) -> None:
    """Draw figures and write the HTML page of a collected CAMPAIGN."""
    work("report", campaign, out)


@cli.command()
@click.argument("names", nargs=-1, metavar="[NAME]...")
@click.option("--all", "everything", is_flag=True, help="Every figure, and a page of them.")
@click.option(
    "--format", "formats", multiple=True, type=click.Choice(FORMATS), help="Formats of the pictures [default: all]"
)
@click.option("--into", type=click.Path(path_type=Path), default=FIGURES, show_default=True, help="Folder of figures.")
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    default=FIGURES,
    show_default=True,
    help="Folder with a folder of results for each campaign.",
)
def figure(names: tuple[str, ...], everything: bool, formats: tuple[str, ...], into: Path, out: Path) -> None:
    """Draw figures of shipped campaigns, with tables.

    A table says what the paper says and what is found. What is not computed yet is computed in this process. Without NAME the
    figures are listed.
    """
    work("figure", names, everything, formats or FORMATS, into, out)


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
def frames(campaign: Path, selection: tuple[str, ...], events: str, output: Path) -> None:
    """Show one case of CAMPAIGN at work, event by event.

    Pressure, shear, slip and F/W are computed again from the campaign file; no results are needed. KEY=VALUE single out the
    case by its axes.

    nanoslip frames smoke intrinsic_friction=0.5 --events 0:200:10 -o pin.gif
    """
    work("frames", campaign, selection, events, output)


@cli.command()
@click.argument("dataset", type=click.Path(path_type=Path))
@click.option(
    "--sample", type=click.IntRange(min=1), help="So many cases only, evenly spread, the same each time [default: all]"
)
def verify(dataset: Path, sample: int | None) -> None:
    """Compute DATASET again from itself alone, and compare.

    DATASET is a file results.nc. Each case is bit-identical, within tolerance, or different.

    Exit codes: 0 identical or within tolerance, 1 something is different, 2 nothing that can be computed again.
    """
    work("verify", dataset, sample)


@cli.command()
@click.argument("name", required=False)
def describe(name: str | None) -> None:
    """Explain the variables of a dataset, or one of them.

    NAME is a variable of a file results.nc; without it a table of all is printed.
    """
    work("describe", name)


@cli.command()
@click.argument("campaign", type=CampaignPath(path_type=Path), required=False)
@OUT
@click.option("--quick", is_flag=True, help="A few settings of every setting, in seconds, to see that it works.")
@click.option(
    "--save",
    type=click.Path(path_type=Path),
    help="Write the front there too: campaigns choose from it by front = FILE.",
)
def accuracy(campaign: Path | None, out: Path | None, quick: bool, save: Path | None) -> None:
    """Measure error against time for every numerical setting.

    On CAMPAIGN's first case [default: the paper's case].
    """
    work("accuracy", campaign, out, quick, save)


@cli.command()
@CAMPAIGN
@OUT
@click.option(
    "--site",
    type=click.Path(path_type=Path),
    help="Settings of the cluster: a changed copy of site.toml [default: the one that comes with nanoslip]",
)
@click.option("--submit", is_flag=True, help="Hand the script to sbatch.")
def submit(campaign: Path, out: Path | None, site: Path | None, submit: bool) -> None:
    """Write the batch script that runs CAMPAIGN as one MPI job."""
    work("submit", campaign, out, site, submit)


def main() -> None:
    """Run the command line and exit."""
    atexit.register(gc.freeze)  # searching all modules for cycles before the process ends anyway takes 0.3 s
    try:
        code = cli.main(prog_name="nanoslip", standalone_mode=False)
    except click.ClickException as error:
        show(error)
        code = error.exit_code
    except click.Abort:
        code = ABORTED
    sys.exit(code or 0)
