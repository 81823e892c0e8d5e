"""Compile the kernels that a run needs before it begins, in one process: the others load them from numba's cache."""

import sys
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, fields, replace
from functools import cache, lru_cache
from operator import attrgetter
from pathlib import Path
from tempfile import TemporaryDirectory

from nanoslip.solver.case import PARTS, Case, Effects, Heterogeneity, Interface, SlipRule
from nanoslip.solver.compiled import reporting_compilation
from nanoslip.solver.drive import Drive
from nanoslip.solver.outcome import COMPLETED, InvalidInput, Outcome
from nanoslip.solver.parameter import choices_of, declared
from nanoslip.study.plan.kinds import compliance_task, contact_task, drive_task, record_task
from nanoslip.study.plan.task import Task
from nanoslip.study.results.store import Store
from nanoslip.study.run.compute import run_task

# Small tasks that run every kernel of a campaign's tasks.


def miniatures(tasks: Sequence[Task]) -> tuple[Task, ...]:
    """Small tasks that run every kernel of these tasks, needs first."""
    found: dict[str, Task] = {}
    seen: set[tuple[object, ...]] = set()
    for task in tasks:
        choices = _choices_of(task)
        if choices not in seen:
            seen.add(choices)
            with suppress(InvalidInput):  # what cannot be made small compiles its kernels itself
                found |= {each.key: each for each in _small(task)}
    return tuple(found.values())


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
def _choices(part: Drive | SlipRule | Effects | Heterogeneity | Interface) -> tuple[object, ...]:
    """Words and switches: they decide which kernels run, the numbers do not."""
    flat = part.flat if isinstance(part, Drive) else {name: getattr(part, name) for name in declared(type(part))}
    return tuple((name, value) for name, value in flat.items() if isinstance(value, str | bool))


_own_choices = attrgetter(*(item.name for item in fields(Case) if choices_of(item.type) or item.type is bool))


def _small(task: Task) -> list[Task]:
    if task.drive is not None:
        return [_COMPLIANCE, record_task(_SMALL), _short(task.drive)]
    if task.case is not None:
        return [_COMPLIANCE, (contact_task if task.kind == "contact" else record_task)(_tiny(task.case))]
    return []


def _short(drive: Drive) -> Task:
    """The drive over a hundredth of its duration, or all of it where that is less than a step of its integrator."""
    with suppress(InvalidInput):
        return drive_task(_SMALL, replace(drive, duration=(drive.duration or 100.0) / 100, samples=2))
    return drive_task(_SMALL, replace(drive, samples=2))


_NUMBERS = {"n_x": 17, "radius": 50.0, "max_events": 300}
"""Numbers of a small case, whose record has a steady part."""
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


@dataclass(frozen=True, slots=True)
class WarmUp:
    """Compilation as a separate task, so that a crash costs no other task."""

    tasks: tuple[Task, ...]
    """Miniatures of those that a run computes."""
    key: str = "warm_up"
    needs: tuple[str, ...] = ()
    kind: str = "warm_up"
    cost: float = 60.0
    limit: float = 600.0
    label: str = "compiling kernels"

    def run(self) -> Outcome:
        """Run all of them, through a store: kernels are compiled for its read-only arrays.

        It is said before the first kernel is compiled, not where all are in the cache.
        """
        say = cache(lambda: sys.stderr.write(f"{self.label}, once: later runs load them\n"))
        with TemporaryDirectory() as folder, reporting_compilation(say):
            store = Store(Path(folder))
            store.prepare()
            for task in self.tasks:
                with suppress(Exception):  # it fails again in a task of the run, where it is reported
                    store.write(run_task(task, {key: store.read(key) for key in task.needs}), task.shared)
        return COMPLETED
