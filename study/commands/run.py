"""`nanoslip run`: compute a campaign in one process, in several, or on all ranks of an MPI job. Only it starts MPI."""

from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

from nanoslip.study.commands.plans import refusals
from nanoslip.study.commands.words import folder
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.results.shard import Shard
from nanoslip.study.run.child import FarmError
from nanoslip.study.run.farm import open_farm
from nanoslip.study.run.launch import computing, processes_started

# The arguments of a run: campaign, folder, shard, and what to compute again.


@dataclass(frozen=True, slots=True)
class Order:
    """A campaign, and how it is to be computed."""

    campaign: Path
    out: Path
    """The campaign's folder."""
    shard: Shard | None = None
    """The part to compute; None: all of it."""
    recompute_foreign: bool = False
    retry: bool = False

    @property
    def into(self) -> Path:
        """Folder of the results."""
        return self.shard.folder(self.out) if self.shard else self.out


def run_campaign(
    campaign: Path, out: Path | None, serial: bool, jobs: int | None, grace: float, shard: Shard | None, **again: bool
) -> None:
    """Compute a campaign's tasks that are left, with all ranks or processes, and write its dataset. Ends the process.

    shard: compute this part alone, and write no dataset. again: `recompute_foreign` and `retry`, as of `Order`.
    """
    if processes_started() == 1:  # of several ranks the root reads it, as all others wait for its answer
        load_manifest(campaign)  # what is wrong is answered before anything is loaded that computes
    order = Order(campaign, folder(campaign, out), shard, **again)
    with refusals(FarmError):
        farm = open_farm(computing(order.into), grace, serial, jobs)
    with farm:
        if not farm.root:
            farm.leave(farm.serve())
        root = import_module("nanoslip.study.commands.conduct")  # the other ranks need neither datasets nor a terminal
        farm.leave(root.conduct(farm, order))
