"""Cases -> tasks: each distinct computation once, needed ones before those that need them, longest chain first."""

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace

from solver.case import Case, Drive
from study.cases import CampaignCase, expand
from study.condensation import condensation_bytes, condensation_seconds
from study.effects import kept, task_kinds
from study.manifest import Manifest
from study.parameters import Value
from study.targets import settled
from study.tasks import Task, compliance_task, contact_task, digest_task, drive_task, friction_task, states_task


@dataclass(frozen=True, slots=True)
class CaseTasks:
    """Keys of the tasks of one case; None or empty where there is no such task."""

    compliance: str | None = None
    contact: str | None = None
    friction: str | None = None
    states: str | None = None
    drives: Mapping[str, str] = field(default_factory=dict)
    """Name of the drive -> key."""


@dataclass(frozen=True, slots=True)
class Plan:
    """The whole work of a campaign, finished or not."""

    manifest: Manifest
    cases: tuple[CampaignCase, ...]
    tasks: tuple[Task, ...]
    """Each distinct task once: needs first, then the longest chain of work first."""
    case_tasks: Mapping[str, CaseTasks]
    """case_id -> its tasks."""

    def remaining(self, finished: Collection[str]) -> tuple[Task, ...]:
        """Tasks still to do, in order, given the keys that are finished.

        A means is not computed again without unfinished work that needs it.
        """
        wanted: set[str] = set()
        for task in reversed(self.tasks):  # from the ends of the chains to their beginnings
            if task.key not in finished and (not task.means or task.key in wanted):
                wanted |= {task.key, *task.needs}
        return tuple(task for task in self.tasks if task.key in wanted and task.key not in finished)

    def spent(self, finished: Collection[str]) -> tuple[str, ...]:
        """Records that were only a means, and that no task still needs, given the keys that are finished."""
        wanted = {need for task in self.remaining(finished) for need in task.needs}
        return tuple(
            task.key
            for task in self.tasks
            if task.means and task.kind == "friction" and task.key in finished and task.key not in wanted
        )


def make_plan(manifest: Manifest) -> Plan:
    """Everything a campaign has to compute. Raises ManifestError where two cases are the same.

    Of an error asked for, the plan's manifest has the numerics that were chosen for it (see study.targets).
    """
    manifest = settled(manifest)
    cases = expand(manifest)
    tasks: dict[str, Task] = {}
    case_tasks = {}
    for case in cases:
        mine, keys = _tasks_of(manifest, case)
        case_tasks[case.case_id] = keys
        for task in mine:
            tasks.setdefault(task.key, task)
    return Plan(manifest, cases, _longest_chain_first(tuple(tasks.values())), case_tasks)


def _tasks_of(manifest: Manifest, campaign_case: CampaignCase) -> tuple[list[Task], CaseTasks]:
    case = campaign_case.case
    if case is None:
        return [], CaseTasks()
    kinds, keeps = task_kinds(manifest), kept(manifest)
    axes = {name: campaign_case.parameters[name] for name in manifest.axes}
    slab = {"n_x": case.slab.n_x, **{name: value for name, value in axes.items() if hasattr(case.slab, name)}}
    compliance = _estimated(compliance_task(case.slab), slab)
    contact = friction = record = states = None
    if "contact" in kinds:
        contact = _estimated(contact_task(case, scalars_only=not keeps["contact"]), axes)
    if "friction" in kinds:
        friction = _estimated(friction_task(case, scalars_only=not keeps["friction"]), axes)
    if friction and "drive" in kinds and not keeps["friction"]:
        record = _estimated(replace(friction_task(case), means=True), axes)
        friction = replace(digest_task(record), label=friction.label)
    if "states" in kinds:
        events = manifest.outputs.tractions_at or (0,)
        states = _estimated(states_task(case, events, manifest.outputs.subsurface), axes)
    drives = {}
    if "drive" in kinds:
        for drive in manifest.drives:
            task = drive_task(case, drive.dimensionless(manifest.scales), scalars_only=not keeps["drive"])
            drives[drive.name] = _estimated(task, {**axes, "drive": drive.name})
    keys = CaseTasks(
        compliance=compliance.key,
        contact=contact.key if contact else None,
        friction=friction.key if friction else None,
        states=states.key if states else None,
        drives={name: task.key for name, task in drives.items()},
    )
    return [task for task in (compliance, contact, record, friction, states, *drives.values()) if task], keys


def _longest_chain_first(tasks: Collection[Task]) -> tuple[Task, ...]:
    """Order by the work that hangs on a task, itself included: what is needed always has more than what needs it."""
    costs = {task.key: task.cost for task in tasks}
    chain = dict(costs)
    # One pass from the last stage back sees every chain whole.
    for task in sorted(tasks, key=_stage, reverse=True):
        for need in task.needs:
            chain[need] = max(chain[need], costs[need] + chain[task.key])
    return tuple(sorted(tasks, key=lambda task: (-chain[task.key], _stage(task))))


