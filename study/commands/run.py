"""`nanoslip run`: compute a campaign in one process or on all ranks of an MPI job. The only command that starts MPI."""

from collections.abc import Callable
from importlib import import_module
from pathlib import Path

import click

from study.commands.shared.arguments import CAMPAIGN, OUT, folder
from study.commands.shared.refusals import refusals
from study.execution.executor import executor
from study.execution.farm import GRACE, FarmError, open_farm
from study.origin import here

_CONDUCT = "study.commands.shared.conduct"
"""Imported by the root alone: the other ranks need neither datasets nor a terminal."""


@click.command("run")
@CAMPAIGN
@OUT
@click.option("--serial", is_flag=True, help="Compute in this process alone, without MPI.")
@click.option(
    "--grace", default=GRACE, show_default=True, help="Seconds that running tasks get to finish after a signal."
)
@click.option(
    "--recompute-foreign", is_flag=True, help="Compute again what other software computed (`nanoslip status` names it)."
)
def command(campaign: Path, out: Path | None, serial: bool, grace: float, recompute_foreign: bool) -> None:
    """Compute what is not finished of CAMPAIGN, then collect it.

    Under mpiexec or srun: with all ranks.
    """
    here()  # starts git, and a process that uses MPI should start none
    with refusals(FarmError):
        farm = open_farm(grace, serial)
    into = folder(campaign, out)
    with farm:
        if not farm.root:
            farm.leave(farm.serve(executor(into)))
        conduct: Callable[..., int] = import_module(_CONDUCT).conduct
        farm.leave(conduct(farm, campaign, into, recompute_foreign))
