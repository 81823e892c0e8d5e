"""The contact of the first member after chosen events of a record (0: initial contact), and the inside of the slab there."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.arrays import Floats
from nanoslip.solver.case import Case
from nanoslip.solver.contact.state import ContactState
from nanoslip.solver.elasticity.fields import InteriorFields
from nanoslip.solver.parameter import as_field, quantities
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.tasks.compliance import compliance_needs, task_compliance
from nanoslip.study.tasks.contact import RowsOfContact, SurfaceNodes
from nanoslip.study.tasks.estimates import (
    FLOAT,
    condensation_seconds,
    contact_bytes,
    estimate_sizes,
    slide_seconds,
    sliding_bytes,
    touch_seconds,
)
from nanoslip.study.tasks.kind import (
    Computed,
    Estimate,
    Kind,
    Member,
    Part,
    Ragged,
    Wanted,
    event_field,
    has_planes,
    output,
)
from nanoslip.study.tasks.record import small_record
from nanoslip.study.tasks.task import Inputs, Task, contact_parameters, record_parameters, task_case, task_key

_AS_IN_A_CONTACT = quantities(ContactState)


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceStates(SurfaceNodes):
    """Surface nodes after each event, one event after the other; units as in ContactState."""

    pressure: Floats = as_field(_AS_IN_A_CONTACT["pressure"])
    shear: Floats = as_field(_AS_IN_A_CONTACT["shear"])
    slip: Floats = as_field(_AS_IN_A_CONTACT["slip"])
    gap: Floats = as_field(_AS_IN_A_CONTACT["gap"])


@dataclass(frozen=True, slots=True, eq=False)
class InteriorEvents:
    """Record and event of each node inside the slab."""

    event: NDArray[np.int64] = event_field(along="interior_node")


def states_task(case: Case, events: tuple[int, ...], subsurface: bool) -> Task:
    """The contact of a case after each of some events of its record, and the inside of the slab."""
    physics = record_parameters(case) if any(events) else contact_parameters(case)
    key = task_key("states", *physics, events, subsurface)
    needs = compliance_needs(case.slab)
    return Task(key, "states", case.slab, case, events=events, subsurface=subsurface, needs=needs)


def _tasks(case: Case, manifest: Manifest) -> tuple[Wanted, ...]:
    outputs = manifest.outputs
    first = manifest.ensemble.case(case, 0)
    # The inside alone is that at initial contact.
    events = outputs.tractions_at or (0,)
    return (Wanted(states_task(first, events, outputs.subsurface)),)


# Numbers for each surface node when the inside of the slab is solved for.
_INNER = 4500.0


def _estimate(task: Task) -> Estimate:
    """A record up to the last of its events; solving for the inside of the slab takes as long as condensing it."""
    case, slab = task_case(task), task.slab
    count = len(task.events)
    last = min(float(max(task.events)), estimate_sizes(case).events)
    seconds, memory = touch_seconds(case), contact_bytes(case)
    if last:
        seconds += slide_seconds(case, last)
        memory = sliding_bytes(case)
    if not task.subsurface:
        return Estimate(seconds, memory, 6.0 * count * slab.nodes)
    inside = count * condensation_seconds(slab)
    memory = max(memory, FLOAT * _INNER * slab.n_x)
    return Estimate(seconds + inside, memory, 70.0 * count * slab.n_x)


def _compute(task: Task, inputs: Inputs) -> Computed:
    from nanoslip.solver.sliding.slide import find_states  # noqa: PLC0415

    compliance = task_compliance(task, inputs)
    states, outcome = find_states(task_case(task), compliance, task.events)
    if not states:
        return Computed((Member((), outcome),))
    # A record may end before the last of the events: then there are fewer states than events.
    events = task.events[: len(states)]
    beside: tuple[object, ...] = ()
    if "y" in states[0].layout.AXES:
        across = np.concatenate([state.y for state in states])
        beside = (RowsOfContact(across),)
    if task.subsurface:
        # Few campaigns look inside.
        from nanoslip.solver.elasticity.interior import interior_fields  # noqa: PLC0415

        parts = [interior_fields(task.slab, state.nodal_force) for state in states]
        counts = [len(part.x) for part in parts]
        interior_events = np.repeat(events, counts)
        interior = InteriorFields(**_columns(InteriorFields, parts))
        beside = (InteriorEvents(interior_events), interior)
    event = np.repeat(events, len(states[0].x))
    surfaces = SurfaceStates(**_columns(SurfaceStates, states), event=event)
    return Computed((Member((surfaces, *beside), outcome),))


def _columns(kind: Any, parts: Sequence[Any]) -> dict[str, NDArray[Any]]:
    """Fields of a kind, joined over parts in their order."""
    names = [item.name for item in fields(kind) if hasattr(parts[0], item.name)]
    return {name: np.concatenate([getattr(part, name) for part in parts]) for name in names}


KIND: Final = Kind(
    "states",
    needed=output("tractions_at", "subsurface"),
    tasks=_tasks,
    estimate=_estimate,
    compute=_compute,
    # Its contacts are those of a record.
    miniature=small_record,
    parts=(
        Part(SurfaceStates, "surface_"),
        Part(InteriorEvents, "interior_"),
        Part(InteriorFields, "interior_"),
        Part(RowsOfContact, "surface_", wanted=has_planes),
    ),
    ragged=(
        Ragged("contact", "contact_node", "contact_row_size", output("tractions_at")),
        Ragged("interior", "interior_node", "interior_row_size", output("subsurface")),
    ),
)
