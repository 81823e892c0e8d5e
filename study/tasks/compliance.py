"""The surface compliance of a slab: an intermediate result, shared by all cases on it that read its matrix."""

from functools import lru_cache
from typing import TYPE_CHECKING, Final

from nanoslip.solver.case import Case
from nanoslip.solver.slab import Slab
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.tasks.estimates import FLOAT, condensation_seconds, grid_nodes
from nanoslip.study.tasks.kind import Computed, Estimate, Kind, Wanted
from nanoslip.study.tasks.task import Inputs, Task, TaskResult, task_key

if TYPE_CHECKING:
    from nanoslip.solver.elasticity.compliance import Compliance, SurfaceCompliance

MATRIX: Final = "matrix"
"""The one array of a compliance."""


# Hashed once for all cases on the slab.
@lru_cache(maxsize=4096)
def compliance_task(slab: Slab) -> Task:
    """The surface compliance of a slab."""
    key = task_key("compliance", slab)
    return Task(key, "compliance", slab, intermediate=True, shared=True)


# All cases on a slab share the text, and the tuple: a million of them would fill the memory.
@lru_cache(maxsize=4096)
def compliance_needs(slab: Slab) -> tuple[str, ...]:
    """Inputs of a task that uses the compliance of a slab; without ends it is computed faster than read."""
    return (compliance_task(slab).key,) if slab.scheme.count_stored_numbers(slab) else ()


def task_compliance(task: Task, inputs: Inputs) -> "Compliance":
    """The compliance that a task needs: an input, or computed here for a surface without ends, which needs no
    separate task."""
    from nanoslip.solver.elasticity.compliance import surface_compliance  # noqa: PLC0415

    needs = [inputs[key] for key in task.needs]
    for need in needs:
        if need.kind == "compliance":
            return result_compliance(need, task.slab)
    # A slab without end is a convolution, which is made faster than it is read.
    return surface_compliance(task.slab)


# Tasks that follow each other get the same compliance: the solver keeps what it computes of it.
@lru_cache(maxsize=4)
def result_compliance(result: TaskResult, slab: Slab) -> "SurfaceCompliance":
    """The compliance that a result holds."""
    from nanoslip.solver.elasticity.compliance import SurfaceCompliance  # noqa: PLC0415

    return SurfaceCompliance(result.arrays[MATRIX], slab)


def _tasks(case: Case, manifest: Manifest) -> tuple[Wanted, ...]:
    if not case.slab.scheme.count_stored_numbers(case.slab):
        return ()
    return (Wanted(compliance_task(case.slab)),)


# Numbers for each node of a slab's grid: its sparse stiffness, copies and products.
_NODE = 500.0
# Numbers for each surface node squared: the compliance, its blocks, those of even and odd fields.
_SQUARE = 12.0


def _estimate(task: Task) -> Estimate:
    squares = task.slab.n_x**2
    memory = FLOAT * (_NODE * grid_nodes(task.slab) + _SQUARE * squares)
    # Both directions of each surface node in rows and in columns.
    return Estimate(condensation_seconds(task.slab), memory, 4.0 * squares)


def _compute(task: Task, inputs: Inputs) -> Computed:
    from nanoslip.solver.elasticity.compliance import surface_compliance  # noqa: PLC0415

    return Computed(arrays={MATRIX: surface_compliance(task.slab).matrix})


def _require_matrix(result: TaskResult) -> None:
    matrix = result.arrays.get(MATRIX)
    if matrix is None or matrix.shape != 2 * (len(matrix),):
        raise ValueError("no square matrix")


KIND: Final = Kind(
    "compliance",
    needed=lambda _: True,
    tasks=_tasks,
    estimate=_estimate,
    compute=_compute,
    # It runs no kernel.
    miniature=lambda _: (),
    require_arrays=_require_matrix,
)
