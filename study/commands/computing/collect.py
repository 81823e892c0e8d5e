"""`nanoslip collect`: the dataset of a campaign from the results that are there."""

from pathlib import Path

from nanoslip.study.commands.shared.arguments import folder
from nanoslip.study.commands.shared.datasets import write_dataset
from nanoslip.study.commands.shared.plans import advised, counted
from nanoslip.study.commands.shared.refusals import refusals
from nanoslip.study.dataset.collect import InPieces
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.report.console import say
from nanoslip.study.results.shard import folders
from nanoslip.study.results.store import Store


def work(campaign: Path, out: Path | None, jobs: int, replace: bool) -> None:
    """Write and print the dataset of a campaign's results; replace: also that of one with more of them."""
    into = folder(campaign, out)
    with refusals():
        plan = InPieces(load_manifest(campaign))
        write_dataset(plan, Store(into), anew=True, processes=jobs, keep=not replace)
    if shards := folders(into):
        say(f"without {counted(len(shards), 'shard')}; {advised('merge', campaign, into)} takes them in")
