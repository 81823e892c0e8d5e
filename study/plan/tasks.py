"""One unit of work and what came of it: the only bridge into the solver. No files, no ranks."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solver.case import Case, Drive, Slab
from solver.contact.initial import initial_contact
from solver.dynamics.coefficients import friction_coefficients
from solver.dynamics.friction_limit import friction_limit_of
from solver.dynamics.integrate import integrate
from solver.dynamics.regime import REGIMES, count_sticks
from solver.dynamics.stick_slip import fit_stick_slip
from solver.elasticity.compliance import SurfaceCompliance, slab_compliance
from solver.outcome import COMPLETED, Ending, Outcome, SolverError
from solver.sliding.events import slide_to_state, states_at
from solver.sliding.plateau import plateau_of
from solver.sliding.record import FrictionRecord
from solver.sliding.statistics import event_statistics
from solver.sliding.validity import contact_flags, contact_half_width, mask_of, record_flags
from study.manifest.effects import TaskKind
from study.origin import Origins, here, stemming
from study.provenance import content_hash

__all__ = [
    "Task",
    "TaskKind",
    "TaskResult",
    "compliance_task",
    "contact_task",
    "digest_task",
    "drive_task",
    "friction_task",
    "run_task",
    "states_task",
]

SOLVER_VERSION = "10"
"""Part of every key: raise it whenever a change of the solver changes a result."""


@dataclass(frozen=True, slots=True)
class Task:
    """One computation, named by its content: equal keys mean equal results."""

    key: str
    """Hash of the kind and of all that decides the result, in the solver's units (20 hexadecimal digits)."""
    kind: TaskKind
    slab: Slab
    case: Case | None = None
    """The physics point; None for a compliance."""
    drive: Drive | None = None
    """How the pin is pulled; drive tasks only."""
    events: tuple[int, ...] = ()
    """Events after which the contact is looked at; states tasks only."""
    subsurface: bool = False
    """Whether the inside of the slab is looked at too; states tasks only."""
    scalars_only: bool = False
    """Whether the result's arrays are left out."""
    means: bool = False
    """Whether the result is wanted by other tasks only, not by the campaign."""
    needs: tuple[str, ...] = ()
    """Keys of the tasks whose results this one reads."""
    cost: float = 0.0
    """Estimated seconds on one core."""
    label: str = field(default="", compare=False)
    """For humans."""


@dataclass(frozen=True, slots=True, eq=False)
class TaskResult:
    """What came of a task, refusals included; all numbers in the solver's units."""

    key: str
    kind: TaskKind
    outcome: Outcome
    scalars: Mapping[str, float | int] = field(default_factory=dict)
    arrays: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    origins: Origins = ()
    """The software that computed it and what it was computed from; empty where nobody knows."""


@lru_cache(maxsize=64)  # hashed once for all cases on it
def compliance_task(slab: Slab) -> Task:
    """The surface compliance of a slab, shared by all cases on it."""
    return Task(_key("compliance", slab), "compliance", slab, means=True)


def contact_task(case: Case, *, scalars_only: bool = False) -> Task:
    """Initial contact of a case."""
    needs = (compliance_task(case.slab).key,)
    key = _key("contact", *_touching(case), *_part(scalars_only))
    return Task(key, "contact", case.slab, case, needs=needs, scalars_only=scalars_only)


@lru_cache(maxsize=64)  # asked again by each of its drives
def friction_task(case: Case, *, scalars_only: bool = False) -> Task:
    """The friction record of a case."""
    key = _key("friction", *_sliding(case), *_part(scalars_only))
    needs = (compliance_task(case.slab).key,)
    return Task(key, "friction", case.slab, case, needs=needs, scalars_only=scalars_only)


def digest_task(record: Task) -> Task:
    """The scalars of a friction record that another task computes; the same result as sliding for them alone."""
    assert record.case is not None  # every record has one
    return replace(friction_task(record.case, scalars_only=True), needs=(record.key,))


def states_task(case: Case, events: tuple[int, ...], subsurface: bool) -> Task:
    """The contact of a case after each of some events of its record (0: initial contact), and the inside of the slab."""
    physics = _sliding(case) if any(events) else _touching(case)
    key = _key("states", *physics, events, subsurface)
    needs = (compliance_task(case.slab).key,)
    return Task(key, "states", case.slab, case, events=events, subsurface=subsurface, needs=needs)


def drive_task(case: Case, drive: Drive, *, scalars_only: bool = False) -> Task:
    """The motion of the pin over a case's friction record."""
    record = friction_task(case)
    key = _key("drive", record.key, drive, *_part(scalars_only))
    return Task(key, "drive", case.slab, case, drive, needs=(record.key,), scalars_only=scalars_only)


