"""Contacts of an interface, in batches: what their friction records add up to. The record of the slider is made of them."""

from collections.abc import Iterator
from typing import Final

from nanoslip.solver.case import Case
from nanoslip.solver.ensemble import Ensemble, Places
from nanoslip.solver.sliding.interface import PIECES, Portion, batches
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.tasks.compliance import compliance_needs, task_compliance
from nanoslip.study.tasks.estimates import FLOAT, record_bytes, record_seconds, sliding_bytes
from nanoslip.study.tasks.kind import KINDS, Computed, Estimate, Kind, Member, Part, Wanted, own_ensemble
from nanoslip.study.tasks.task import Inputs, Task, record_parameters, task_case, task_key


def contacts_task(case: Case, places: Places, contacts: tuple[int, int]) -> Task:
    """A batch of the contacts of an interface, which is one member of an ensemble."""
    key = task_key("contacts", *record_parameters(case), places, contacts)
    return Task(
        key,
        "contacts",
        case.slab,
        case,
        contacts=contacts,
        intermediate=True,
        ensemble=Ensemble(places=places),
        shared=True,
        needs=compliance_needs(case.slab),
    )


def member_batches(member: Case, ensemble: Ensemble) -> Iterator[Task]:
    """The batches of a member of an ensemble."""
    ranges = batches(member.interface.contacts)
    return (contacts_task(member, ensemble.places, contacts) for contacts in ranges)


def all_batches(case: Case, ensemble: Ensemble) -> tuple[Task, ...]:
    """The batches of all members that are certain to be computed; empty for a case with a single contact."""
    if case.interface.contacts == 1:
        return ()
    tasks: list[Task] = []
    for member in range(ensemble.likely):
        tasks += member_batches(ensemble.case(case, member), ensemble)
    return tuple(tasks)


def _tasks(case: Case, manifest: Manifest) -> tuple[Wanted, ...]:
    ensemble, _ = own_ensemble("record", manifest.ensemble)
    return tuple(Wanted(task, part=True) for task in all_batches(case, ensemble))


def has_interface(manifest: Manifest) -> bool:
    """True if a pin of a campaign may have several contacts."""
    return "contacts" in manifest.fixed or "contacts" in manifest.axes


PORTION: Final = 6.0 * PIECES
"""Count of the numbers of a portion."""


def _estimate(task: Task) -> Estimate:
    case, (first, beyond) = task_case(task), task.contacts
    # One contact slides at a time: its record is added to the portion, and dropped.
    memory = sliding_bytes(case) + record_bytes(case) + 2.0 * FLOAT * PORTION
    return Estimate((beyond - first) * record_seconds(case), memory, PORTION)


def _compute(task: Task, inputs: Inputs) -> Computed:
    from nanoslip.solver.sliding.slider import portion  # noqa: PLC0415

    compliance = task_compliance(task, inputs)
    interface = portion(task_case(task), compliance, *task.contacts, task.ensemble)
    return Computed((Member((interface,), interface.outcome),))


def _miniature(task: Task) -> tuple[Task, ...]:
    """The record of a single contact: each contact slides as if it carried all."""
    return KINDS["record"].miniature(task)


KIND: Final = Kind(
    "contacts",
    needed=lambda manifest: "slip" in manifest.stages and has_interface(manifest),
    tasks=_tasks,
    estimate=_estimate,
    compute=_compute,
    miniature=_miniature,
    parts=(Part(Portion, whole=True),),
)
