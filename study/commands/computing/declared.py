"""Arguments and help of the commands that compute a campaign; the code of each is in the file of its name."""

from pathlib import Path
from typing import Any

import click

from study.commands.shared.arguments import CAMPAIGN, JSON, OUT
from study.commands.shared.group import cli
from study.commands.shared.lazy import work
from study.execution.interruption import GRACE
from study.results.shard import Shard


class ShardText(click.ParamType[Shard]):
    """A part of a campaign, as `3/10`."""

    name = "n/of"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Shard:
        """The part."""
        try:
            return value if isinstance(value, Shard) else Shard.parse(value)
        except ValueError as error:
            self.fail(str(error), param, ctx)


@cli.command()
@CAMPAIGN
@OUT
@click.option(
    "--serial", is_flag=True, help="Compute in this process alone, without MPI: no task is ended for its time."
)
@click.option(
    "-j", "--jobs", type=click.IntRange(min=1), help="Compute in so many processes on this machine, without MPI."
)
@click.option(
    "--grace", default=GRACE, show_default=True, help="Seconds that running tasks get to finish after a signal."
)
@click.option(
    "--recompute-foreign", is_flag=True, help="Compute again what other software computed (`nanoslip status` names it)."
)
@click.option("--retry", is_flag=True, help="Try again what has failed (`nanoslip status` counts it).")
@click.option(
    "--shard",
    type=ShardText(),
    help="Compute one of so many parts (3/10), in a folder of its own; `nanoslip merge` brings them together.",
)
def run(**given: object) -> None:
    """Compute what is not finished of CAMPAIGN, then collect it.

    Under mpiexec or srun: with all ranks.

    Exit codes: 0 complete, 3 complete but for tasks that failed, 99 interrupted: run again, 2 wrong input or a full disk, 1 a
    defect of the program itself.
    """
    work("computing.run", **given)


@cli.command()
@CAMPAIGN
@OUT
@click.option("--watch", is_flag=True, help="Look again every two seconds until all is finished; Ctrl-C ends it.")
@JSON
def status(**given: object) -> None:
    """Show how much of CAMPAIGN is finished, and how it ended.

    From the files of results alone: while it runs, after an interruption, from another machine.
    """
    work("computing.status", **given)


@cli.command()
@CAMPAIGN
@OUT
def collect(**given: object) -> None:
    """Write the dataset of CAMPAIGN from the results that are there."""
    work("computing.collect", **given)


@cli.command()
@CAMPAIGN
@OUT
def merge(**given: object) -> None:
    """Bring all shards of CAMPAIGN together, and write its dataset.

    Exit codes: 0 complete, 3 complete but for tasks that failed, 99 tasks are left: nanoslip run computes them.
    """
    work("computing.merge", **given)


@cli.command()
@CAMPAIGN
@OUT
@click.option(
    "--site",
    type=click.Path(path_type=Path),
    help="Settings of the cluster: a changed copy of site.toml [default: the one that comes with nanoslip]",
)
@click.option(
    "--shards", type=click.IntRange(min=1), help="An array of so many small jobs, and one that merges what they have."
)
@click.option("--submit", is_flag=True, help="Hand it to sbatch.")
def submit(**given: object) -> None:
    """Write batch scripts that run CAMPAIGN as a job, or an array."""
    work("computing.submit", **given)
