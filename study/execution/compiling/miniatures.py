"""Small tasks that run every kernel of a campaign's tasks."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import fields, replace
from functools import lru_cache
from operator import attrgetter

from nanoslip.solver.case import PARTS, Case, Effects, Heterogeneity, SlipRule
from nanoslip.solver.drive import Drive
from nanoslip.solver.outcome import COMPLETED, InvalidInput
from nanoslip.solver.parameter import choices_of, declared
from nanoslip.solver.sliding.plateau import plateau_of
from nanoslip.study.execution.compiling.sawtooth import sawtooth
from nanoslip.study.plan.kinds.kind import Member, numbers
from nanoslip.study.plan.task import Task, TaskResult
from nanoslip.study.plan.tasks import KINDS, compliance_task, contact_task, drive_task, record_task


def miniatures(tasks: Sequence[Task]) -> list[Task]:
    """Small tasks that run every kernel of these tasks, needs first; drives need `made_up_record`."""
    found: dict[str, Task] = {}
    seen: set[tuple[object, ...]] = set()
    for task in tasks:
        choices = _choices_of(task)
        if choices not in seen:
            seen.add(choices)
            with suppress(InvalidInput):  # what cannot be made small compiles its kernels itself
                found |= {each.key: each for each in _small(task)}
    return list(found.values())


def made_up_record() -> TaskResult:
    """The result that drives among miniatures need: of the right name and types, but no slab has been computed for it."""
    record = sawtooth(_SMALL)
    scalars, arrays = numbers(KINDS["record"], [Member((None, plateau_of(record), None, record))])
    return TaskResult(record_task(_SMALL).key, "record", COMPLETED, scalars, arrays)


def _choices_of(task: Task) -> tuple[object, ...]:
    """All that decides which kernels a task runs: the words and switches of its drive, or of its case."""
    if task.drive is not None:
        return (_choices(task.drive),)
    if task.case is None:
        return ()
    case = task.case
    parts = (_choices(getattr(case, part)) for part in PARTS)
    return (task.kind == "contact", bool(case.heterogeneity.roughness), *_own_choices(case), *parts)


@lru_cache(maxsize=4096)
def _choices(part: Drive | SlipRule | Effects | Heterogeneity) -> tuple[object, ...]:
    """Words and switches: they decide which kernels run, the numbers do not."""
    flat = part.flat if isinstance(part, Drive) else {name: getattr(part, name) for name in declared(type(part))}
    return tuple((name, value) for name, value in flat.items() if isinstance(value, str | bool))


_own_choices = attrgetter(*(item.name for item in fields(Case) if choices_of(item.type) or item.type is bool))


def _small(task: Task) -> list[Task]:
    if task.drive is not None:
        return [_short(task.drive)]
    if task.case is not None:
        return [_COMPLIANCE, (contact_task if task.kind == "contact" else record_task)(_tiny(task.case))]
    return []


def _short(drive: Drive) -> Task:
    """The drive over a hundredth of its duration, or all of it where that is less than a step of its integrator."""
    with suppress(InvalidInput):
        return drive_task(_SMALL, replace(drive, duration=drive.duration / 100, samples=2))
    return drive_task(_SMALL, replace(drive, samples=2))


_NUMBERS = {"n_x": 17, "radius": 50.0, "max_events": 60}
"""Numbers of a small case."""
_SMALL = Case.of(_NUMBERS)
_COMPLIANCE = compliance_task(_SMALL.slab)
_ROUGH = ((-0.1, 0.0), (0.1, 0.0))
"""A rough pin has kernels of its own, whatever its profile."""


def _tiny(case: Case) -> Case:
    """A small case with the same words and switches: they decide which kernels run, the numbers do not.

    The slab's are left out: nothing of a compliance is compiled.
    """
    flat = case.flat
    chosen = {name: flat[name] for name in flat.keys() - case.slab.flat.keys() if isinstance(flat[name], str | bool)}
    return Case.of({**_NUMBERS, **chosen, "roughness": _ROUGH if case.heterogeneity.roughness else ()})
