"""The command line: every command with its arguments and its help. What a command does is in the file of its name."""

import atexit
import gc
import sys
from pathlib import Path
from typing import Final

import click

from study.commands.shared.arguments import CAMPAIGN, JSON, OUT, CampaignPath
from study.commands.shared.exits import ABORTED, show
from study.commands.shared.lazy import work
from study.execution.interruption import GRACE

FORMATS: Final = ("pdf", "svg", "png")
"""Of pictures; study.figures.shared.canvas knows how to write them."""
RESULTS: Final = Path("results")


PARAMETERS = click.argument("parameters", nargs=-1, metavar="[KEY=VALUE]...")
PICTURE = click.option(
    "-o", "--picture", type=click.Path(path_type=Path), help="Draw into this file (.png, .pdf, .svg), not in text."
)


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
@JSON
def campaigns(as_json: bool) -> None:
    """List the campaigns that come with nanoslip.

    They are there to run by name or to copy.
    """
    work("campaigns", as_json)


@cli.command()
@click.argument("starter", required=False)
@click.argument("file", type=click.Path(path_type=Path), required=False)
def new(starter: str | None, file: Path | None) -> None:
    """Write a commented campaign to start from.

    STARTER is its name; without it the starters are listed. It is written to FILE [default: STARTER.toml], which must not be
    there yet, with the files that it needs beside it.

    Example: nanoslip new sweep campaigns/mine.toml
    """
    work("new", starter, file)


@cli.command()
@click.argument("campaigns", metavar="CAMPAIGN...", nargs=-1, required=True, type=CampaignPath(path_type=Path))
def check(campaigns: tuple[Path, ...]) -> None:
    """Find every problem of campaign files, without computing.

    Each CAMPAIGN is a file, or the name of one that comes with nanoslip. One that is fine is one line: its cases and tasks. The
    problems of the others are all shown, a line each: file, key, value and what is allowed.

    Exit codes: 0 all are fine, 2 some are not. Example: nanoslip check campaigns/*.toml
    """
    work("check", campaigns)


@cli.command()
@CAMPAIGN
@OUT
@click.option("--ranks", type=click.IntRange(min=1), help="Estimate the time on so many ranks [default: cores here]")
@click.option(
    "--effects", "show_effects", is_flag=True, help="Say of every effect whether it is on, and what is left out."
)
@JSON
def plan(campaign: Path, out: Path | None, ranks: int | None, show_effects: bool, as_json: bool) -> None:
    """Show what CAMPAIGN would compute, and what it takes.

    What is finished is left out of the time.
    """
    work("plan", campaign, out, ranks, show_effects, as_json)


@cli.command()
@CAMPAIGN
@OUT
@click.option("--serial", is_flag=True, help="Compute in this process alone, without MPI.")
@click.option(
    "-j", "--jobs", type=click.IntRange(min=1), help="Compute in so many processes on this machine, without MPI."
)
@click.option(
    "--grace", default=GRACE, show_default=True, help="Seconds that running tasks get to finish after a signal."
)
@click.option(
    "--recompute-foreign", is_flag=True, help="Compute again what other software computed (`nanoslip status` names it)."
)
def run(
    campaign: Path, out: Path | None, serial: bool, jobs: int | None, grace: float, recompute_foreign: bool
) -> None:
    """Compute what is not finished of CAMPAIGN, then collect it.

    Under mpiexec or srun: with all ranks.
    """
    work("run", campaign, out, serial, jobs, grace, recompute_foreign)


@cli.command()
@CAMPAIGN
@OUT
@click.option("--watch", is_flag=True, help="Look again every two seconds until all is finished; Ctrl-C ends it.")
@JSON
def status(campaign: Path, out: Path | None, watch: bool, as_json: bool) -> None:
    """Show how much of CAMPAIGN is finished, and how it ended.

    From the files of results alone: while it runs, after an interruption, from another machine.
    """
    work("status", campaign, out, watch, as_json)


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
    """Write the HTML page of a collected CAMPAIGN."""
    work("report", campaign, out)