def _key(kind: TaskKind, *content: object) -> str:
    return content_hash(kind, SOLVER_VERSION, *content)


def _part(scalars_only: bool) -> tuple[str, ...]:
    return ("scalars",) if scalars_only else ()


def _touching(case: Case) -> tuple[object, ...]:
    """All that decides initial contact; a pin's other shape's size is ignored, and the friction of a pin that drags nothing."""
    effects = case.effects
    pressing = (*_pressing(case), effects.friction, effects.coupling)
    return (*pressing, *_slipping(case)) if effects.friction and effects.coupling else pressing


def _sliding(case: Case) -> tuple[object, ...]:
    """All that decides a friction record."""
    return (*_pressing(case), *_slipping(case), case.effects, case.max_events, case.farthest)


def _pressing(case: Case) -> tuple[object, ...]:
    size = case.radius if case.pin == "parabola" else case.half_width
    return (case.slab, case.pin, size, case.start, case.normal_load, case.heterogeneity.roughness)


def _slipping(case: Case) -> tuple[object, ...]:
    drawn = replace(case.heterogeneity, roughness=()) if case.heterogeneity.spread else None
    return (case.intrinsic_friction, case.initial_contact, case.slip_rule, drawn)


def run_task(task: Task, inputs: Mapping[str, TaskResult]) -> TaskResult:
    """Compute a task from the results it needs. Never raises for physics: a refusal is a result with its outcome.

    `OUT_OF_MEMORY` is of the machine, not of the task: such a result is not to be kept.
    """
    if task.kind == "friction" and inputs[task.needs[0]].kind == "friction":
        return replace(inputs[task.needs[0]], key=task.key, arrays={})
    used = stemming((here(),), *(inputs[key].origins for key in task.needs))
    return replace(_computed(task, inputs), origins=used)


def _computed(task: Task, inputs: Mapping[str, TaskResult]) -> TaskResult:
    for need in (inputs[key] for key in task.needs):
        if not need.outcome.usable:  # a record without a plateau is still a record
            message = f"its {need.kind} ended as {need.outcome.ending}: {need.outcome.message}"
            return TaskResult(task.key, task.kind, Outcome(Ending.NEEDS_FAILED, message))
    try:
        return _RUN[task.kind](task, inputs)
    except SolverError as error:
        return TaskResult(task.key, task.kind, error.outcome)
    except MemoryError as error:
        return TaskResult(task.key, task.kind, Outcome(Ending.OUT_OF_MEMORY, _NO_MEMORY.format(task.slab.n_x, error)))


_NO_MEMORY = "no memory left at n_x = {}: start fewer ranks on a machine, or use a smaller n_x or fewer events ({})"


def _run_compliance(task: Task, inputs: Mapping[str, TaskResult]) -> TaskResult:
    return _completed(task, {}, {"matrix": slab_compliance(task.slab).matrix})


def _run_contact(task: Task, inputs: Mapping[str, TaskResult]) -> TaskResult:
    case, compliance = _case(task), _compliance(task, inputs)
    state = initial_contact(case, compliance)
    scalars, arrays = _parted(state)
    scalars |= {
        "initial_slips": scalars.pop("slips"),
        "contact_size": int(state.contact.sum()),
        "maximum_pressure": float(state.pressure.max()),
        "friction_force": state.friction_force,
        "normal_load": case.normal_load,
        "contact_half_width": contact_half_width(case, state),
        "validity_flags": mask_of(contact_flags(case, state)),
    }
    return _completed(task, scalars, {"x": compliance.x, **arrays}, state.outcome)


def _run_friction(task: Task, inputs: Mapping[str, TaskResult]) -> TaskResult:
    case, compliance = _case(task), _compliance(task, inputs)
    start = initial_contact(case, compliance)
    record, end = slide_to_state(case, compliance, start)
    plateau = plateau_of(record)
    scalars, arrays = _parted(record)
    scalars |= _counts(record) | {
        "surface_stiffness": record.initial_stiffness,
        "plateau_mean": plateau.mean,
        "plateau_std": plateau.std,
        "plateau_uncertainty": plateau.uncertainty,
        "plateau_spacings": plateau.spacings,
        "plateau_start": plateau.start,
        "plateau_end": plateau.end,
        "contact_half_width": contact_half_width(case, start),
        "validity_flags": mask_of(record_flags(case, start, record, end)),
    }
    return _completed(task, scalars, arrays, plateau.outcome if record.outcome.ok else record.outcome)


