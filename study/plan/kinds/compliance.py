"""The surface compliance of a slab: an intermediate result, shared by all cases on it that read its matrix."""

from functools import lru_cache

from nanoslip.solver.case import Case
from nanoslip.solver.contact.convolved import needs_no_matrix
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.slab import Slab
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.plan.cost import condensation_bytes, condensation_seconds
from nanoslip.study.plan.kinds.kind import Computed, Estimate, Kind, Wanted, disk_of
from nanoslip.study.plan.task import Inputs, Task, task_key

NAME = "compliance"


@lru_cache(maxsize=4096)  # hashed once for all cases on it
def compliance_task(slab: Slab) -> Task:
    """The surface compliance of a slab."""
    return Task(task_key(NAME, slab), NAME, slab, intermediate=True, shared=True)


@lru_cache(maxsize=4096)  # all cases on it share the text, and the tuple
def compliance_needs(slab: Slab) -> tuple[str, ...]:
    """What a task needs that reads the compliance of a slab."""
    return (compliance_task(slab).key,)


def contact_needs(case: Case) -> tuple[str, ...]:
    """Tasks that initial contact of a case needs, whether or not it slides afterwards."""
    return () if needs_no_matrix(case) else compliance_needs(case.slab)


def _needed(manifest: Manifest) -> bool:
    return True


def _tasks(case: Case, manifest: Manifest) -> tuple[Wanted, ...]:
    if needs_no_matrix(case) and "slip" not in manifest.stages:
        return ()
    return (Wanted(compliance_task(case.slab)),)


def _run(task: Task, inputs: Inputs) -> Computed:
    return Computed(arrays={"matrix": surface_compliance(task.slab).matrix})


def _estimate(task: Task) -> Estimate:
    matrix = disk_of(0, (2.0 * task.slab.n_x) ** 2)
    return Estimate(condensation_seconds(task.slab), condensation_bytes(task.slab), matrix)


COMPLIANCE = Kind(NAME, _needed, _tasks, _run, _estimate)
