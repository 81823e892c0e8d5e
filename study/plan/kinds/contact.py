"""Initial contact of a case.

Sliding starts from its own initial contact, so a task of contact alone exists only where nothing follows it or where its
tractions are wanted.
"""

from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.case import Case
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.contact.state import NODE_X, ContactState, ContactSummary, contact_summary
from nanoslip.solver.ensemble import ALONE, Ensemble
from nanoslip.solver.parameter import quantity
from nanoslip.solver.sliding.validity import Validity, contact_validity
from nanoslip.study.canonical import CanonicalText
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.plan.cost import contact_bytes, touch_seconds
from nanoslip.study.plan.kinds.compliance import contact_needs
from nanoslip.study.plan.kinds.kind import (
    MEMBER,
    Computed,
    Estimate,
    Kind,
    Member,
    Part,
    Ragged,
    Wanted,
    case_of,
    compliance_of,
    computed_members,
    disk_of,
    own_ensemble,
    scalars_only_mark,
    several,
)
from nanoslip.study.plan.task import Inputs, Task, of_contact, task_key

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


def contact_task(case: Case, ensemble: Ensemble = ALONE, *, scalars_only: bool = False) -> Task:
    """Initial contact of a case's members."""
    ensemble, text = _own(ensemble)
    key = task_key(NAME, *of_contact(case), text, *scalars_only_mark(scalars_only))
    return Task(key, NAME, case.slab, case, ensemble=ensemble, needs=contact_needs(case), scalars_only=scalars_only)


@lru_cache(maxsize=64)  # of all cases
def _own(ensemble: Ensemble) -> tuple[Ensemble, CanonicalText]:
    return own_ensemble(CONTACT, ensemble)


def _needed(manifest: Manifest) -> bool:
    return "slip" not in manifest.stages or manifest.outputs.tractions


def _tractions(manifest: Manifest) -> bool:
    return manifest.outputs.tractions


def _tasks(case: Case, manifest: Manifest) -> tuple[Wanted, ...]:
    return (Wanted(contact_task(case, manifest.ensemble, scalars_only=not _tractions(manifest))),)


def _run(task: Task, inputs: Inputs) -> Computed:
    compliance = compliance_of(task, inputs)
    nodes = SurfaceNodes(np.zeros(len(compliance.x), np.int64), compliance.x)

    def compute(case: Case, number: int) -> Member:
        state = initial_contact(case, compliance)
        return Member((contact_validity(case, state), state, contact_summary(state), nodes), state.outcome)

    return Computed(computed_members(CONTACT, task, compute))


def _estimate(task: Task) -> Estimate:
    case = case_of(task)
    arrays = 0.0 if task.scalars_only else _ARRAYS + _PER_NODE * case.slab.n_x
    members = task.ensemble.likely
    return Estimate(members * touch_seconds(case), contact_bytes(case), disk_of(10 * members, arrays))


_ARRAYS = 250.0  # numbers' worth of the names of its arrays
_PER_NODE = 10.0  # numbers of each surface node


CONTACT = Kind(
    NAME,
    _needed,
    _tasks,
    _run,
    _estimate,
    (Part(Validity), Part(ContactState, whole=True), Part(ContactSummary), Part(SurfaceNodes)),
    (
        Ragged("contact", "contact_node", "contact_row_size", _tractions),
        Ragged(
            "ensemble", MEMBER, "member_row_size", lambda manifest: several(manifest) and "slip" not in manifest.stages
        ),
    ),
)
