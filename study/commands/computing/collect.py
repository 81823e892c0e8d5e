"""`nanoslip collect`: the dataset of a campaign from the results that are there."""

from pathlib import Path

from study.commands.shared.arguments import folder
from study.commands.shared.datasets import write_dataset
from study.commands.shared.plans import planned
from study.commands.shared.refusals import refusals


def work(campaign: Path, out: Path | None) -> None:
    """Write and print the dataset of a campaign's results."""
    with refusals():
        write_dataset(planned(campaign), folder(campaign, out), anew=True)
