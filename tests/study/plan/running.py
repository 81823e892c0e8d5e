"""Campaigns read and planned from a text, a tiny case and its drive, and running tasks."""

from pathlib import Path

from nanoslip.solver.case import Case
from nanoslip.solver.drive import Drive, Scales
from nanoslip.solver.slab import Slab
from nanoslip.study.manifest.manifest import Manifest, NamedDrive
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.plan.plan import Plan, make_plan
from nanoslip.study.tasks.compliance import compliance_task
from nanoslip.study.tasks.compute import run_task
from nanoslip.study.tasks.drive import drive_task
from nanoslip.study.tasks.record import record_task
from nanoslip.study.tasks.task import Task, TaskResult

CASE = Case(radius=50.0, slab=Slab(33), max_events=300)
DRIVE = NamedDrive.of("paper", duration=0.2, samples=50).dimensionless(Scales())


def read(folder: Path, text: str) -> Manifest:
    """The campaign of this text below a title, in a file `mine.toml`."""
    path = folder / "mine.toml"
    path.write_text(f'title = "x"\n{text}', "utf-8")
    return load_manifest(path)


def planned(folder: Path, text: str) -> Plan:
    """Its plan."""
    return make_plan(read(folder, text))


def first(result: TaskResult, member: int = 0) -> dict[str, float]:
    """The numbers of a member, the first one or the only one there is."""
    return {name: values[member] for name, values in result.scalars.items()}


def run(*tasks: Task) -> TaskResult:
    """The result of the last task, the others being what it needs."""
    results: dict[str, TaskResult] = {}
    for task in tasks:
        results[task.key] = run_task(task, {key: results[key] for key in task.needs})
    return results[tasks[-1].key]


def slid(case: Case) -> TaskResult:
    return run(compliance_task(case.slab), record_task(case))


def drive(case: Case, drive: Drive = DRIVE) -> TaskResult:
    return run(compliance_task(case.slab), record_task(case), drive_task(case, drive))
