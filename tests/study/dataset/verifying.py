"""Datasets computed again from themselves, as tests of that share it."""

import shutil
from collections.abc import Callable, Mapping
from pathlib import Path

import netCDF4

from nanoslip.solver.outcome import Ending
from nanoslip.study.dataset import file
from nanoslip.study.dataset import verify as verification
from nanoslip.study.dataset.collect import collect
from nanoslip.study.dataset.compare import Finding, Verdict
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.origin import here
from nanoslip.study.plan.kinds import in_stages
from nanoslip.study.plan.plan import make_plan
from nanoslip.study.plan.task import Task, TaskResult
from nanoslip.study.results import attempts
from nanoslip.study.results.attempts import Attempt
from nanoslip.study.results.store import Store
from nanoslip.study.run.compute import run_task
from tests.conftest import SMALL

Change = Callable[[netCDF4.Dataset], None]


Run = Callable[[Task, Mapping[str, TaskResult]], TaskResult]


RECORDS = SMALL.split("[[drives]]")[0].replace(', "dynamics"', "")


STEADY = RECORDS.replace("[0.25, 0.5]", "[0.5]").replace("[50.0, 100.0]", "[100.0, 200.0]")
STEADY = (
    STEADY.replace("n_x = 17", "n_x = 65")
    .replace("events = 200", "presliding = 3.0")
    .replace("members = 1", "members = 3")
)


DRIVEN = STEADY.replace('"slip"]', '"slip", "dynamics"]').replace("[100.0, 200.0]", "[200.0]")
DRIVEN += '[[drives]]\nname = "a"\nsamples = 200\n'


KNOWN: dict[str, TaskResult] = {}


def once(task: Task, inputs: Mapping[str, TaskResult]) -> TaskResult:
    """Compute a task, in this file's tests together once: what is tested is what is made of the results."""
    if task.key not in KNOWN:
        KNOWN[task.key] = run_task(task, inputs)
    return KNOWN[task.key]


def computed(
    folder: Path,
    text: str,
    leave_out: Callable[[Task], bool] = lambda _: False,
    fails: Callable[[Task], Ending | None] = lambda _: None,
) -> Path:
    """The dataset of a campaign; what stands beside it is gone.

    fails: how an attempt at a task ends that leaves no result; what needs it is left out, too.
    """
    folder.mkdir(exist_ok=True)
    (folder / "campaign.toml").write_bytes(text.encode())
    plan, store = make_plan(load_manifest(folder / "campaign.toml")), Store(folder)
    store.prepare()
    lost: set[str] = set()
    for task in in_stages(plan.tasks):
        if ending := fails(task):
            attempts.add(folder, failure(task.key, ending))
        if ending or not lost.isdisjoint(task.needs):
            lost.add(task.key)
        elif not leave_out(task):
            store.write(once(task, {key: store.read(key) for key in task.needs}))
    file.write(collect(plan, store), folder / file.FILE)
    shutil.rmtree(folder / "results")
    for path in folder.iterdir():
        if path.name != file.FILE:
            path.unlink()
    return folder / file.FILE


def failure(key: str, ending: Ending) -> Attempt:
    return Attempt(key, "a task", ending.value, "why", True, False, here().solver, "rank 0 on here", "2026")


def verified(path: Path, folder: Path, count: int | None = None, run: Run = once) -> list[Finding]:
    folder.mkdir(exist_ok=True)
    store = Store(folder / "again")
    store.prepare()
    with file.reading(path) as found:
        plan = verification.rebuilt(found, path)
        cases = verification.sample(verification.computed(plan, found), count)
        for task in verification.tasks_of(plan, cases, found):
            store.write(run(task, {key: store.read(key) for key in task.needs}))
        return list(verification.compare(found, plan, cases, store))


def verdicts(findings: list[Finding]) -> list[Verdict]:
    return [each.verdict for each in findings]