def _run_states(task: Task, inputs: Mapping[str, TaskResult]) -> TaskResult:
    case, compliance = _case(task), _compliance(task, inputs)
    states, outcome = states_at(case, compliance, task.events)
    columns: dict[str, list[NDArray[Any]]] = {}
    for event, state in zip(task.events, states, strict=False):
        surface = {"x": compliance.x, **{name: getattr(state, name) for name in ("pressure", "shear", "slip", "gap")}}
        found = {f"surface_{name}": values for name, values in surface.items()}
        if task.subsurface:
            from solver.elasticity.interior import interior_fields  # noqa: PLC0415  brings splines that no other task needs

            _, inside = _parted(interior_fields(case.slab, state.nodal_force))
            found |= {f"interior_{name}": values for name, values in inside.items()}
            found["interior_event"] = np.full(len(inside["x"]), event)
        found["surface_event"] = np.full(len(compliance.x), event)
        for name, values in found.items():
            columns.setdefault(name, []).append(values)
    return _completed(task, {}, {name: np.concatenate(parts) for name, parts in columns.items()}, outcome)


def _run_drive(task: Task, inputs: Mapping[str, TaskResult]) -> TaskResult:
    record, drive = _joined(inputs[task.needs[0]]), _drive(task)
    plateau = plateau_of(record)
    motion = integrate(friction_limit_of(record, plateau, drive.profile), drive, record.initial_stiffness)
    friction = friction_coefficients(motion, record, plateau)
    fit = fit_stick_slip(motion, drive, record.normal_load)
    sticks = count_sticks(motion)
    scalars, arrays = _parted(motion)
    scalars |= {
        "normal_load": record.normal_load,
        "macroscopic_slips": len(motion.slip_time),
        "resticks": sticks.resticks,
        "time_stuck": sticks.time_stuck,
        "regime": REGIMES.index(sticks.regime) if sticks.regime else float("nan"),
        "static_friction": friction.static_friction,
        "static_friction_uncertainty": friction.static_friction_uncertainty,
        "kinetic_friction": friction.kinetic_friction,
        "kinetic_friction_uncertainty": friction.kinetic_friction_uncertainty,
        "fitted_static_friction": fit.static_friction,
        "fitted_later_static_friction": fit.later_static_friction,
        "fitted_kinetic_friction": fit.kinetic_friction,
        "fit_residual": fit.residual,
    }
    return _completed(task, scalars, arrays, friction.outcome)


_RUN = {
    "compliance": _run_compliance,
    "contact": _run_contact,
    "friction": _run_friction,
    "states": _run_states,
    "drive": _run_drive,
}


def _counts(record: FrictionRecord) -> dict[str, float | int]:
    """What triggered the record's events, and what happened in all of them together."""
    statistics = event_statistics(record)
    return {
        "events": statistics.events,
        "slips": statistics.slips,
        "releases": statistics.releases,
        "touches": statistics.touches,
        "cascade_slips": statistics.cascade_slips,
        "cascade_releases": statistics.cascade_releases,
        "cascade_touches": statistics.cascade_touches,
        "mean_step": statistics.mean_step,
        "mean_step_uncertainty": statistics.mean_step_uncertainty,
        "mean_drop": statistics.mean_drop,
        "mean_drop_uncertainty": statistics.mean_drop_uncertainty,
        "peak_friction": statistics.peak_friction,
        "spacings": statistics.spacings,
        "cycle_events": statistics.cycle_events,
        "cycle_spacings": statistics.cycle_spacings,
    }


def _completed(
    task: Task, scalars: dict[str, float | int], arrays: dict[str, NDArray[Any]], outcome: Outcome = COMPLETED
) -> TaskResult:
    return TaskResult(task.key, task.kind, outcome, scalars, {} if task.scalars_only else arrays)


def _case(task: Task) -> Case:
    assert task.case is not None  # every task but a compliance has one
    return task.case


def _drive(task: Task) -> Drive:
    assert task.drive is not None  # every drive task has one
    return task.drive


def _compliance(task: Task, inputs: Mapping[str, TaskResult]) -> SurfaceCompliance:
    return SurfaceCompliance(inputs[task.needs[0]].arrays["matrix"], task.slab)


def _parted(value: Any) -> tuple[dict[str, float | int], dict[str, NDArray[Any]]]:
    """A solver's value as scalars and arrays by field name, its outcome left out."""
    parts = {item.name: getattr(value, item.name) for item in fields(value) if item.name != "outcome"}
    arrays = {name: part for name, part in parts.items() if isinstance(part, np.ndarray)}
    return {name: part for name, part in parts.items() if name not in arrays}, arrays


def _joined(result: TaskResult) -> FrictionRecord:
    """The friction record that `_parted` took apart."""
    names = {item.name for item in fields(FrictionRecord)} - {"outcome"}
    parts: dict[str, Any] = {**result.scalars, **result.arrays}
    return FrictionRecord(**{name: parts[name] for name in names}, outcome=result.outcome)
