"""The root's part of `nanoslip run`: plan, hand out tasks, collect. Other ranks do not import this file."""

from collections.abc import Mapping
from contextlib import closing
from pathlib import Path
from typing import Final

import click

from nanoslip.solver.outcome import Ending, Outcome
from nanoslip.study.commands.datasets import write_dataset
from nanoslip.study.commands.plans import advised, counted, idle_lines, planned, print_foreign, refusals
from nanoslip.study.commands.run import Order
from nanoslip.study.commands.words import Refusal, show
from nanoslip.study.exit_codes import FAILURES, INTERRUPTED
from nanoslip.study.origin import Origins
from nanoslip.study.plan.outlook import shortages
from nanoslip.study.plan.plan import Plan
from nanoslip.study.plan.task import Task
from nanoslip.study.report.console import console, say
from nanoslip.study.results import attempts
from nanoslip.study.results.attempts import Attempt
from nanoslip.study.results.store import Lease, Store, merge_shards
from nanoslip.study.run.batch import finished_with, part
from nanoslip.study.run.dispatch import Done, Tally
from nanoslip.study.run.executor import Diary, Left, drop_intermediates, given_up, left, unseen
from nanoslip.study.run.farm import Farm
from nanoslip.study.run.journal import Journal, measured_in
from nanoslip.study.run.mail import Begun
from nanoslip.study.run.progress import open_progress
from nanoslip.study.run.warm_up import warm_ups

# Tasks that were running when a whole run was killed: the next run computes them last. After a second time they have
# failed.

KILLED: Final = (
    "all processes of its run ended while it was computed: a defect or too little memory, its own or another task's"
)


def blame(plan: Plan, store: Store, out: Path) -> None:
    """Write down as failed what a run in this folder left begun, for good if that is so for the second time."""
    begun = Begun(out)
    if keys := begun.read().difference(store.inventory()):
        before, diary = store.failures(), Diary(out, lambda *_: None)
        for task in plan.tasks:
            known = before.get(task.key)
            if task.key in keys and not (known and known.given_up):
                second = known is not None and known.message == KILLED
                diary.fail(task, Done(task.key, Outcome(Ending.CRASHED, KILLED), 0.0, passing=not second), final=True)
    begun.close()


# Whether a run ends before all is computed, and what it says then.


def broken_off(journal: Journal, tally: Tally, lease: Lease) -> bool:
    """Whether a run ends before all is computed; says why. Raises Refusal where no task could be finished any more."""
    journal.computed(tally)
    lost = lease.look()
    if tally.halt:
        raise Refusal(f"{tally.halt}; what is finished is kept: run again to continue")
    if tally.interrupted and not lost:
        _print_interrupted(tally)
    return bool(lost) or tally.interrupted


def _print_interrupted(tally: Tally) -> None:
    late = f"{counted(tally.outlasting, 'task')} left would outlast this job; " if tally.outlasting else ""
    say(f"interrupted: {late}what is finished is kept; run again to continue", stderr=True)


# What is left to do of a plan, and what stands in its way: results of older or other software, tasks that failed.


def print_outdated(store: Store) -> None:
    """Print which results are of an older nanoslip, which this one does not read."""
    if found := store.outdated():
        told = f"{counted(len(found), 'result')} of an older nanoslip there, first {found[0].name}"
        say(f"{store.folder}: {told}: not read, computed again; the files may be removed", stderr=True)


def remaining(plan: Plan, order: Order, store: Store, retry: bool) -> Left:
    """What is left to do. Results of other software are named, or left out where they are to be computed again."""
    finished, failures = _known(plan, order, store)
    foreign = plan.foreign(finished)
    if order.recompute_foreign:
        say(f"{len(foreign)} results of other software count as not finished", stderr=True)
        finished = {key: origins for key, origins in finished.items() if key not in foreign}
    else:
        print_foreign(foreign, order.campaign, order.out, stderr=True)
    return left(plan, failures, finished, retry)


def _known(plan: Plan, order: Order, store: Store) -> tuple[dict[str, Origins], Mapping[str, Attempt]]:
    """Which tasks are finished, and which have failed. A shard looks at what was merged, too; the whole takes shards in."""
    if order.shard:
        merged = Store(order.out)
        failures = {**merged.failures(), **store.failures()}
        known = finished_with(plan, store.inventory(), merged.inventory(), given_up(failures, order.retry))
        return known, failures
    for problem in merge_shards(order.out):
        say(problem, stderr=True)
    return store.inventory(), store.failures()


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
