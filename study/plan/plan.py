"""Cases -> tasks: each distinct computation once, needed ones before those that need them, longest chain first."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace

from study.discretization.targets import settled
from study.manifest.cases import MEMBER, CampaignCase, expand
from study.manifest.effects import kept, task_kinds
from study.manifest.manifest import Manifest
from study.manifest.parameters import Value
from study.origin import Origins, foreign, here
from study.plan.condensation import condensation_seconds
from study.plan.cost import memory_of, seconds_of
from study.plan.drive_cost import drive_seconds
from study.plan.tasks import Task, compliance_task, contact_task, digest_task, drive_task, friction_task, states_task

__all__ = ["CaseTasks", "Plan", "make_plan", "memory_of"]


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

    def foreign(self, finished: Mapping[str, Origins]) -> dict[str, Origins]:
        """The plan's results that other software than this had a hand in, given all that are finished."""
        home = here()
        mine = (task.key for task in self.tasks if task.key in finished)
        return {key: finished[key] for key in mine if foreign(finished[key], home)}

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

    Of an error asked for, the plan's manifest has the numerics that were chosen for it (see study.discretization.targets).
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
    if MEMBER in campaign_case.parameters:
        axes[MEMBER] = campaign_case.parameters[MEMBER]
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
    return replace(task, cost=min(_seconds(task), _LONGEST), label=" ".join((task.kind, *words)))


# Rough seconds on one core of an ordinary machine: they order the work and warn of days, no more. See study.plan.cost.
_LONGEST = 1e12  # thirty thousand years will do for what never ends
_START = 1e-3  # any task: hand out, read, write


def _seconds(task: Task) -> float:
    if task.kind == "compliance" or task.case is None:
        return _START + condensation_seconds(task.slab)
    if task.drive is not None:
        return _START + drive_seconds(task.drive, task.case)
    return _START + seconds_of(task, task.case)
