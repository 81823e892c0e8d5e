"""Compile the kernels that a run needs on one rank first: the others load them from numba's cache."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from solver.case import Case, Heterogeneity
from solver.drive import Drive
from solver.slab import Slab
from study.dataset.store import Store
from study.plan.tasks import Task, compliance_task, contact_task, drive_task, record_task, run_task


def warm_up(tasks: Sequence[Task]) -> None:
    """Run small tasks of the same kinds, through a store: kernels are compiled for its read-only arrays."""
    # What fails here fails again in a task of the run, where it is reported.
    with TemporaryDirectory() as folder, suppress(Exception):
        store = Store(Path(folder))
        store.prepare()
        for task in miniatures(tasks):
            store.write(run_task(task, {key: store.read(key) for key in task.needs}))


def miniatures(tasks: Sequence[Task]) -> list[Task]:
    """Small tasks that run every kernel of these tasks, needs first."""
    found = {_COMPLIANCE.key: _COMPLIANCE}
    drives: dict[tuple[object, ...], Task] = {}
    for task in tasks:
        if task.drive is not None:
            choices = _choices(task.drive)
            if choices not in drives:
                drives[choices] = _short(task.drive)
            small = [record_task(_STEADY), drives[choices]]
        elif task.case is not None:
            make = contact_task if task.kind == "contact" else record_task
            small = [make(_tiny(task.case))]
        else:
            small = []
        found |= {each.key: each for each in small}
    return list(found.values())


def _choices(drive: Drive) -> tuple[object, ...]:
    """Words and switches of a drive: they decide which kernels run, the numbers do not."""
    return tuple((name, value) for name, value in drive.flat.items() if isinstance(value, str | bool))


def _short(drive: Drive) -> Task:
    return drive_task(_STEADY, replace(drive, duration=drive.duration / 100, samples=2))


_STEADY = Case(slab=Slab(n_x=17), radius=50.0, max_events=60)
"""A small case whose record becomes steady, as a drive needs it."""
_COMPLIANCE = compliance_task(_STEADY.slab)


def _tiny(case: Case) -> Case:
    """A small case with the same switches: they decide which kernels run, the numbers do not."""
    rule = replace(_STEADY.slip_rule, slip_order=case.slip_rule.slip_order)
    return replace(
        _STEADY,
        pin=case.pin,
        initial_contact=case.initial_contact,
        slip_rule=rule,
        effects=case.effects,
        heterogeneity=_rough_or_not(case),
    )


def _rough_or_not(case: Case) -> Heterogeneity:
    """A rough pin has kernels of its own."""
    return Heterogeneity(roughness=((-0.1, 0.0), (0.1, 0.0)) if case.heterogeneity.roughness else ())
