"""One's own numbers of the records of a case's members: a changed function is evaluate_members anew over the same records."""

from typing import Final

from nanoslip.solver.case import Case
from nanoslip.solver.ensemble import Ensemble
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.manifest.observables import Observable
from nanoslip.study.tasks.estimates import FLOAT, TASK, estimate_sizes
from nanoslip.study.tasks.functions import Arguments, evaluate
from nanoslip.study.tasks.kind import Computed, Estimate, Kind, Member, Wanted, has_own_numbers, own_numbers
from nanoslip.study.tasks.record import PER_EVENT, member_records, record_task, small_record
from nanoslip.study.tasks.task import Inputs, Task, task_case, task_key


def observables_task(case: Case, ensemble: Ensemble, numbers: tuple[Observable, ...]) -> Task:
    """One's own numbers of the friction records of a case's members."""
    record = record_task(case, ensemble)
    identities = [number.identity for number in numbers]
    key = task_key("observables", record.key, *identities)
    needs = (record.key,)
    return Task(key, "observables", case.slab, case, observables=numbers, ensemble=record.ensemble, needs=needs)


def _tasks(case: Case, manifest: Manifest) -> tuple[Wanted, ...]:
    numbers = own_numbers("observables", manifest)
    return (Wanted(observables_task(case, manifest.ensemble, numbers)),)


def estimate_reading(task: Task) -> Estimate:
    """Cost of reading the records: nobody knows that of the functions."""
    numbers = task.ensemble.likely * PER_EVENT * estimate_sizes(task_case(task)).events
    return Estimate(task.ensemble.likely * TASK, FLOAT * 2.0 * numbers)


def _compute(task: Task, inputs: Inputs) -> Computed:
    result = inputs[task.needs[0]]
    records = [record for record, _ in member_records(result)]
    return evaluate_members(task, [(record,) if record.outcome.usable else None for record in records])


def evaluate_members(task: Task, arguments: list[Arguments | None]) -> Computed:
    """Numbers of members by the user's functions. Outcomes belong to records and drives: here all are complete."""
    evaluated = evaluate(task.observables, arguments)
    members = (Member((), evaluated.outcome),) * len(arguments)
    return Computed(members, scalars=evaluated.scalars)


KIND: Final = Kind(
    "observables",
    needed=has_own_numbers("observables"),
    tasks=_tasks,
    estimate=estimate_reading,
    compute=_compute,
    # They run no kernel beside the record's.
    miniature=small_record,
)
