"""One's own numbers of drives: motions are computed again, as results hold that of the first member alone."""

from functools import partial
from typing import Final

from nanoslip.solver.case import Case
from nanoslip.solver.drive import Drive
from nanoslip.solver.ensemble import Ensemble
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.manifest.observables import Observable
from nanoslip.study.tasks import drive as drives
from nanoslip.study.tasks.compliance import compliance_needs
from nanoslip.study.tasks.functions import Arguments
from nanoslip.study.tasks.kind import Computed, Estimate, Kind, Wanted, has_own_numbers, own_numbers
from nanoslip.study.tasks.observables import estimate_reading, evaluate_members
from nanoslip.study.tasks.record import record_task
from nanoslip.study.tasks.task import Inputs, Task, task_key


def drive_observables_task(case: Case, drive: Drive, ensemble: Ensemble, numbers: tuple[Observable, ...]) -> Task:
    """One's own numbers of the motions of a drive over the friction records of a case's members."""
    record = record_task(case, ensemble)
    identities = [number.identity for number in numbers]
    return Task(
        task_key("drive_observables", record.key, drives.drive_text(drive), *identities),
        "drive_observables",
        case.slab,
        case,
        drive,
        fitted=False,
        observables=numbers,
        ensemble=record.ensemble,
        needs=(record.key, *(compliance_needs(case.slab) if drive.memory else ())),
    )


def _tasks(case: Case, manifest: Manifest) -> tuple[Wanted, ...]:
    numbers = own_numbers("drive_observables", manifest)
    task = partial(drive_observables_task, ensemble=manifest.ensemble, numbers=numbers)
    pulls = drives.dimensionless_drives(manifest)
    return tuple(Wanted(task(case, drive), label) for label, drive in pulls)


def _estimate(task: Task) -> Estimate:
    again, reading = drives.KIND.estimate(task), estimate_reading(task)
    # The motions of all members are there at once, as functions get them together.
    memory = task.ensemble.likely * again.memory + reading.memory
    return Estimate(again.seconds + reading.seconds, memory)


def _compute(task: Task, inputs: Inputs) -> Computed:
    pulling = drives.Pulling(task, inputs)
    arguments = list[Arguments | None]()
    for number, (record, _) in enumerate(pulling.records):
        motion = pulling.motion(number)
        arguments.append(None if motion is None else (record, motion))
    return evaluate_members(task, arguments)


KIND: Final = Kind(
    "drive_observables",
    needed=has_own_numbers("drive_observables"),
    tasks=_tasks,
    estimate=_estimate,
    compute=_compute,
    # They run no kernel beside the drive's.
    miniature=drives.KIND.miniature,
    driven=True,
)
