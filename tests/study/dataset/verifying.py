"""Datasets computed again from themselves, as tests of that share it."""

import shutil
from collections.abc import Callable, Mapping
from pathlib import Path

import netCDF4

from study.dataset import file, verification
from study.dataset.collection.collect import collect
from study.dataset.comparison import Verdict
from study.dataset.pair import Finding
from study.manifest.reader import load_manifest
from study.plan.plan import make_plan
from study.plan.tasks import Task, TaskResult, run_task
from study.results.store import Store
from tests.conftest import SMALL

Change = Callable[[netCDF4.Dataset], None]


Run = Callable[[Task, Mapping[str, TaskResult]], TaskResult]


RECORDS = SMALL.split("[[drives]]")[0].replace(', "dynamics"', "")


STEADY = RECORDS.replace("[0.25, 0.5]", "[0.5]").replace("[50.0, 100.0]", "[100.0, 200.0]")
STEADY = STEADY.replace("n_x = 17", "n_x = 65").replace("events = 60", "events = 1500")


DRIVEN = STEADY.replace('"slip"]', '"slip", "dynamics"]').replace("[100.0, 200.0]", "[200.0]")
DRIVEN += '[[drives]]\nname = "a"\nsamples = 200\n'


KNOWN: dict[str, TaskResult] = {}


def once(task: Task, inputs: Mapping[str, TaskResult]) -> TaskResult:
    """Compute a task, in this file's tests together once: what is tested is what is made of the results."""
    if task.key not in KNOWN:
        KNOWN[task.key] = run_task(task, inputs)
    return KNOWN[task.key]


def computed(folder: Path, text: str, leave_out: Callable[[Task], bool] = lambda _: False) -> Path:
    """The dataset of a campaign; what stands beside it is gone."""
    folder.mkdir(exist_ok=True)
    (folder / "campaign.toml").write_bytes(text.encode())
    plan, store = make_plan(load_manifest(folder / "campaign.toml")), Store(folder)
    store.prepare()
    for task in plan.tasks:
        if not leave_out(task):
            store.write(once(task, {key: store.read(key) for key in task.needs}))
    file.write(collect(plan, store), folder / file.FILE)
    shutil.rmtree(folder / "results")
    for path in folder.iterdir():
        if path.name != file.FILE:
            path.unlink()
    return folder / file.FILE


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
