"""Arguments and help of the commands that compute a campaign; the code of each is in the file of its name."""

from pathlib import Path
from typing import Any

import click

from nanoslip.study.commands.shared.arguments import CAMPAIGN, JSON, OUT
from nanoslip.study.commands.shared.group import cli
from nanoslip.study.commands.shared.lazy import work
from nanoslip.study.results.shard import MOST, Shard
from nanoslip.study.run.launch import GRACE


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
@click.option("--serial", is_flag=True, help="Compute in this process alone, without MPI; no time limit ends a task.")
@click.option("-j", "--jobs", type=click.IntRange(min=1), help="Number of processes on this machine, without MPI.")
@click.option(
    "--grace",
    type=click.FloatRange(min=0.0),
    default=GRACE,
    show_default=True,
    help="Seconds that running tasks get to finish after a signal.",
)
@click.option(
    "--recompute-foreign", is_flag=True, help="Compute results of other software again (`nanoslip status` names it)."
)
@click.option("--retry", is_flag=True, help="Try tasks again that have failed (`nanoslip status` counts them).")
@click.option(
    "--shard",
    type=ShardText(),
    help="Compute one part, 3/10 the third of ten, in a folder of its own; `nanoslip merge` joins the parts.",
)
def run(**given: object) -> None:
    """Compute what is left of CAMPAIGN, then write its dataset.

    Under mpiexec or srun all ranks compute.

    Exit codes: 0 complete; 1 a defect of the program; 2 wrong input or a full disk; 3 complete, but some tasks failed; 99
    interrupted, run again to continue.
    """
    work("computing.run", **given)


@cli.command()
@CAMPAIGN
@OUT
@click.option("--watch", is_flag=True, help="Repeat every two seconds until all is finished; stop it with Ctrl-C.")
@JSON
def status(**given: object) -> None:
    """Show how much of CAMPAIGN is finished, and how its cases ended.

    It reads the files of results alone. So it works while CAMPAIGN is computed, after an interruption, and on another machine.
    """
    work("computing.status", **given)


@cli.command()
@CAMPAIGN
@OUT
@click.option(
    "-j",
    "--jobs",
    type=click.IntRange(min=1),
    default=1,
    help="Read results in so many processes; the bytes are the same.",
)
@click.option(
    "--replace",
    is_flag=True,
    help="Replace a dataset that has more finished cases, as of the campaign before it changed.",
)
def collect(**given: object) -> None:
    """Write the dataset of CAMPAIGN from its finished results.

    What is not computed is "pending". An existing dataset with more finished cases is kept.
    """
    work("computing.collect", **given)


@cli.command()
@CAMPAIGN
@OUT
def merge(**given: object) -> None:
    """Join all shards of CAMPAIGN, and write its dataset.

    Exit codes: 0 complete; 3 complete, but some tasks failed; 99 tasks are left, which `nanoslip run` computes.
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
    "--shards",
    type=click.IntRange(1, MOST),
    help="Number of small jobs in an array; one job more merges their results.",
)
@click.option("--submit", is_flag=True, help="Submit the scripts by sbatch.")
def submit(**given: object) -> None:
    """Write batch scripts that run CAMPAIGN as a job, or an array."""
    work("computing.submit", **given)
