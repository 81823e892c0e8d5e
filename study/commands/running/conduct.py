"""The root's part of `nanoslip run`: plan, hand out tasks, collect. Other ranks do not import this file."""

from contextlib import closing

import click

from nanoslip.study.commands.running.broken_off import broken_off
from nanoslip.study.commands.running.killed import blame
from nanoslip.study.commands.running.order import Order
from nanoslip.study.commands.running.remaining import print_outdated, remaining
from nanoslip.study.commands.shared.datasets import write_dataset
from nanoslip.study.commands.shared.exits import Refusal, show
from nanoslip.study.commands.shared.plans import advised, counted, idle_lines, planned
from nanoslip.study.commands.shared.refusals import refusals
from nanoslip.study.plan.outlook import shortages
from nanoslip.study.plan.plan import Plan
from nanoslip.study.plan.tasks import Task
from nanoslip.study.report.console import console, say
from nanoslip.study.results import attempts
from nanoslip.study.results.store import Lease, Store
from nanoslip.study.run.batch import part
from nanoslip.study.run.dispatch import Tally
from nanoslip.study.run.executor import Diary, drop_intermediates, unseen
from nanoslip.study.run.farm import Farm
from nanoslip.study.run.journal import Journal, measured_in
from nanoslip.study.run.launch import FAILURES, INTERRUPTED
from nanoslip.study.run.mail import Begun
from nanoslip.study.run.progress import open_progress
from nanoslip.study.run.warm_up import warm_ups


def conduct(farm: Farm, order: Order) -> int:
    """Compute what is left of a campaign on this farm, and write its dataset; returns the exit code of all ranks."""
    journal = Journal(order.into)
    try:
        with refusals():
            code = _run(farm, journal, order)
    except click.ClickException as error:
        show(error)
        code = error.exit_code
    journal.end(code)
    return code


def _run(farm: Farm, journal: Journal, order: Order) -> int:
    plan, store = planned(order.campaign), Store(order.into)  # what cannot be planned leaves no folder
    with Lease(order.into, farm.interruption.request) as lease:
        store.prepare()
        print_outdated(store)
        return _carry_out(farm, journal, order, plan, store, lease)


def _carry_out(farm: Farm, journal: Journal, order: Order, plan: Plan, store: Store, lease: Lease) -> int:
    if order.shard:
        plan = part(plan, order.shard)
        if not plan.cases:
            say(f"{order.shard} has nothing to do: there are fewer cases (or ensembles) than shards")
            return 0
    blame(plan, store, order.into)
    work = remaining(plan, order, store, retry=order.retry)
    _get_ready(farm, plan, order, work.tasks)
    if work.tasks:
        journal.begin(farm.size, farm.unit)
    tally, undone = _compute(farm, journal, order, work.tasks)
    if broken_off(journal, tally, lease):
        return INTERRUPTED
    farm.settle()
    store.settle()
    if missing := unseen(work.tasks, undone, store):
        say(missing, stderr=True)
        return INTERRUPTED
    if work.tasks:
        drop_intermediates(plan, store)
    if order.shard:
        failed = tally.crashed + len(work.given_up)
        ended = f"has ended without {counted(failed, 'task')}" if failed else "is done"
        say(f"{order.shard} {ended}; {advised('merge', order.campaign, order.out)} brings all shards together")
    pending = 0 if order.shard else write_dataset(plan, store)
    code = _conclude(tally.crashed, len(work.given_up), order)
    if pending and not code:
        say(f"{counted(pending, 'outcome')} pending, though nothing was left to do: run again to continue", stderr=True)
        return INTERRUPTED
    return code


def _get_ready(farm: Farm, plan: Plan, order: Order, tasks: tuple[Task, ...]) -> None:
    """See that memory suffices, have the kernels compiled, and say what there is to do."""
    if short := shortages(plan, tasks, farm.here):
        raise Refusal("\n".join(short))
    if tasks:
        farm.run(warm_ups(tasks), lambda *_: None)
    said = f"{counted(len(plan.cases), 'case')}, {counted(len(tasks), 'task')} left, {farm.size} {farm.unit}"
    title = f"{plan.manifest.title}, {order.shard}" if order.shard else plan.manifest.title
    for line in (f"{title}: {said}", *idle_lines(plan)):
        say(line, stderr=True)


def _compute(farm: Farm, journal: Journal, order: Order, tasks: tuple[Task, ...]) -> tuple[Tally, set[str]]:
    """Compute tasks; returns the keys of those that have no result, too."""
    begun, measured = Begun(order.into), measured_in(order.into, order.out)
    farm.interruption.at_request(begun.close)  # whatever ends the run from then on is no task
    with open_progress(tasks, console(stderr=True), farm.size, measured) as progress, closing(begun):
        diary = Diary(order.into, journal.noting(progress))
        return farm.run(tasks, diary.report, diary.fail, begun.begin), diary.undone


def _conclude(failed: int, given_up: int, order: Order) -> int:
    """Say what has failed, now and before; returns the exit code."""
    if failed:
        said = f"{counted(failed, 'task')} failed, or needed one that did: see {order.into / attempts.FILE}"
        say(said, stderr=True)
    if given_up:
        say(f"{counted(given_up, 'task')} failed before, or needed one that did: --retry tries again", stderr=True)
    return FAILURES if failed or given_up else 0
