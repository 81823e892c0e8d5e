"""Commands that compute a campaign and gather its results, here or on a cluster."""

from pathlib import Path

import click

from study.commands.shared.arguments import CAMPAIGN, JSON, OUT
from study.commands.shared.group import cli
from study.commands.shared.lazy import work
from study.execution.interruption import GRACE


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
@click.option(
    "--site",
    type=click.Path(path_type=Path),
    help="Settings of the cluster: a changed copy of site.toml [default: the one that comes with nanoslip]",
)
@click.option("--submit", is_flag=True, help="Hand the script to sbatch.")
def submit(campaign: Path, out: Path | None, site: Path | None, submit: bool) -> None:
    """Write the batch script that runs CAMPAIGN as one MPI job."""
    work("submit", campaign, out, site, submit)
