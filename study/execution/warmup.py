"""Compile the kernels that a run needs before it begins, in one process: the others load them from numba's cache."""

import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, fields, replace
from functools import cache, lru_cache
from operator import attrgetter
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from solver.case import PARTS, Case, Effects, Heterogeneity, SlipRule
from solver.compiled import told_of_compiling
from solver.drive import Drive
from solver.outcome import COMPLETED, InvalidInput, Outcome
from solver.parameter import choices_of, declared
from study.plan.tasks import Task, compliance_task, contact_task, drive_task, record_task, run_task
from study.results.store import Store


@dataclass(frozen=True, slots=True)
class WarmUp:
    """The compiling as a task of its own: what it does to its process costs nobody another one."""

    tasks: tuple[Task, ...]
    """Small ones, that run every kernel of a run's."""
    key: str = "warm_up"
    kind: str = "warm_up"
    label: str = "compiling kernels"
    needs: tuple[str, ...] = ()
    cost: float = 60.0
    limit: float = 3600.0

    def run(self) -> Outcome:
        """Compile, and say so first where the cache has not all of it."""
        warm_up(self.tasks, lambda: sys.stderr.write(f"{COMPILING}\n"))
        return COMPLETED


COMPILING: Final = "compiling kernels, once: about a minute; later runs load them"


def warm_up(tasks: Sequence[Task], say: Callable[[], object]) -> None:
    """Run `miniatures` of tasks, through a store: kernels are compiled for its read-only arrays.

    say: called once, before the first kernel is compiled; not where all are in the cache.
    """
    # What fails here fails again in a task of the run, where it is reported.
    with TemporaryDirectory() as folder, suppress(Exception), told_of_compiling(cache(say)):
        store = Store(Path(folder))
        store.prepare()
        for task in tasks:
            store.write(run_task(task, {key: store.read(key) for key in task.needs}), task.shared)


def miniatures(tasks: Sequence[Task]) -> list[Task]:
    """Small tasks that run every kernel of these tasks, needs first."""
    found = {_COMPLIANCE.key: _COMPLIANCE}
    seen: set[tuple[object, ...]] = set()
    for task in tasks:
        choices = _choices_of(task)
        if choices not in seen:
            seen.add(choices)
            with suppress(InvalidInput):  # what cannot be made small compiles its kernels itself
                found |= {each.key: each for each in _small(task)}
    return list(found.values())


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
        return [record_task(_STEADY), _short(task.drive)]
    if task.case is not None:
        return [(contact_task if task.kind == "contact" else record_task)(_tiny(task.case))]
    return []


def _short(drive: Drive) -> Task:
    """The drive over a hundredth of its duration, or all of it where that is less than a step of its integrator."""
    with suppress(InvalidInput):
        return drive_task(_STEADY, replace(drive, duration=drive.duration / 100, samples=2))
    return drive_task(_STEADY, replace(drive, samples=2))


_NUMBERS = {"n_x": 17, "radius": 50.0, "max_events": 60}
"""Numbers of a small case whose record becomes steady, as a drive needs it."""
_STEADY = Case.of(_NUMBERS)
_COMPLIANCE = compliance_task(_STEADY.slab)
_ROUGH = ((-0.1, 0.0), (0.1, 0.0))
"""A rough pin has kernels of its own, whatever its profile."""


def _tiny(case: Case) -> Case:
    """A small case with the same words and switches: they decide which kernels run, the numbers do not.

    The slab's are left out: nothing of a compliance is compiled.
    """
    flat = case.flat
    chosen = {name: flat[name] for name in flat.keys() - case.slab.flat.keys() if isinstance(flat[name], str | bool)}
    return Case.of({**_NUMBERS, **chosen, "roughness": _ROUGH if case.heterogeneity.roughness else ()})
