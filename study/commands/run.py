"""`nanoslip run`: compute a campaign in one process, in several, or on all ranks of an MPI job. Only it starts MPI."""

from importlib import import_module
from pathlib import Path
from typing import Final

import click

from nanoslip.study.commands.plans import (
    command_text,
    idle_lines,
    load_own_numbers,
    plan_campaign,
    plural,
    print_foreign,
    refusals,
)
from nanoslip.study.commands.words import show
from nanoslip.study.exit_codes import FAILURES, INTERRUPTED
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.report.console import console, note, print_sentences
from nanoslip.study.results import attempts
from nanoslip.study.results.files import Shard, results_folder
from nanoslip.study.results.store import Lease
from nanoslip.study.run.campaign import Rest, ShortageError, UnfinishedError, compute_campaign, part
from nanoslip.study.run.child import FarmError
from nanoslip.study.run.dispatch import MeasuredTimes
from nanoslip.study.run.farm import Farm, open_farm
from nanoslip.study.run.journal import Journal
from nanoslip.study.run.launch import cores, processes_started, task_program
from nanoslip.study.run.progress import Progress, open_progress

_DATASETS: Final = "nanoslip.study.commands.datasets"
"""Module that the root alone imports: it loads xarray."""


def run_campaign(
    campaign: Path, out: Path | None, serial: bool, jobs: int | None, grace: float, shard: Shard | None, **again: bool
) -> None:
    """Compute a campaign's tasks that are left, with all ranks or processes, and write its dataset. Ends the process.

    shard: compute this part alone, and write no dataset. again: `recompute_foreign` and `retry`, as of `campaign.compute`.
    """
    # Of several ranks the root reads it, as all others wait for its answer.
    if processes_started() == 1:
        # What is wrong is answered before anything is loaded that computes.
        load_manifest(campaign)
    into = results_folder(campaign, out)
    if jobs and jobs > cores():
        note(f"-j {jobs}: {cores()} cores here; more processes than cores are no faster", stderr=True)
    with refusals(FarmError):
        folder = shard.folder(into) if shard else into
        farm = open_farm(task_program(folder), grace, serial, jobs)
    with farm:
        if not farm.root:
            farm.leave(farm.serve())
        farm.leave(conduct(farm, campaign, into, shard, **again))


# The root plans, has tasks computed, and writes the dataset.


def conduct(farm: Farm, campaign: Path, out: Path, shard: Shard | None, **again: bool) -> int:
    """Compute remaining tasks of a campaign on this farm, and write its dataset; returns the exit code of all ranks.

    out: the campaign's folder. again: as of `compute_campaign`.
    """
    try:
        with refusals(ShortageError, FarmError):
            return _run(farm, campaign, out, shard, again)
    except click.ClickException as error:
        show(error)
        return error.exit_code


def _run(farm: Farm, campaign: Path, out: Path, shard: Shard | None, again: dict[str, bool]) -> int:
    # Before anything is written: what cannot be planned leaves no folder.
    plan = plan_campaign(campaign)
    load_own_numbers(plan.manifest)
    into = shard.folder(out) if shard else out
    if shard:
        plan = part(plan, shard)
        if not plan.cases:
            note(f"{shard} has nothing to do: there are fewer cases (or ensembles) than shards")
            return 0

    def progress(rest: Rest, processes: int, measured: MeasuredTimes) -> Progress:
        if again["recompute_foreign"]:
            _warn(f"{len(rest.foreign)} results of other software count as not finished")
        else:
            print_foreign(rest.foreign, campaign, out, stderr=True)
        title = f"{plan.manifest.title}, {shard}" if shard else plan.manifest.title
        cases = plural(len(plan.cases), "case")
        todo = plural(len(rest.tasks), "task")
        _warn(f"{title}: {cases}, {todo} left, {processes} {farm.unit}")
        print_sentences(idle_lines(plan), stderr=True)
        # Imported while other processes import what they compute with.
        import_module(_DATASETS)
        return open_progress(rest.tasks, console(stderr=True), processes, measured)

    journal = Journal(into)
    with Lease(into, farm.interruption.request) as lease:
        try:
            store, failed, given_up = compute_campaign(farm, plan, journal, lease, progress, _warn, out, **again)
        except UnfinishedError as error:
            # A lost lease has been reported when it was lost.
            if not lease.lost:
                _warn(str(error))
            return INTERRUPTED
        pending, kept = 0, ""
        if shard:
            ended = f"has ended without {plural(failed + given_up, 'task')}" if failed + given_up else "is done"
            note(f"{shard} {ended}; {command_text('merge', campaign, out)} brings all shards together")
        else:
            datasets = import_module(_DATASETS)
            try:
                pending = datasets.write_dataset(plan, store)
            except datasets.FewerFinishedError as error:
                # What was computed is stored, and failures are reported before this.
                kept = str(error)
        if failed:
            _warn(f"{plural(failed, 'task')} failed, or needed one that did: see {into / attempts.FILE}")
        if given_up:
            _warn(f"{plural(given_up, 'task')} failed before, or needed one that did: --retry tries again")
        if kept:
            _warn(kept)
        if failed or given_up:
            return FAILURES
        if pending or kept:
            # It sets aside what could not be read.
            store.prepare()
            journal.end(INTERRUPTED)
            lacking = f"{plural(pending, 'outcome')} pending, though nothing was left to do"
            _warn(f"{lacking if pending else 'not all is there'}: run again to continue")
            return INTERRUPTED
        return 0


def _warn(text: str) -> None:
    note(text, stderr=True)
