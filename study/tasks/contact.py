"""Initial contact. A record computes the contact that it starts from, so a task of contact alone exists only if nothing slides
or if tractions are requested."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.arrays import Floats
from nanoslip.solver.case import Case
from nanoslip.solver.contact.state import NODE_X, NODE_Y, ContactState, ContactSummary, contact_summary
from nanoslip.solver.ensemble import ALONE, Ensemble
from nanoslip.solver.parameter import as_field
from nanoslip.solver.sliding.validity import Validity, contact_validity
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.tasks.compliance import compliance_needs, compliance_task, task_compliance
from nanoslip.study.tasks.compute import compute_members
from nanoslip.study.tasks.estimates import contact_bytes, touch_seconds
from nanoslip.study.tasks.kind import (
    MEMBER,
    Computed,
    Estimate,
    Kind,
    Member,
    Part,
    Ragged,
    Wanted,
    event_field,
    has_planes,
    has_several_members,
    member_task,
    output,
)
from nanoslip.study.tasks.miniature import small_case
from nanoslip.study.tasks.task import Inputs, Task, contact_parameters, task_case


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceNodes:
    """Event and position at which each surface node of a contact is seen."""

    event: NDArray[np.int64] = event_field(along="contact_node")
    x: Floats = as_field(NODE_X)


@dataclass(frozen=True, slots=True, eq=False)
class RowsOfContact:
    """Position of each surface node across the drag, of a plane of nodes."""

    y: Floats = as_field(NODE_Y)


def contact_task(case: Case, ensemble: Ensemble = ALONE, *, scalars_only: bool = False) -> Task:
    """Initial contact of a case's members."""
    needs = compliance_needs(case.slab)
    return member_task("contact", contact_parameters(case), case, ensemble, needs, scalars_only=scalars_only)


def _tasks(case: Case, manifest: Manifest) -> tuple[Wanted, ...]:
    bare = not manifest.outputs.tractions
    return (Wanted(contact_task(case, manifest.ensemble, scalars_only=bare)),)


def _estimate(task: Task) -> Estimate:
    case = task_case(task)
    seconds = task.ensemble.likely * touch_seconds(case)
    return Estimate(seconds, contact_bytes(case), 10.0 * case.slab.nodes)


def _compute(task: Task, inputs: Inputs) -> Computed:
    from nanoslip.solver.contact.initial import initial_contact  # noqa: PLC0415

    compliance = task_compliance(task, inputs)
    before_all_events = np.zeros(len(compliance.x), np.int64)
    nodes = SurfaceNodes(before_all_events, compliance.x)

    def compute(case: Case, number: int) -> Member:
        state = initial_contact(case, compliance)
        across = RowsOfContact(state.y) if "y" in state.layout.AXES else None
        values = (contact_validity(case, state), state, contact_summary(state), nodes, across)
        return Member(values, state.outcome)

    return Computed(compute_members(task, compute))


def _miniature(task: Task) -> tuple[Task, ...]:
    case = small_case(task)
    return compliance_task(case.slab), contact_task(case)


KIND: Final = Kind(
    "contact",
    needed=lambda manifest: "slip" not in manifest.stages or manifest.outputs.tractions,
    tasks=_tasks,
    estimate=_estimate,
    compute=_compute,
    miniature=_miniature,
    parts=(
        Part(Validity),
        Part(ContactState, whole=True),
        Part(ContactSummary),
        Part(SurfaceNodes),
        Part(RowsOfContact, wanted=has_planes),
    ),
    ragged=(
        Ragged("contact", "contact_node", "contact_row_size", output("tractions")),
        Ragged(
            "ensemble",
            MEMBER,
            "member_row_size",
            lambda manifest: has_several_members(manifest) and "slip" not in manifest.stages,
        ),
    ),
)
