"""Initial contact of a case.

Sliding starts from its own initial contact, so a task of contact alone exists only where nothing follows it or where its
tractions are wanted.
"""

from solver.case import Case
from solver.contact.initial import initial_contact
from solver.contact.state import ContactState, ContactSummary, contact_summary
from solver.sliding.validity import Validity, contact_validity
from study.manifest.manifest import Manifest
from study.plan.keys import of_contact, task_key
from study.plan.kinds.compliance import compliance_task
from study.plan.kinds.kind import Computed, Kind, Part, Ragged, Wanted, case_of, compliance_of, scalars_only_mark
from study.plan.task import Inputs, Task

NAME = "contact"


def contact_task(case: Case, *, scalars_only: bool = False) -> Task:
    """Initial contact of a case."""
    needs = (compliance_task(case.slab).key,)
    key = task_key(NAME, *of_contact(case), *scalars_only_mark(scalars_only))
    return Task(key, NAME, case.slab, case, needs=needs, scalars_only=scalars_only)


def _needed(manifest: Manifest) -> bool:
    return "slip" not in manifest.stages or manifest.outputs.tractions


def _tractions(manifest: Manifest) -> bool:
    return manifest.outputs.tractions


def _tasks(case: Case, manifest: Manifest) -> tuple[Wanted, ...]:
    return (Wanted(contact_task(case, scalars_only=not _tractions(manifest))),)


def _run(task: Task, inputs: Inputs) -> Computed:
    case, compliance = case_of(task), compliance_of(task, inputs)
    state = initial_contact(case, compliance)
    values = (contact_validity(case, state), state, contact_summary(state))
    return Computed(values, state.outcome, {"x": compliance.x})


CONTACT = Kind(
    NAME,
    _needed,
    _tasks,
    _run,
    (Part(Validity), Part(ContactState, whole=True), Part(ContactSummary)),
    (Ragged("contact_state", "surface_node", "node_row_size", _tractions),),
)
