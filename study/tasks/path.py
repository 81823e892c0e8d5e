"""The contact along a path of pin and load, in place of a record: a line of friction force, and the numbers of its loops."""

from operator import attrgetter
from typing import Final

from nanoslip.solver.case import Case
from nanoslip.solver.ensemble import ALONE, Ensemble
from nanoslip.solver.load_path import Loops, PathLine, Turns
from nanoslip.solver.sliding.validity import Validity, contact_half_width
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.tasks.compliance import compliance_needs, task_compliance
from nanoslip.study.tasks.compute import compute_members
from nanoslip.study.tasks.estimates import (
    FLOAT,
    estimate_sizes,
    path_length,
    slide_seconds,
    sliding_bytes,
    touch_seconds,
)
from nanoslip.study.tasks.kind import (
    MEMBER,
    Computed,
    Estimate,
    Kind,
    Member,
    Part,
    Ragged,
    Wanted,
    has_several_members,
    member_task,
    output,
)
from nanoslip.study.tasks.record import small_record
from nanoslip.study.tasks.task import Inputs, Task, path_parameters, task_case


def path_task(case: Case, ensemble: Ensemble = ALONE, *, scalars_only: bool = False) -> Task:
    """The paths of a case's members."""
    needs = compliance_needs(case.slab)
    return member_task("path", path_parameters(case), case, ensemble, needs, scalars_only=scalars_only)


def _tasks(case: Case, manifest: Manifest) -> tuple[Wanted, ...]:
    bare = not manifest.outputs.records
    return (Wanted(path_task(case, manifest.ensemble, scalars_only=bare)),)


def _estimate(task: Task) -> Estimate:
    """Each leg sets up its contact."""
    case = task_case(task)
    events = _estimate_events(case)
    legs, _, _ = path_length(case)
    seconds = (legs + 1) * touch_seconds(case) + slide_seconds(case, events)
    numbers = 8.0 * events
    memory = sliding_bytes(case) + FLOAT * 3.0 * numbers
    return Estimate(task.ensemble.likely * seconds, memory, numbers)


def _estimate_events(case: Case) -> float:
    """Events on a case's path; a change of the load by itself is as a presliding length."""
    legs, way, _ = path_length(case)
    sizes, loads = estimate_sizes(case), len(case.path.visited_loads)
    per_length = sizes.presliding / sizes.step / sizes.nodes
    # In Coulomb sliding each node begins to slide once in a presliding length.
    if case.slip_rule.residual_shear == 1.0:
        per_length = 1.0
    lengths = way / max(sizes.presliding, 1e-300)
    return (lengths + loads) * per_length * sizes.nodes + legs


def _compute(task: Task, inputs: Inputs) -> Computed:
    from nanoslip.solver.elasticity.compliance import stiffness_of_node  # noqa: PLC0415
    from nanoslip.solver.sliding.path import follow, leg_numbers, loops_of, path_line  # noqa: PLC0415

    compliance = task_compliance(task, inputs)

    def compute(case: Case, number: int) -> Member:
        path = follow(case, compliance)
        valid = Validity(path.validity_flags, contact_half_width(path.start))
        numbers = (valid, loops_of(path), leg_numbers(path), path_line(path))
        if not path.start.outcome.ok:
            return Member((), path.outcome)
        node = stiffness_of_node(compliance, path.start.contact)
        return Member(numbers, path.outcome, node=node)

    return Computed(compute_members(task, compute))


KIND: Final = Kind(
    "path",
    needed=attrgetter("paths"),
    tasks=_tasks,
    estimate=_estimate,
    compute=_compute,
    # Its legs run the kernels of a record.
    miniature=small_record,
    parts=(Part(Validity), Part(Loops), Part(Turns, "leg_"), Part(PathLine, "path_")),
    ragged=(
        Ragged("path", "turn", "turn_row_size", output("records")),
        Ragged("path", "path_point", "path_row_size", output("records")),
        Ragged("path_ensemble", MEMBER, "path_member_row_size", has_several_members),
    ),
)
