"""The root's part of `nanoslip run`: plan, hand out tasks, collect. Other ranks do not import this file."""

from collections.abc import Mapping
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import click

from study.commands.running import head_start
from study.commands.running.finished import nothing_to_do
from study.commands.running.killed import blame
from study.commands.running.order import Order
from study.commands.shared.datasets import write_dataset
from study.commands.shared.exits import Refusal, show
from study.commands.shared.glance import leave, outlined
from study.commands.shared.plans import PLANNED, counted, planned_from, print_foreign
from study.commands.shared.refusals import refusals
from study.execution.batch.cutting import finished_with, part
from study.execution.compiling.warm_up import warm_ups
from study.execution.executor import drop_intermediates
from study.execution.failures import Diary, Left, given_up, left
from study.execution.farms.begun import Begun
from study.execution.farms.farm import Farm
from study.execution.journal import Journal
from study.execution.ledger import Tally
from study.execution.progress import open_progress
from study.exit_codes import FAILURES, INTERRUPTED
from study.garbage import all_kept, keep_for_good
from study.manifest.manifest import Manifest
from study.manifest.reader import load_manifest
from study.origin import Origins
from study.plan.memory import shortages
from study.plan.plan import Plan, Planning, spelled_out
from study.plan.tasks import Task
from study.report.console import console, counting, say, whole
from study.results import attempts
from study.results.attempts import Attempt
from study.results.lease import Lease
from study.results.merging import merge_shards
from study.results.store import Store


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
    manifest = load_manifest(order.campaign)
    early = head_start.worthwhile(manifest)
    # What cannot be planned leaves no folder.
    plan, store = None if early or outlined(order.into) else planned_from(manifest), Store(order.into)
    with Lease(order.into, farm.interruption.request) as lease:
        store.prepare()
        _print_outdated(store)
        if plan is None and outlined(order.into) and nothing_to_do(order, manifest, store):
            return 0
        if early and head_start.possible(order, store):
            plan = _planned_meanwhile(farm, journal, order, manifest, lease)
            return INTERRUPTED if plan is None else _carry_out(farm, journal, order, plan, store, lease)
        return _carry_out(farm, journal, order, plan or planned_from(manifest), store, lease)


def _planned_meanwhile(farm: Farm, journal: Journal, order: Order, manifest: Manifest, lease: Lease) -> Plan | None:
    """The plan of very many cases, the first of which are computed meanwhile; None where that is broken off."""
    say(f"{manifest.title}: computing begins while cases are planned, {farm.size} {farm.unit}", stderr=True)
    journal.begin(farm.size, farm.unit)
    with counting(PLANNED) as heard, all_kept():
        planning = Planning(spelled_out(manifest))
        tally = head_start.HeadStart(farm, planning, heard).run(order.into)
        # What has failed is counted when the whole plan says what needs it.
        tally = replace(tally, crashed=0, interrupted=farm.interruption.requested, outlasting=0)
        if _broken_off(journal, tally, lease):
            return None
        plan = planning.plan()
        keep_for_good()
    return plan


def _carry_out(farm: Farm, journal: Journal, order: Order, plan: Plan, store: Store, lease: Lease) -> int:
    early = journal.begun
    if order.shard:
        plan = part(plan, order.shard)
        if not plan.cases:
            say(f"{order.shard} has nothing to do: there are fewer cases (or ensembles) than shards")
            return 0
    blame(plan, store, order.into)
    work = _left(plan, order, store, retry=order.retry and not early)
    _get_ready(farm, plan, order, work.tasks)
    if not order.shard:  # whose plan is a part: only the whole's is looked at
        leave(plan, order.into)
    if work.tasks:
        journal.begin(farm.size, farm.unit)
    tally = _compute(farm, order.into, work.tasks)
    now = len(work.given_up) if early else 0  # nothing had failed before
    tally = replace(tally, crashed=tally.crashed + now)
    if _broken_off(journal, tally, lease):
        return INTERRUPTED
    store.settle()
    if early or work.tasks:
        drop_intermediates(plan, store)
    if order.shard:
        say(f"{order.shard} is done; {whole(f'nanoslip merge {order.campaign}')} brings all shards together")
    else:
        write_dataset(plan, store)
    return _conclude(tally.crashed, len(work.given_up) - now, order)


def _broken_off(journal: Journal, tally: Tally, lease: Lease) -> bool:
    """Whether a run ends before all is computed; says why. Raises Refusal where no task could be finished any more."""
    journal.computed(tally)
    if tally.halt:
        raise Refusal(f"{tally.halt}; what is finished is kept: run again to continue")
    if tally.interrupted and not lease.lost:
        _print_interrupted(tally)
    return bool(lease.lost) or tally.interrupted


def _print_outdated(store: Store) -> None:
    if found := store.outdated():
        told = f"{counted(len(found), 'result')} of an older nanoslip there, first {found[0].name}"
        say(f"{store.folder}: {told}: not read, computed again; the files may be removed", stderr=True)


def _left(plan: Plan, order: Order, store: Store, retry: bool) -> Left:
    """What is left to do. Results of other software are named, or left out where they are to be computed again."""
    finished, failures = _known(plan, order, store)
    foreign = plan.foreign(finished)
    if order.recompute_foreign:
        say(f"{len(foreign)} results of other software count as not finished", stderr=True)
        finished = {key: origins for key, origins in finished.items() if key not in foreign}
    else:
        print_foreign(foreign, order.campaign, stderr=True)
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


def _get_ready(farm: Farm, plan: Plan, order: Order, tasks: tuple[Task, ...]) -> None:
    """See that memory suffices, have the kernels compiled, and say what there is to do."""
    if short := shortages(plan, tasks, farm.here):
        raise Refusal("\n".join(short))
    if tasks:
        farm.run(warm_ups(tasks), lambda *_: None)
    said = f"{counted(len(plan.cases), 'case')}, {counted(len(tasks), 'task')} left, {farm.size} {farm.unit}"
    title = f"{plan.manifest.title}, {order.shard}" if order.shard else plan.manifest.title
    say(f"{title}: {said}", stderr=True)


def _compute(farm: Farm, out: Path, tasks: tuple[Task, ...]) -> Tally:
    begun = Begun(out)
    farm.interruption.at_request(begun.close)  # whatever ends the run from then on is no task
    with open_progress(tasks, console(stderr=True), farm.size) as progress, closing(begun):
        diary = Diary(out, progress)
        return farm.run(tasks, diary.report, diary.fail, begun.begin)


def _print_interrupted(tally: Tally) -> None:
    late = f"{counted(tally.outlasting, 'task')} left would outlast this job; " if tally.outlasting else ""
    say(f"interrupted: {late}what is finished is kept; run again to continue", stderr=True)


def _conclude(failed: int, given_up: int, order: Order) -> int:
    """Say what has failed, now and before; returns the exit code."""
    if failed:
        said = f"{counted(failed, 'task')} failed, or needed one that did: see {order.into / attempts.FILE}"
        say(said, stderr=True)
    if given_up:
        say(f"{counted(given_up, 'task')} failed before, or needed one that did: --retry tries again", stderr=True)
    return FAILURES if failed or given_up else 0
