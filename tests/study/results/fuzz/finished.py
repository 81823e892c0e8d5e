"""A small campaign that has ended, with one task that failed: the folder whose files are damaged, and what it says."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from nanoslip.study.commands.datasets import write_dataset
from nanoslip.study.dataset import file
from nanoslip.study.dataset.collect import NOTE
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.origin import here
from nanoslip.study.plan.plan import Plan, make_plan
from nanoslip.study.plan.task import TaskResult
from nanoslip.study.results import attempts, log
from nanoslip.study.results import attempts as runs
from nanoslip.study.results import entry as own
from nanoslip.study.results import store as lease
from nanoslip.study.results.attempts import Attempt
from nanoslip.study.results.store import FOLDER, Lease, Store
from nanoslip.study.run.dispatch import Tally
from nanoslip.study.run.executor import executor
from nanoslip.study.run.journal import Journal

CAMPAIGN: Final = """\
title = "A campaign whose files are damaged"
stages = ["contact", "slip", "dynamics"]

[axes]
intrinsic_friction = [0.25, 0.5]

[constants]
radius = 100.0

[numerics]
n_x = 17

[limits]
events = 20

[outputs]
fit = false

[[drives]]
name = "slow"
stage_velocity = 1e-3
samples = 10

[[drives]]
name = "fast"
samples = 10
"""


@dataclass(frozen=True)
class Finished:
    """The campaign, and what its folder has when nothing is damaged."""

    plan: Plan
    out: Path
    results: dict[str, TaskResult]
    failed: Attempt
    files: dict[str, Path]
    """Sort of file -> one of that sort, seen from the folder."""


def finished(folder: Path) -> Finished:
    """Compute it in this process."""
    campaign, out = folder / "damaged.toml", folder / "out"
    campaign.write_text(CAMPAIGN, "utf-8")
    plan = make_plan(load_manifest(campaign))
    *tasks, last = plan.tasks
    journal, writers = Journal(out, "nanoslip run damaged.toml"), [executor(out), executor(out)]
    Store(out).prepare()
    journal.begin(2, "processes")
    for number, task in enumerate(tasks):
        writers[number % 2](task)
    failed = Attempt(
        last.key, last.label, "crashed", "a defect", True, False, here().solver, "rank 1", "2026-01-01T00:00:00+00:00"
    )
    for each in (replace(failed, final=False), failed):
        attempts.add(out, each)
    journal.computed(Tally())
    journal.end(3)
    with Lease(out):
        running = (out / lease.FILE).read_text("utf-8")
    (out / lease.FILE).write_text(running, "utf-8")  # as a run leaves it that is killed
    write_dataset(plan, Store(out))
    store = Store(out)
    results = {key: store.read(key) for key in store.finished()}
    return Finished(plan, out, results, failed, dict(_files(out, results)))


def seals(out: Path) -> dict[str, int]:
    """Key -> checksum of all that its result says."""
    return dict(Store(out).seals())


def _files(out: Path, results: dict[str, TaskResult]) -> Iterator[tuple[str, Path]]:
    logs = sorted((out / FOLDER).glob(f"*{log.ENDING}"))
    yield "a log of results", max(logs, key=lambda path: path.stat().st_size).relative_to(out)
    # Of a compliance nothing is wanted any more when its records are there.
    shared = [path for path in (out / FOLDER).glob(f"*{own.ENDING}") if results[path.stem].kind == "record"]
    yield "a result of its own", min(shared).relative_to(out)
    for name in (attempts.FILE, runs.RUNS_FILE, lease.FILE, f"{FOLDER}/{NOTE}", file.FILE):
        yield f"`{name}`", Path(name)
