"""The root's part of `nanoslip run`: plan, hand out tasks, collect. Other ranks do not import this file."""

from contextlib import ExitStack
from pathlib import Path

import click

from study.commands.shared.datasets import write_dataset
from study.commands.shared.exits import Refusal, show
from study.commands.shared.plans import counted, planned, print_foreign
from study.commands.shared.refusals import refusals
from study.execution.executor import drop_intermediates
from study.execution.failures import Diary, Left, left
from study.execution.farms.farm import Farm
from study.execution.journal import Journal
from study.execution.progress import open_progress
from study.execution.warmup import WarmUp, miniatures
from study.exit_codes import FAILURES, INTERRUPTED
from study.plan.memory import shortages
from study.plan.plan import Plan
from study.plan.tasks import Task
from study.report.console import console, say
from study.results import attempts
from study.results.lease import Lease
from study.results.store import Store


def conduct(farm: Farm, campaign: Path, out: Path, recompute_foreign: bool, retry: bool) -> int:
    """Compute what is left of a campaign on this farm, and write its dataset; returns the exit code of all ranks."""
    journal = Journal(out)
    code = _conducted(farm, journal, campaign, out, recompute_foreign, retry)
    journal.end(code)
    return code


def _conducted(farm: Farm, journal: Journal, campaign: Path, out: Path, recompute_foreign: bool, retry: bool) -> int:
    try:
        with refusals(), ExitStack() as stack:
            plan, store = planned(campaign), Store(out)
            lease = stack.enter_context(Lease(out, farm.interruption.request))
            store.prepare()
            finished = store.inventory()
            foreign = plan.foreign(finished)
            if recompute_foreign:
                say(f"{len(foreign)} results of other software count as not finished", stderr=True)
                finished = {key: origins for key, origins in finished.items() if key not in foreign}
            else:
                print_foreign(foreign, campaign, stderr=True)
            return _compute(farm, journal, plan, out, left(plan, store, finished, retry), lease)
    except click.ClickException as error:
        show(error)
        return error.exit_code


def _compute(farm: Farm, journal: Journal, plan: Plan, out: Path, work: Left, lease: Lease) -> int:
    tasks = work.tasks
    _refuse_shortages(farm, plan, tasks)
    if tasks:
        farm.run([WarmUp(tuple(miniatures(tasks)))], lambda *_: None)
    said = f"{counted(len(plan.cases), 'case')}, {counted(len(tasks), 'task')} left, {farm.size} {farm.unit}"
    say(f"{plan.manifest.title}: {said}", stderr=True)
    if tasks:
        journal.begin(farm.size, farm.unit)
    with open_progress(tasks, console(stderr=True), farm.size) as progress:
        diary = Diary(out, progress)
        tally = farm.run(tasks, diary.report, diary.fail)
    journal.computed(tally)
    if tally.halt:
        raise Refusal(f"{tally.halt}; what is finished is kept: run again to continue")
    if lease.lost:
        return INTERRUPTED
    if tally.interrupted:
        say("interrupted: what is finished is kept; run again to continue", stderr=True)
        return INTERRUPTED
    drop_intermediates(plan, tasks, Store(out))
    write_dataset(plan, out)
    return _conclude(tally.crashed, len(work.given_up), out)


def _conclude(failed: int, given_up: int, out: Path) -> int:
    """Say what has failed, now and before; returns the exit code."""
    if failed:
        say(f"{counted(failed, 'task')} failed, or needed one that did: see {out / attempts.FILE}", stderr=True)
    if given_up:
        say(f"{counted(given_up, 'task')} failed before, or needed one that did: --retry tries again", stderr=True)
    return FAILURES if failed or given_up else 0


def _refuse_shortages(farm: Farm, plan: Plan, tasks: tuple[Task, ...]) -> None:
    if short := shortages(plan, tasks, farm.here):
        raise Refusal("\n".join(short))
