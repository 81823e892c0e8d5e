"""The contact of the first member after chosen events of a record (0: initial contact), and the inside of the slab there."""

from collections.abc import Sequence
from dataclasses import dataclass, field, fields

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.case import Case
from nanoslip.solver.contact.state import ContactState
from nanoslip.solver.elasticity.compliance import Compliance
from nanoslip.solver.elasticity.interior import InteriorFields, interior_fields
from nanoslip.solver.sliding.slide import states_at
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.plan.cost import contact_bytes, inside_bytes, sliding_bytes, states_seconds
from nanoslip.study.plan.kinds.compliance import compliance_needs, contact_needs
from nanoslip.study.plan.kinds.contact import SurfaceNodes, seen_after
from nanoslip.study.plan.kinds.kind import (
    Computed,
    Estimate,
    Kind,
    Member,
    Part,
    Ragged,
    Wanted,
    case_of,
    compliance_of,
    disk_of,
)
from nanoslip.study.plan.task import Inputs, Task, of_contact, of_record, task_key

NAME = "states"


_AS_IN_A_CONTACT = {item.name: item.metadata for item in fields(ContactState)}


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceStates(SurfaceNodes):
    """Every surface node after each event, one event behind the other; units as in ContactState."""

    pressure: NDArray[np.float64] = field(metadata=_AS_IN_A_CONTACT["pressure"])
    shear: NDArray[np.float64] = field(metadata=_AS_IN_A_CONTACT["shear"])
    slip: NDArray[np.float64] = field(metadata=_AS_IN_A_CONTACT["slip"])
    gap: NDArray[np.float64] = field(metadata=_AS_IN_A_CONTACT["gap"])


@dataclass(frozen=True, slots=True, eq=False)
class InteriorEvents:
    """What each node inside the slab belongs to."""

    event: NDArray[np.int64] = field(metadata=seen_after(along="interior_node"))


def states_task(case: Case, events: tuple[int, ...], subsurface: bool) -> Task:
    """The contact of a case after each of some events of its record, and the inside of the slab."""
    physics = of_record(case) if any(events) else of_contact(case)
    key = task_key(NAME, *physics, events, subsurface)
    needs = compliance_needs(case.slab) if any(events) else contact_needs(case)
    return Task(key, NAME, case.slab, case, events=events, subsurface=subsurface, needs=needs)


def _needed(manifest: Manifest) -> bool:
    return bool(manifest.outputs.tractions_at) or manifest.outputs.subsurface


def _on_the_surface(manifest: Manifest) -> bool:
    return bool(manifest.outputs.tractions_at)


def _inside(manifest: Manifest) -> bool:
    return manifest.outputs.subsurface


def _tasks(case: Case, manifest: Manifest) -> tuple[Wanted, ...]:
    return (
        Wanted(states_task(manifest.ensemble.case(case, 0), manifest.outputs.tractions_at or (0,), _inside(manifest))),
    )


def _run(task: Task, inputs: Inputs) -> Computed:
    compliance = compliance_of(task, inputs)
    states, outcome = states_at(case_of(task), compliance, task.events)
    values: tuple[object, ...] = ()
    if states:
        values = (_surfaces(task.events, states, compliance),)
        if task.subsurface:
            inside = [interior_fields(task.slab, state.nodal_force) for state in states]
            nodes = [len(each.x) for each in inside]
            values = (*values, InteriorEvents(np.repeat(task.events[: len(states)], nodes)), _behind(inside))
    return Computed((Member(values, outcome),))


def _surfaces(events: Sequence[int], states: Sequence[ContactState], compliance: Compliance) -> SurfaceStates:
    nodes = len(compliance.x)
    columns = {name: np.concatenate([getattr(state, name) for state in states]) for name in _OF_STATE}
    return SurfaceStates(event=np.repeat(events[: len(states)], nodes), x=np.tile(compliance.x, len(states)), **columns)


_OF_STATE = tuple(item.name for item in fields(SurfaceStates) if item.name not in ("event", "x"))


def _behind(parts: Sequence[InteriorFields]) -> InteriorFields:
    """Fields after several events as one."""
    names = [item.name for item in fields(InteriorFields)]
    return InteriorFields(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


def _estimate(task: Task) -> Estimate:
    case, looks = case_of(task), len(task.events)
    memory = sliding_bytes(case) if any(task.events) else contact_bytes(case)
    nodes = _PER_NODE * looks * task.slab.n_x
    if task.subsurface:
        memory = max(memory, inside_bytes(task.slab))
        nodes += _PER_NODE_INSIDE * looks * task.slab.n_x
    return Estimate(states_seconds(case, task.events, task.subsurface), memory, disk_of(0, _ARRAYS + nodes))


_ARRAYS = 250.0  # numbers' worth of the names of its arrays
_PER_NODE = 6.0  # numbers of each surface node
_PER_NODE_INSIDE = 8.0 * 8.0  # of the nodes under one of the surface, on a graded grid


STATES = Kind(
    NAME,
    _needed,
    _tasks,
    _run,
    _estimate,
    (Part(SurfaceStates, "surface_"), Part(InteriorEvents, "interior_"), Part(InteriorFields, "interior_")),
    (
        Ragged("contact", "contact_node", "contact_row_size", _on_the_surface),
        Ragged("interior", "interior_node", "interior_row_size", _inside),
    ),
)
