"""`nanoslip merge`: move the results of shards into the campaign's folder, and write its dataset."""

import sys
from contextlib import ExitStack
from pathlib import Path

from nanoslip.study.commands.shared.arguments import folder
from nanoslip.study.commands.shared.datasets import write_dataset
from nanoslip.study.commands.shared.plans import advised, counted, planned
from nanoslip.study.commands.shared.refusals import refusals
from nanoslip.study.report.console import say
from nanoslip.study.results.shard import folders
from nanoslip.study.results.store import Lease, Store, StoreError, merge_shards
from nanoslip.study.run.executor import drop_intermediates, left
from nanoslip.study.run.launch import FAILURES, INTERRUPTED


def work(campaign: Path, out: Path | None) -> None:
    """Move the results of all shards into the campaign's, and write and print its dataset. Ends the process."""
    into = folder(campaign, out)
    with refusals(), ExitStack() as stack:
        plan, store = planned(campaign), Store(into)
        if plan.tasks and not (folders(into) or store.finished() or store.failures()):
            raise StoreError(
                f"{into}: no shards and no results of {campaign} there, nothing to merge: "
                f"{advised('run', campaign, into)} computes all of it; results of runs with another --out are found with it"
            )
        stack.enter_context(Lease(into))
        store.prepare()
        problems = merge_shards(into)
        drop_intermediates(plan, store)
        write_dataset(plan, store)
        rest = left(plan, store.failures(), store.finished())
    for problem in problems:
        say(problem, stderr=True)
    if rest.given_up:
        said = f"{counted(len(rest.given_up), 'task')} failed, or need one that did"
        say(f"{said}: {advised('run', campaign, into, '--retry')} tries again", stderr=True)
    if rest.tasks:
        say(f"{counted(len(rest.tasks), 'task')} left: {advised('run', campaign, into)} computes them", stderr=True)
    sys.exit(INTERRUPTED if rest.tasks else FAILURES if rest.given_up else 0)
