"""Initial contact of a case.

Sliding starts from its own initial contact, so a task of contact alone exists only where nothing follows it or where its
tractions are wanted.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solver.case import Case
from solver.contact.initial import initial_contact
from solver.contact.state import NODE_X, ContactState, ContactSummary, contact_summary
from solver.quantity import quantity
from solver.sliding.validity import Validity, contact_validity
from study.manifest.manifest import Manifest
from study.plan.cost.arrays import contact_bytes
from study.plan.cost.seconds import touch_seconds
from study.plan.keys import of_contact, task_key
from study.plan.kinds.compliance import contact_needs
from study.plan.kinds.kind import (
    Computed,
    Estimate,
    Kind,
    Part,
    Ragged,
    Wanted,
    case_of,
    compliance_of,
    disk_of,
    scalars_only_mark,
)
from study.plan.task import Inputs, Task

NAME = "contact"


def seen_after(along: str) -> dict[str, Any]:
    """Metadata of a column that says which event of its record a node is seen after."""
    return quantity("event that it is seen after", "event", along=along, dtype=np.int64, comment=_OF_THE_RECORD)


_OF_THE_RECORD = "of the record; 0: initial contact"


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceNodes:
    """When and where each surface node of a contact is seen."""

    event: NDArray[np.int64] = field(metadata=seen_after(along="contact_node"))
    x: NDArray[np.float64] = field(metadata=NODE_X)


def contact_task(case: Case, *, scalars_only: bool = False) -> Task:
    """Initial contact of a case."""
    needs = contact_needs(case)
    key = task_key(NAME, *of_contact(case), *scalars_only_mark(scalars_only))
    return Task(key, NAME, case.slab, case, needs=needs, scalars_only=scalars_only)


def _needed(manifest: Manifest) -> bool:
    return "slip" not in manifest.stages or manifest.outputs.tractions


def _tractions(manifest: Manifest) -> bool:
    return manifest.outputs.tractions


def _tasks(case: Case, manifest: Manifest) -> tuple[Wanted, ...]:
    return (Wanted(contact_task(case, scalars_only=not _tractions(manifest))),)


def _run(task: Task, inputs: Inputs) -> Computed:
    case, compliance = case_of(task), compliance_of(task, inputs)
    state = initial_contact(case, compliance)
    nodes = SurfaceNodes(np.zeros(len(compliance.x), np.int64), compliance.x)
    return Computed((contact_validity(case, state), state, contact_summary(state), nodes), state.outcome)


def _estimate(task: Task) -> Estimate:
    case = case_of(task)
    arrays = 0.0 if task.scalars_only else _ARRAYS + _PER_NODE * case.slab.n_x
    return Estimate(touch_seconds(case), contact_bytes(case), disk_of(10, arrays))


_ARRAYS = 250.0  # numbers' worth of the names of its arrays
_PER_NODE = 10.0  # numbers of each surface node


CONTACT = Kind(
    NAME,
    _needed,
    _tasks,
    _run,
    _estimate,
    (Part(Validity), Part(ContactState, whole=True), Part(ContactSummary), Part(SurfaceNodes)),
    (Ragged("contact", "contact_node", "contact_row_size", _tractions),),
)
