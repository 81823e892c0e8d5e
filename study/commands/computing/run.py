"""`nanoslip run`: compute a campaign in one process, in several, or on all ranks of an MPI job. Only it starts MPI."""

from collections.abc import Callable
from importlib import import_module
from pathlib import Path

from study.commands.shared.arguments import folder
from study.commands.shared.refusals import refusals
from study.execution.executor import executor
from study.execution.farm import FarmError, open_farm
from study.origin import here

_CONDUCT = "study.commands.shared.conduct"
"""Imported by the root alone: the other ranks need neither datasets nor a terminal."""


def work(
    campaign: Path, out: Path | None, serial: bool, jobs: int | None, grace: float, recompute_foreign: bool
) -> None:
    """Compute a campaign's tasks that are left, with all ranks or processes, and write its dataset. Ends the process."""
    here()  # starts git, and a process that uses MPI should start none
    with refusals(FarmError):
        farm = open_farm(grace, serial, jobs)
    into = folder(campaign, out)
    with farm:
        if not farm.root:
            farm.leave(farm.serve(executor(into)))
        conduct: Callable[..., int] = import_module(_CONDUCT).conduct
        farm.leave(conduct(farm, campaign, into, recompute_foreign))