def _stage(task: Task) -> tuple[int, bool]:
    """Kinds are stages; a record that is only a means comes before its scalars."""
    return _STAGE_ORDER[task.kind], not task.means


_STAGE_ORDER = {"compliance": 0, "contact": 1, "friction": 2, "states": 3, "drive": 4}


def _estimated(task: Task, label: Mapping[str, Value]) -> Task:
    words = (f"{name}={value:g}" if isinstance(value, float) else f"{name}={value}" for name, value in label.items())
    return replace(task, cost=_seconds(task), label=" ".join((task.kind, *words)))


# Rough seconds on one core of an ordinary machine: they order the work and warn of days, no more.
_START = 0.01  # any task: hand out, read, write
_PER_TOUCH = 2e-9  # first touch, times n_x^3: a few dense solves for the nodes in contact
_PER_INNER_SOLVE = 4e-5  # inside of the slab, times n_x^1.5: one sparse factorization
_FROZEN = 0.4  # a slip with frozen pressures over one with all
_PER_EVENT = (
    3.5e-8  # friction, times n_x^1.5 as seen from 33 to 257 nodes: a cascade of slips, each a pass over the contact
)
_MEAN_STEP = 0.32  # displacement per event, times mean pressure and n_x^-1.2 (§3.2.1, Fig. 8)
_ROOM = 3.0  # copies of its operator that a contact holds at once
_PER_SOLVE = 1e-7  # friction at residual 1, times n_x^2: a few dense solves per event
_PER_TOOTH = 1.5e-7  # exact integrator
_PER_TIME_STEP = 3e-8  # rk4


def _seconds(task: Task) -> float:
    if task.kind == "compliance" or task.case is None:
        return _START + condensation_seconds(task.slab)
    if task.drive is not None:
        return _START + _drive_seconds(task.drive, task.case)
    events = {"friction": _events(task.case), "states": min(max(task.events, default=0), _events(task.case))}.get(
        task.kind, 0.0
    )
    inside = _PER_INNER_SOLVE * len(task.events) * task.slab.n_x**1.5 if task.subsurface else 0.0
    touch = _PER_TOUCH * task.slab.n_x**3 * (1.0 if task.case.effects.friction and task.case.effects.coupling else 0.2)
    start = _START + touch + inside
    residual = task.case.slip_rule.residual
    if residual == 1.0:
        return start + _PER_SOLVE * min(events, 20.0 * task.slab.n_x) * float(task.slab.n_x) ** 2
    # A slip that leaves a residual shear is followed by the more slips the less of the shear it drops.
    per_event = _PER_EVENT * (1.0 if task.case.effects.pin_translation else _FROZEN)
    return start + per_event * events * math.pow(task.slab.n_x, 1.5) / (1.0 - residual)


def memory_of(task: Task) -> float:
    """Rough bytes of arrays while a task runs, beside the compliance that it maps and the program's own."""
    if task.kind == "compliance" or task.case is None:
        return condensation_bytes(task.slab)
    nodes = float(task.slab.n_x)
    if task.drive is not None:
        return 8.0 * (5.0 * task.drive.samples + 16.0 * min(_events(task.case), 1e7))
    effects, records = task.case.effects, 80.0 * min(_events(task.case), 1e7) if task.kind == "friction" else 0.0
    if not effects.friction or (task.kind == "contact" and not effects.coupling):
        entries = _ROOM * nodes**2
    elif not effects.pin_translation and not effects.coupling:
        entries = 2.0 * _ROOM * nodes**2
    else:
        entries = _ROOM * (2.0 * nodes) ** 2
    inside = 400.0 * nodes**1.5 if task.subsurface else 0.0
    return 8.0 * (entries + inside) + records


def _drive_seconds(drive: Drive, case: Case) -> float:
    if drive.time_step is not None:
        return _PER_TIME_STEP * drive.duration / drive.time_step
    teeth = 0.0 if drive.profile == "mean" else drive.stage_velocity * drive.duration / _mean_step(case)
    return _PER_TOOTH * (drive.samples + teeth)


def _events(case: Case) -> float:
    far = case.max_displacement
    by_distance = math.inf if far is None else far / _mean_step(case)
    return min(by_distance, math.inf if case.max_events is None else case.max_events)


def _mean_step(case: Case) -> float:
    hertz = math.sqrt(0.4 * case.load * case.radius)  # half-width of the contact, ν = 1/3
    pressure = case.load / (2.0 * (case.half_width if case.pin == "flat_punch" else min(hertz, 0.5)))
    return _MEAN_STEP * pressure * math.pow(case.slab.n_x, -1.2)
