"""Small tasks that run the kernels of large ones: kernels are compiled on them before a run begins."""

from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from nanoslip.solver.case import Case
from nanoslip.solver.outcome import COMPLETED
from nanoslip.solver.sliding.plateau import plateau_of
from nanoslip.solver.sliding.record import FrictionRecord
from nanoslip.study.tasks.compute import member_numbers
from nanoslip.study.tasks.kind import KINDS, Member
from nanoslip.study.tasks.task import Task, TaskResult, task_case

NUMBERS: Final[Mapping[str, object]] = {"n_x": 17, "scheme": "biquadratic", "radius": 50.0, "max_events": 300}
"""Numbers of a small case, whose record has a steady part."""
SMALL: Final = Case.of({**NUMBERS})
_OF_SLABS = SMALL.slab.flat
_ROUGH = ((-0.1, 0.0), (0.1, 0.0))
"""A rough pin has separate kernels, the same for every profile."""
_ROUGH_BALL = tuple((x, y, 0.0) for x in (-0.1, 0.1) for y in (-0.1, 0.1))
"""Heights over a plane of nodes, which take no profile."""


def compiling_choices(task: Task) -> dict[str, object]:
    """Words and switches of a task's drive, or of its case: they decide which kernels run, the numbers do not.

    The slab's are left out: of a compliance `compiling_shape` has all that kernels know.
    """
    part = task.drive or task.case
    flat = part.flat if part else {}
    return {name: value for name, value in flat.items() if isinstance(value, str | bool) and name not in _OF_SLABS}


def compiling_shape(case: Case | None) -> dict[str, object]:
    """Parameters that decide, beside the choices, which kernels a case runs: a rough pin, nodes on a plane."""
    if case is None:
        return {}
    planar = "y" in case.slab.layout.AXES
    scheme: dict[str, object] = {"scheme": "half_space", "n_x": 9} if planar else {}
    rough = _ROUGH_BALL if planar else _ROUGH
    return scheme | {"roughness": rough if case.heterogeneity.roughness else ()}


def small_case(task: Task) -> Case:
    """A small case that runs the kernels of a task's. Raises InvalidInput if its choices go with no small one."""
    shape = compiling_shape(task_case(task))
    return Case.of({**NUMBERS, **compiling_choices(task), **shape})


def make_record(key: str) -> TaskResult:
    """A record for drives: it rises, then falls by a tenth again and again."""
    events, ramp, step = 300, 100, 1e-6
    before = step * np.minimum(np.arange(1.0, events + 1), ramp)
    short = np.zeros(events, np.int32)
    counts = np.ones(events, np.int64)
    unused = ("node", "releases", "touches", "extent")
    sizes: dict[str, Any] = dict.fromkeys(unused, short)
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
    member = Member((plateau_of(record), record))
    numbers = member_numbers(KINDS["record"], (member,))
    return TaskResult(key, "record", COMPLETED, *numbers)
