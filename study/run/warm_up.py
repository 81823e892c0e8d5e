"""Compile the kernels that a run needs before it begins, each in one process: the others load them from numba's cache.

Kernels of sliding and of the driven pin are independent, so two processes compile in parallel.
"""

import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, fields, replace
from functools import cache, lru_cache
from operator import attrgetter
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

import numpy as np

from nanoslip.solver.case import PARTS, Case, Effects, Heterogeneity, Interface, SlipRule
from nanoslip.solver.compiled import reporting_compilation
from nanoslip.solver.drive import Drive
from nanoslip.solver.outcome import COMPLETED, InvalidInput, Outcome
from nanoslip.solver.parameter import choices_of, declared
from nanoslip.solver.sliding.plateau import plateau_of
from nanoslip.solver.sliding.record import EVENT_TYPES, FrictionRecord
from nanoslip.study.plan.kinds import KINDS, compliance_task, contact_task, drive_task, record_task
from nanoslip.study.plan.task import Task, TaskResult
from nanoslip.study.plan.task import Task as WarmUpTask
from nanoslip.study.results.store import Store
from nanoslip.study.run.compute import Member, numbers, run_task

# What is compiled before a run begins: its kernels, by small tasks that call them.


# A made-up friction record: what the kernels of a driven pin are compiled with while those of records are.

TEETH: Final = 64
HEIGHT: Final = 0.01
"""Of a tooth, as F/W; they stand at ten times that."""


def sawtooth(case: Case) -> FrictionRecord:
    """A record of equal teeth, over one node spacing of the case, with the types of a record that was computed."""
    n, load = case.slab.n_x, case.normal_load
    spacing = 1.0 / (n - 1)
    low, high = 10.0 * HEIGHT * load, 11.0 * HEIGHT * load
    stiffness = (high - low) * TEETH / spacing
    columns = {name: np.zeros(TEETH, kind) for name, kind in EVENT_TYPES.items()}
    columns["displacement"][:] = np.arange(1, TEETH + 1) * spacing / TEETH
    for name, value in (("force_before", high), ("force_after", low), ("stiffness", stiffness)):
        columns[name][:] = value
    return FrictionRecord(
        **columns,
        node_x=np.linspace(-0.5, 0.5, n),
        node_slips=np.zeros(n, np.int64),
        normal_load=load,
        spacing=spacing,
        presliding_length=0.1 * spacing,
        initial_force=low,
        initial_stiffness=stiffness,
        initial_slips=0,
        initial_contact_size=1,
        end_nodes=0,
        final_displacement=spacing,
        final_force=low,
        outcome=COMPLETED,
    )


# Small tasks that run every kernel of a campaign's tasks.


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
def _choices(part: Drive | SlipRule | Effects | Heterogeneity | Interface) -> tuple[object, ...]:
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
        return drive_task(_SMALL, replace(drive, duration=(drive.duration or 100.0) / 100, samples=2))
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


@dataclass(frozen=True, slots=True)
class WarmUp:
    """Compilation as a separate task, so that a crash costs no other task."""

    of: str
    """What is compiled, in words."""
    tasks: tuple[WarmUpTask, ...]
    """Small ones, that run every kernel of that."""
    needs: tuple[str, ...] = ()
    kind: str = "warm_up"
    cost: float = 60.0
    limit: float = 600.0

    @property
    def key(self) -> str:
        """One name for each."""
        return f"{self.kind} {self.of}"

    @property
    def label(self) -> str:
        """Label in messages."""
        return f"compiling kernels of {self.of}"

    def run(self) -> Outcome:
        """Compile, and say so first where the cache has not all of it."""
        warm_up(self.tasks, lambda: sys.stderr.write(f"{self.label}, once: later runs load them\n"))
        return COMPLETED


def warm_ups(tasks: Sequence[WarmUpTask]) -> list[WarmUp]:
    """Compilations that these tasks need, in parallel."""
    small = miniatures(tasks)
    parts = {
        "contact and sliding": tuple(task for task in small if task.drive is None),
        "the driven pin": tuple(task for task in small if task.drive is not None),
    }
    return [WarmUp(of, found) for of, found in parts.items() if found]


def warm_up(tasks: Sequence[WarmUpTask], say: Callable[[], object] = lambda: None) -> None:
    """Run `miniatures` of tasks, through a store: kernels are compiled for its read-only arrays.

    say: called once, before the first kernel is compiled; not where all are in the cache.
    """
    # What fails here fails again in a task of the run, where it is reported.
    with TemporaryDirectory() as folder, suppress(Exception), reporting_compilation(cache(say)):
        store = Store(Path(folder))
        store.prepare()
        store.write(made_up_record(), shared=True)
        for task in tasks:
            store.write(run_task(task, {key: store.read(key) for key in task.needs}), task.shared)
