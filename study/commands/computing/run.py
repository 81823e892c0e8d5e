"""`nanoslip run`: compute a campaign in one process, in several, or on all ranks of an MPI job. Only it starts MPI."""

from collections.abc import Callable
from importlib import import_module
from pathlib import Path

from nanoslip.study.commands.running.order import Order
from nanoslip.study.commands.shared.arguments import folder
from nanoslip.study.commands.shared.refusals import refusals
from nanoslip.study.results.shard import Shard
from nanoslip.study.run.farm import FarmError
from nanoslip.study.run.launch import computing
from nanoslip.study.run.mpi import open_farm

_CONDUCT = "nanoslip.study.commands.running.conduct"
"""Imported by the root alone: the other ranks need neither datasets nor a terminal."""


def work(
    campaign: Path,
    out: Path | None,
    serial: bool,
    jobs: int | None,
    grace: float,
    recompute_foreign: bool,
    retry: bool,
    shard: Shard | None,
) -> None:
    """Compute a campaign's tasks that are left, with all ranks or processes, and write its dataset. Ends the process.

    shard: compute this part alone, and write no dataset.
    """
    order = Order(campaign, folder(campaign, out), shard, recompute_foreign, retry)
    with refusals(FarmError):
        farm = open_farm(computing(order.into), grace, serial, jobs)
    with farm:
        if not farm.root:
            farm.leave(farm.serve())
        conduct: Callable[..., int] = import_module(_CONDUCT).conduct
        farm.leave(conduct(farm, order))
