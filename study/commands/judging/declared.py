"""Arguments and help of the commands that export and compare numbers; the code of each is in the file of its name."""

from pathlib import Path

import click

from nanoslip.study.commands.shared.arguments import CAMPAIGN, JSON, OUT, CampaignPath, NewFile
from nanoslip.study.commands.shared.group import cli
from nanoslip.study.commands.shared.lazy import work


@cli.command()
@CAMPAIGN
@OUT
@click.option(
    "--csv", "form", flag_value="csv", help="As CSV: a header, a line of units that begins with #, rows [default]."
)
@click.option("--json", "form", flag_value="json", help="As JSON: title, variables with unit and meaning, rows.")
@click.option("--records", "table", flag_value="records", help="The events of all friction records instead of cases.")
@click.option("--trajectories", "table", flag_value="trajectories", help="The samples of all drives instead of cases.")
@click.option("-o", "--output", type=NewFile(path_type=Path), help="Write this file [default: standard output].")
def export(**given: object) -> None:
    """Write CAMPAIGN's numbers as a table for other programs.

    CAMPAIGN is a campaign file or its name, a dataset (results.nc) or the folder it is in. The table has a row for each case,
    or for each drive of each case: parameters first, then numbers. Unknown numbers are empty in CSV and null in JSON.

    Example: nanoslip export results/mine --csv -o mine.csv
    """
    work("judging.export", **given)


@cli.command()
@click.argument("first", metavar="A", type=CampaignPath(path_type=Path))
@click.argument("second", metavar="B", type=CampaignPath(path_type=Path))
def compare(**given: object) -> None:
    """Show what differs between datasets A and B, and how much.

    Each is a dataset (results.nc), the folder it is in, or a campaign. Cases are compared that have the same values of all
    parameters that vary in either; an ensemble is one case. Numbers with an uncertainty agree within 2 combined standard
    deviations. Words agree if they are the same. Numbers without an uncertainty are named where they differ, but not judged.
    Cases of only one dataset are counted; they are no difference.

    Exit codes: 0 same or within uncertainties; 1 a difference beyond them; 2 nothing to compare.

    Example: nanoslip compare results/mine results/finer
    """
    work("judging.compare", **given)


@cli.command()
@click.argument("dataset", type=click.Path(path_type=Path))
@click.option(
    "--sample", type=click.IntRange(min=1), help="Number of cases, evenly spread, the same each time [default: all]"
)
@JSON
def verify(**given: object) -> None:
    """Compute DATASET again from the file alone, and compare.

    DATASET is a file results.nc, or the folder it is in. Each case is bit-identical, within tolerance, or different.

    Exit codes: 0 all identical or within tolerance; 1 a case is different; 2 DATASET cannot be computed again.
    """
    work("judging.verify", **given)


@cli.command()
@click.argument("name", required=False)
@JSON
def describe(**given: object) -> None:
    """Explain the variables of a dataset, or one of them.

    NAME is a variable of a file results.nc; without a name a table of all variables is printed.
    """
    work("judging.describe", **given)


@cli.command()
@click.argument("campaign", type=CampaignPath(path_type=Path), required=False)
@OUT
@click.option("--quick", is_flag=True, help="Measure few values of every setting: a trial that takes seconds.")
@click.option(
    "--digit",
    is_flag=True,
    help="Measure what another digit of plateau, μ_s and μ_k costs instead: more members, or longer records.",
)
@click.option(
    "--save",
    type=click.Path(path_type=Path),
    help="Write the Pareto front to this file; campaigns choose from it by front = FILE.",
)
def accuracy(**given: object) -> None:
    """Measure error against time for every numerical setting.

    It is measured on the first case of CAMPAIGN [default: the paper's case; with --digit three cases]. With --digit the
    limits of its records are those that are measured.

    Example: nanoslip accuracy campaigns/mine.toml --digit
    """
    work("judging.accuracy", **given)
