"""A campaign's plan, and what `plan`, `status` and `run` print of it."""

from collections import Counter
from collections.abc import Callable, Mapping
from pathlib import Path

import click

from study.commands.shared.arguments import folder
from study.commands.shared.refusals import refusals
from study.dataset.store import Store
from study.manifest.reader import load_manifest
from study.origin import Origins, census, here
from study.plan.plan import Plan, make_plan, memory_of
from study.plan.tasks import Task
from study.report.console import Table, print_table


def planned(campaign: Path) -> Plan:
    """The plan of a campaign file. Raises ManifestError."""
    return make_plan(load_manifest(campaign))


def show(campaign: Path, out: Path | None, print_plan: Callable[[Plan, tuple[Task, ...]], None]) -> None:
    """Print a campaign's plan and what is left of it, then which finished results are by other software.

    out: folder of the results, None for the campaign's own. Raises Refusal.
    """
    with refusals():
        plan = planned(campaign)
        found = Store(folder(campaign, out)).inventory()
        print_plan(plan, plan.remaining(found))
        print_foreign(plan.foreign(found), campaign)


def print_counts(tasks: tuple[Task, ...], remaining: tuple[Task, ...]) -> None:
    """Print how many tasks of each kind there are, are finished and are left, with estimated seconds and memory."""
    every, left = Counter(task.kind for task in tasks), Counter(task.kind for task in remaining)
    rows = []
    for kind, count in every.items():
        seconds = sum(task.cost for task in remaining if task.kind == kind)
        memory = max(memory_of(task) for task in tasks if task.kind == kind) / 1e6
        done = str(count - left[kind])
        rows.append((kind, str(count), done, str(left[kind]), f"{seconds:.3g}", f"{memory:.3g}"))
    header = ("tasks", "all", "finished", "left", "core seconds left, about", "MB of arrays each, about")
    print_table(Table(header, tuple(rows)))


def print_foreign(foreign: Mapping[str, Origins], campaign: Path, err: bool = False) -> None:
    """Print which finished results are by other software, and how to compute them again; nothing where none are."""
    if not foreign:
        return
    parts = "; ".join(f"{count} of {origin}" for origin, count in sorted(census(foreign.values()).items()))
    click.echo(
        f"{len(foreign)} finished results are other software's: {parts}; here is {here()}. They are used as they are; "
        f"nanoslip run {campaign} --recompute-foreign computes them again",
        err=err,
    )
