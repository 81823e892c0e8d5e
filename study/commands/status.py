"""`nanoslip status`: how much of a campaign is finished, from the files of results alone."""

from pathlib import Path

import click

from study.commands.shared.plans import print_counts, show
from study.plan.plan import Plan
from study.plan.tasks import Task


def work(campaign: Path, out: Path | None) -> None:
    """Print how many of a campaign's tasks are finished."""
    show(campaign, out, _print_status)


def _print_status(plan: Plan, remaining: tuple[Task, ...]) -> None:
    click.echo(plan.manifest.title)
    print_counts(plan.tasks, remaining)
