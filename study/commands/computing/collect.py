"""`nanoslip collect`: the dataset of a campaign from the results that are there."""

from pathlib import Path

from study.commands.shared.arguments import folder
from study.commands.shared.datasets import write_dataset
from study.commands.shared.plans import counted, planned
from study.commands.shared.refusals import refusals
from study.report.console import say, whole
from study.results.shard import folders
from study.results.store import Store


def work(campaign: Path, out: Path | None) -> None:
    """Write and print the dataset of a campaign's results."""
    into = folder(campaign, out)
    with refusals():
        store = Store(into)
        # Without failures tasks say nothing that their results do not.
        write_dataset(planned(campaign, tasks=bool(store.failures())), store, anew=True)
    if shards := folders(into):
        say(f"without {counted(len(shards), 'shard')}; {whole(f'nanoslip merge {campaign}')} takes them in")
