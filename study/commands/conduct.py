"""The root's part of `nanoslip run`: plan, compute remaining tasks, write the dataset. Other ranks do not import this file."""

from collections.abc import Sequence

import click

from nanoslip.study.commands.datasets import write_dataset
from nanoslip.study.commands.plans import advised, counted, idle_lines, planned, print_foreign, refusals
from nanoslip.study.commands.run import Order
from nanoslip.study.commands.words import show
from nanoslip.study.exit_codes import FAILURES, INTERRUPTED
from nanoslip.study.plan.task import Task
from nanoslip.study.report.console import console, note, print_sentences
from nanoslip.study.results import attempts
from nanoslip.study.results.store import Lease, Store
from nanoslip.study.run.campaign import Rest, ShortageError, UnfinishedError, compute_rest, part, rest_of
from nanoslip.study.run.child import FarmError
from nanoslip.study.run.dispatch import Measured
from nanoslip.study.run.farm import Farm
from nanoslip.study.run.journal import Journal
from nanoslip.study.run.progress import Progress, open_progress


def conduct(farm: Farm, order: Order) -> int:
    """Compute remaining tasks of a campaign on this farm, and write its dataset; returns the exit code of all ranks."""
    journal = Journal(order.into)
    try:
        with refusals(ShortageError, FarmError):
            code = _run(farm, journal, order)
    except click.ClickException as error:
        show(error)
        code = error.exit_code
    journal.end(code)
    return code


def _run(farm: Farm, journal: Journal, order: Order) -> int:
    plan, store = planned(order.campaign), Store(order.into)  # what cannot be planned leaves no folder
    with Lease(order.into, farm.interruption.request) as lease:
        if order.shard:
            plan = part(plan, order.shard)
            if not plan.cases:
                note(f"{order.shard} has nothing to do: there are fewer cases (or ensembles) than shards")
                return 0
        rest = rest_of(plan, store, order.out, journal, _warn, order.recompute_foreign, order.retry)
        if order.recompute_foreign:
            _warn(f"{len(rest.foreign)} results of other software count as not finished")
        else:
            print_foreign(rest.foreign, order.campaign, order.out, stderr=True)

        def progress(tasks: Sequence[Task], processes: int, measured: Measured) -> Progress:
            title = f"{plan.manifest.title}, {order.shard}" if order.shard else plan.manifest.title
            cases, todo = counted(len(plan.cases), "case"), counted(len(tasks), "task")
            _warn(f"{title}: {cases}, {todo} left, {processes} {farm.unit}")
            print_sentences(idle_lines(plan), stderr=True)
            return open_progress(tasks, console(stderr=True), processes, measured)

        try:
            failed = compute_rest(farm, rest, journal, lease, progress)
        except UnfinishedError as error:
            if not lease.lost:  # else it has been printed
                _warn(str(error))
            return INTERRUPTED
        return _conclude(rest, failed, order)


def _warn(text: str) -> None:
    note(text, stderr=True)


def _conclude(rest: Rest, failed: int, order: Order) -> int:
    """Write the dataset, or of a shard how it goes on, and print what has failed, now and before; returns the exit code."""
    given_up, pending = len(rest.left.given_up), 0
    if order.shard:
        lost = failed + given_up
        ended = f"has ended without {counted(lost, 'task')}" if lost else "is done"
        note(f"{order.shard} {ended}; {advised('merge', order.campaign, order.out)} brings all shards together")
    else:
        pending = write_dataset(rest.plan, rest.store)
    if failed:
        _warn(f"{counted(failed, 'task')} failed, or needed one that did: see {order.into / attempts.FILE}")
    if given_up:
        _warn(f"{counted(given_up, 'task')} failed before, or needed one that did: --retry tries again")
    if failed or given_up:
        return FAILURES
    if pending:
        rest.store.prepare()  # sets aside what could not be read
        _warn(f"{counted(pending, 'outcome')} pending, though nothing was left to do: run again to continue")
        return INTERRUPTED
    return 0
