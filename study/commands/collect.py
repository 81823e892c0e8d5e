"""`nanoslip collect`: the dataset of a campaign from the results that are there."""

from pathlib import Path

import click

from study.commands.shared.arguments import CAMPAIGN, OUT, folder
from study.commands.shared.datasets import write_dataset
from study.commands.shared.plans import planned
from study.commands.shared.refusals import refusals


@click.command("collect")
@CAMPAIGN
@OUT
def command(campaign: Path, out: Path | None) -> None:
    """Write the dataset of CAMPAIGN from the results that are there."""
    with refusals():
        write_dataset(planned(campaign), folder(campaign, out))
