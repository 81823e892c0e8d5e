"""`nanoslip status`: how much of a campaign is finished, from the files of results alone."""

from pathlib import Path

import click

from study.commands.shared.arguments import folder
from study.commands.shared.plans import planned, print_counts, print_foreign
from study.commands.shared.refusals import refusals
from study.dataset.store import Store


def work(campaign: Path, out: Path | None) -> None:
    """Print how many of a campaign's tasks are finished."""
    with refusals():
        plan = planned(campaign)
        found = Store(folder(campaign, out)).inventory()
        click.echo(plan.manifest.title)
        print_counts(plan.tasks, plan.remaining(found))
        print_foreign(plan.foreign(found), campaign)
