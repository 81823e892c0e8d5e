"""`nanoslip plan`: tasks, effects, estimated cost and expected flags of a campaign, before anything is computed."""

from pathlib import Path

import click

from study.commands.shared.plans import print_counts, show
from study.discretization.targets import choice
from study.manifest.effects import effects
from study.plan.flags import expected_lines
from study.plan.memory import shortages
from study.plan.plan import Plan
from study.plan.spans import span_line
from study.plan.tasks import Task
from study.report.console import Table, print_table


def work(campaign: Path, out: Path | None) -> None:
    """Print the plan of a campaign, what is left of it, and which tasks do not fit the memory here."""
    show(campaign, out, _print_plan)


def _print_plan(plan: Plan, remaining: tuple[Task, ...]) -> None:
    manifest = plan.manifest
    refused = [case for case in plan.cases if not case.outcome.ok]
    members = manifest.ensemble.members
    of_members = f" ({len(plan.cases) // members} times {members} members)" if members > 1 else ""
    click.echo(f"{manifest.title}\n{len(plan.cases)} cases{of_members}, {len(refused)} of them refused")
    if manifest.accuracy is not None:
        click.echo(f"accuracy = {manifest.accuracy:g}: {choice(manifest)}")
    _print_effects(plan)
    if manifest.drive_axes and manifest.drives:
        impossible = [drive for drive in manifest.drives if drive.drive is None]
        click.echo(f"{len(manifest.drives)} drives of each case, {len(impossible)} of them refused")
        for drive in impossible:
            click.echo(f"refused: drive {drive.label}: {drive.outcome.message}")
    if left_out := manifest.drives_left_out:
        click.echo(f'drives left out, as stages leave out "dynamics": {", ".join(left_out)}')
    print_counts(plan.tasks, remaining)
    if spans := span_line(plan):
        click.echo(spans)
    for line in expected_lines(plan):
        click.echo(f"expected: {line}")
    for case in refused:
        click.echo(f"refused: {case.point}: {case.outcome.message}")
    for line in shortages(plan, remaining):
        click.echo(f"does not fit here: {line}")


def _print_effects(plan: Plan) -> None:
    rows = [(each.name, each.setting, "" if each.setting == "on" else each.without) for each in effects(plan.manifest)]
    print_table(Table(("effect", "here", "left out where off"), tuple(rows)))
