"""`nanoslip run`: compute a campaign in one process, in several, or on all ranks of an MPI job. Only it starts MPI."""

from importlib import import_module
from pathlib import Path

from nanoslip.study.commands.plans import refusals
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.report.console import note
from nanoslip.study.results.files import Shard, results_folder
from nanoslip.study.run.child import FarmError
from nanoslip.study.run.farm import open_farm
from nanoslip.study.run.launch import cores, processes_started, task_program


def run_campaign(
    campaign: Path, out: Path | None, serial: bool, jobs: int | None, grace: float, shard: Shard | None, **again: bool
) -> None:
    """Compute a campaign's tasks that are left, with all ranks or processes, and write its dataset. Ends the process.

    shard: compute this part alone, and write no dataset. again: `recompute_foreign` and `retry`, as of `campaign.compute`.
    """
    # Of several ranks the root reads it, as all others wait for its answer.
    if processes_started() == 1:
        # What is wrong is answered before anything is loaded that computes.
        load_manifest(campaign)
    into = results_folder(campaign, out)
    if jobs and jobs > cores():
        note(f"-j {jobs}: {cores()} cores here; more processes than cores are no faster", stderr=True)
    with refusals(FarmError):
        folder = shard.folder(into) if shard else into
        farm = open_farm(task_program(folder), grace, serial, jobs)
    with farm:
        if not farm.root:
            farm.leave(farm.serve())
        # Imported here: the other ranks need neither datasets nor a terminal.
        root = import_module("nanoslip.study.commands.conduct")
        farm.leave(root.conduct(farm, campaign, into, shard, **again))