@cli.command()
@click.argument("names", nargs=-1, metavar="[CAMPAIGN | NAME]...")
@click.option("--all", "everything", is_flag=True, help="Every shipped figure, and pages of them.")
@click.option(
    "--format",
    "formats",
    multiple=True,
    type=click.Choice(FORMATS),
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
def figure(
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
    """Draw a number of CAMPAIGN over its axes, or shipped figures.

    CAMPAIGN has been run, or is a file results.nc. Variables are those of `nanoslip describe`, or as equations call them; axes
    left over are panels, members of an ensemble mean and standard error:

    nanoslip figure campaigns/mine.toml --y plateau/mu_i -o mine.pdf

    Without --y, NAMEs are shipped figures, which are drawn with tables of what the paper says and what is found. What is not
    computed yet is computed in this process. Each folder gets a page of all its figures. Without anything they are listed.
    """
    work("figure", names, everything, formats or FORMATS, into, out, y, x, hue, output, table)


@cli.command("show")
@CAMPAIGN
@PARAMETERS
@OUT
@PICTURE
def show_case(campaign: Path, parameters: tuple[str, ...], out: Path | None, picture: Path | None) -> None:
    """Show one case of CAMPAIGN: its numbers and a small plot.

    CAMPAIGN is a campaign file or its name, a dataset (results.nc) or the folder it is in. KEY=VALUE single out the case by its
    parameters, exactly. A campaign's dataset is taken, or its finished results where it has none yet. Members of an ensemble
    are one case unless member=NUMBER is given; drives are rows of a table unless one is singled out.

    Example: nanoslip show campaigns/mine.toml intrinsic_friction=0.5 normal_load=1e-3
    """
    work("show", campaign, parameters, out, picture)


@cli.command("try")
@PARAMETERS
@click.option("--contact", is_flag=True, help="Press the pin down only.")
@click.option(
    "--drive", is_flag=True, help="Pull the pin by the paper's drive too; a key of [[drives]] does so by itself."
)
@PICTURE
def try_case(parameters: tuple[str, ...], contact: bool, drive: bool, picture: Path | None) -> None:
    """Compute one case now and show it; nothing is kept.

    KEY=VALUE are keys of a campaign's tables of parameters, [scales], [ensemble], [outputs] and [[drives]]; the rest has its
    default: the paper's case at 129 nodes, over two node spacings.

    Example: nanoslip try radius=50 normal_load=1e-3
    """
    work("try", parameters, contact, drive, picture)


@cli.command()
@CAMPAIGN
@OUT
@click.option("--csv", "form", flag_value="csv", help="A header, a line of units that begins with #, rows [default].")
@click.option("--json", "form", flag_value="json", help="Title, variables with unit and meaning, rows.")
@click.option("--records", "table", flag_value="records", help="The events of all friction records instead of cases.")
@click.option("--trajectories", "table", flag_value="trajectories", help="The samples of all drives instead of cases.")
@click.option("-o", "--output", type=click.Path(path_type=Path), help="Write this file [default: standard output].")
def export(campaign: Path, out: Path | None, form: str | None, table: str | None, output: Path | None) -> None:
    """Write CAMPAIGN's numbers as a table for other programs.

    CAMPAIGN is a campaign file or its name, a dataset (results.nc) or the folder it is in. The table has a row for each case,
    with a drive for each case and drive: parameters first, then numbers. What is not known is empty in CSV, null in JSON.

    Example: nanoslip export results/mine --csv -o mine.csv
    """
    work("export", campaign, out, form, table, output)


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
@JSON
def verify(dataset: Path, sample: int | None, as_json: bool) -> None:
    """Compute DATASET again from itself alone, and compare.

    DATASET is a file results.nc. Each case is bit-identical, within tolerance, or different.

    Exit codes: 0 identical or within tolerance, 1 something is different, 2 nothing that can be computed again.
    """
    work("verify", dataset, sample, as_json)


@cli.command()
@click.argument("first", metavar="A", type=CampaignPath(path_type=Path))
@click.argument("second", metavar="B", type=CampaignPath(path_type=Path))
def compare(first: Path, second: Path) -> None:
    """Show what differs between datasets A and B, and how much.

    Each is a dataset (results.nc), the folder it is in, or a campaign. Cases with the same values of all parameters that vary in
    either are compared; an ensemble is one case. Numbers that state an uncertainty agree within 2 combined standard deviations,
    words if they are the same; other numbers are only named. Cases that only one has are counted, and are no difference.

    Exit codes: 0 same or within uncertainties, 1 something is beyond, 2 nothing to compare.

    Example: nanoslip compare results/mine results/finer
    """
    work("compare", first, second)


@cli.command()
@click.argument("name", required=False)
@JSON
def describe(name: str | None, as_json: bool) -> None:
    """Explain the variables of a dataset, or one of them.

    NAME is a variable of a file results.nc; without it a table of all is printed.
    """
    work("describe", name, as_json)


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
