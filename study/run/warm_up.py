"""Kernels that a run needs are compiled before it begins, in one task: all processes then load them from numba's cache.

Small tasks run every kernel of a campaign's tasks. Those of drives need no record that was computed, so that a second process can
compile their kernels meanwhile.
"""

import gc
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import numpy as np

from nanoslip.solver.case import Case
from nanoslip.solver.compiled import reporting_compilation
from nanoslip.solver.drive import Drive
from nanoslip.solver.outcome import COMPLETED, InvalidInput, Outcome
from nanoslip.solver.sliding.plateau import plateau_of
from nanoslip.solver.sliding.record import FrictionRecord
from nanoslip.study.notices import print_notice
from nanoslip.study.plan.kinds import RECORD, compliance_task, contact_task, drive_task, record_task
from nanoslip.study.plan.task import Task, TaskResult, task_case
from nanoslip.study.results.store import Store
from nanoslip.study.run.child import Agent
from nanoslip.study.run.compute import Member, member_numbers, run_task
from nanoslip.study.run.launch import cores, task_program

_NUMBERS = {"n_x": 17, "radius": 50.0, "max_events": 300}
"""Numbers of a small case, whose record has a steady part."""
_SMALL = Case.of(_NUMBERS)
_OF_SLABS = _SMALL.slab.flat
_ROUGH = ((-0.1, 0.0), (0.1, 0.0))
"""A rough pin has separate kernels, the same for every profile."""


def miniatures(tasks: Sequence[Task]) -> tuple[Task, ...]:
    """Small tasks that run every kernel of these tasks; a drive's needs no more than `make_record`."""
    found: dict[str, Task] = {}
    for (*_, choices), task in {
        (task.kind, str(_shape(task.case)), _compiling_choices(task)): task for task in tasks
    }.items():
        with suppress(InvalidInput):  # what cannot be made small compiles its kernels itself
            found |= {each.key: each for each in _small(task, dict(choices))}
    return tuple(found.values())


def _compiling_choices(task: Task) -> tuple[tuple[str, object], ...]:
    """Words and switches of a task's drive, or of its case: they decide which kernels run, the numbers do not.

    The slab's are left out: of a compliance `_shape` has all that kernels know.
    """
    part = task.drive or task.case
    flat = part.flat if part else {}
    return tuple([each for each in flat.items() if isinstance(each[1], str | bool) and each[0] not in _OF_SLABS])


def _shape(case: Case | None) -> dict[str, object]:
    """Parameters that decide, beside the choices, which kernels a case runs: a rough pin, nodes on a plane."""
    if case is None:
        return {}
    scheme: dict[str, object] = {"scheme": "half_space", "n_x": 9} if case.slab.scheme.planar else {}
    return scheme | {"roughness": _ROUGH if case.heterogeneity.roughness else ()}


def _small(task: Task, choices: Mapping[str, object]) -> list[Task]:
    if task.drive is not None:
        return [_short(task.drive, task_case(task) if task.drive.memory else _SMALL)]
    if task.case is None:
        return []
    case = Case.of({**_NUMBERS, **choices, **_shape(task.case)})
    return [compliance_task(case.slab), (contact_task if task.kind == "contact" else record_task)(case)]


def _short(drive: Drive, case: Case) -> Task:
    """The drive over a hundredth of its duration, or all of it where that is less than a step of its integrator.

    It needs a record alone, which may be made up.
    """
    small = Case.of({**_NUMBERS, "slip_order": case.slip_rule.slip_order, **_shape(case)})
    with suppress(InvalidInput):
        shorter: dict[str, Any] = {"duration": (drive.duration or 100.0) / 100}
        if drive.stage_stroke is not None:
            shorter = {"stage_stroke": drive.stage_stroke / 100}
        found = drive_task(small, replace(drive, **shorter, samples=2))
        return replace(found, needs=found.needs[:1])
    return drive_task(small, replace(drive, samples=2))


def make_record(key: str) -> TaskResult:
    """A record for drives: it rises, then falls by a tenth again and again."""
    events, ramp, step = 300, 100, 1e-6
    before = step * np.minimum(np.arange(1.0, events + 1), ramp)
    short, counts = np.zeros(events, np.int32), np.ones(events, np.int64)
    sizes: dict[str, Any] = dict.fromkeys(("node", "releases", "touches", "extent"), short)
    record = FrictionRecord(
        displacement=step * np.arange(1.0, events + 1),
        force_before=before,
        force_after=0.9 * before,
        stiffness=np.ones(events),
        kind=np.zeros(events, np.int8),
        **sizes,
        contact_size=np.ones(events, np.int32),
        slips=counts,
        dissipated=np.zeros(events),
        node_x=np.zeros(1),
        node_slips=counts[:1],
        normal_load=1e-3,
        spacing=ramp * step,
        presliding_length=ramp * step,
        initial_force=0.0,
        initial_stiffness=1.0,
        initial_slips=0,
        initial_contact_size=1,
        end_nodes=0,
        final_displacement=events * step,
        final_force=0.9 * before[-1],
        outcome=COMPLETED,
    )
    return TaskResult(key, "record", COMPLETED, *member_numbers(RECORD, (Member((plateau_of(record), record)),)))


POLL_SECONDS: Final = 0.01
"""Seconds between two looks whether the second process is done."""


@dataclass(frozen=True, slots=True)
class WarmUp:
    """Compilation as a separate task, so that a crash costs no other task."""

    tasks: tuple[Task, ...]
    """Miniature versions of the run's tasks."""
    alone: bool = False
    """True if it neither reports that it compiles nor starts a second process."""
    key: str = "warm_up"
    needs: tuple[str, ...] = ()
    kind: str = "warm_up"
    cost: float = 60.0
    limit: float = 600.0
    label: str = "compiling kernels"

    def run(self) -> Outcome:
        """Run all tasks; drives in a second process if a core is free and other kernels are compiled, too.

        A notice is printed before the first kernel is compiled, and none if all kernels are in the cache.
        """
        drives = [task for task in self.tasks if task.drive]
        others = [task for task in self.tasks if not task.drive]
        with TemporaryDirectory() as folder, ExitStack() as stack:
            beside: list[Agent] = []

            @cache
            def begin() -> None:
                if not self.alone:
                    print_notice(f"{self.label}, once: later runs load them")
                    if others and drives and cores() > 1:
                        beside.append(Agent(task_program(Path(folder)), 0))
                        stack.callback(beside[0].close)
                        beside[0].give([WarmUp(tuple(drives), alone=True)])

            stack.enter_context(reporting_compilation(begin))
            stack.enter_context(_pausing_collection())
            _compute(others, Path(folder))
            while any(agent.busy for agent in beside):
                beside[0].arrived()
                time.sleep(POLL_SECONDS)
            _compute(drives, Path(folder))
        return COMPLETED


def _compute(tasks: Sequence[Task], folder: Path) -> None:
    """Through a store: kernels are compiled for its read-only arrays."""
    store = Store(folder)
    store.prepare()
    for task in tasks:
        with suppress(Exception):  # it fails again in a task of the run, where it is reported
            needs = {key: make_record(key) if task.drive else store.read(key) for key in task.needs}
            store.write(run_task(task, needs), task.shared)


@contextmanager
def _pausing_collection() -> Iterator[None]:
    """Stop garbage collection, which takes an eighth of the time of a compiler that makes and keeps millions of objects."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()
